// Made from ptzcal.h (make header), which is the manual: do not edit.
#ifndef PTZCAL_API_HPP
#define PTZCAL_API_HPP

#include "callbacks.hpp"
#include "constants.hpp"
#include "error.hpp"
#include "handle.hpp"
#include "view.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

PTZCAL_BEGIN

struct shot;
struct image;
struct camera;
struct rig_model;
struct spot;
struct chessboard_options;
struct chessboard;
struct sift_options;
struct sift_match_options;
struct line_options;
struct line_fit_options;
struct line_match_options;
struct calibration_summary;
struct board_view;
struct laser_line;
struct zoom_position;
struct common_line;
struct rig_view;
struct rgbd_options;
struct rgbd_view;
struct pose;
struct planes_options;
struct plane;
struct station_options;
struct station_pose;
struct angle_summary;
struct head_capabilities;
struct angle_learning_options;
struct probe_options;
struct figure;
struct region;
struct scan_summary;
struct surface_options;
struct explore_options;
struct visible;
struct health_options;
struct health;
struct adjusted_summary;
struct suspect;
struct tie_options;
struct ties_summary;
struct link;
struct loop;
struct adjust_options;
struct study_options;
struct study_cell;
struct label_row;
struct plan_options;
struct plan_summary;
struct aim;
struct located;
struct sweep_summary;
class cancel;
class picture;
class depth_map;
class undistorter;
class spot_options;
class spot_detector;
class sift_features;
class correspondences;
class calibration_options;
class calibration;
class board_calibration;
class boards;
class laser_calibration;
class zoom_curve;
class rig_calibrated;
class rig_calibration;
class rgbd;
class roof_edges;
class pose_estimate;
class pose_options;
class planes;
class registration;
class simulator;
class angle_map;
class rig_options;
class head_options;
class head;
class probe_report;
class rig;
class scan_options;
class scan;
class cloud;
class mesh;
class exploration;
class health_report;
class adjustment;
class adjusted;
class ties;
class site;
class set_up;
class study;
class label;
class plan;
class pointing;
class sweep;
class camera_list;
class report;

struct shot : ptzcal_shot {
  shot() noexcept { ptzcal_shot_init(this, sizeof(ptzcal_shot)); }
  shot(const ptzcal_shot &c) noexcept : ptzcal_shot(c) {}
};

struct image : ptzcal_image {
  image() noexcept { ptzcal_image_init(this, sizeof(ptzcal_image)); }
  image(const ptzcal_image &c) noexcept : ptzcal_image(c) {}
};

struct camera : ptzcal_camera {
  camera() noexcept { ptzcal_camera_init(this, sizeof(ptzcal_camera)); }
  camera(const ptzcal_camera &c) noexcept : ptzcal_camera(c) {}

  // Centre of a camera in the world, -R^T t.
  // C: ptzcal_camera_centre
  outcome<std::array<double, 3>> centre() const;

  // Projects world points into the image, lens distortion included. Pixels outside the image are
  // not an error: compare them with the image size.
  //   xyz: n x 3 numbers: points, metres, world frame.
  // C: ptzcal_camera_project
  outcome<std::vector<double>> project(ptzcal::view<const double> xyz) const;

  // The viewing rays of pixels: from the camera's centre (ptzcal_camera_centre), lens distortion
  // removed.
  //   uv: n x 2 numbers: pixels.
  // C: ptzcal_camera_back_project
  outcome<std::vector<double>> back_project(ptzcal::view<const double> uv) const;

  // The ideal camera that shows what a camera sees: at its place, of its size, its rotation and its
  // ratio of focal lengths, without lens and skew. Change its rotation, focal lengths, principal
  // point or size for another view.
  //   keep: How much of the image's border is kept, as the alpha of OpenCV's
  //   getOptimalNewCameraMatrix. 0: the largest view whose pixels are all inside the image; 1: the
  //   smallest that holds all pixels of the image, with empty margins; between them something
  //   between.
  // C: ptzcal_camera_undistorted
  outcome<ptzcal::camera> undistorted(double keep) const;

  // Reads the one camera of a file.
  //   path: The file; of COLMAP its folder.
  //   format: A ptzcal_camera_format.
  // C: ptzcal_camera_read
  static outcome<ptzcal::camera> read(ptzcal::c_string path, ptzcal::camera_format format);

  // Writes one camera. The file is at every moment the old one or the whole new one.
  //   path: The file; of COLMAP its folder, which is made where it is not there.
  //   format: A ptzcal_camera_format.
  // C: ptzcal_camera_write
  outcome<void> write(ptzcal::c_string path, ptzcal::camera_format format) const;

  // Writes a camera alone as JSON.
  //   path: The file.
  // C: ptzcal_camera_save
  outcome<void> save(ptzcal::c_string path) const;

  // Reads the camera of a file written by ptzcal_camera_save or ptzcal_calibration_save.
  //   path: The file.
  // C: ptzcal_camera_load
  static outcome<ptzcal::camera> load(ptzcal::c_string path);

  // Writes a camera as OpenCV's YAML, with the pose in keys of our own.
  //   path: The file.
  // C: ptzcal_camera_save_opencv
  outcome<void> save_opencv(ptzcal::c_string path) const;

  // Reads a camera from OpenCV's YAML, XML or JSON. Without our keys its pose is the identity.
  //   path: The file.
  // C: ptzcal_camera_load_opencv
  static outcome<ptzcal::camera> load_opencv(ptzcal::c_string path);
};

struct rig_model : ptzcal_rig_model {
  rig_model() noexcept { ptzcal_rig_model_init(this, sizeof(ptzcal_rig_model)); }
  rig_model(const ptzcal_rig_model &c) noexcept : ptzcal_rig_model(c) {}
  struct locate_result;
  struct aim_result;

  // The head camera as a camera of the world, at given encoder readings.
  //   pan: Reading, radians.
  //   tilt: Reading, radians.
  // C: ptzcal_rig_model_head_camera
  outcome<ptzcal::camera> head_camera(double pan, double tilt) const;

  // The points that laser shots hit. Depth comes from both coordinates of each spot, weighted by
  // its covariance; far away it is uncertain and skewed, so hand shots to a calibration as shots
  // (ptzcal_correspondences_add_laser_shots), not as these points.
  //   pan_tilt: n x 2 numbers: readings at each shot, radians.
  //   spots: n x 2 numbers: the spot's pixel in the head camera.
  //   spot_covariance: n x 3 numbers: xx, xy, yy of each spot, px^2; may be left out: 1 px,
  //   uncorrelated.
  // C: ptzcal_rig_model_locate
  outcome<ptzcal::rig_model::locate_result> locate(ptzcal::view<const double> pan_tilt,
      ptzcal::view<const double> spots, ptzcal::view<const double> spot_covariance = {}) const;

  // The readings at which the laser of a rig hits a point, without moving anything.
  //   xyz: 3 numbers: the point in the rig's world, metres.
  // C: ptzcal_rig_model_aim
  outcome<ptzcal::rig_model::aim_result> aim(ptzcal::view<const double> xyz) const;
};

struct spot : ptzcal_spot {
  spot() noexcept { ptzcal_spot_init(this, sizeof(ptzcal_spot)); }
  spot(const ptzcal_spot &c) noexcept : ptzcal_spot(c) {}
};

struct chessboard_options : ptzcal_chessboard_options {
  chessboard_options() noexcept { ptzcal_chessboard_options_init(this, sizeof(ptzcal_chessboard_options)); }
  chessboard_options(const ptzcal_chessboard_options &c) noexcept : ptzcal_chessboard_options(c) {}
};

struct chessboard : ptzcal_chessboard {
  chessboard() noexcept { ptzcal_chessboard_init(this, sizeof(ptzcal_chessboard)); }
  chessboard(const ptzcal_chessboard &c) noexcept : ptzcal_chessboard(c) {}
};

struct sift_options : ptzcal_sift_options {
  sift_options() noexcept { ptzcal_sift_options_init(this, sizeof(ptzcal_sift_options)); }
  sift_options(const ptzcal_sift_options &c) noexcept : ptzcal_sift_options(c) {}
};

struct sift_match_options : ptzcal_sift_match_options {
  sift_match_options() noexcept { ptzcal_sift_match_options_init(this, sizeof(ptzcal_sift_match_options)); }
  sift_match_options(const ptzcal_sift_match_options &c) noexcept : ptzcal_sift_match_options(c) {}
};

struct line_options : ptzcal_line_options {
  line_options() noexcept { ptzcal_line_options_init(this, sizeof(ptzcal_line_options)); }
  line_options(const ptzcal_line_options &c) noexcept : ptzcal_line_options(c) {}
};

struct line_fit_options : ptzcal_line_fit_options {
  line_fit_options() noexcept { ptzcal_line_fit_options_init(this, sizeof(ptzcal_line_fit_options)); }
  line_fit_options(const ptzcal_line_fit_options &c) noexcept : ptzcal_line_fit_options(c) {}
};

struct line_match_options : ptzcal_line_match_options {
  line_match_options() noexcept { ptzcal_line_match_options_init(this, sizeof(ptzcal_line_match_options)); }
  line_match_options(const ptzcal_line_match_options &c) noexcept : ptzcal_line_match_options(c) {}
};

struct calibration_summary : ptzcal_calibration_summary {
  calibration_summary() noexcept { ptzcal_calibration_summary_init(this, sizeof(ptzcal_calibration_summary)); }
  calibration_summary(const ptzcal_calibration_summary &c) noexcept : ptzcal_calibration_summary(c) {}
};

struct board_view : ptzcal_board_view {
  board_view() noexcept { ptzcal_board_view_init(this, sizeof(ptzcal_board_view)); }
  board_view(const ptzcal_board_view &c) noexcept : ptzcal_board_view(c) {}
};

struct laser_line : ptzcal_laser_line {
  laser_line() noexcept { ptzcal_laser_line_init(this, sizeof(ptzcal_laser_line)); }
  laser_line(const ptzcal_laser_line &c) noexcept : ptzcal_laser_line(c) {}
};

struct zoom_position : ptzcal_zoom_position {
  zoom_position() noexcept { ptzcal_zoom_position_init(this, sizeof(ptzcal_zoom_position)); }
  zoom_position(const ptzcal_zoom_position &c) noexcept : ptzcal_zoom_position(c) {}
};

struct common_line : ptzcal_common_line {
  common_line() noexcept { ptzcal_common_line_init(this, sizeof(ptzcal_common_line)); }
  common_line(const ptzcal_common_line &c) noexcept : ptzcal_common_line(c) {}
};

struct rig_view : ptzcal_rig_view {
  rig_view() noexcept { ptzcal_rig_view_init(this, sizeof(ptzcal_rig_view)); }
  rig_view(const ptzcal_rig_view &c) noexcept : ptzcal_rig_view(c) {}
};

struct rgbd_options : ptzcal_rgbd_options {
  rgbd_options() noexcept { ptzcal_rgbd_options_init(this, sizeof(ptzcal_rgbd_options)); }
  rgbd_options(const ptzcal_rgbd_options &c) noexcept : ptzcal_rgbd_options(c) {}
};

struct rgbd_view : ptzcal_rgbd_view {
  rgbd_view() noexcept { ptzcal_rgbd_view_init(this, sizeof(ptzcal_rgbd_view)); }
  rgbd_view(const ptzcal_rgbd_view &c) noexcept : ptzcal_rgbd_view(c) {}
};

struct pose : ptzcal_pose {
  pose() noexcept { ptzcal_pose_init(this, sizeof(ptzcal_pose)); }
  pose(const ptzcal_pose &c) noexcept : ptzcal_pose(c) {}
};

struct planes_options : ptzcal_planes_options {
  planes_options() noexcept { ptzcal_planes_options_init(this, sizeof(ptzcal_planes_options)); }
  planes_options(const ptzcal_planes_options &c) noexcept : ptzcal_planes_options(c) {}
};

struct plane : ptzcal_plane {
  plane() noexcept { ptzcal_plane_init(this, sizeof(ptzcal_plane)); }
  plane(const ptzcal_plane &c) noexcept : ptzcal_plane(c) {}
};

struct station_options : ptzcal_station_options {
  station_options() noexcept { ptzcal_station_options_init(this, sizeof(ptzcal_station_options)); }
  station_options(const ptzcal_station_options &c) noexcept : ptzcal_station_options(c) {}
};

struct station_pose : ptzcal_station_pose {
  station_pose() noexcept { ptzcal_station_pose_init(this, sizeof(ptzcal_station_pose)); }
  station_pose(const ptzcal_station_pose &c) noexcept : ptzcal_station_pose(c) {}
};

struct angle_summary : ptzcal_angle_summary {
  angle_summary() noexcept { ptzcal_angle_summary_init(this, sizeof(ptzcal_angle_summary)); }
  angle_summary(const ptzcal_angle_summary &c) noexcept : ptzcal_angle_summary(c) {}
};

struct head_capabilities : ptzcal_head_capabilities {
  head_capabilities() noexcept { ptzcal_head_capabilities_init(this, sizeof(ptzcal_head_capabilities)); }
  head_capabilities(const ptzcal_head_capabilities &c) noexcept : ptzcal_head_capabilities(c) {}
};

struct angle_learning_options : ptzcal_angle_learning_options {
  angle_learning_options() noexcept { ptzcal_angle_learning_options_init(this, sizeof(ptzcal_angle_learning_options)); }
  angle_learning_options(const ptzcal_angle_learning_options &c) noexcept : ptzcal_angle_learning_options(c) {}
};

struct probe_options : ptzcal_probe_options {
  probe_options() noexcept { ptzcal_probe_options_init(this, sizeof(ptzcal_probe_options)); }
  probe_options(const ptzcal_probe_options &c) noexcept : ptzcal_probe_options(c) {}
};

struct figure : ptzcal_figure {
  figure() noexcept { ptzcal_figure_init(this, sizeof(ptzcal_figure)); }
  figure(const ptzcal_figure &c) noexcept : ptzcal_figure(c) {}
};

struct region : ptzcal_region {
  region() noexcept { ptzcal_region_init(this, sizeof(ptzcal_region)); }
  region(const ptzcal_region &c) noexcept : ptzcal_region(c) {}
};

struct scan_summary : ptzcal_scan_summary {
  scan_summary() noexcept { ptzcal_scan_summary_init(this, sizeof(ptzcal_scan_summary)); }
  scan_summary(const ptzcal_scan_summary &c) noexcept : ptzcal_scan_summary(c) {}
};

struct surface_options : ptzcal_surface_options {
  surface_options() noexcept { ptzcal_surface_options_init(this, sizeof(ptzcal_surface_options)); }
  surface_options(const ptzcal_surface_options &c) noexcept : ptzcal_surface_options(c) {}
};

struct explore_options : ptzcal_explore_options {
  explore_options() noexcept { ptzcal_explore_options_init(this, sizeof(ptzcal_explore_options)); }
  explore_options(const ptzcal_explore_options &c) noexcept : ptzcal_explore_options(c) {}
};

struct visible : ptzcal_visible {
  visible() noexcept { ptzcal_visible_init(this, sizeof(ptzcal_visible)); }
  visible(const ptzcal_visible &c) noexcept : ptzcal_visible(c) {}
};

struct health_options : ptzcal_health_options {
  health_options() noexcept { ptzcal_health_options_init(this, sizeof(ptzcal_health_options)); }
  health_options(const ptzcal_health_options &c) noexcept : ptzcal_health_options(c) {}
};

struct health : ptzcal_health {
  health() noexcept { ptzcal_health_init(this, sizeof(ptzcal_health)); }
  health(const ptzcal_health &c) noexcept : ptzcal_health(c) {}
};

struct adjusted_summary : ptzcal_adjusted_summary {
  adjusted_summary() noexcept { ptzcal_adjusted_summary_init(this, sizeof(ptzcal_adjusted_summary)); }
  adjusted_summary(const ptzcal_adjusted_summary &c) noexcept : ptzcal_adjusted_summary(c) {}
};

struct suspect : ptzcal_suspect {
  suspect() noexcept { ptzcal_suspect_init(this, sizeof(ptzcal_suspect)); }
  suspect(const ptzcal_suspect &c) noexcept : ptzcal_suspect(c) {}
};

struct tie_options : ptzcal_tie_options {
  tie_options() noexcept { ptzcal_tie_options_init(this, sizeof(ptzcal_tie_options)); }
  tie_options(const ptzcal_tie_options &c) noexcept : ptzcal_tie_options(c) {}
};

struct ties_summary : ptzcal_ties_summary {
  ties_summary() noexcept { ptzcal_ties_summary_init(this, sizeof(ptzcal_ties_summary)); }
  ties_summary(const ptzcal_ties_summary &c) noexcept : ptzcal_ties_summary(c) {}
};

struct link : ptzcal_link {
  link() noexcept { ptzcal_link_init(this, sizeof(ptzcal_link)); }
  link(const ptzcal_link &c) noexcept : ptzcal_link(c) {}
};

struct loop : ptzcal_loop {
  loop() noexcept { ptzcal_loop_init(this, sizeof(ptzcal_loop)); }
  loop(const ptzcal_loop &c) noexcept : ptzcal_loop(c) {}
};

struct adjust_options : ptzcal_adjust_options {
  adjust_options() noexcept { ptzcal_adjust_options_init(this, sizeof(ptzcal_adjust_options)); }
  adjust_options(const ptzcal_adjust_options &c) noexcept : ptzcal_adjust_options(c) {}
};

struct study_options : ptzcal_study_options {
  study_options() noexcept { ptzcal_study_options_init(this, sizeof(ptzcal_study_options)); }
  study_options(const ptzcal_study_options &c) noexcept : ptzcal_study_options(c) {}
};

struct study_cell : ptzcal_study_cell {
  study_cell() noexcept { ptzcal_study_cell_init(this, sizeof(ptzcal_study_cell)); }
  study_cell(const ptzcal_study_cell &c) noexcept : ptzcal_study_cell(c) {}
};

struct label_row : ptzcal_label_row {
  label_row() noexcept { ptzcal_label_row_init(this, sizeof(ptzcal_label_row)); }
  label_row(const ptzcal_label_row &c) noexcept : ptzcal_label_row(c) {}
};

struct plan_options : ptzcal_plan_options {
  plan_options() noexcept { ptzcal_plan_options_init(this, sizeof(ptzcal_plan_options)); }
  plan_options(const ptzcal_plan_options &c) noexcept : ptzcal_plan_options(c) {}
};

struct plan_summary : ptzcal_plan_summary {
  plan_summary() noexcept { ptzcal_plan_summary_init(this, sizeof(ptzcal_plan_summary)); }
  plan_summary(const ptzcal_plan_summary &c) noexcept : ptzcal_plan_summary(c) {}
};

struct aim : ptzcal_aim {
  aim() noexcept { ptzcal_aim_init(this, sizeof(ptzcal_aim)); }
  aim(const ptzcal_aim &c) noexcept : ptzcal_aim(c) {}
};

struct located : ptzcal_located {
  located() noexcept { ptzcal_located_init(this, sizeof(ptzcal_located)); }
  located(const ptzcal_located &c) noexcept : ptzcal_located(c) {}
};

struct sweep_summary : ptzcal_sweep_summary {
  sweep_summary() noexcept { ptzcal_sweep_summary_init(this, sizeof(ptzcal_sweep_summary)); }
  sweep_summary(const ptzcal_sweep_summary &c) noexcept : ptzcal_sweep_summary(c) {}
};

class cancel : public detail::handle<ptzcal_cancel, ptzcal_cancel_free> {
 public:
  using handle::handle;
  cancel() : handle(detail::make<ptzcal_cancel>(ptzcal_cancel_new)) {}

  // Makes a token that is not requested.
  // C: ptzcal_cancel_new
  static outcome<ptzcal::cancel> make();

  // Requests that all work which has this token stops. May be called again, from any thread, and
  // from a signal handler: it only stores a flag.
  // C: ptzcal_cancel_request
  outcome<void> request() const;

  // Takes a request back, so that the token can be used for the next work. Work that is still
  // running may or may not have seen the request.
  // C: ptzcal_cancel_reset
  outcome<void> reset() const;

  // Has cancellation been requested?
  // C: ptzcal_cancel_is_requested
  bool is_requested() const;
};

class picture : public detail::handle<ptzcal_picture, ptzcal_picture_free> {
 public:
  using handle::handle;
  picture() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  explicit picture(const ptzcal_image &image) : picture(make(image)) {}
#endif

  // Reads a photograph: PNG, JPEG or PNM, told by what it holds; 16 bits per sample are cut to 8.
  //   path: The file.
  // C: ptzcal_picture_read
  static outcome<ptzcal::picture> read(ptzcal::c_string path);

  // Copies an image, to draw on it.
  //   image: The image.
  // C: ptzcal_picture_new
  static outcome<ptzcal::picture> make(const ptzcal_image &image);

  // Copies two images side by side, to draw what matches in them.
  //   left: The left one.
  //   right: The right one; it begins at x = the left one's width.
  // C: ptzcal_picture_beside
  static outcome<ptzcal::picture> beside(const ptzcal_image &left, const ptzcal_image &right);

  // The picture's pixels, for every function that takes an image. They stay where they are until
  // the picture is freed; drawing changes them.
  // C: ptzcal_picture_image
  outcome<ptzcal::image> image() const;

  // Writes a picture as PNG, at once or not at all.
  //   path: The file.
  // C: ptzcal_picture_save
  outcome<void> save(ptzcal::c_string path) const;

  // Darkens a picture, so that marks stand out.
  //   light: What is left of its light, 0 to 1.
  // C: ptzcal_picture_dim
  outcome<void> dim(double light);

  // Draws lines.
  //   ends: n x 4 numbers: x, y of the one end and of the other, pixels.
  //   width: Width of the lines, pixels.
  //   colour: 0xRRGGBB.
  // C: ptzcal_picture_draw_lines
  outcome<void> draw_lines(ptzcal::view<const double> ends, double width, std::uint32_t colour);

  // Draws circles.
  //   centres: n x 2 numbers, pixels.
  //   radius: Radius, pixels.
  //   width: Width of the line, pixels.
  //   colour: 0xRRGGBB.
  // C: ptzcal_picture_draw_circles
  outcome<void> draw_circles(ptzcal::view<const double> centres, double radius, double width,
      std::uint32_t colour);

  // Draws a chessboard's corners, as ptzcal_detect_chessboard gives them: each row in a colour,
  // joined in order, a ring around the first.
  //   corners: columns x rows x 2 numbers, pixels.
  //   found: columns x rows numbers: 0 where there is no corner; may be left out: all are there.
  //   columns: Corners in a row.
  //   rows: Corners in a column.
  // C: ptzcal_picture_draw_board
  outcome<void> draw_board(ptzcal::view<const double> corners, ptzcal::view<const std::uint8_t> found,
      std::size_t columns, std::size_t rows);

  // Draws residuals as arrows from where each point was seen; outliers are red rings.
  //   uv: n x 2 numbers: where the points were seen, pixels.
  //   residuals: n x 2 numbers, pixels; they may be infinite: those are left out.
  //   inliers: n numbers: 0 for outliers; may be left out: there are none.
  //   scale: How much longer than the residuals the arrows are.
  // C: ptzcal_picture_draw_residuals
  outcome<void> draw_residuals(ptzcal::view<const double> uv, ptzcal::view<const double> residuals,
      ptzcal::view<const std::uint8_t> inliers, double scale);

  // Draws pairs of points of two pictures that stand side by side (ptzcal_picture_beside): kept
  // ones are joined by a line, the others are red rings.
  //   left: n x 2 numbers, pixels of the left picture.
  //   right: n x 2 numbers, pixels of the right picture.
  //   kept: n numbers: 0 for pairs that are not kept; may be left out: all are.
  //   offset: Width of the left picture, pixels.
  // C: ptzcal_picture_draw_matches
  outcome<void> draw_matches(ptzcal::view<const double> left, ptzcal::view<const double> right,
      ptzcal::view<const std::uint8_t> kept, double offset);
};

class depth_map : public detail::handle<ptzcal_depth_map, ptzcal_depth_map_free> {
 public:
  using handle::handle;
  depth_map() noexcept = default;
  struct size_result;

  // Makes a depth map of 16-bit values, as most depth cameras give; 0 is no depth.
  //   values: Rows from the top, `stride` values apart.
  //   width: Pixels.
  //   height: Pixels.
  //   stride: Values from a row to the next, at least `width`.
  //   metres: Metres per unit: 0.001 for millimetres.
  // C: ptzcal_depth_map_new_u16
  static outcome<ptzcal::depth_map> from_u16(ptzcal::view<const std::uint16_t> values, std::uint32_t width,
      std::uint32_t height, std::size_t stride, double metres);

  // Makes a depth map of floats; what is not a positive number (0, negative, NaN, infinite) is no
  // depth.
  //   values: Rows from the top, `stride` values apart.
  //   width: Pixels.
  //   height: Pixels.
  //   stride: Values from a row to the next, at least `width`.
  //   metres: Metres per unit: 1 for metres.
  // C: ptzcal_depth_map_new_f32
  static outcome<ptzcal::depth_map> from_f32(ptzcal::view<const float> values, std::uint32_t width,
      std::uint32_t height, std::size_t stride, double metres);

  // Reads a depth map: a PNG or PGM with one channel of 16 bits; 0 is no depth.
  //   path: The file.
  //   metres: Metres per unit: 0.001 for millimetres.
  // C: ptzcal_depth_map_read
  static outcome<ptzcal::depth_map> read(ptzcal::c_string path, double metres);

  // Size of a depth map and how many of its pixels have a depth.
  // C: ptzcal_depth_map_size
  outcome<ptzcal::depth_map::size_result> size() const;

  // Copies the depths: width x height numbers, row by row, metres; 0 where there is none.
  // C: ptzcal_depth_map_copy_metres
  outcome<std::vector<float>> metres() const;

  // Copies the variances of a map that was made of a cloud or mesh: width x height numbers, row by
  // row, m^2; 0 where there is no depth.
  // C: ptzcal_depth_map_copy_variances
  outcome<std::vector<float>> variances() const;

  // Writes a depth map as a PNG with one channel of 16 bits; 0 is no depth.
  //   path: The file.
  //   metres: Metres per unit: 0.001 for millimetres, up to 65.535 m.
  // C: ptzcal_depth_map_save
  outcome<void> save(ptzcal::c_string path, double metres) const;
};

class undistorter : public detail::handle<ptzcal_undistorter, ptzcal_undistorter_free> {
 public:
  using handle::handle;
  undistorter() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  undistorter(const ptzcal_camera &camera, const ptzcal_camera &ideal) : undistorter(make(camera, ideal)) {}
#endif

  // Makes an undistorter. Both cameras look from the same place: of the ideal camera's pose only
  // the rotation counts, its translation becomes the one that goes with the camera's centre.
  //   camera: The calibrated camera, of any lens model.
  //   ideal: The ideal camera, as ptzcal_camera_undistorted gives it or any other without a lens;
  //   2^26 pixels at most.
  // C: ptzcal_undistorter_new
  static outcome<ptzcal::undistorter> make(const ptzcal_camera &camera, const ptzcal_camera &ideal);

  // The ideal camera, whose pictures an undistorter draws: with it points are projected into them
  // and pixels of them back into the world (ptzcal_camera_project, ptzcal_camera_back_project).
  // C: ptzcal_undistorter_get_camera
  outcome<ptzcal::camera> camera() const;

  // Draws the ideal camera's picture. Pixels outside the image are black (all bytes 0).
  //   image: The calibrated camera's image, of its size: GRAY8, RGB24, BGR24, RGBA32 or BGRA32. Of
  //   NV12 and I420 the Y plane alone is a GRAY8 image.
  //   pixels: Receives n bytes: the picture, in the image's format. Not the image's memory. What is
  //   between the rows stays as it is.
  //   stride: Bytes from a row to the one below; negative = bottom-up: the bottom row is the first
  //   in memory.
  // C: ptzcal_undistorter_apply
  outcome<void> apply(const ptzcal_image &image, ptzcal::view<std::uint8_t> pixels,
      std::ptrdiff_t stride) const;

  // Draws a part of the ideal camera's picture: a tile that is shown, or a thread's share of the
  // rows.
  //   image: As for ptzcal_undistorter_apply.
  //   x: First column.
  //   y: First row.
  //   width: Columns, at least 1; the region is inside the ideal camera's picture.
  //   height: Rows, at least 1.
  //   border: 4 bytes: the value of pixels outside the image, of which as many count as a pixel of
  //   its format has; may be left out: 0.
  //   pixels: Receives n bytes: the region's pixels, as for ptzcal_undistorter_apply.
  //   stride: As for ptzcal_undistorter_apply.
  // C: ptzcal_undistorter_apply_region
  outcome<void> apply_region(const ptzcal_image &image, std::uint32_t x, std::uint32_t y, std::uint32_t width,
      std::uint32_t height, ptzcal::view<const std::uint8_t> border, ptzcal::view<std::uint8_t> pixels,
      std::ptrdiff_t stride) const;
};

class spot_options : public detail::handle<ptzcal_spot_options, ptzcal_spot_options_free> {
 public:
  using handle::handle;
  spot_options() : handle(detail::make<ptzcal_spot_options>(ptzcal_spot_options_new)) {}

  // Makes options with their defaults: the whole image, any colour, a signal-to-noise ratio of 8.
  // C: ptzcal_spot_options_new
  static outcome<ptzcal::spot_options> make();

  // Searches only a rectangle: columns x to x + width - 1, rows y to y + height - 1. With a band
  // set as well, both must hold.
  //   x: First column.
  //   y: First row.
  //   width: Columns, at least 1.
  //   height: Rows, at least 1.
  // C: ptzcal_spot_options_set_region
  outcome<void> set_region(std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height);

  // Searches only a band about a line of pixels, such as the epipolar line on which the laser's
  // spot must lie. The line may bend, as epipolar lines do behind a lens.
  //   polyline: n x 2 numbers: corners of the line, pixels.
  //   half_width: Greatest distance from the line, pixels, positive.
  // C: ptzcal_spot_options_set_band
  outcome<void> set_band(ptzcal::view<const double> polyline, double half_width);

  // Tells the laser's colour, so that other changes in the image weigh less.
  //   colour: A ptzcal_laser_colour.
  // C: ptzcal_spot_options_set_colour
  outcome<void> set_colour(ptzcal::laser_colour colour);

  // Sets the least signal-to-noise ratio of a spot that is believed.
  //   ratio: Positive; the default is 8.
  // C: ptzcal_spot_options_set_min_signal_to_noise
  outcome<void> set_min_signal_to_noise(double ratio);

  // Sets the greatest area of a spot; larger changes are people, lamps or shadows.
  //   area: Pixels, at least 1; the default is 5000.
  // C: ptzcal_spot_options_set_max_area
  outcome<void> set_max_area(std::uint32_t area);

  // Sets how strong a second candidate may be: at this fraction of the best one's strength or more
  // the answer is PTZCAL_STATUS_AMBIGUOUS.
  //   ratio: Above 0, at most 1; the default is 0.5.
  // C: ptzcal_spot_options_set_ambiguity_ratio
  outcome<void> set_ambiguity_ratio(double ratio);
};

class spot_detector : public detail::handle<ptzcal_spot_detector, ptzcal_spot_detector_free> {
 public:
  using handle::handle;
  spot_detector() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  explicit spot_detector(ptzcal::optional_ref<ptzcal::spot_options> options) : spot_detector(make(options)) {}
#endif

  // Makes a detector.
  //   options: The options, which are copied; may be left out: the defaults.
  // C: ptzcal_spot_detector_new
  static outcome<ptzcal::spot_detector> make(ptzcal::optional_ref<ptzcal::spot_options> options = {});

  // Finds the laser's spot, as ptzcal_detect_spot_averaged does: what the detector saw before does
  // not change the answer.
  //   on: n_on frames with the laser on, all of one size and format.
  //   off: n_off frames of the same view with the laser off; may be left out when n_off is 0.
  // C: ptzcal_spot_detector_detect
  outcome<ptzcal::spot> detect(ptzcal::view<const ptzcal::image> on = {},
      ptzcal::view<const ptzcal::image> off = {});
};

class sift_features : public detail::handle<ptzcal_sift_features, ptzcal_sift_features_free> {
 public:
  using handle::handle;
  sift_features() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  sift_features(ptzcal::view<const double> keypoints,
      ptzcal::view<const std::uint8_t> descriptors) : sift_features(make(keypoints, descriptors)) {}
#endif

  // Makes features of keypoints and descriptors that were kept elsewhere, or come from elsewhere.
  //   keypoints: n x 9 numbers, as ptzcal_sift_features_copy_keypoints writes them; sigma is
  //   ignored. Of keypoints whose elongation is not known: 1.
  //   descriptors: n x 128 bytes.
  // C: ptzcal_sift_features_new
  static outcome<ptzcal::sift_features> make(ptzcal::view<const double> keypoints,
      ptzcal::view<const std::uint8_t> descriptors);

  // How many features there are.
  // C: ptzcal_sift_features_count
  outcome<std::size_t> count() const;

  // Copies the keypoints, PTZCAL_SIFT_KEYPOINT_SIZE numbers each.
  // C: ptzcal_sift_features_copy_keypoints
  outcome<std::vector<double>> keypoints() const;

  // Copies the descriptors, PTZCAL_SIFT_DESCRIPTOR_SIZE bytes each.
  // C: ptzcal_sift_features_copy_descriptors
  outcome<std::vector<std::uint8_t>> descriptors() const;
};

class correspondences : public detail::handle<ptzcal_correspondences, ptzcal_correspondences_free> {
 public:
  using handle::handle;
  correspondences() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  correspondences(std::uint32_t image_width, std::uint32_t image_height) : correspondences(make(image_width,
      image_height)) {}
#endif

  // Makes an empty set for a camera with the given image size.
  //   image_width: Pixels, 1 to 65536.
  //   image_height: Pixels, 1 to 65536.
  // C: ptzcal_correspondences_new
  static outcome<ptzcal::correspondences> make(std::uint32_t image_width, std::uint32_t image_height);

  // Adds points whose 3D position is exact (surveyed, or far better known than a pixel).
  //   xyz: n x 3 numbers: points, metres, world frame.
  //   uv: n x 2 numbers: their pixels; (0, 0) is the centre of the top-left pixel.
  // C: ptzcal_correspondences_add_points
  outcome<void> add_points(ptzcal::view<const double> xyz, ptzcal::view<const double> uv);

  // Adds points with the covariances of their 3D positions, of their pixels, or of both.
  //   xyz: n x 3 numbers: points, metres, world frame.
  //   xyz_covariance: n x 9 numbers: of each point, row-major, symmetric, positive semi-definite,
  //   m^2; may be left out: the points are exact.
  //   uv: n x 2 numbers: their pixels.
  //   uv_covariance: n x 3 numbers: xx, xy, yy of each pixel, positive definite, px^2; may be left
  //   out: the calibration's pixel noise.
  // C: ptzcal_correspondences_add_points_weighted
  outcome<void> add_points_weighted(ptzcal::view<const double> xyz, ptzcal::view<const double> xyz_covariance,
      ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance = {});

  // Adds laser shots: what the rig's head read and saw, and where this camera saw the spot. The
  // solver then knows each point by its ray and its inverse depth, whose noise, unlike that of the
  // depth, is Gaussian; this is what makes the calibration as good as the shots are.
  //   model: The rig model.
  //   pan_tilt: n x 2 numbers: readings at each shot, radians.
  //   spots: n x 2 numbers: the spot's pixel in the head camera.
  //   spot_covariance: n x 3 numbers: xx, xy, yy, px^2; may be left out: 1 px, uncorrelated.
  //   uv: n x 2 numbers: the spot's pixel in the camera to be calibrated.
  //   uv_covariance: n x 3 numbers: xx, xy, yy, px^2; may be left out: 1 px, uncorrelated.
  // C: ptzcal_correspondences_add_laser_shots
  outcome<void> add_laser_shots(const ptzcal_rig_model &model, ptzcal::view<const double> pan_tilt,
      ptzcal::view<const double> spots, ptzcal::view<const double> spot_covariance,
      ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance = {});

  // Adds straight lines by two points of each in space, exact or with covariances. The ends of a
  // segment are images of no particular points of its line: how long the segment is, and how far
  // apart the two points, does not matter beyond their noise. A line is worth a point: two
  // equations. Its residual in ptzcal_calibration_copy_residuals are the distances of its two ends
  // from the line's image, which a distorting lens bends.
  //   xyz: n x 6 numbers: two points of each line, metres, world frame.
  //   xyz_covariance: n x 18 numbers: of the two points of each line, row-major, positive
  //   semi-definite, m^2; may be left out: the lines are exact.
  //   uv: n x 4 numbers: the two ends of each line's segment in the image, pixels.
  //   uv_covariance: n x 6 numbers: xx, xy, yy of each end, positive definite, px^2; may be left
  //   out: the calibration's pixel noise.
  // C: ptzcal_correspondences_add_lines
  outcome<void> add_lines(ptzcal::view<const double> xyz, ptzcal::view<const double> xyz_covariance,
      ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance = {});

  // Adds straight lines like ptzcal_correspondences_add_lines, each by a point and a direction, as
  // a fit of a line to a cloud gives them.
  //   point_direction: n x 6 numbers: a point of each line, metres, world frame, and its direction,
  //   of any length but zero.
  //   line_covariance: n x 36 numbers: of point and direction together, 6 x 6 row-major, positive
  //   semi-definite; may be left out: the lines are exact.
  //   uv: n x 4 numbers: the two ends of each line's segment in the image, pixels.
  //   uv_covariance: n x 6 numbers: xx, xy, yy of each end, positive definite, px^2; may be left
  //   out: the calibration's pixel noise.
  // C: ptzcal_correspondences_add_directed_lines
  outcome<void> add_directed_lines(ptzcal::view<const double> point_direction,
      ptzcal::view<const double> line_covariance, ptzcal::view<const double> uv,
      ptzcal::view<const double> uv_covariance = {});

  // How many measurements there are.
  // C: ptzcal_correspondences_count
  outcome<std::size_t> count() const;

  // Adds to a set what the head camera and a fixed camera saw together: the calibration of that
  // camera from this scan.
  //   scan: The scan.
  //   camera: The fixed camera's number.
  // C: ptzcal_correspondences_add_scan
  outcome<void> add_scan(const ptzcal::scan &scan, std::uint32_t camera);

  // Adds the points of a table of comma-separated values, all or none. Its first line names the
  // columns, in any order: x y z (metres, world) and u v (pixels). Optional: sigma_x sigma_y
  // sigma_z (m), or cov_xx cov_xy cov_xz cov_yy cov_yz cov_zz (m^2); sigma_u sigma_v (px), or
  // cov_uu cov_uv cov_vv (px^2), each group empty where a point has none; name and comment, which
  // are passed over. So are lines that begin with #. The last line has its end, or the file was cut
  // short.
  //   path: The file.
  // C: ptzcal_correspondences_add_csv
  outcome<std::size_t> add_csv(ptzcal::c_string path);

  // Writes the points of a set as a table of comma-separated values, every number to its last bit:
  // see ptzcal_correspondences_add_csv.
  //   path: The file.
  // C: ptzcal_correspondences_save_csv
  outcome<void> save_csv(ptzcal::c_string path) const;
};

class calibration_options : public detail::handle<ptzcal_calibration_options, ptzcal_calibration_options_free> {
 public:
  using handle::handle;
  calibration_options() : handle(detail::make<ptzcal_calibration_options>(ptzcal_calibration_options_new)) {}

  // Makes options with their defaults, which are right for laser shots and surveyed points: no
  // distortion, hardly any skew, nearly square pixels, outliers set aside, seed 1.
  // C: ptzcal_calibration_options_new
  static outcome<ptzcal::calibration_options> make();

  // Sets the lens model that is fitted. Each coefficient wants points towards the image's corners.
  //   model: A ptzcal_distortion_model; the default is PTZCAL_DISTORTION_MODEL_NONE.
  // C: ptzcal_calibration_options_set_distortion
  outcome<void> set_distortion(ptzcal::distortion_model model);

  // Keeps a known lens, so that only the pose is found: the points may then lie in a plane.
  //   camera: A camera whose intrinsics and distortion are kept (its pose is ignored); may be left
  //   out: the lens is found, which is the default.
  // C: ptzcal_calibration_options_set_lens
  outcome<void> set_lens(ptzcal::optional_ref<ptzcal_camera> camera = {});

  // Sets how much the pixels' axes may lean: the prior standard deviation of skew / f about 0.
  //   sigma: 0 forces no skew; INFINITY leaves it to the data; the default is 0.001.
  // C: ptzcal_calibration_options_set_skew_sigma
  outcome<void> set_skew_sigma(double sigma);

  // Sets how far pixels may be from square: the prior standard deviation of fx / fy about 1.
  //   sigma: 0 forces fx = fy; INFINITY leaves it to the data; the default is 0.001.
  // C: ptzcal_calibration_options_set_aspect_sigma
  outcome<void> set_aspect_sigma(double sigma);

  // Sets the noise of pixels that were added without a covariance.
  //   sigma: Standard deviation of each coordinate, pixels; 0 (the default): estimated from the
  //   residuals.
  // C: ptzcal_calibration_options_set_pixel_sigma
  outcome<void> set_pixel_sigma(double sigma);

  // Chooses whether gross outliers are searched and set aside.
  //   robust: 0: every measurement is used; anything else (the default): outliers are set aside.
  // C: ptzcal_calibration_options_set_robust
  outcome<void> set_robust(bool robust);

  // Sets the seed of the search for outliers. The same seed gives the same result, bit for bit, on
  // the same machine.
  //   seed: Any number; the default is 1.
  // C: ptzcal_calibration_options_set_seed
  outcome<void> set_seed(std::uint64_t seed);

  // Sets how uncertain the focal length may be: above it the calibration is refused
  // (PTZCAL_STATUS_DEGENERATE) rather than returned.
  //   relative: Standard deviation over focal length, positive; the default is 0.1; INFINITY
  //   returns whatever was found.
  // C: ptzcal_calibration_options_set_max_focal_deviation
  outcome<void> set_max_focal_deviation(double relative);

  // Sets how many iterations a refinement may take before it is PTZCAL_STATUS_NO_CONVERGENCE.
  //   iterations: 1 to 10000; the default is 100.
  // C: ptzcal_calibration_options_set_max_iterations
  outcome<void> set_max_iterations(std::uint32_t iterations);

  // Sets the token that stops the calibration.
  //   token: The token; may be left out: none (the default). It may be freed before the options.
  // C: ptzcal_calibration_options_set_cancel
  outcome<void> set_cancel(ptzcal::optional_ref<ptzcal::cancel> token = {});
};

class calibration : public detail::handle<ptzcal_calibration, ptzcal_calibration_free> {
 public:
  using handle::handle;
  calibration() noexcept = default;
  struct project_result;
  struct back_project_result;
  struct back_project_to_plane_result;

  // The calibrated camera.
  // C: ptzcal_calibration_get_camera
  outcome<ptzcal::camera> camera() const;

  // What the calibration says about itself.
  // C: ptzcal_calibration_get_summary
  outcome<ptzcal::calibration_summary> summary() const;

  // The covariance of all parameters: p x p numbers, row-major, symmetric, p = the summary's
  // `parameters`. Their order: 0 fx, 1 fy, 2 skew, 3 cx, 4 cy (pixels), 5 ... the coefficients of
  // the camera's lens model, in its order (0, 1, 4 or 5 of them), then 3 for the rotation: w in R
  // <- exp([w]x) R, a turn about the camera's own axes (radians), then 3 for the camera's centre in
  // the world (metres). Rows and columns of parameters that were not free are 0.
  // C: ptzcal_calibration_copy_covariance
  outcome<std::vector<double>> covariance() const;

  // Measured minus predicted pixel of every measurement, outliers included: n x 2 numbers, n = the
  // summary's `measurements`, in the order of adding. Of a line they are the signed distances of
  // its segment's two ends from the line's image, positive to the right of it as seen from the
  // first end to the second. Infinite for an outlier that the camera cannot see (behind it).
  // C: ptzcal_calibration_copy_residuals
  outcome<std::vector<double>> residuals() const;

  // Which measurements were used: n bytes, n = the summary's `measurements`, in the order of
  // adding; 1 for an inlier, 0 for an outlier.
  // C: ptzcal_calibration_copy_inliers
  outcome<std::vector<std::uint8_t>> inliers() const;

  // What a person should know of the calibration, one line of English UTF-8: residuals beyond the
  // stated noise, a lens or skew that was kept fixed and should not be. The wording may change in
  // any version; decide by the number of warnings and by the summary's `probability`.
  //   index: From 0 to the summary's `warnings` less 1.
  // C: ptzcal_calibration_warning
  std::string warning(std::size_t index) const;

  // What the data determine worst, and what to add, one line of English UTF-8, such as "weakest:
  // camera focal length against camera position: add shots much nearer or farther".
  // C: ptzcal_calibration_weakest
  std::string weakest() const;

  // The pixels of world points and their covariances.
  //   xyz: n x 3 numbers: points, metres, world frame.
  //   xyz_covariance: n x 9 numbers: of each point, row-major, positive semi-definite, m^2; may be
  //   left out: the points are exact.
  // C: ptzcal_calibration_project
  outcome<ptzcal::calibration::project_result> project(ptzcal::view<const double> xyz,
      ptzcal::view<const double> xyz_covariance = {}) const;

  // The viewing rays of pixels, from the camera's centre (ptzcal_camera_centre), and their
  // covariances.
  //   uv: n x 2 numbers: pixels.
  //   uv_covariance: n x 3 numbers: xx, xy, yy of each pixel, positive semi-definite, px^2; may be
  //   left out: the pixels are exact.
  // C: ptzcal_calibration_back_project
  outcome<ptzcal::calibration::back_project_result> back_project(ptzcal::view<const double> uv,
      ptzcal::view<const double> uv_covariance = {}) const;

  // The points of a plane under pixels, and their covariances: where on the floor is what was
  // clicked on?
  //   uv: n x 2 numbers: pixels.
  //   uv_covariance: n x 3 numbers: xx, xy, yy of each pixel, positive semi-definite, px^2; may be
  //   left out: the pixels are exact.
  //   normal: 3 numbers: the plane's normal in the world frame, of any length but zero.
  //   distance: The plane is normal . x = distance (metres, for a normal of unit length).
  // C: ptzcal_calibration_back_project_to_plane
  outcome<ptzcal::calibration::back_project_to_plane_result> back_project_to_plane(ptzcal::view<const double> uv,
      ptzcal::view<const double> uv_covariance, ptzcal::view<const double> normal, double distance) const;

  // Writes a calibration as JSON: the camera, its covariance, the residuals and what else it says
  // of itself, every number to its last bit; of ptzcal_calibrate_camera also the measurements and
  // options that it was made from, so that ptzcal_calibration_load_inputs can solve it again.
  //   path: The file.
  // C: ptzcal_calibration_save
  outcome<void> save(ptzcal::c_string path) const;
};

class board_calibration : public detail::handle<ptzcal_board_calibration, ptzcal_board_calibration_free> {
 public:
  using handle::handle;
  board_calibration() noexcept = default;

  // The camera's calibration, as any other: intrinsics, lens and their covariance; its pose is the
  // identity. Its measurements are all corners, view after view.
  // C: ptzcal_board_calibration_copy_camera
  outcome<ptzcal::calibration> camera() const;

  // How many views there are.
  // C: ptzcal_board_calibration_count
  outcome<std::size_t> count() const;

  // What was found about one view.
  //   number: The view.
  // C: ptzcal_board_calibration_get_view
  outcome<ptzcal::board_view> view(std::uint32_t number) const;

  // How the boards bend: b1 b2 b3 of ptzcal_boards_set_bending; 0 for flat ones.
  // C: ptzcal_board_calibration_get_bending
  outcome<std::array<double, 3>> bending() const;

  // What to add to make the calibration better, lines of English UTF-8, the most needed first.
  // C: ptzcal_board_calibration_advice
  std::string advice() const;
};

class boards : public detail::handle<ptzcal_boards, ptzcal_boards_free> {
 public:
  using handle::handle;
  boards() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  boards(std::uint32_t image_width, std::uint32_t image_height) : boards(make(image_width, image_height)) {}
#endif

  // Makes an empty set of views for a camera with the given image size.
  //   image_width: Pixels, 1 to 65536.
  //   image_height: Pixels, 1 to 65536.
  // C: ptzcal_boards_new
  static outcome<ptzcal::boards> make(std::uint32_t image_width, std::uint32_t image_height);

  // Adds the corners of a board that one image shows.
  //   board_xy: n x 2 numbers: places on the board, in any unit (metres for a laser line), the same
  //   for all boards; all boards must show the same side of their x and y axes.
  //   uv: n x 2 numbers: their pixels; (0, 0) is the centre of the top-left pixel.
  //   uv_covariance: n x 3 numbers: xx, xy, yy of each pixel, positive definite, px^2; may be left
  //   out: the common noise that the options state, or that the residuals show.
  // C: ptzcal_boards_add_view
  outcome<void> add_view(ptzcal::view<const double> board_xy, ptzcal::view<const double> uv,
      ptzcal::view<const double> uv_covariance = {});

  // Sets where the laser's spot on the board of a view was seen; a later one replaces it.
  //   view: The view.
  //   uv: 2 numbers: the spot's pixel.
  //   uv_covariance: 3 numbers: xx, xy, yy, positive definite, px^2; may be left out: the common
  //   noise of the corners.
  // C: ptzcal_boards_set_spot
  outcome<void> set_spot(std::uint32_t view, ptzcal::view<const double> uv,
      ptzcal::view<const double> uv_covariance = {});

  // Lets the board be a smoothly bent sheet, z = b1 x^2 + b2 x y + b3 y^2 with x and y from the
  // middle of all corners, in units of the greatest distance from there. All views must then be of
  // one board.
  //   sigma: Prior standard deviation of each b, in the board's unit; 0, the default: boards are
  //   flat.
  // C: ptzcal_boards_set_bending
  outcome<void> set_bending(double sigma);

  // How many views there are.
  // C: ptzcal_boards_count
  outcome<std::size_t> count() const;
};

class laser_calibration : public detail::handle<ptzcal_laser_calibration, ptzcal_laser_calibration_free> {
 public:
  using handle::handle;
  laser_calibration() noexcept = default;

  // The laser's line and its covariance.
  // C: ptzcal_laser_calibration_get_line
  outcome<ptzcal::laser_line> line() const;

  // A rig with the lens and the laser that were found; axes through the camera's centre, true
  // encoders.
  // C: ptzcal_laser_calibration_get_rig_model
  outcome<ptzcal::rig_model> rig_model() const;

  // Lens and poses as the joint adjustment left them.
  // C: ptzcal_laser_calibration_copy_boards
  outcome<ptzcal::board_calibration> boards() const;

  // Measured minus predicted pixel of the spot of every view, outliers included: n x 2 numbers, n
  // the number of views. Infinite where there is no spot, or none is predicted.
  // C: ptzcal_laser_calibration_copy_residuals
  outcome<std::vector<double>> residuals() const;

  // Which views' spots were used: n bytes, n the number of views; 1 for a spot that was used, 0 for
  // an outlier and where there is no spot.
  // C: ptzcal_laser_calibration_copy_inliers
  outcome<std::vector<std::uint8_t>> inliers() const;
};

class zoom_curve : public detail::handle<ptzcal_zoom_curve, ptzcal_zoom_curve_free> {
 public:
  using handle::handle;
  zoom_curve() noexcept = default;
  struct rig_model_result;
  struct range_result;

  // The rig at a zoom; axes through the camera's centre, true encoders.
  //   zoom: Within the curve's range; of a single calibrated position: that position.
  // C: ptzcal_zoom_curve_get_rig_model
  outcome<ptzcal::zoom_curve::rig_model_result> rig_model(double zoom) const;

  // The zooms that a curve answers for.
  // C: ptzcal_zoom_curve_get_range
  outcome<ptzcal::zoom_curve::range_result> range() const;

  // Writes a curve as JSON, every number to its last bit.
  //   path: The file.
  // C: ptzcal_zoom_curve_save
  outcome<void> save(ptzcal::c_string path) const;

  // Reads a curve from a file of ptzcal_zoom_curve_save.
  //   path: The file.
  // C: ptzcal_zoom_curve_load
  static outcome<ptzcal::zoom_curve> load(ptzcal::c_string path);
};

class rig_calibrated : public detail::handle<ptzcal_rig_calibrated, ptzcal_rig_calibrated_free> {
 public:
  using handle::handle;
  rig_calibrated() noexcept = default;
  struct count_result;
  struct rig_model_result;
  struct corners_result;

  // How many zoom positions and views there are.
  // C: ptzcal_rig_calibrated_count
  outcome<ptzcal::rig_calibrated::count_result> count() const;

  // What became of a zoom position.
  //   index: The zoom position.
  // C: ptzcal_rig_calibrated_get_position
  outcome<ptzcal::zoom_position> position(std::uint32_t index) const;

  // Why there is no lens at a zoom position, one line of English UTF-8. The wording may change in
  // any version; decide by the status.
  //   index: The zoom position.
  // C: ptzcal_rig_calibrated_position_reason
  std::string position_reason(std::uint32_t index) const;

  // Why a zoom position has no laser line of its own, one line of English UTF-8. The wording may
  // change in any version; decide by the status.
  //   index: The zoom position.
  // C: ptzcal_rig_calibrated_laser_reason
  std::string laser_reason(std::uint32_t index) const;

  // The rig at a zoom position; axes through the camera's centre, true encoders. Its laser line is
  // the one that all positions share, if they do.
  //   index: The zoom position.
  // C: ptzcal_rig_calibrated_get_rig_model
  outcome<ptzcal::rig_calibrated::rig_model_result> rig_model(std::uint32_t index) const;

  // Lens and poses of a zoom position, from its own views alone.
  //   index: The zoom position.
  // C: ptzcal_rig_calibrated_copy_boards
  outcome<ptzcal::board_calibration> boards(std::uint32_t index) const;

  // Lens, poses and laser line of a zoom position, from its own views alone.
  //   index: The zoom position.
  // C: ptzcal_rig_calibrated_copy_laser
  outcome<ptzcal::laser_calibration> laser(std::uint32_t index) const;

  // The laser's line as all zoom positions see it, and whether they agree.
  // C: ptzcal_rig_calibrated_get_common_line
  outcome<ptzcal::common_line> common_line() const;

  // The rig over zoom, from all positions that have a rig model.
  // C: ptzcal_rig_calibrated_get_curve
  outcome<ptzcal::zoom_curve> curve() const;

  // What became of a view.
  //   view: The view.
  // C: ptzcal_rig_calibrated_get_view
  outcome<ptzcal::rig_view> view(std::uint32_t view) const;

  // Why a view was not used, one line of English UTF-8. The wording may change in any version;
  // decide by the status.
  //   view: The view.
  // C: ptzcal_rig_calibrated_view_reason
  std::string view_reason(std::uint32_t view) const;

  // Why a view's spot was not used, one line of English UTF-8. The wording may change in any
  // version; decide by the status.
  //   view: The view.
  // C: ptzcal_rig_calibrated_spot_reason
  std::string spot_reason(std::uint32_t view) const;

  // The corners of a view, for tables and pictures.
  //   view: The view.
  // C: ptzcal_rig_calibrated_copy_corners
  outcome<ptzcal::rig_calibrated::corners_result> corners(std::uint32_t view) const;
};

class rig_calibration : public detail::handle<ptzcal_rig_calibration, ptzcal_rig_calibration_free> {
 public:
  using handle::handle;
  rig_calibration() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  rig_calibration(std::uint32_t columns, std::uint32_t rows, double square,
      ptzcal::optional_ref<ptzcal::calibration_options> options = {},
      ptzcal::optional_ref<ptzcal::spot_options> spot = {}) : rig_calibration(make(columns, rows, square,
      options, spot)) {}
#endif

  // Makes an empty set of views. The options are copied.
  //   columns: Inner corners in a row of the board, 3 to 128.
  //   rows: Inner corners in a column, 3 to 128. With one even and one odd number boards cannot be
  //   mistaken for turned ones.
  //   square: Side of a square, metres.
  //   options: Lens model and how it is fitted, without a fixed lens; may be left out: the
  //   defaults.
  //   spot: The search for the spot, which is looked for on the board only; may be left out: the
  //   defaults.
  // C: ptzcal_rig_calibration_new
  static outcome<ptzcal::rig_calibration> make(std::uint32_t columns, std::uint32_t rows, double square,
      ptzcal::optional_ref<ptzcal::calibration_options> options = {},
      ptzcal::optional_ref<ptzcal::spot_options> spot = {});

  // The board of the views that are added from now on: near, or at a long focal length, a smaller
  // one fits into the image.
  //   columns: Inner corners in a row, 3 to 128.
  //   rows: Inner corners in a column, 3 to 128.
  //   square: Side of a square, metres.
  // C: ptzcal_rig_calibration_set_board
  outcome<void> set_board(std::uint32_t columns, std::uint32_t rows, double square);

  // Whether the zoom positions share one laser line. They do by default: the laser is fixed to the
  // camera, and zooming moves the camera's centre along its axis only. The data are asked: where
  // they contradict it, every position keeps its own line.
  //   share: 0: every position keeps its own line; else they share one.
  //   pupil_sigma: How far the camera's centre moves with the zoom: a standard deviation in metres;
  //   0.05 by default.
  // C: ptzcal_rig_calibration_set_common_line
  outcome<void> set_common_line(bool share, double pupil_sigma);

  // Adds a picture of the board with the laser off and one with it on, the head at rest. That
  // nothing is found in them is no error: the view keeps the reason
  // (ptzcal_rig_calibrated_view_reason).
  //   zoom: The device's own number of the zoom position, in any unit that grows or falls with the
  //   focal length; views of one position have the same number.
  //   off: With the laser off.
  //   on: The same with the laser on; may be left out: this view is for the lens only.
  // C: ptzcal_rig_calibration_add_images
  outcome<std::uint32_t> add_images(double zoom, const ptzcal_image &off,
      ptzcal::optional_ref<ptzcal_image> on = {});

  // Adds corners that were found elsewhere.
  //   zoom: As for ptzcal_rig_calibration_add_images.
  //   image_width: Pixels; the same for all views.
  //   image_height: Pixels; the same for all views.
  //   board_xy: n x 2 numbers: places on the board, metres.
  //   uv: n x 2 numbers: their pixels.
  //   uv_covariance: n x 3 numbers: xx, xy, yy of each pixel, positive definite, px^2; may be left
  //   out: the common noise that the options state, or that the residuals show.
  // C: ptzcal_rig_calibration_add_corners
  outcome<std::uint32_t> add_corners(double zoom, std::uint32_t image_width, std::uint32_t image_height,
      ptzcal::view<const double> board_xy, ptzcal::view<const double> uv,
      ptzcal::view<const double> uv_covariance = {});

  // Sets where the laser's spot on the board of a view was seen; replaces what was found.
  //   view: The view; a board was found in it.
  //   uv: 2 numbers: the spot's pixel.
  //   uv_covariance: 3 numbers: xx, xy, yy, positive definite, px^2; may be left out: the common
  //   noise of the corners.
  // C: ptzcal_rig_calibration_set_spot
  outcome<void> set_spot(std::uint32_t view, ptzcal::view<const double> uv,
      ptzcal::view<const double> uv_covariance = {});

  // Calibrates every zoom position: lens, laser line and all board poses by maximum likelihood
  // together, then one laser line for all positions. What fails at a position is said there
  // (ptzcal_rig_calibrated_get_position).
  // C: ptzcal_rig_calibration_solve
  outcome<ptzcal::rig_calibrated> solve() const;
};

class rgbd : public detail::handle<ptzcal_rgbd, ptzcal_rgbd_free> {
 public:
  using handle::handle;
  rgbd() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  rgbd(const ptzcal_image &fixed,
      const ptzcal_rgbd_options &options = ptzcal::rgbd_options()) : rgbd(make(fixed, options)) {}
#endif

  // Begins with the fixed camera's image.
  //   fixed: The image; it is not needed after the call.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_rgbd_new
  static outcome<ptzcal::rgbd> make(const ptzcal_image &fixed,
      const ptzcal_rgbd_options &options = ptzcal::rgbd_options());

  // Adds a view of an auxiliary camera. A view without texture or depth adds nothing; its counts
  // say so.
  //   colour: The auxiliary camera's image; it is not needed after the call.
  //   depth: The depth of each of its pixels.
  //   camera: The auxiliary camera, of the image's size; its pose says what the world is.
  // C: ptzcal_rgbd_add_view
  outcome<ptzcal::rgbd_view> add_view(const ptzcal_image &colour, const ptzcal::depth_map &depth,
      const ptzcal_camera &camera);

  // Calibrates the fixed camera from all views added so far. Views may be added later and the
  // camera calibrated again. The calibration's residuals and inliers are those of the pairs that
  // ptzcal_rgbd_copy_pairs gives, in their order, and then of the lines of ptzcal_rgbd_copy_lines.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_rgbd_calibrate
  outcome<ptzcal::calibration> calibrate(ptzcal::optional_ref<ptzcal::calibration_options> options = {});

  // Copies the pairs of points of the last calibration, PTZCAL_RGBD_PAIR_SIZE numbers each.
  // C: ptzcal_rgbd_copy_pairs
  outcome<std::vector<double>> pairs() const;

  // Copies the pairs of lines of the last calibration, PTZCAL_RGBD_LINE_SIZE numbers each.
  // C: ptzcal_rgbd_copy_lines
  outcome<std::vector<double>> lines() const;
};

class roof_edges : public detail::handle<ptzcal_roof_edges, ptzcal_roof_edges_free> {
 public:
  using handle::handle;
  roof_edges() : handle(detail::make<ptzcal_roof_edges>(ptzcal_roof_edges_new)) {}

  // Makes an empty set of planes and edges for one station.
  // C: ptzcal_roof_edges_new
  static outcome<ptzcal::roof_edges> make();

  // Adds a plane fitted to laser shots by maximum likelihood in inverse depth. Gross outliers are
  // set aside.
  //   model: The rig model.
  //   pan_tilt: n x 2 numbers: readings at each shot, radians.
  //   spots: n x 2 numbers: the spot's pixel in the head camera.
  //   spot_covariance: n x 3 numbers: xx, xy, yy, px^2; may be left out: 1 px, uncorrelated.
  // C: ptzcal_roof_edges_add_plane_shots
  outcome<std::uint32_t> add_plane_shots(const ptzcal_rig_model &model, ptzcal::view<const double> pan_tilt,
      ptzcal::view<const double> spots, ptzcal::view<const double> spot_covariance = {});

  // Adds a plane fitted to points in the station's frame by total least squares. Gross outliers are
  // set aside.
  //   xyz: n x 3 numbers: points, metres.
  //   sigma: Standard deviation of the points in each direction, metres; 0: estimated from how far
  //   they are from the plane.
  // C: ptzcal_roof_edges_add_plane_points
  outcome<std::uint32_t> add_plane_points(ptzcal::view<const double> xyz, double sigma);

  // Adds a plane that is known: normal . X = distance in the station's frame.
  //   normal: 3 numbers of any length but 0.
  //   distance: Metres; not 0: the plane must not pass through the station.
  //   covariance: 9 numbers: covariance of n = normal / distance, row-major, 1 / m^2; may be left
  //   out: the plane is exact.
  // C: ptzcal_roof_edges_add_plane
  outcome<std::uint32_t> add_plane(ptzcal::view<const double> normal, double distance,
      ptzcal::view<const double> covariance = {});

  // Adds the edge where two of the station's planes meet.
  //   first: Number of a plane.
  //   second: Number of another plane. The order matters: it must be the same in both stations.
  // C: ptzcal_roof_edges_add_edge
  outcome<void> add_edge(std::uint32_t first, std::uint32_t second);

  // Adds a plane fitted to the shots of a scan within a range of readings: the scan of a region
  // that shows one plane, or a part of it that does.
  //   scan: The scan.
  //   region: The range of readings; its steps do not matter; may be left out: all shots.
  // C: ptzcal_roof_edges_add_plane_scan
  outcome<std::uint32_t> add_plane_scan(const ptzcal::scan &scan,
      ptzcal::optional_ref<ptzcal_region> region = {});
};

class pose_estimate : public detail::handle<ptzcal_pose_estimate, ptzcal_pose_estimate_free> {
 public:
  using handle::handle;
  pose_estimate() noexcept = default;

  // The pose.
  // C: ptzcal_pose_estimate_get
  outcome<ptzcal::pose> pose() const;

  // Copies the 6 x 6 covariance of the pose, row-major: of the rotation vector w in R <- exp([w]x)
  // R (radians, axes of station a) and of the translation (metres).
  // C: ptzcal_pose_estimate_copy_covariance
  outcome<std::vector<double>> covariance() const;
};

class pose_options : public detail::handle<ptzcal_pose_options, ptzcal_pose_options_free> {
 public:
  using handle::handle;
  pose_options() : handle(detail::make<ptzcal_pose_options>(ptzcal_pose_options_new)) {}

  // Makes options with their defaults: roof-edge Procrustes, levers of the scene's size, planes and
  // edges at least 5 degrees apart.
  // C: ptzcal_pose_options_new
  static outcome<ptzcal::pose_options> make();

  // Sets the method.
  //   method: A ptzcal_pose_method; the default is PTZCAL_POSE_METHOD_ROOF_EDGE_PROCRUSTES.
  // C: ptzcal_pose_options_set_method
  outcome<void> set_method(ptzcal::pose_method method);

  // Sets how far along an edge its second point lies (Procrustes only).
  //   lever: Metres, positive; 0 (the default): the edges' mean distance from the stations.
  // C: ptzcal_pose_options_set_lever
  outcome<void> set_lever(double lever);

  // Sets the angles below which planes make no edge and edges count as parallel.
  //   min_plane_angle: Radians, 0 to pi/2; the default is 5 degrees.
  //   min_edge_angle: Radians, 0 to pi/2; the default is 5 degrees.
  // C: ptzcal_pose_options_set_min_angles
  outcome<void> set_min_angles(double min_plane_angle, double min_edge_angle);
};

class planes : public detail::handle<ptzcal_planes, ptzcal_planes_free> {
 public:
  using handle::handle;
  planes() noexcept = default;

  // Finds the planes of a cloud of points, in the frame of the station that measured them.
  //   xyz: n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
  //   sigma: Standard deviation of the points in each direction, metres; 0: estimated from
  //   neighbours.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_find_points
  static outcome<ptzcal::planes> find_points(ptzcal::view<const double> xyz, double sigma,
      const ptzcal_planes_options &options = ptzcal::planes_options());

  // Finds the planes of a cloud of points that a scanner at the origin measured by their ranges:
  // the noise is along the rays, so that a slanted wall is known better than from points with the
  // same noise in all directions.
  //   xyz: n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
  //   sigma: Standard deviation of the ranges, metres, more than 0.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_find_ranges
  static outcome<ptzcal::planes> find_ranges(ptzcal::view<const double> xyz, double sigma,
      const ptzcal_planes_options &options = ptzcal::planes_options());

  // Finds the planes of laser shots, in the rig's frame. Spots at or beyond infinity are passed
  // over.
  //   model: The rig model.
  //   pan_tilt: n x 2 numbers: readings at each shot, radians.
  //   spots: n x 2 numbers: the spot's pixel in the head camera.
  //   spot_covariance: n x 3 numbers: xx, xy, yy, px^2; may be left out: 1 px, uncorrelated.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_find_shots
  static outcome<ptzcal::planes> find_shots(const ptzcal_rig_model &model,
      ptzcal::view<const double> pan_tilt, ptzcal::view<const double> spots,
      ptzcal::view<const double> spot_covariance = {},
      const ptzcal_planes_options &options = ptzcal::planes_options());

  // Finds the planes of a depth map, in the camera's frame. The camera's pose plays no part. The
  // labels (ptzcal_planes_copy_labels) are the pixels', row by row.
  //   map: The depths.
  //   camera: The camera that they are of.
  //   inverse_depth_sigma: Standard deviation of inverse depths, 1/m: for cameras that triangulate.
  //   depth_sigma: Standard deviation of depths besides, metres.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_find_depths
  static outcome<ptzcal::planes> find_depths(const ptzcal::depth_map &map, const ptzcal_camera &camera,
      double inverse_depth_sigma, double depth_sigma,
      const ptzcal_planes_options &options = ptzcal::planes_options());

  // How many planes there are.
  // C: ptzcal_planes_count
  outcome<std::uint32_t> count() const;

  // One plane: those that were found come the most significant first, those of regions in their
  // order.
  //   index: Which one, from 0.
  // C: ptzcal_planes_get
  outcome<ptzcal::plane> plane(std::uint32_t index) const;

  // Copies the plane of each measurement (point, shot or pixel) that was handed in: its number, or
  // -1.
  // C: ptzcal_planes_copy_labels
  outcome<std::vector<std::int32_t>> labels() const;

  // The standard deviation of the points, metres: as stated, or as estimated; 0 for shots and
  // depths, which have each their own.
  // C: ptzcal_planes_sigma
  outcome<double> sigma() const;

  // Fits one plane to each region of a cloud of points. Up to half of a region may be something
  // else.
  //   xyz: n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
  //   sigma: Standard deviation of the points in each direction, metres; 0: estimated from how far
  //   they are from their planes.
  //   region_of: n numbers: the region of each point, from 0; -1: of none.
  //   regions: Number of regions, 1 to 1000.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_fit_points
  static outcome<ptzcal::planes> fit_points(ptzcal::view<const double> xyz, double sigma,
      ptzcal::view<const std::int32_t> region_of, std::uint32_t regions,
      const ptzcal_planes_options &options = ptzcal::planes_options());

  // Fits one plane to what each of several boxes holds of a cloud of points. Up to half of that may
  // be something else.
  //   xyz: n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
  //   sigma: Standard deviation of the points in each direction, metres; 0: estimated from how far
  //   they are from their planes.
  //   boxes: 6 numbers a region: least x, y, z of a box, then greatest, metres, in the station's
  //   frame.
  //   regions: Number of boxes, 1 to 1000.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_fit_points_in_boxes
  static outcome<ptzcal::planes> fit_points_in_boxes(ptzcal::view<const double> xyz, double sigma,
      ptzcal::view<const double> boxes, std::uint32_t regions,
      const ptzcal_planes_options &options = ptzcal::planes_options());

  // Fits one plane to each region of laser shots. Up to half of a region may be something else.
  //   model: The rig model.
  //   pan_tilt: n x 2 numbers: readings at each shot, radians.
  //   spots: n x 2 numbers: the spot's pixel in the head camera.
  //   spot_covariance: n x 3 numbers: xx, xy, yy, px^2; may be left out: 1 px, uncorrelated.
  //   region_of: n numbers: the region of each shot, from 0; -1: of none.
  //   regions: Number of regions, 1 to 1000.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_fit_shots
  static outcome<ptzcal::planes> fit_shots(const ptzcal_rig_model &model, ptzcal::view<const double> pan_tilt,
      ptzcal::view<const double> spots, ptzcal::view<const double> spot_covariance,
      ptzcal::view<const std::int32_t> region_of, std::uint32_t regions,
      const ptzcal_planes_options &options = ptzcal::planes_options());

  // Fits one plane to what each of several boxes holds of laser shots. Up to half of that may be
  // something else.
  //   model: The rig model.
  //   pan_tilt: n x 2 numbers: readings at each shot, radians.
  //   spots: n x 2 numbers: the spot's pixel in the head camera.
  //   spot_covariance: n x 3 numbers: xx, xy, yy, px^2; may be left out: 1 px, uncorrelated.
  //   boxes: 6 numbers a region: least x, y, z of a box, then greatest, metres, in the rig's frame.
  //   regions: Number of boxes, 1 to 1000.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_fit_shots_in_boxes
  static outcome<ptzcal::planes> fit_shots_in_boxes(const ptzcal_rig_model &model,
      ptzcal::view<const double> pan_tilt, ptzcal::view<const double> spots,
      ptzcal::view<const double> spot_covariance, ptzcal::view<const double> boxes, std::uint32_t regions,
      const ptzcal_planes_options &options = ptzcal::planes_options());

  // Finds the planes that a scan shows.
  //   scan: The scan.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_find_scan
  static outcome<ptzcal::planes> find_scan(const ptzcal::scan &scan,
      const ptzcal_planes_options &options = ptzcal::planes_options());

  // Fits one plane to the shots of a scan whose readings lie in a range, for each of several
  // ranges. Up to half of them may have hit something else.
  //   scan: The scan.
  //   readings: 4 numbers a region: least and greatest pan, least and greatest tilt, radians, ends
  //   included.
  //   regions: Number of regions, 1 to 1000.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_fit_scan
  static outcome<ptzcal::planes> fit_scan(const ptzcal::scan &scan, ptzcal::view<const double> readings,
      std::uint32_t regions, const ptzcal_planes_options &options = ptzcal::planes_options());

  // Fits one plane to the shots of a scan that hit something in a box, for each of several boxes.
  // Up to half of them may have hit something else.
  //   scan: The scan.
  //   boxes: 6 numbers a region: least x, y, z of a box, then greatest, metres, in the rig's frame.
  //   regions: Number of boxes, 1 to 1000.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_planes_fit_scan_in_boxes
  static outcome<ptzcal::planes> fit_scan_in_boxes(const ptzcal::scan &scan, ptzcal::view<const double> boxes,
      std::uint32_t regions, const ptzcal_planes_options &options = ptzcal::planes_options());
};

class registration : public detail::handle<ptzcal_registration, ptzcal_registration_free> {
 public:
  using handle::handle;
  registration() noexcept = default;
  struct roof_edges_result;

  // The pose.
  // C: ptzcal_registration_get
  outcome<ptzcal::station_pose> station_pose() const;

  // Copies the pairs of planes that are the same: of each pair the number in station a, then in
  // station b.
  // C: ptzcal_registration_copy_matches
  outcome<std::vector<std::uint32_t>> matches() const;

  // Makes the roof edges where the matched planes meet, the same ones in the same order for both
  // stations: for ptzcal_estimate_pose_roof_edges.
  //   station_a: The planes that it was made from.
  //   station_b: Those of the other station.
  //   min_angle: Planes that meet at less than this make no edge, radians, 0 to pi/2.
  // C: ptzcal_registration_roof_edges
  outcome<ptzcal::registration::roof_edges_result> roof_edges(const ptzcal::planes &station_a,
      const ptzcal::planes &station_b, double min_angle) const;
};

class simulator : public detail::handle<ptzcal_simulator, ptzcal_simulator_free> {
 public:
  using handle::handle;
  simulator() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  explicit simulator(ptzcal::c_string address) : simulator(make(address)) {}
#endif
  struct position_result;
  struct next_frame_result;

  // Makes a simulator.
  //   address: "sim:room", with options behind a question mark: "sim:room?seed=3&station=2". An
  //   unknown option is refused with a list of the known ones.
  // C: ptzcal_simulator_new
  static outcome<ptzcal::simulator> make(ptzcal::c_string address);

  // What the owner of such a rig would know of it: the truth less a small misalignment.
  // C: ptzcal_simulator_nominal_rig
  outcome<ptzcal::rig_model> nominal_rig() const;

  // The true rig.
  // C: ptzcal_simulator_true_rig
  outcome<ptzcal::rig_model> true_rig() const;

  // How many fixed cameras there are.
  // C: ptzcal_simulator_fixed_cameras
  outcome<std::size_t> fixed_cameras() const;

  // A fixed camera as it truly is, in the rig's frame.
  //   index: Which fixed camera, from 0.
  // C: ptzcal_simulator_true_camera
  outcome<ptzcal::camera> true_camera(std::uint32_t index) const;

  // Where the rig truly stands: X_room = R X_rig + t, the room's frame being that of station 1.
  // C: ptzcal_simulator_true_station
  outcome<ptzcal::pose> true_station() const;

  // Moves the simulated head: as a PTZ callback does.
  //   pan: Radians.
  //   tilt: Radians.
  // C: ptzcal_simulator_move
  outcome<void> move(double pan, double tilt) const;

  // Reads the simulated head's position.
  // C: ptzcal_simulator_position
  outcome<ptzcal::simulator::position_result> position() const;

  // Says whether the simulated head moves.
  // C: ptzcal_simulator_motion
  outcome<ptzcal::motion> motion() const;

  // Stops the simulated head.
  // C: ptzcal_simulator_stop
  outcome<void> stop() const;

  // Switches the simulated laser. What was switched on here goes off when the simulator is freed.
  //   on: 1 or 0.
  // C: ptzcal_simulator_set_laser
  outcome<void> set_laser(bool on) const;

  // Waits for a frame of a simulated camera; waiting moves the clock.
  //   camera: A fixed camera from 0, or PTZCAL_HEAD_CAMERA.
  //   not_before: The frame's exposure begins then or later.
  //   timeout: Longest wait, seconds.
  // C: ptzcal_simulator_next_frame
  outcome<ptzcal::simulator::next_frame_result> next_frame(std::uint32_t camera, double not_before,
      double timeout) const;

  // The simulator's clock.
  // C: ptzcal_simulator_now
  outcome<double> now() const;

  // Lets seconds of the simulator's clock pass, at once.
  //   seconds: 0 or more.
  // C: ptzcal_simulator_sleep
  outcome<void> sleep(double seconds) const;
};

class angle_map : public detail::handle<ptzcal_angle_map, ptzcal_angle_map_free> {
 public:
  using handle::handle;
  angle_map() noexcept = default;
  struct to_angles_result;
  struct to_raw_result;

  // Reads a map's file.
  //   path: The file.
  // C: ptzcal_angle_map_read
  static outcome<ptzcal::angle_map> read(ptzcal::c_string path);

  // Writes a map as JSON, with the residuals of its learning. The file is at every moment the old
  // one or the whole new one.
  //   path: The file.
  // C: ptzcal_angle_map_save
  outcome<void> save(ptzcal::c_string path) const;

  // What the map covers, and how well it was learned.
  // C: ptzcal_angle_map_get_summary
  outcome<ptzcal::angle_summary> summary() const;

  // Angles of a head's numbers.
  //   raw_pan: The device's number.
  //   raw_tilt: The device's number.
  // C: ptzcal_angle_map_to_angles
  outcome<ptzcal::angle_map::to_angles_result> to_angles(double raw_pan, double raw_tilt) const;

  // A head's numbers of angles.
  //   pan: Radians, positive right.
  //   tilt: Radians, positive up.
  // C: ptzcal_angle_map_to_raw
  outcome<ptzcal::angle_map::to_raw_result> to_raw(double pan, double tilt) const;
};

class rig_options : public detail::holder, public detail::handle<ptzcal_rig_options, ptzcal_rig_options_free> {
 public:
  using handle::handle;
  rig_options() : handle(detail::make<ptzcal_rig_options>(ptzcal_rig_options_new)) {}

  // ptzcal_rig_options_set_ptz
  outcome<void> set_ptz(ptzcal::ptz head);

  // ptzcal_rig_options_set_laser
  outcome<void> set_laser(laser_callback set);

  // ptzcal_rig_options_set_frames
  outcome<void> set_frames(frame_callback next_frame);

  // ptzcal_rig_options_set_clock
  outcome<void> set_clock(clock_now_callback now, clock_sleep_callback sleep);

  // ptzcal_rig_options_set_log
  outcome<void> set_log(log_callback log);

  // Makes options: no devices, defaults for everything else.
  // C: ptzcal_rig_options_new
  static outcome<ptzcal::rig_options> make();

  // Sets the address of a whole rig: the simulator, or a recorded scan. Callbacks and addresses of
  // single devices that are set as well take their place one by one.
  //   address: "sim:room?key=value&..." or "folder:///path"; may be left out: none. It may hold no
  //   password.
  // C: ptzcal_rig_options_set_address
  outcome<void> set_address(ptzcal::c_string address = {});

  // Sets the address of the head; a host's head takes its place.
  //   address: Such as "visca:///dev/ttyUSB0?model=evi-d100" (docs/addresses.md); may be left out:
  //   none. It may hold no password.
  // C: ptzcal_rig_options_set_ptz_address
  outcome<void> set_ptz_address(ptzcal::c_string address = {});

  // Sets the address of the laser; a host's laser takes its place.
  //   address: Such as "gpio:///dev/gpiochip0/laser" (docs/addresses.md); may be left out: none. It
  //   may hold no password.
  // C: ptzcal_rig_options_set_laser_address
  outcome<void> set_laser_address(ptzcal::c_string address = {});

  // Sets the address of the head camera's frames; a host's frames take its place.
  //   address: Such as "v4l2:///dev/video0?format=YUYV" (docs/addresses.md); may be left out: none.
  //   It may hold no password.
  // C: ptzcal_rig_options_set_frames_address
  outcome<void> set_frames_address(ptzcal::c_string address = {});

  // Sets which angles the numbers of a head without angles are: the rig refuses such a head without
  // it.
  //   map: The map, copied; may be left out: none.
  // C: ptzcal_rig_options_set_angle_map
  outcome<void> set_angle_map(ptzcal::optional_ref<ptzcal::angle_map> map = {});

  // Sets the greatest share of the time that the laser is on, in any window. Scans pause where they
  // have to.
  //   duty: More than 0, at most 1; the default is 1: no limit.
  //   window: Seconds, more than 0, at most 3600; the default is 10.
  // C: ptzcal_rig_options_set_laser_duty
  outcome<void> set_laser_duty(double duty, double window);

  // Sets who opens the devices that ask for it (ONVIF).
  //   user: The user's name; may be left out: nobody.
  //   password: The password; may be left out: empty. It is neither logged nor written anywhere.
  // C: ptzcal_rig_options_set_credentials
  outcome<void> set_credentials(ptzcal::c_string user = {}, ptzcal::c_string password = {});

  // Sets the rig model. Simulators and recordings bring one of their own; all other rigs need it.
  //   model: The model.
  // C: ptzcal_rig_options_set_model
  outcome<void> set_model(const ptzcal_rig_model &model);

  // Sets when a move is finished: the device says so (where it does), some readings in a row are
  // equal, and the head camera's picture stands still.
  //   readings: Equal readings in a row, at least 2; the default is 3.
  //   duration: Seconds that they span; the default is 0.15.
  //   overshoot: Radians that a move goes past its target first when it comes from the upper side,
  //   so that every target is approached from below (backlash); the default is 0.01, 0 goes
  //   straight there.
  //   move_timeout: Longest time for a move, seconds; the default is 30.
  //   picture: Longest wait for a still picture, seconds; the default is 5, 0 does not look.
  // C: ptzcal_rig_options_set_settle
  outcome<void> set_settle(std::uint32_t readings, double duration, double overshoot, double move_timeout,
      double picture);

  // Sets how frames are waited for.
  //   timeout: Longest wait for a frame, seconds; the default is 3.
  //   stale_frames: Frames without timestamps to drop after each change; the default is 4: the
  //   depth of the source's buffers and one.
  // C: ptzcal_rig_options_set_frame_wait
  outcome<void> set_frame_wait(double timeout, std::uint32_t stale_frames);

  // Sets the longest time that the laser stays on. It is enforced whenever the library has control:
  // a callback that does not return keeps it from acting.
  //   seconds: Positive; the default is 2.
  // C: ptzcal_rig_options_set_laser_max_on
  outcome<void> set_laser_max_on(double seconds);
};

class head_options : public detail::holder, public detail::handle<ptzcal_head_options, ptzcal_head_options_free> {
 public:
  using handle::handle;
  head_options() : handle(detail::make<ptzcal_head_options>(ptzcal_head_options_new)) {}

  // ptzcal_head_options_set_ptz
  outcome<void> set_ptz(ptzcal::ptz head);

  // ptzcal_head_options_set_laser
  outcome<void> set_laser(laser_callback set);

  // ptzcal_head_options_set_frames
  outcome<void> set_frames(frame_callback next_frame);

  // ptzcal_head_options_set_log
  outcome<void> set_log(log_callback log);

  // ptzcal_head_options_set_on_move_end
  outcome<void> set_on_move_end(move_end_callback hears);

  // Makes options: no device, silent.
  // C: ptzcal_head_options_new
  static outcome<ptzcal::head_options> make();

  // Sets the head's address; a host's head takes its place.
  //   address: Such as "visca+udp://camera.lan", "onvif://camera.lan", "sim:room"
  //   (docs/addresses.md); may be left out: none. It may hold no password.
  // C: ptzcal_head_options_set_address
  outcome<void> set_address(ptzcal::c_string address = {});

  // Sets where frames of the camera on the head come from, for ptzcal_probe and
  // ptzcal_learn_angles; a host's frames take their place. A simulator and a recording bring their
  // own.
  //   address: Such as "v4l2:///dev/video0", "onvif://camera.lan"; may be left out: none. It may
  //   hold no password.
  // C: ptzcal_head_options_set_frames_address
  outcome<void> set_frames_address(ptzcal::c_string address = {});

  // Sets the laser of the head, for ptzcal_probe; a host's takes its place. A simulator brings its
  // own.
  //   address: Such as "gpio:///dev/gpiochip0/laser"; may be left out: none. It may hold no
  //   password.
  // C: ptzcal_head_options_set_laser_address
  outcome<void> set_laser_address(ptzcal::c_string address = {});

  // Sets which angles the numbers of a head without angles are: it then speaks radians.
  //   map: The map, copied; may be left out: none.
  // C: ptzcal_head_options_set_angle_map
  outcome<void> set_angle_map(ptzcal::optional_ref<ptzcal::angle_map> map = {});

  // Sets who opens a device that asks for it (ONVIF).
  //   user: The user's name; may be left out: nobody.
  //   password: The password; may be left out: empty. It is neither logged nor written anywhere.
  // C: ptzcal_head_options_set_credentials
  outcome<void> set_credentials(ptzcal::c_string user = {}, ptzcal::c_string password = {});
};

namespace detail {
inline void head_close(ptzcal_head *open) noexcept { ptzcal_head_close(open, nullptr); }
}

class head : public detail::holder, public detail::handle<ptzcal_head, detail::head_close> {
 public:
  using handle::handle;
  head() noexcept = default;

  // Closes it; it is gone whatever comes of it. The destructor does the same, and says nothing.
  outcome<void> close();
  struct position_result;
  struct wait_result;

  // Opens a head: takes it over; it does not move.
  //   options: What it is opened with.
  // C: ptzcal_head_open
  static outcome<ptzcal::head> open(const ptzcal::head_options &options);

  // What the head can do.
  // C: ptzcal_head_get_capabilities
  outcome<ptzcal::head_capabilities> capabilities() const;

  // What the device says of itself, as UTF-8 without a NUL.
  //   which: A ptzcal_identity.
  // C: ptzcal_head_copy_identity
  outcome<std::string> identity(ptzcal::identity which) const;

  // Reads where the head is.
  // C: ptzcal_head_position
  outcome<ptzcal::head::position_result> position() const;

  // Says whether the head moves.
  // C: ptzcal_head_motion
  outcome<ptzcal::motion> motion() const;

  // Waits until a move has ended. The end of a move that is long gone is PTZCAL_MOVE_END_REPLACED.
  //   move_number: The move, from the call that started it.
  //   timeout: Longest wait, seconds, not negative.
  //   token: Ends the waiting from another thread, not the move; may be left out.
  // C: ptzcal_head_wait
  outcome<ptzcal::head::wait_result> wait(std::uint64_t move_number, double timeout,
      ptzcal::optional_ref<ptzcal::cancel> token = {}) const;

  // Starts a move and returns. ptzcal_head_wait waits for its end, the callback hears of it.
  //   pan: Reading of the device, radians; positive is right.
  //   tilt: Reading of the device, radians; positive is up.
  // C: ptzcal_head_move
  outcome<std::uint64_t> move(double pan, double tilt) const;

  // Starts a move from where the head is and returns.
  //   pan: Radians; positive is right.
  //   tilt: Radians; positive is up.
  // C: ptzcal_head_move_by
  outcome<std::uint64_t> move_by(double pan, double tilt) const;

  // Starts a move that brings a place of the present picture to its centre, where the device itself
  // can do that (has_view_moves): it needs no known angles and no calibrated lens.
  //   x: From the picture's centre, 0, to its right edge, 1, or left edge, -1.
  //   y: From the picture's centre, 0, to its upper edge, 1, or lower edge, -1.
  // C: ptzcal_head_move_in_view
  outcome<std::uint64_t> move_in_view(double x, double y) const;

  // Drives at a speed until told otherwise, and no longer than dead_man seconds after the last
  // call: a host that hangs, or whose operator is gone, lets go. Call it again in time to go on.
  // All speeds 0 stop the head.
  //   pan_speed: Radians per second, positive right; cut to what the device can.
  //   tilt_speed: Radians per second, positive up; cut to what the device can.
  //   zoom_speed: -1 (to wide at full speed) to 1 (to tele).
  //   dead_man: Seconds, more than 0, at most 60.
  // C: ptzcal_head_drive
  outcome<std::uint64_t> drive(double pan_speed, double tilt_speed, double zoom_speed, double dead_man) const;

  // Stops pan, tilt and zoom. It waits neither for an answer of the device nor for another thread's
  // call; where the device cannot be reached beside that call, the stop follows as the call
  // returns.
  // C: ptzcal_head_stop
  outcome<void> stop() const;

  // Starts the move to the device's home position.
  // C: ptzcal_head_home
  outcome<std::uint64_t> home() const;

  // Starts zooming.
  //   zoom: 0 (wide) to 1 (tele).
  // C: ptzcal_head_set_zoom
  outcome<std::uint64_t> set_zoom(double zoom) const;

  // Sets how the lens is focused.
  //   focus: A ptzcal_focus.
  //   at: 0 (far) to 1 (near) for PTZCAL_FOCUS_AT; else it is not used, but finite.
  // C: ptzcal_head_set_focus
  outcome<void> set_focus(ptzcal::focus focus, double at) const;

  // Reads where the focus is.
  // C: ptzcal_head_focus
  outcome<double> focus() const;

  // Holds exposure and white balance as they are, as taking differences of frames wants it, or lets
  // the camera have them again.
  //   locked: 1 or 0.
  // C: ptzcal_head_lock_exposure
  outcome<void> lock_exposure(bool locked) const;

  // Remembers where the head is.
  //   preset: Which, from 0.
  // C: ptzcal_head_store_preset
  outcome<void> store_preset(std::uint32_t preset) const;

  // Starts the move to what was remembered.
  //   preset: Which, from 0.
  // C: ptzcal_head_recall_preset
  outcome<std::uint64_t> recall_preset(std::uint32_t preset) const;

  // Forgets a preset.
  //   preset: Which, from 0.
  // C: ptzcal_head_clear_preset
  outcome<void> clear_preset(std::uint32_t preset) const;
};

class probe_report : public detail::handle<ptzcal_probe_report, ptzcal_probe_report_free> {
 public:
  using handle::handle;
  probe_report() noexcept = default;

  // A figure of a report.
  //   which: A ptzcal_probe_figure.
  // C: ptzcal_probe_report_get
  outcome<ptzcal::figure> figure(ptzcal::probe_figure which) const;

  // The report as text that a person understands, in UTF-8 without a NUL.
  // C: ptzcal_probe_report_copy_text
  outcome<std::string> text() const;
};

namespace detail {
inline void rig_close(ptzcal_rig *open) noexcept { ptzcal_rig_close(open, nullptr); }
}

class rig : public detail::holder, public detail::handle<ptzcal_rig, detail::rig_close> {
 public:
  using handle::handle;
  rig() noexcept = default;

  // Closes it; it is gone whatever comes of it. The destructor does the same, and says nothing.
  outcome<void> close();
  struct position_result;
  struct aim_at_point_result;
  struct aim_at_pixel_result;

  // Opens a rig: takes its devices over and switches the laser off; the head does not move.
  //   options: What the rig is made of.
  // C: ptzcal_rig_open
  static outcome<ptzcal::rig> open(const ptzcal::rig_options &options);

  // The rig's model.
  // C: ptzcal_rig_get_model
  outcome<ptzcal::rig_model> model() const;

  // The simulator behind a rig that was opened with its address: the same room, the same truth.
  // C: ptzcal_rig_simulator
  outcome<ptzcal::simulator> simulator() const;

  // Moves the head and waits until it stands still. The laser is off before it moves.
  //   pan: Reading of the device, radians; positive is right.
  //   tilt: Reading of the device, radians; positive is up.
  //   token: Stops the move from another thread; may be left out.
  // C: ptzcal_rig_move
  outcome<void> move(double pan, double tilt, ptzcal::optional_ref<ptzcal::cancel> token = {});

  // Reads where the head is.
  // C: ptzcal_rig_position
  outcome<ptzcal::rig::position_result> position();

  // Turns the head so that the laser hits a point, and waits until it stands still.
  //   xyz: 3 numbers: the point in the rig's world, metres.
  //   token: Stops the move from another thread; may be left out.
  // C: ptzcal_rig_aim_at_point
  outcome<ptzcal::rig::aim_at_point_result> aim_at_point(ptzcal::view<const double> xyz,
      ptzcal::optional_ref<ptzcal::cancel> token = {});

  // Turns the head so that the laser hits what the head camera sees now at a pixel.
  //   u: Pixel in the head camera's image.
  //   v: Pixel in the head camera's image.
  //   depth: Distance of what is seen along the camera's axis, metres, positive.
  //   token: Stops the move from another thread; may be left out.
  // C: ptzcal_rig_aim_at_pixel
  outcome<ptzcal::rig::aim_at_pixel_result> aim_at_pixel(double u, double v, double depth,
      ptzcal::optional_ref<ptzcal::cancel> token = {});

  // Switches the laser by hand. On is refused while the head moves. It goes off again by itself
  // only when a call on this rig finds that its longest time on is over; the next move switches it
  // off.
  //   on: 1 or 0.
  // C: ptzcal_rig_set_laser
  outcome<void> set_laser(bool on);

  // Stops the head and switches the laser off, now. While another thread's call is at work with the
  // rig, that call is cancelled: it stops the head and switches the laser off on its way out. Heads
  // opened by address are stopped beside it at once.
  // C: ptzcal_rig_stop
  outcome<void> stop() const;

  // Switches the laser off and keeps it off until ptzcal_rig_release, from any thread and whatever
  // else is going on. Call it from an interlock, a timer, a button.
  // C: ptzcal_rig_emergency_off
  outcome<void> emergency_off() const;

  // Ends an emergency: the laser may be switched on again.
  // C: ptzcal_rig_release
  outcome<void> release() const;

  // The region that a recorded scan covers, of a rig that was opened on a recording's folder.
  // C: ptzcal_rig_recorded_region
  outcome<ptzcal::region> recorded_region() const;

  // Scans a region. A scan that ends early (stopped by the callback, cancelled, a device or the
  // journal failed) still returns what it measured: PTZCAL_STATUS_OK with a scan that is not
  // complete, and ptzcal_scan_end says why. However it ends, the laser is off and the head was told
  // to stop.
  //   region: The positions.
  //   options: The options; may be left out: the defaults, without fixed cameras.
  //   progress: Hears of each shot and can stop the scan; may be left out.
  // C: ptzcal_rig_scan_region
  outcome<ptzcal::scan> scan_region(const ptzcal_region &region,
      ptzcal::optional_ref<ptzcal::scan_options> options = {},
      const ptzcal::progress_callback &progress = {});

  // Finds the range of pan and tilt in which each fixed camera sees the laser's spot. What ends
  // early (stopped, cancelled, a device failed) is PTZCAL_STATUS_OK with what was found until then:
  // ptzcal_scan_end of ptzcal_exploration_get_scan says why. However it ends, the laser is off and
  // the head was told to stop.
  //   options: The options; may be left out: the defaults.
  //   scan_options: How shots are taken and which fixed cameras watch; journal, recording and
  //   coarse pass do not matter.
  //   progress: Hears of each shot and can stop the work; may be left out.
  // C: ptzcal_rig_explore
  outcome<ptzcal::exploration> explore(const ptzcal_explore_options &options,
      const ptzcal::scan_options &scan_options, const ptzcal::progress_callback &progress = {});

  // Fires single shots again at the readings of an earlier scan's, for ptzcal_health_check. A work
  // that ends early returns what it measured; ptzcal_scan_end says why. However it ends, the laser
  // is off and the head was told to stop.
  //   before: The earlier scan.
  //   indices: n indices of its shots, as ptzcal_scan_choose_health_shots gives them.
  //   scan_options: How shots are taken and which fixed cameras watch; journal, recording and
  //   coarse pass do not matter.
  //   progress: Hears of each shot and can stop the work; may be left out.
  // C: ptzcal_rig_fire_again
  outcome<ptzcal::scan> fire_again(const ptzcal::scan &before, ptzcal::view<const std::size_t> indices,
      const ptzcal::scan_options &scan_options, const ptzcal::progress_callback &progress = {});
};

class scan_options : public detail::holder, public detail::handle<ptzcal_scan_options, ptzcal_scan_options_free> {
 public:
  using handle::handle;
  scan_options() : handle(detail::make<ptzcal_scan_options>(ptzcal_scan_options_new)) {}

  // ptzcal_scan_options_add_camera
  outcome<std::uint32_t> add_camera(frame_callback next_frame, std::uint32_t width, std::uint32_t height);

  // Makes options with their defaults: no fixed cameras, one frame per state, no journal.
  // C: ptzcal_scan_options_new
  static outcome<ptzcal::scan_options> make();

  // Adds a fixed camera by its address.
  //   address: "sim:fixed/0" or "folder:fixed/0": the first fixed camera of the rig's simulator or
  //   recording; "v4l2://...", "onvif://...": a camera of its own (docs/addresses.md).
  // C: ptzcal_scan_options_add_camera_address
  outcome<std::uint32_t> add_camera_address(ptzcal::c_string address);

  // Says what is known of a watched camera, so that its spots are looked for in the right place
  // from the first shot.
  //   camera: The camera's number.
  //   known: The camera, calibrated in the rig's world; may be left out: nothing is known (the
  //   default).
  // C: ptzcal_scan_options_set_known_camera
  outcome<void> set_known_camera(std::uint32_t camera, ptzcal::optional_ref<ptzcal_camera> known = {});

  // Sets the lens model with which a watched camera is calibrated between the two passes.
  //   camera: The camera's number.
  //   model: A ptzcal_distortion_model; the default is PTZCAL_DISTORTION_MODEL_RADIAL1.
  // C: ptzcal_scan_options_set_distortion
  outcome<void> set_distortion(std::uint32_t camera, ptzcal::distortion_model model);

  // Sets how many frames are averaged with the laser off, and with it on.
  //   frames: 1 to 256; the default is 1.
  // C: ptzcal_scan_options_set_frames_per_state
  outcome<void> set_frames_per_state(std::uint32_t frames);

  // Sets about how many positions the coarse pass takes.
  //   shots: The default is 80; 0: no coarse pass.
  // C: ptzcal_scan_options_set_coarse_shots
  outcome<void> set_coarse_shots(std::uint32_t shots);

  // Ends a scan once every fixed camera's position is expected to be known well enough, by the
  // covariance of its calibration from the shots so far; the rig is taken as exact. Positions are
  // then visited in eight passes over the region, so that a scan that ends early has covered it.
  // Such a scan is not complete (ptzcal_scan_summary), and ptzcal_scan_end is PTZCAL_STATUS_OK.
  //   metres: Root mean square error of the position; 0, the default: the whole region is scanned.
  // C: ptzcal_scan_options_set_target_accuracy
  outcome<void> set_target_accuracy(double metres);

  // Sets how long a device that is gone (unplugged, switched off) is waited for; the drivers of the
  // library open theirs again when it is back. The laser is off meanwhile.
  //   seconds: 0 to 86400; the default is 0: the scan ends at once, and its journal keeps what it
  //   has.
  // C: ptzcal_scan_options_set_reconnect
  outcome<void> set_reconnect(double seconds);

  // Sets how spots are found; region and band of the spot options are set by the scan.
  //   spot: The spot options, copied; may be left out: the defaults.
  // C: ptzcal_scan_options_set_spot
  outcome<void> set_spot(ptzcal::optional_ref<ptzcal::spot_options> spot = {});

  // Sets where spots can be: the depths of the scene, and how far from its predicted place a spot
  // may be.
  //   nearest: Metres along the head camera's axis, positive; the default is 0.3.
  //   farthest: Metres; the default is 100.
  //   half_width: Half the width of the bands that are searched, pixels; the default is 16: the
  //   spot with its halo has to fit in.
  //   model_sigma: Standard deviation of the rig model's errors in its images, pixels; the default
  //   is 1.
  // C: ptzcal_scan_options_set_gate
  outcome<void> set_gate(double nearest, double farthest, double half_width, double model_sigma);

  // Sets the journal: each shot is in it before it is reported. When the file is there and belongs
  // to the same scan, the scan goes on from it; a file that is no journal is never touched.
  //   path: The file; may be left out: none (the default).
  //   sync: 1: wait for the disk at each shot, so that a power cut loses none either; 0: do not.
  // C: ptzcal_scan_options_set_journal
  outcome<void> set_journal(ptzcal::c_string path, bool sync);

  // Sets a folder where all frames of the scan are written, so that it can be scanned again without
  // the rig: open it as "folder:///path". A scan of the same region by the same rig goes on with
  // what is recorded there already; a folder with anything else in it is never touched.
  // docs/recordings.md tells the format.
  //   path: The folder; may be left out: none (the default).
  // C: ptzcal_scan_options_set_recording
  outcome<void> set_recording(ptzcal::c_string path = {});

  // Sets the token that stops the scan.
  //   token: The token; may be left out: none (the default). It may be freed before the options.
  // C: ptzcal_scan_options_set_cancel
  outcome<void> set_cancel(ptzcal::optional_ref<ptzcal::cancel> token = {});
};

class scan : public detail::handle<ptzcal_scan, ptzcal_scan_free> {
 public:
  using handle::handle;
  scan() noexcept = default;
  struct camera_size_result;

  // What a scan came to.
  // C: ptzcal_scan_get_summary
  outcome<ptzcal::scan_summary> summary() const;

  // Image size of a fixed camera of a scan: what ptzcal_correspondences_new wants.
  //   camera: The fixed camera's number.
  // C: ptzcal_scan_camera_size
  outcome<ptzcal::scan::camera_size_result> camera_size(std::uint32_t camera) const;

  // How a scan ended: fails with the reason when it ended before its time.
  // C: ptzcal_scan_end
  outcome<void> end() const;

  // A shot of a scan, in the order in which they were taken.
  //   index: From 0 to the number of shots less 1.
  // C: ptzcal_scan_get_shot
  outcome<ptzcal::shot> shot(std::size_t index) const;

  // Where a camera saw the spot of a shot.
  //   index: The shot.
  //   camera: A fixed camera's number, or PTZCAL_HEAD_CAMERA.
  // C: ptzcal_scan_get_spot
  outcome<ptzcal::spot> spot(std::size_t index, std::uint32_t camera) const;

  // Copies the measured points, in the order of the shots; shots without a point are left out.
  // C: ptzcal_scan_copy_points
  outcome<std::vector<double>> points() const;

  // The shots of a scan that are worth firing again to check a fixed camera: seen by both cameras,
  // as far from each other in the picture and in depth as can be.
  //   camera: The fixed camera's number.
  //   count: How many are wanted; ten are enough. Fewer where there are no more.
  // C: ptzcal_scan_choose_health_shots
  outcome<std::vector<std::size_t>> choose_health_shots(std::uint32_t camera, std::size_t count) const;

  // Writes the measured points of a scan as binary PLY, with their colours and covariances:
  // ptzcal_cloud_from_scan and ptzcal_cloud_save in one.
  //   path: The file.
  // C: ptzcal_scan_save_ply
  outcome<void> save_ply(ptzcal::c_string path) const;
};

class cloud : public detail::handle<ptzcal_cloud, ptzcal_cloud_free> {
 public:
  using handle::handle;
  cloud() : handle(detail::make<ptzcal_cloud>(ptzcal_cloud_new)) {}
  struct size_result;
  struct load_result;

  // Makes a cloud without points.
  // C: ptzcal_cloud_new
  static outcome<ptzcal::cloud> make();

  // The points that a scan measured with its head camera, with colours and covariances, which are
  // those of the spots' noise: rank one, along the laser's line.
  //   scan: The scan.
  // C: ptzcal_cloud_from_scan
  static outcome<ptzcal::cloud> from_scan(const ptzcal::scan &scan);

  // The points of a depth map's pixels, in the world of its camera's pose, with covariances.
  //   map: The map.
  //   camera: Its camera, of the same size.
  //   image: The camera's picture, of the same size, for the colours; may be left out: white.
  //   inverse_depth_sigma: Standard deviation of inverse depths, 1/m: for cameras that triangulate.
  //   0.001425 is a Kinect's of the first kind.
  //   depth_sigma: Standard deviation of depths besides, metres: for times of flight. Not both are
  //   0.
  // C: ptzcal_cloud_from_depth_map
  static outcome<ptzcal::cloud> from_depth_map(const ptzcal::depth_map &map, const ptzcal_camera &camera,
      ptzcal::optional_ref<ptzcal_image> image, double inverse_depth_sigma, double depth_sigma);

  // Adds points: all of them, or none.
  //   xyz: n x 3 numbers: x, y, z, metres.
  //   rgb: n x 3 bytes: red, green, blue; may be left out: white.
  //   covariances: n x 6 numbers: xx, xy, xz, yy, yz, zz, m^2; may be left out: unknown.
  // C: ptzcal_cloud_add_points
  outcome<void> add_points(ptzcal::view<const double> xyz, ptzcal::view<const std::uint8_t> rgb = {},
      ptzcal::view<const double> covariances = {});

  // Adds another cloud's points: all of them, or none. Deviations become covariances where the
  // other cloud has those.
  //   other: Another cloud.
  // C: ptzcal_cloud_merge
  outcome<void> merge(const ptzcal::cloud &other);

  // Forgets what is known of the noise and the normals, so that the cloud can be merged with one
  // that does not know them.
  // C: ptzcal_cloud_strip
  outcome<void> strip();

  // Moves a cloud: X <- R X + t, with its normals and covariances.
  //   pose: R and t; of station b in station a's frame it takes a cloud of b into a's frame.
  //   covariance: 36 numbers: the pose's covariance as ptzcal_pose_estimate_copy_covariance gives
  //   it, of the rotation vector in R <- exp([w]x) R (radians), then of t (metres). What the pose's
  //   error does to each point is added to its covariance; may be left out: none.
  // C: ptzcal_cloud_transform
  outcome<void> transform(const ptzcal_pose &pose, ptzcal::view<const double> covariance = {});

  // Keeps the points inside a box, its faces included.
  //   least: 3 numbers: least x, y, z, metres.
  //   greatest: 3 numbers: greatest x, y, z, metres.
  // C: ptzcal_cloud_crop
  outcome<void> crop(ptzcal::view<const double> least, ptzcal::view<const double> greatest);

  // Thins a cloud out: the points in each cube of a grid through the origin become one, the mean
  // weighted by what is known of their noise, with the mean of their colours and the covariance of
  // the mean.
  //   voxel: Side of the cubes, metres.
  // C: ptzcal_cloud_thin
  outcome<void> thin(double voxel);

  // How many points a cloud has, and what is known of them.
  // C: ptzcal_cloud_size
  outcome<ptzcal::cloud::size_result> size() const;

  // Copies the points: n x 3 numbers, x, y, z, metres.
  // C: ptzcal_cloud_copy_points
  outcome<std::vector<double>> points() const;

  // Copies the colours: n x 3 bytes, red, green, blue.
  // C: ptzcal_cloud_copy_colours
  outcome<std::vector<std::uint8_t>> colours() const;

  // Copies the normals: n x 3 numbers, unit vectors out of the surface, zeros where there is none.
  // C: ptzcal_cloud_copy_normals
  outcome<std::vector<double>> normals() const;

  // Copies the standard deviations: n numbers, metres, the root mean square distance of each point
  // from its truth, which is the root of its covariance's trace.
  // C: ptzcal_cloud_copy_deviations
  outcome<std::vector<double>> deviations() const;

  // Copies the covariances: n x 6 numbers, xx, xy, xz, yy, yz, zz, m^2.
  // C: ptzcal_cloud_copy_covariances
  outcome<std::vector<double>> covariances() const;

  // Writes a cloud, in the format that the file's ending names: .ply, .pcd (both binary, with
  // normals and noise), .glb (glTF 2.0, with normals and noise) or .wrl (VRML97).
  //   path: The file.
  // C: ptzcal_cloud_save
  outcome<void> save(ptzcal::c_string path) const;

  // Reads a cloud: .ply, .pcd, .glb or .wrl, ours or another's; of a mesh its vertices.
  //   path: The file.
  // C: ptzcal_cloud_load
  static outcome<ptzcal::cloud::load_result> load(ptzcal::c_string path);

  // Depths of the points in a camera's image, lens distortion included: the nearest one in each
  // pixel, with its variance where the noise is known. Between the points there is no depth; a
  // surface (ptzcal_mesh_depth_map) has no gaps.
  //   camera: The camera, of at most 2^25 pixels.
  // C: ptzcal_cloud_depth_map
  outcome<ptzcal::depth_map> depth_map(const ptzcal_camera &camera) const;
};

class mesh : public detail::handle<ptzcal_mesh, ptzcal_mesh_free> {
 public:
  using handle::handle;
  mesh() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  mesh(const ptzcal::cloud &vertices, ptzcal::view<const std::uint32_t> triangles) : mesh(make(vertices,
      triangles)) {}
#endif
  struct size_result;

  // Makes a mesh of given triangles.
  //   vertices: The points; the mesh has a copy.
  //   triangles: n x 3 numbers of points, counter-clockwise for who sees the front.
  // C: ptzcal_mesh_new
  static outcome<ptzcal::mesh> make(const ptzcal::cloud &vertices,
      ptzcal::view<const std::uint32_t> triangles);

  // The surface through the points of a scan, on the grid of its region, with colours, normals and
  // covariances. Shots without a point are holes; the front is where the rig stood.
  //   scan: The scan.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_mesh_from_scan
  static outcome<ptzcal::mesh> from_scan(const ptzcal::scan &scan,
      const ptzcal_surface_options &options = ptzcal::surface_options());

  // The surface that a depth map shows, in the world of its camera's pose.
  //   map: The map.
  //   camera: Its camera, of the same size.
  //   image: The camera's picture, of the same size, for the colours; may be left out: white.
  //   inverse_depth_sigma: Standard deviation of inverse depths, 1/m.
  //   depth_sigma: Standard deviation of depths besides, metres. Not both are 0.
  //   options: The options; may be left out: the defaults.
  // C: ptzcal_mesh_from_depth_map
  static outcome<ptzcal::mesh> from_depth_map(const ptzcal::depth_map &map, const ptzcal_camera &camera,
      ptzcal::optional_ref<ptzcal_image> image, double inverse_depth_sigma, double depth_sigma,
      const ptzcal_surface_options &options = ptzcal::surface_options());

  // Gives a mesh a picture for its textures; ptzcal_mesh_texture puts it on.
  //   image: The picture; the mesh has a copy.
  //   camera: Where it was taken from: a camera of the picture's size.
  // C: ptzcal_mesh_add_picture
  outcome<void> add_picture(const ptzcal_image &image, const ptzcal_camera &camera);

  // Covers a mesh with the pictures added to it: each triangle gets the picture that shows its
  // whole front, unhidden, with the most pixels. Triangles that no picture shows keep their points'
  // colours.
  // C: ptzcal_mesh_texture
  outcome<std::size_t> texture();

  // How large a mesh is.
  // C: ptzcal_mesh_size
  outcome<ptzcal::mesh::size_result> size() const;

  // A copy of a mesh's points, with their colours, normals and noise.
  // C: ptzcal_mesh_vertices
  outcome<ptzcal::cloud> vertices() const;

  // Copies the triangles: n x 3 numbers of points, counter-clockwise for who sees the front.
  // C: ptzcal_mesh_copy_triangles
  outcome<std::vector<std::uint32_t>> triangles() const;

  // Writes a mesh, in the format that the file's ending names: .glb (glTF 2.0, with everything),
  // .wrl (VRML97, with its pictures, without normals and noise) or .ply (without its pictures).
  //   path: The file.
  // C: ptzcal_mesh_save
  outcome<void> save(ptzcal::c_string path) const;

  // Reads a mesh: .glb, .wrl or .ply, ours or another's.
  //   path: The file.
  // C: ptzcal_mesh_load
  static outcome<ptzcal::mesh> load(ptzcal::c_string path);

  // Depths of a surface in a camera's image, exact at the centre of every pixel whatever the lens;
  // both sides of the surface are seen. Where there is no surface there is no depth. The variances
  // are those of the triangles' planes, from the noise of the points.
  //   camera: The camera, of at most 2^25 pixels.
  // C: ptzcal_mesh_depth_map
  outcome<ptzcal::depth_map> depth_map(const ptzcal_camera &camera) const;
};

class exploration : public detail::handle<ptzcal_exploration, ptzcal_exploration_free> {
 public:
  using handle::handle;
  exploration() noexcept = default;
  struct visible_result;

  // Where a fixed camera sees the spot.
  //   camera: The fixed camera's number.
  // C: ptzcal_exploration_get_visible
  outcome<ptzcal::exploration::visible_result> visible(std::uint32_t camera) const;

  // For each position of the region, tilt step * pan_steps + pan step: 1 when the camera sees the
  // spot there, as far as the shots about it tell, else 0.
  //   camera: The fixed camera's number.
  // C: ptzcal_exploration_copy_mask
  outcome<std::vector<std::uint8_t>> mask(std::uint32_t camera) const;

  // The shots of an exploration, and how it ended, as a scan.
  // C: ptzcal_exploration_get_scan
  outcome<ptzcal::scan> scan() const;
};

class health_report : public detail::handle<ptzcal_health_report, ptzcal_health_report_free> {
 public:
  using handle::handle;
  health_report() noexcept = default;

  // What a check came to.
  // C: ptzcal_health_report_get
  outcome<ptzcal::health> health() const;

  // The verdict in words.
  // C: ptzcal_health_report_reason
  std::string reason() const;

  // What became of each shot that was compared, in the order of the earlier scan:
  // ptzcal_shot_state.
  // C: ptzcal_health_report_copy_shots
  outcome<std::vector<std::uint32_t>> shots() const;

  // The camera with its pose refitted and its lens held.
  // C: ptzcal_health_report_refitted
  outcome<ptzcal::calibration> refitted() const;
};

class adjustment : public detail::handle<ptzcal_adjustment, ptzcal_adjustment_free> {
 public:
  using handle::handle;
  adjustment() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  explicit adjustment(const ptzcal_rig_model &model) : adjustment(make(model)) {}
#endif

  // Makes a survey without stations, cameras and shots. Its rig is known exactly until
  // ptzcal_adjustment_set_rig_sigmas or ptzcal_adjustment_set_rig_covariance says otherwise.
  //   model: The rig as it is believed to be: the mean of its prior.
  // C: ptzcal_adjustment_new
  static outcome<ptzcal::adjustment> make(const ptzcal_rig_model &model);

  // Says how well each of the rig's parameters is known, independently of the others.
  //   sigmas: PTZCAL_RIG_PARAMETERS standard deviations in the order of ptzcal_rig_parameter: 0
  //   fixes a parameter, INFINITY frees it.
  // C: ptzcal_adjustment_set_rig_sigmas
  outcome<void> set_rig_sigmas(ptzcal::view<const double> sigmas);

  // Says how well the rig's parameters are known together, as the rig's own calibration left them:
  // the first 7 rows and columns are in the order of ptzcal_laser_line's `covariance`.
  //   covariance: 15 x 15 numbers in the order of ptzcal_rig_parameter, row-major, symmetric: a
  //   variance of 0 fixes a parameter, INFINITY frees it (the rest of its row and column is 0
  //   then); those of the others are positive definite.
  // C: ptzcal_adjustment_set_rig_covariance
  outcome<void> set_rig_covariance(ptzcal::view<const double> covariance);

  // Adds a place where the rig stood. Its frame is the rig's at pan = tilt = 0. The world is the
  // frame in which poses are given: usually the first station's, added with a pose as
  // ptzcal_pose_init leaves it. Other stations may be unknown: they are found from cameras that
  // another station's shots calibrate.
  //   pose: The station in the world, X_world = rotation X_station + translation; its other members
  //   do not matter, so that what ptzcal_pose_estimate_get gave can be handed over; may be left
  //   out: nothing is known.
  //   covariance: 36 numbers, row-major: of w in R <- exp([w]x) R (axes of the world, radians) and
  //   of the translation (metres), as ptzcal_pose_estimate_copy_covariance gives them; 0 fixes and
  //   INFINITY frees as for the rig; may be left out: the pose is exact. NULL when the pose is.
  // C: ptzcal_adjustment_add_station
  outcome<std::uint32_t> add_station(ptzcal::optional_ref<ptzcal_pose> pose = {},
      ptzcal::view<const double> covariance = {});

  // Adds a fixed camera of which no more is known than the options say.
  //   width: Image size in pixels, 1 to 65536.
  //   height: Image size in pixels, 1 to 65536.
  //   options: Lens model, known lens, and the priors of skew and aspect are taken from them,
  //   nothing else; may be left out: the defaults.
  // C: ptzcal_adjustment_add_camera
  outcome<std::uint32_t> add_camera(std::uint32_t width, std::uint32_t height,
      ptzcal::optional_ref<ptzcal::calibration_options> options = {});

  // Adds a fixed camera that was calibrated earlier, in the same world: the calibration with its
  // covariance becomes its prior. The measurements behind it must not be added again. Parameters
  // that were fixed there stay fixed.
  //   calibration: The calibration.
  // C: ptzcal_adjustment_add_calibrated_camera
  outcome<std::uint32_t> add_calibrated_camera(const ptzcal::calibration &calibration);

  // Adds a fixed camera of which some parameters are known, each to a standard deviation.
  //   known: The camera as it is believed to be.
  //   sigmas: n standard deviations in the order of ptzcal_calibration_copy_covariance: fx fy skew
  //   cx cy (pixels), the coefficients of the camera's lens model, a turn about the camera's own
  //   axes (3, radians), the centre (3, metres). 0 fixes a parameter, INFINITY frees it.
  // C: ptzcal_adjustment_add_known_camera
  outcome<std::uint32_t> add_known_camera(const ptzcal_camera &known, ptzcal::view<const double> sigmas);

  // Adds laser shots: what the head read and where its camera saw the spot.
  //   station: Where the rig stood.
  //   pan_tilt: n x 2 numbers: readings at each shot, radians.
  //   spots: n x 2 numbers: the spot's pixel in the head camera; may be left out: the head camera
  //   saw none of them.
  //   spot_covariance: n x 3 numbers: xx, xy, yy, positive definite, px^2; may be left out: 1 px,
  //   uncorrelated.
  //   seen: n bytes: 0 where the head camera saw no spot, and what stands in `spots` does not
  //   matter (but is finite); may be left out: it saw all.
  // C: ptzcal_adjustment_add_shots
  outcome<std::size_t> add_shots(std::uint32_t station, ptzcal::view<const double> pan_tilt,
      ptzcal::view<const double> spots = {}, ptzcal::view<const double> spot_covariance = {},
      ptzcal::view<const std::uint8_t> seen = {});

  // Adds where a fixed camera saw shots that were added before. The residuals and inliers of its
  // calibration are in the order of the shots.
  //   camera: The fixed camera.
  //   shots: n indices of shots; a camera sees each at most once.
  //   uv: n x 2 numbers: the spot's pixel in the camera.
  //   uv_covariance: n x 3 numbers: xx, xy, yy, positive definite, px^2; may be left out: 1 px,
  //   uncorrelated.
  // C: ptzcal_adjustment_add_sightings
  outcome<void> add_sightings(std::uint32_t camera, ptzcal::view<const std::size_t> shots,
      ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance = {});

  // Adds all shots of a scan, with what the head camera and the fixed cameras saw: shot i of the
  // scan becomes shot `first` + i.
  //   station: Where the rig stood during the scan.
  //   scan: The scan.
  //   cameras: For each fixed camera of the scan its index in the survey (of the same image size),
  //   or PTZCAL_NO_CAMERA.
  // C: ptzcal_adjustment_add_scan
  outcome<std::size_t> add_scan(std::uint32_t station, const ptzcal::scan &scan,
      ptzcal::view<const std::uint32_t> cameras);

  // Adds a plane, whose place is found.
  //   flatness: How far its surface strays from it: standard deviation, 1e-6 to 1 m. A painted wall
  //   has about 0.002.
  // C: ptzcal_adjustment_add_plane
  outcome<std::uint32_t> add_plane(double flatness);

  // Says which plane each of several shots hit. Where that is wrong, it is set aside like any other
  // outlier.
  //   first: The first shot; the others follow it.
  //   hits: n indices of planes, or PTZCAL_NO_PLANE.
  // C: ptzcal_adjustment_set_planes
  outcome<void> set_planes(std::size_t first, ptzcal::view<const std::uint32_t> hits);

  // Finds the planes that the stations of a survey share, and adds them to it with the shots that
  // hit them. Of the stations no pose needs to be known; what was said of them (odometry, with its
  // covariance) settles what planes alone leave ambiguous. Shots that the head camera did not see
  // say nothing here. A survey that is refused is left as it was. ptzcal_adjustment_solve then
  // finds stations and cameras together.
  //   options: The options, set up by ptzcal_tie_options_init; may be left out: the defaults.
  //   progress: Hears how many steps are done (each station is one, then each pair), and can stop
  //   them; may be left out.
  //   token: Stops it from another thread; may be left out. It is looked at before each step.
  // C: ptzcal_adjustment_tie_stations
  outcome<ptzcal::ties> tie_stations(const ptzcal_tie_options &options = ptzcal::tie_options(),
      const ptzcal::progress_callback &progress = {}, ptzcal::optional_ref<ptzcal::cancel> token = {});

  // Solves a survey. It is in use until the call returns: other threads may solve it too, but
  // adding to it is PTZCAL_STATUS_BUSY. The same survey, options and seed give the same bits.
  //   options: The options, set up by ptzcal_adjust_options_init; may be left out: the defaults.
  //   cancel: Ends the call early from another thread; may be left out.
  // C: ptzcal_adjustment_solve
  outcome<ptzcal::adjusted> solve(const ptzcal_adjust_options &options = ptzcal::adjust_options(),
      ptzcal::optional_ref<ptzcal::cancel> cancel = {}) const;
};

class adjusted : public detail::handle<ptzcal_adjusted, ptzcal_adjusted_free> {
 public:
  using handle::handle;
  adjusted() noexcept = default;
  struct shot_point_result;
  struct measure_result;
  struct plane_result;

  // What the adjustment says about itself.
  // C: ptzcal_adjusted_get_summary
  outcome<ptzcal::adjusted_summary> summary() const;

  // The adjusted rig.
  // C: ptzcal_adjusted_get_rig_model
  outcome<ptzcal::rig_model> rig_model() const;

  // Where the rig stood: X_world = rotation X_station + translation.
  //   station: The station's index.
  // C: ptzcal_adjusted_get_station
  outcome<ptzcal::pose> station(std::uint32_t station) const;

  // A fixed camera as a calibration of its own. Its covariance contains what is not known of rig
  // and stations; its residuals and inliers are of its sightings in the order of the shots.
  //   camera: The camera's index.
  // C: ptzcal_adjusted_get_calibration
  outcome<ptzcal::calibration> calibration(std::uint32_t camera) const;

  // The covariance of all parameters: p x p numbers, row-major, symmetric, p = the summary's
  // `parameters`. Their order: PTZCAL_RIG_PARAMETERS of the rig (ptzcal_rig_parameter); six of
  // every station (as ptzcal_adjustment_add_station takes them); those of every camera (as
  // ptzcal_calibration_copy_covariance has them); then three of every plane, of which
  // ptzcal_adjusted_get_plane says more. Rows and columns of fixed parameters are 0.
  // C: ptzcal_adjusted_copy_covariance
  outcome<std::vector<double>> covariance() const;

  // Name of a parameter of the covariance, such as "laser x0" or "camera 1 position z".
  //   index: The parameter.
  // C: ptzcal_adjusted_parameter_name
  std::string parameter_name(std::size_t index) const;

  // Solves the same survey again with the same options: the same bits.
  //   cancel: Ends the call early from another thread; may be left out.
  // C: ptzcal_adjusted_resolve
  outcome<ptzcal::adjusted> resolve(ptzcal::optional_ref<ptzcal::cancel> cancel = {}) const;

  // What a person should know of the answer, one line of English UTF-8: a misfit, what it comes
  // from, a prior that contradicts the data. The wording may change in any version; decide by their
  // number, by `probability` and by the suspects.
  //   index: From 0 to the summary's `warnings` less 1.
  // C: ptzcal_adjusted_warning
  std::string warning(std::size_t index) const;

  // What the data and priors determine worst, and what to add, one line of English UTF-8.
  // C: ptzcal_adjusted_weakest
  std::string weakest() const;

  // Name of a parameter of which the data say next to nothing: 0.95 or more of its prior standard
  // deviation is left.
  //   index: From 0 to the summary's `prior_only` less 1.
  // C: ptzcal_adjusted_prior_only
  std::string prior_only(std::size_t index) const;

  // A group of fixed parameters that the data want to move, the most wanted first.
  //   index: From 0 to the summary's `suspects` less 1.
  // C: ptzcal_adjusted_get_suspect
  outcome<ptzcal::suspect> suspect(std::size_t index) const;

  // Name of a suspect, such as "the axis offsets".
  //   index: From 0 to the summary's `suspects` less 1.
  // C: ptzcal_adjusted_suspect_name
  std::string suspect_name(std::size_t index) const;

  // Which spots of the head camera were used: n bytes, n = the summary's `shots`; 1 for an inlier,
  // 0 for an outlier and where the head camera saw none.
  // C: ptzcal_adjusted_copy_head_inliers
  outcome<std::vector<std::uint8_t>> head_inliers() const;

  // Where a shot hit, by all who saw it.
  //   shot: The shot's index.
  // C: ptzcal_adjusted_shot_point
  outcome<ptzcal::adjusted::shot_point_result> shot_point(std::size_t shot) const;

  // Measures new spots of the head camera with the adjusted rig.
  //   station: Where the rig stands.
  //   pan_tilt: n x 2 numbers: readings at each shot, radians.
  //   spots: n x 2 numbers: the spot's pixel in the head camera.
  //   spot_covariance: n x 3 numbers: xx, xy, yy, px^2; may be left out: 1 px, uncorrelated.
  // C: ptzcal_adjusted_measure
  outcome<ptzcal::adjusted::measure_result> measure(std::uint32_t station,
      ptzcal::view<const double> pan_tilt, ptzcal::view<const double> spots,
      ptzcal::view<const double> spot_covariance = {}) const;

  // A plane of the scene in the world: normal . X = distance.
  //   plane: The plane's index.
  // C: ptzcal_adjusted_get_plane
  outcome<ptzcal::adjusted::plane_result> plane(std::uint32_t plane) const;

  // Which shots hit the plane that they were said to hit: one byte a shot, 1 where the answer uses
  // it, 0 where it was set aside or no plane was named.
  // C: ptzcal_adjusted_copy_plane_inliers
  outcome<std::vector<std::uint8_t>> plane_inliers() const;
};

class ties : public detail::handle<ptzcal_ties, ptzcal_ties_free> {
 public:
  using handle::handle;
  ties() noexcept = default;

  // How many links, loops, planes and shots there are.
  // C: ptzcal_ties_get_summary
  outcome<ptzcal::ties_summary> summary() const;

  // A pair of stations that was tried: in the order of the options' pairs, or 0 and 1, 0 and 2, and
  // so on.
  //   index: Which one, from 0.
  // C: ptzcal_ties_get_link
  outcome<ptzcal::link> link(std::uint32_t index) const;

  // Why planes do not tell the pose between the stations of a link.
  //   index: The link.
  // C: ptzcal_ties_link_reason
  std::string link_reason(std::uint32_t index) const;

  // The pose between the stations of a link, and the planes that it is from.
  //   index: The link.
  // C: ptzcal_ties_get_registration
  outcome<ptzcal::registration> registration(std::uint32_t index) const;

  // How well a loop of stations closes.
  //   index: Which loop, from 0.
  // C: ptzcal_ties_get_loop
  outcome<ptzcal::loop> loop(std::uint32_t index) const;

  // Copies the stations of a loop in their order; the last is linked to the first.
  //   index: The loop.
  // C: ptzcal_ties_copy_loop
  outcome<std::vector<std::uint32_t>> copy_loop(std::uint32_t index) const;
};

class site : public detail::handle<ptzcal_site, ptzcal_site_free> {
 public:
  using handle::handle;
  site() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  site(const ptzcal_rig_model &model, const ptzcal_camera &camera) : site(make(model, camera)) {}
#endif

  // Makes a site: a rig that is known exactly, no surroundings yet.
  //   model: The rig.
  //   camera: The fixed camera, its pose in the rig's frame; the lens model that it has is the one
  //   that will be fitted.
  // C: ptzcal_site_new
  static outcome<ptzcal::site> make(const ptzcal_rig_model &model, const ptzcal_camera &camera);

  // Says how well the rig's parameters are known.
  //   sigmas: 15 standard deviations in the order of ptzcal_rig_parameter; 0 fixes a parameter (all
  //   of them by default), INFINITY frees it.
  // C: ptzcal_site_set_rig_sigmas
  outcome<void> set_rig_sigmas(ptzcal::view<const double> sigmas);

  // Says how well single moves of the head are known.
  //   sigma_pan: Standard deviation of the true pan about its readings, radians; the default is 0.
  //   sigma_tilt: The same of tilt.
  // C: ptzcal_site_set_pointing_sigma
  outcome<void> set_pointing_sigma(double sigma_pan, double sigma_tilt);

  // Says how the camera will be calibrated: lens model (that of the site's camera), known lens,
  // beliefs about skew and aspect. The options' other settings do not matter here.
  //   options: The options; may be left out: the defaults with the camera's lens model.
  // C: ptzcal_site_set_estimate
  outcome<void> set_estimate(ptzcal::optional_ref<ptzcal::calibration_options> options = {});

  // Surrounds rig and camera by one plane: a wall, a floor.
  //   normal: Its normal n, 3 numbers of any length: n . x = distance in the rig's frame.
  //   distance: Metres for a normal of unit length.
  // C: ptzcal_site_set_plane
  outcome<void> set_plane(ptzcal::view<const double> normal, double distance);

  // Surrounds rig and camera by a room with boxes in it, which also hide what is behind them.
  //   room: 6 numbers: the lower corner x y z, then the higher one; the rig's frame, metres.
  //   boxes: 6 numbers for each box; may be left out when there is none.
  // C: ptzcal_site_set_room
  outcome<void> set_room(ptzcal::view<const double> room, ptzcal::view<const double> boxes);

  // Says of the surroundings only which depths occur: every position gets one of them.
  //   nearest: Least depth along the head's axis, metres.
  //   farthest: Greatest depth.
  // C: ptzcal_site_set_depths
  outcome<void> set_depths(double nearest, double farthest);
};

class set_up : public detail::handle<ptzcal_set_up, ptzcal_set_up_free> {
 public:
  using handle::handle;
  set_up() noexcept = default;

  // The shots of a region that both cameras would see in the site's surroundings.
  //   site: The site.
  //   region: The positions.
  // C: ptzcal_set_up_from_region
  static outcome<ptzcal::set_up> from_region(const ptzcal::site &site, const ptzcal_region &region);

  // The points of a scan, taken for true and projected anew into both cameras; those that are not
  // in view of both are left out.
  //   site: The site; its camera is where the scan's fixed camera was found, its rig the scan's.
  //   scan: The scan.
  // C: ptzcal_set_up_from_scan
  static outcome<ptzcal::set_up> from_scan(const ptzcal::site &site, const ptzcal::scan &scan);

  // Points at which the laser is aimed; those out of its reach or not in view of both cameras are
  // left out.
  //   site: The site.
  //   xyz: n points in the rig's frame, metres.
  // C: ptzcal_set_up_from_points
  static outcome<ptzcal::set_up> from_points(const ptzcal::site &site, ptzcal::view<const double> xyz);

  // Gives the points by which the cascade as printed (PTZCAL_STUDY_METHOD_DLT_CASCADE_PRINTED)
  // finds the head camera's pose: the corners of the thesis's boards. No other method needs them.
  //   xyz: n points in the rig's frame, metres, in front of the head camera at pan = tilt = 0.
  // C: ptzcal_set_up_set_control
  outcome<void> set_control(ptzcal::view<const double> xyz);

  // The number of shots that both cameras see.
  // C: ptzcal_set_up_get_count
  outcome<std::size_t> count() const;
};

class study : public detail::handle<ptzcal_study, ptzcal_study_free> {
 public:
  using handle::handle;
  study() noexcept = default;

  // Makes a study.
  //   set_up: The set-up.
  //   levels: n pairs of noises, px: of the head camera's spot, of the fixed camera's; 0 to 1000.
  //   distances: m distances from the fixed camera at which points are handed off, metres; may be
  //   left out when there is none.
  //   options: The options; may be left out: the defaults.
  //   progress: Hears how many trials are done, and can stop the study; may be left out.
  //   token: Stops the study from another thread; may be left out.
  // C: ptzcal_study_run
  static outcome<ptzcal::study> run(const ptzcal::set_up &set_up, ptzcal::view<const double> levels,
      ptzcal::view<const double> distances, const ptzcal_study_options &options = ptzcal::study_options(),
      const ptzcal::progress_callback &progress = {}, ptzcal::optional_ref<ptzcal::cancel> token = {});

  // The errors of a method at a level.
  //   method: A ptzcal_study_method that was asked for.
  //   level: Index of the level.
  // C: ptzcal_study_get_cell
  outcome<ptzcal::study_cell> cell(ptzcal::study_method method, std::size_t level) const;

  // Root mean square errors of points handed off: where the fixed camera believes a pixel's point
  // at a distance to be, over 3 x 3 pixels of its image.
  //   method: A ptzcal_study_method that was asked for.
  //   level: Index of the level.
  // C: ptzcal_study_copy_handoff
  outcome<std::vector<double>> handoff(ptzcal::study_method method, std::size_t level) const;

  // Writes all figures of a study as JSON; an infinite one is null.
  //   path: The file.
  // C: ptzcal_study_save_json
  outcome<void> save_json(ptzcal::c_string path) const;

  // Writes all figures of a study as CSV, a line for each method and level.
  //   path: The file.
  // C: ptzcal_study_save_csv
  outcome<void> save_csv(ptzcal::c_string path) const;

  // Draws a chart as a self-contained SVG.
  //   plot: A ptzcal_study_plot.
  //   of: What it is of: a quantity, a method or a level, as the plot says.
  //   path: The file.
  // C: ptzcal_study_save_plot
  outcome<void> save_plot(ptzcal::study_plot plot, std::uint32_t of, ptzcal::c_string path) const;
};

class label : public detail::handle<ptzcal_label, ptzcal_label_free> {
 public:
  using handle::handle;
  label() noexcept = default;

  // Makes a label.
  //   set_up: The set-up.
  //   distances: m working distances, metres.
  //   levels: n pairs of noises, px: of the head camera's spot, of the fixed camera's.
  //   options: Of the method (the highest bit), trials, threads and seed; may be left out: the
  //   defaults, maximum likelihood.
  //   progress: Hears how many trials are done, and can stop it; may be left out.
  //   token: Stops it from another thread; may be left out.
  // C: ptzcal_label_make
  static outcome<ptzcal::label> make(const ptzcal::set_up &set_up, ptzcal::view<const double> distances,
      ptzcal::view<const double> levels, const ptzcal_study_options &options = ptzcal::study_options(),
      const ptzcal::progress_callback &progress = {}, ptzcal::optional_ref<ptzcal::cancel> token = {});

  // The number of rows: distance by distance, level by level within. Distances up to which the
  // shots do not determine a camera have none.
  // C: ptzcal_label_get_count
  outcome<std::size_t> count() const;

  // A row of a label.
  //   index: The row.
  // C: ptzcal_label_get_row
  outcome<ptzcal::label_row> row(std::size_t index) const;

  // Writes a label as JSON; an infinite figure is null.
  //   path: The file.
  // C: ptzcal_label_save_json
  outcome<void> save_json(ptzcal::c_string path) const;

  // Writes a label as CSV, a line for each row.
  //   path: The file.
  // C: ptzcal_label_save_csv
  outcome<void> save_csv(ptzcal::c_string path) const;

  // Draws errors against the working distance, a line for each level, as a self-contained SVG.
  //   of: A ptzcal_study_quantity, or PTZCAL_LABEL_HANDOFF.
  //   path: The file.
  // C: ptzcal_label_save_plot
  outcome<void> save_plot(std::uint32_t of, ptzcal::c_string path) const;
};

class plan : public detail::handle<ptzcal_plan, ptzcal_plan_free> {
 public:
  using handle::handle;
  plan() noexcept = default;

  // Plans a scan in a site's surroundings.
  //   site: The site; its camera is a guess.
  //   options: What is wanted.
  //   token: Stops it from another thread; may be left out.
  // C: ptzcal_plan_make
  static outcome<ptzcal::plan> make(const ptzcal::site &site, const ptzcal_plan_options &options,
      ptzcal::optional_ref<ptzcal::cancel> token = {});

  // What a plan comes to.
  // C: ptzcal_plan_get_summary
  outcome<ptzcal::plan_summary> summary() const;

  // The chosen shots of a plan, the most valuable first.
  // C: ptzcal_plan_copy_shots
  outcome<std::vector<double>> shots() const;
};

class pointing : public detail::handle<ptzcal_pointing, ptzcal_pointing_free> {
 public:
  using handle::handle;
  pointing() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  pointing(const ptzcal::calibration &calibration, const ptzcal_rig_model &model) : pointing(make(calibration,
      model)) {}
#endif

  // Makes a pointing of a camera whose world is the rig's frame. The rig is taken as exact until
  // ptzcal_pointing_set_rig_covariance; where the targets are must still be set.
  //   calibration: The fixed camera with its covariance.
  //   model: The rig.
  // C: ptzcal_pointing_new
  static outcome<ptzcal::pointing> make(const ptzcal::calibration &calibration,
      const ptzcal_rig_model &model);

  // Makes a pointing of a joint adjustment, with all that camera and rig have in common.
  //   adjusted: The adjustment's answer.
  //   camera: The fixed camera's index.
  //   station: The station at which the rig stands.
  // C: ptzcal_pointing_new_adjusted
  static outcome<ptzcal::pointing> from_adjusted(const ptzcal::adjusted &adjusted, std::uint32_t camera,
      std::uint32_t station);

  // Says how well the rig is known, independent of the camera.
  //   covariance: 225 numbers, 15 x 15: of the rig's parameters in the order of
  //   ptzcal_adjusted_copy_covariance, row-major, positive semi-definite.
  // C: ptzcal_pointing_set_rig_covariance
  outcome<void> set_rig_covariance(ptzcal::view<const double> covariance);

  // Says where the rig stands, when that is not where the world is.
  //   pose: The station in the world, X_world = rotation X_station + translation; its other members
  //   do not matter.
  //   covariance: 36 numbers, row-major: of w in R <- exp([w]x) R (axes of the world, radians) and
  //   of the translation (metres); may be left out: the pose is exact.
  // C: ptzcal_pointing_set_station
  outcome<void> set_station(const ptzcal_pose &pose, ptzcal::view<const double> covariance = {});

  // Says where the head comes to rest about its readings: its repeatability and, of a head with
  // steps, step / sqrt(12). 0 until then.
  //   pan: Standard deviation of pan, radians.
  //   tilt: Standard deviation of tilt, radians.
  // C: ptzcal_pointing_set_head_deviation
  outcome<void> set_head_deviation(double pan, double tilt);

  // Gives the head camera's lens over zoom: aims then have a zoom. Its errors are taken as
  // independent of the rig's axes and encoders.
  //   curve: The curve, of the rig's image size; it is copied.
  // C: ptzcal_pointing_set_zoom_curve
  outcome<void> set_zoom_curve(const ptzcal::zoom_curve &curve);

  // Says how far the head reaches: aims beyond are refused.
  //   pan_min: Least reading of pan, radians.
  //   pan_max: Greatest reading of pan, radians.
  //   tilt_min: Least reading of tilt, radians.
  //   tilt_max: Greatest reading of tilt, radians.
  // C: ptzcal_pointing_set_reach
  outcome<void> set_reach(double pan_min, double pan_max, double tilt_min, double tilt_max);

  // The targets are on a plane n . x = distance of the world: the floor, the road, a wall.
  //   normal: 3 numbers, of any length but 0.
  //   distance: Metres times the normal's length.
  //   covariance: 16 numbers, 4 x 4 row-major, positive semi-definite: of the unit normal's three
  //   components and the distance (metres); may be left out: the plane is exact, but for what
  //   `measured_by` makes of it.
  //   measured_by: A ptzcal_measured_by.
  // C: ptzcal_pointing_set_plane
  outcome<void> set_plane(ptzcal::view<const double> normal, double distance,
      ptzcal::view<const double> covariance, ptzcal::measured_by measured_by);

  // The targets are on the surface that a point cloud samples. The cloud is copied and arranged
  // once: a second or two for a million points.
  //   xyz: n x 3 numbers: points in the world, metres.
  //   covariances: n x 9 numbers: of each point, row-major, positive semi-definite, m^2; may be
  //   left out: estimated from the points' scatter.
  //   measured_by: A ptzcal_measured_by.
  // C: ptzcal_pointing_set_cloud
  outcome<void> set_cloud(ptzcal::view<const double> xyz, ptzcal::view<const double> covariances,
      ptzcal::measured_by measured_by);

  // The targets are at a known distance along their rays, from whichever camera sees the pixel.
  //   metres: The distance, positive.
  //   sigma: Its standard deviation, metres; 0: exact.
  // C: ptzcal_pointing_set_distance
  outcome<void> set_distance(double metres, double sigma);

  // Where to turn the head, and how far to zoom, so that its camera shows at its picture's centre
  // what the fixed camera shows at a pixel.
  //   uv: 2 numbers: a pixel of the fixed camera.
  //   uv_covariance: 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be left out: the
  //   pixel is exact.
  //   probability: With which the whole target is to be in the picture, between 0 and 1.
  //   target_size: Diameter of the target, metres; 0 for a point.
  // C: ptzcal_pointing_aim
  outcome<ptzcal::aim> aim(ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance,
      double probability, double target_size) const;

  // Where the fixed camera sees what the head camera sees at a pixel.
  //   pan: Reading of the head, radians.
  //   tilt: Reading of the head, radians.
  //   zoom: Zoom on the curve's scale; without a curve it does not matter.
  //   uv: 2 numbers: a pixel of the head camera.
  //   uv_covariance: 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be left out: the
  //   pixel is exact.
  // C: ptzcal_pointing_locate
  outcome<ptzcal::located> locate(double pan, double tilt, double zoom, ptzcal::view<const double> uv,
      ptzcal::view<const double> uv_covariance = {}) const;

  // The part of the fixed camera's picture in which what the head camera sees at a pixel can be,
  // its depth unknown: of 65 places evenly spread in inverse distance those that are in the
  // picture, nearest first.
  //   pan: Reading of the head, radians.
  //   tilt: Reading of the head, radians.
  //   zoom: Zoom on the curve's scale; without a curve it does not matter.
  //   uv: 2 numbers: a pixel of the head camera.
  //   uv_covariance: 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be left out: the
  //   pixel is exact.
  //   nearest: Metres, positive.
  //   farthest: Metres; INFINITY is far enough.
  // C: ptzcal_pointing_copy_located_along
  outcome<std::vector<double>> located_along(double pan, double tilt, double zoom,
      ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance, double nearest,
      double farthest) const;

  // What to do about a pixel of the fixed camera whose depth is unknown, but for its nearest and
  // farthest distance from that camera.
  //   uv: 2 numbers: a pixel of the fixed camera.
  //   uv_covariance: 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be left out: the
  //   pixel is exact.
  //   nearest: Metres, positive.
  //   farthest: Metres; INFINITY is far enough.
  //   probability: With which the whole target is to be in the picture, between 0 and 1.
  //   target_size: Diameter of the target, metres; 0 for a point.
  // C: ptzcal_pointing_sweep
  outcome<ptzcal::sweep> sweep(ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance,
      double nearest, double farthest, double probability, double target_size) const;
};

class sweep : public detail::handle<ptzcal_sweep, ptzcal_sweep_free> {
 public:
  using handle::handle;
  sweep() noexcept = default;

  // What a sweep comes to.
  // C: ptzcal_sweep_get_summary
  outcome<ptzcal::sweep_summary> summary() const;

  // The pictures that together show the whole curve, nearest first.
  // C: ptzcal_sweep_copy_steps
  outcome<std::vector<double>> steps() const;

  // Pan and tilt over the distance, nearest first.
  // C: ptzcal_sweep_copy_curve
  outcome<std::vector<double>> curve() const;
};

class camera_list : public detail::handle<ptzcal_camera_list, ptzcal_camera_list_free> {
 public:
  using handle::handle;
  camera_list() : handle(detail::make<ptzcal_camera_list>(ptzcal_camera_list_new)) {}
  struct count_result;
  struct camera_result;

  // Makes an empty list.
  // C: ptzcal_camera_list_new
  static outcome<ptzcal::camera_list> make();

  // Adds a camera with its pose.
  //   camera: The camera.
  //   name: What files call it; may be left out: it has no name.
  // C: ptzcal_camera_list_add
  outcome<void> add(const ptzcal_camera &camera, ptzcal::c_string name = {});

  // Reads all cameras of a file.
  //   path: The file; of COLMAP its folder.
  //   format: A ptzcal_camera_format.
  // C: ptzcal_camera_list_read
  static outcome<ptzcal::camera_list> read(ptzcal::c_string path, ptzcal::camera_format format);

  // Writes all cameras of a list into one file, or COLMAP's folder. COLMAP calls an image without a
  // name camera0, camera1, ...; names of its images have no white space.
  //   path: The file; of COLMAP its folder, which is made where it is not there.
  //   format: A ptzcal_camera_format.
  // C: ptzcal_camera_list_write
  outcome<void> write(ptzcal::c_string path, ptzcal::camera_format format) const;

  // How many cameras a list has, and the format that it was read from.
  // C: ptzcal_camera_list_count
  outcome<ptzcal::camera_list::count_result> count() const;

  // A camera of a list.
  //   index: The camera, from 0.
  // C: ptzcal_camera_list_get
  outcome<ptzcal::camera_list::camera_result> camera(std::size_t index) const;

  // Name of a camera of a list.
  //   index: The camera, from 0.
  // C: ptzcal_camera_list_name
  std::string name(std::size_t index) const;
};

class report : public detail::handle<ptzcal_report, ptzcal_report_free> {
 public:
  using handle::handle;
  report() noexcept = default;
#ifndef PTZCAL_NO_EXCEPTIONS
  explicit report(ptzcal::c_string title) : report(make(title)) {}
#endif

  // Begins a report.
  //   title: Its title, UTF-8.
  // C: ptzcal_report_new
  static outcome<ptzcal::report> make(ptzcal::c_string title);

  // Says which way is up in the world, for the view from above; without it -y, as in a rig's frame.
  //   up: 3 numbers, of any length but zero.
  // C: ptzcal_report_set_up
  outcome<void> set_up(ptzcal::view<const double> up);

  // Adds a paragraph of the host's own: who measured, when, where, with what.
  //   note: The paragraph, UTF-8; it is shown as it is.
  // C: ptzcal_report_add_note
  outcome<void> add_note(ptzcal::c_string note);

  // Adds a calibrated camera: parameters with standard deviations, warnings in words, and drawings
  // of its measurements and residuals, of depths, and of how far off a click may be.
  //   name: The camera's name, UTF-8.
  //   calibration: The calibration.
  //   set: What it was calibrated from; may be left out: then the drawings are left out.
  //   picture: A picture of the camera's, of its size, drawn beneath the measurements; may be left
  //   out.
  // C: ptzcal_report_add_calibration
  outcome<void> add_calibration(ptzcal::c_string name, const ptzcal::calibration &calibration,
      ptzcal::optional_ref<ptzcal::correspondences> set = {},
      ptzcal::optional_ref<ptzcal_image> picture = {});

  // Adds a camera calibrated from boards: parameters with standard deviations, warnings in words,
  // drawings of its corners and residuals, every view, and what to add to make it better.
  //   name: The camera's name, UTF-8.
  //   calibration: The calibration.
  //   boards: What it was calibrated from.
  // C: ptzcal_report_add_board_calibration
  outcome<void> add_board_calibration(ptzcal::c_string name, const ptzcal::board_calibration &calibration,
      const ptzcal::boards &boards);

  // Adds a scan: positions, who saw each spot and why not, depths.
  //   name: The scan's name, UTF-8.
  //   scan: The scan.
  // C: ptzcal_report_add_scan
  outcome<void> add_scan(ptzcal::c_string name, const ptzcal::scan &scan);

  // Adds a survey: rig, stations, planes, and each of its cameras as a section.
  //   name: The survey's name, UTF-8.
  //   adjusted: The survey, solved.
  // C: ptzcal_report_add_adjusted
  outcome<void> add_adjusted(ptzcal::c_string name, const ptzcal::adjusted &adjusted);

  // Names something that the result was made from by its SHA-256, such as the bytes of a journal or
  // of a rig's file. What is added above is named without being asked.
  //   name: Its name, UTF-8.
  //   bytes: n bytes; may be left out when n is 0.
  // C: ptzcal_report_add_input
  outcome<void> add_input(ptzcal::c_string name, ptzcal::view<const std::uint8_t> bytes);

  // The report as HTML: UTF-8 without a NUL.
  // C: ptzcal_report_copy_html
  outcome<std::string> html() const;

  // Writes the report as an HTML file, whole or not at all.
  //   path: The file, UTF-8.
  // C: ptzcal_report_save
  outcome<void> save(ptzcal::c_string path) const;
};

// What functions with several outputs return.

struct depth_map::size_result {
  std::uint32_t width;
  std::uint32_t height;
  std::size_t known;
};

struct rig_model::locate_result {
  std::vector<double> xyz;
  std::vector<double> covariance;
};

struct detect_chessboard_result {
  ptzcal::chessboard board;
  std::vector<double> corners;
  std::vector<double> covariance;
  std::vector<std::uint8_t> found;
};

struct match_sift_result {
  std::vector<std::uint32_t> pairs;
  std::vector<double> distances;
};

struct detect_line_segments_result {
  std::vector<double> uv;
  std::vector<double> uv_covariance;
  std::vector<double> ends;
  std::vector<double> details;
};

struct fit_line_3d_result {
  std::array<double, 6> point_direction;
  std::array<double, 36> line_covariance;
  std::array<double, 2> extent;
  std::vector<std::uint8_t> inliers;
  double noise_factor;
};

struct lift_line_segments_result {
  std::vector<double> point_direction;
  std::vector<double> line_covariance;
  std::vector<double> extents;
  std::vector<std::uint8_t> found;
};

struct match_lines_result {
  std::vector<std::uint32_t> pairs;
  std::vector<double> residuals;
};

struct calibration::project_result {
  std::vector<double> uv;
  std::vector<double> uv_covariance;
};

struct calibration::back_project_result {
  std::vector<double> directions;
  std::vector<double> ray_covariance;
};

struct calibration::back_project_to_plane_result {
  std::vector<double> xyz;
  std::vector<double> xyz_covariance;
};

struct zoom_curve::rig_model_result {
  ptzcal::rig_model model;
  std::array<double, 49> covariance;
};

struct zoom_curve::range_result {
  double low;
  double high;
};

struct rig_calibrated::count_result {
  std::uint32_t positions;
  std::uint32_t views;
};

struct rig_calibrated::rig_model_result {
  ptzcal::rig_model model;
  std::array<double, 49> covariance;
};

struct rig_calibrated::corners_result {
  std::vector<double> board_xy;
  std::vector<double> uv;
  std::vector<double> residuals;
  std::vector<std::uint8_t> inliers;
};

struct registration::roof_edges_result {
  ptzcal::roof_edges edges_a;
  ptzcal::roof_edges edges_b;
};

struct simulator::position_result {
  double pan;
  double tilt;
};

struct simulator::next_frame_result {
  ptzcal::image image;
  double timestamp;
};

struct angle_map::to_angles_result {
  double pan;
  double tilt;
  double pan_sigma;
  double tilt_sigma;
};

struct angle_map::to_raw_result {
  double raw_pan;
  double raw_tilt;
};

struct head::position_result {
  double pan;
  double tilt;
  double zoom;
};

struct head::wait_result {
  ptzcal::move_end end;
  std::int32_t status;
};

struct rig::position_result {
  double pan;
  double tilt;
};

struct rig::aim_at_point_result {
  double pan;
  double tilt;
};

struct rig::aim_at_pixel_result {
  double pan;
  double tilt;
};

struct rig_model::aim_result {
  double pan;
  double tilt;
};

struct scan::camera_size_result {
  std::uint32_t width;
  std::uint32_t height;
};

struct cloud::size_result {
  std::size_t points;
  ptzcal::cloud_noise noise;
  std::uint32_t normals;
};

struct cloud::load_result {
  ptzcal::cloud cloud;
  std::size_t skipped;
};

struct mesh::size_result {
  std::size_t vertices;
  std::size_t triangles;
  std::size_t textures;
};

struct exploration::visible_result {
  ptzcal::region region;
  ptzcal::visible visible;
};

struct adjusted::shot_point_result {
  std::array<double, 3> xyz;
  std::array<double, 9> covariance;
};

struct adjusted::measure_result {
  std::vector<double> xyz;
  std::vector<double> covariance;
};

struct adjusted::plane_result {
  std::array<double, 4> values;
  std::array<double, 16> covariance;
};

struct next_shots_result {
  std::array<double, 2> now;
  std::vector<double> buffer;
};

struct ellipse_result {
  std::array<double, 2> semi_axes;
  double angle;
};

struct camera_list::count_result {
  std::size_t count;
  std::uint32_t format;
};

struct camera_list::camera_result {
  ptzcal::camera camera;
  std::uint32_t has_pose;
};

struct calibration_load_inputs_result {
  ptzcal::correspondences set;
  ptzcal::calibration_options options;
};

// Version of the library, such as "0.1.0" (semantic versioning).
// C: ptzcal_version
std::string version();

// ABI number of the loaded library; compare it with PTZCAL_ABI_VERSION after dlopen.
// C: ptzcal_abi_version
std::uint32_t abi_version();

// Name of a status, such as "PTZCAL_STATUS_NOT_FOUND".
//   status: A ptzcal_status, or any number.
// C: ptzcal_status_name
std::string status_name(ptzcal::status status);

// Finds the laser's spot in one frame with the laser on, against one with it off.
//   on: The frame with the laser on.
//   off: The same view with the laser off, of the same size and format; may be left out: the search
//   then knows no background and is much weaker.
//   options: The options; may be left out: the defaults.
// C: ptzcal_detect_spot
outcome<ptzcal::spot> detect_spot(const ptzcal_image &on, ptzcal::optional_ref<ptzcal_image> off = {},
    ptzcal::optional_ref<ptzcal::spot_options> options = {});

// Finds the laser's spot in several frames with the laser on, averaged, against several with it
// off, averaged: noise falls with the square root of their number.
//   on: n_on frames with the laser on, all of one size and format.
//   off: n_off frames of the same view with the laser off; may be left out when n_off is 0.
//   options: The options; may be left out: the defaults.
// C: ptzcal_detect_spot_averaged
outcome<ptzcal::spot> detect_spot_averaged(ptzcal::view<const ptzcal::image> on = {},
    ptzcal::view<const ptzcal::image> off = {}, ptzcal::optional_ref<ptzcal::spot_options> options = {});

// Finds a chessboard in an image. Corners that are hidden, outside the image or unlike a corner are
// left out: their entry of `found` is 0, and so are their other numbers.
//   image: The image; of colours their luma is used.
//   options: The options; may be left out: any size.
// C: ptzcal_detect_chessboard
outcome<ptzcal::detect_chessboard_result> detect_chessboard(const ptzcal_image &image,
    const ptzcal_chessboard_options &options = ptzcal::chessboard_options());

// Finds and describes the keypoints of an image, the strongest first. An image without contrast has
// none. Memory: about 20 kB for each column of the image (5 kB when it is not doubled), and 0.2 kB
// a feature.
//   image: The image, at least 12 pixels high and wide, at most 32768 wide, at most 268435456 in
//   all; of colours their luma is used.
//   options: The options; may be left out: the defaults.
// C: ptzcal_detect_sift
outcome<ptzcal::sift_features> detect_sift(const ptzcal_image &image,
    const ptzcal_sift_options &options = ptzcal::sift_options());

// Matches the features of two images. A feature of `a` has at most one match; without the mutual
// check one of `b` can have several.
//   a: Features of the first image.
//   b: Features of the second image.
//   options: The options; may be left out: the defaults.
// C: ptzcal_match_sift
outcome<ptzcal::match_sift_result> match_sift(const ptzcal::sift_features &a, const ptzcal::sift_features &b,
    const ptzcal_sift_match_options &options = ptzcal::sift_match_options());

// Finds edges: Canny's maxima of the gradient, row by row.
//   image: The image; of colours their luma is used.
//   sigma: Standard deviation of the Gaussian that smooths the image first, pixels, at most 10; 0:
//   a 3 x 3 binomial filter (0.71 pixels), which is faster.
//   low: Gradient from which on an edge goes on, grey levels per pixel of the smoothed image, above
//   0.
//   high: Gradient that an edge must reach somewhere, `low` or more.
// C: ptzcal_detect_edges
outcome<std::vector<double>> detect_edges(const ptzcal_image &image, double sigma, double low, double high);

// Finds straight line segments, the longest first. In an image of nothing but white noise there is
// about one at most. A line that a lens bends is one segment while it leaves a straight line by a
// pixel or so, and several otherwise. What is needed besides the image is a byte a pixel.
//   image: The image; of colours their luma is used.
//   options: The options; may be left out: the defaults.
// C: ptzcal_detect_line_segments
outcome<ptzcal::detect_line_segments_result> detect_line_segments(const ptzcal_image &image,
    const ptzcal_line_options &options = ptzcal::line_options());

// Fits a straight line to points in space, of which some may be of other things: consensus of
// minimal samples (RANSAC), then maximum likelihood. Of several lines the one that most points
// agree with is taken. Points of a depth image need their covariances: along the ray their errors
// grow with the square of the depth. Pixels without depth must be left out.
//   xyz: n x 3 numbers: points, metres.
//   xyz_covariance: n x 9 numbers: of each point, row-major, positive definite, m^2; may be left
//   out: the options' sigma.
//   options: The options; may be left out: the defaults.
// C: ptzcal_fit_line_3d
outcome<ptzcal::fit_line_3d_result> fit_line_3d(ptzcal::view<const double> xyz,
    ptzcal::view<const double> xyz_covariance = {},
    const ptzcal_line_fit_options &options = ptzcal::line_fit_options());

// Finds where line segments of an image with depths lie in space: where the surfaces beside them
// meet their viewing planes. Where the depth differs from side to side, the line is the edge of
// what is in front; it is taken to be an edge of the thing itself, not the outline of a round one.
//   uv: n x 4 numbers: two points of each segment with independent errors, pixels, as
//   ptzcal_detect_line_segments gives them.
//   uv_covariance: n x 6 numbers: xx, xy, yy of each point, px^2; may be left out: 1 px,
//   uncorrelated.
//   ends: n x 4 numbers: from where to where each segment is seen, pixels.
//   camera: The camera of the image and of the depths. Its pose gives the frame of the lines.
//   map: The depths, of the camera's image size.
//   inverse_depth_sigma: Standard deviation of the inverse depths, 1 / metre: 0.0014 for a Kinect.
//   depth_sigma: Standard deviation of the depths besides, metres; not 0 with the other.
// C: ptzcal_lift_line_segments
outcome<ptzcal::lift_line_segments_result> lift_line_segments(ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance, ptzcal::view<const double> ends, const ptzcal_camera &camera,
    const ptzcal::depth_map &map, double inverse_depth_sigma, double depth_sigma);

// Matches lines in space with the segments of a camera's image, by a first estimate of the camera.
// A line and a segment are matched once at most. What is not certain is not matched: lines with a
// second candidate nearly as good have none (but of pieces of one line the longest is taken).
//   point_direction: n_lines x 6 numbers: a point of each line, metres, world frame, and its
//   direction, of any length but zero.
//   line_covariance: n_lines x 36 numbers: of point and direction, row-major; may be left out: the
//   lines are exact.
//   extents: n_lines x 2 numbers: from where to where each line was seen: multiples of its
//   direction from its point.
//   camera: The camera.
//   uv: n_segments x 4 numbers: two points of each segment with independent errors, pixels, as
//   ptzcal_detect_line_segments gives them.
//   uv_covariance: n_segments x 6 numbers: xx, xy, yy of each point, px^2; may be left out: 1 px,
//   uncorrelated. Only what it says across the segment counts.
//   ends: n_segments x 4 numbers: from where to where each segment is seen, pixels.
//   options: The options; may be left out: the defaults.
// C: ptzcal_match_lines
outcome<ptzcal::match_lines_result> match_lines(ptzcal::view<const double> point_direction,
    ptzcal::view<const double> line_covariance, ptzcal::view<const double> extents,
    const ptzcal_camera &camera, ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance,
    ptzcal::view<const double> ends, const ptzcal_line_match_options &options = ptzcal::line_match_options());

// Calibrates a camera from 2D-3D measurements. The set is in use until the call returns: other
// threads may read it, but adding to it is PTZCAL_STATUS_BUSY. The calibration keeps a copy of
// both, which ptzcal_calibration_save writes.
//   set: The measurements.
//   options: The options; may be left out: the defaults.
// C: ptzcal_calibrate_camera
outcome<ptzcal::calibration> calibrate_camera(const ptzcal::correspondences &set,
    ptzcal::optional_ref<ptzcal::calibration_options> options = {});

// Radial alignment (Tsai 1987) with the division model: a camera with a radial lens in two linear
// steps, from at least 7 measurements. Its lambda is within about a fifth of the best possible
// accuracy, and it works without distortion too.
//   set: The measurements, free of outliers; not in one plane.
//   centre: 2 numbers: the centre of distortion, pixels; may be left out: the image's centre.
// C: ptzcal_radial_alignment
outcome<ptzcal::camera> radial_alignment(const ptzcal::correspondences &set,
    ptzcal::view<const double> centre = {});

// The direct linear transform with the division model as a generalised eigenproblem (Fitzgibbon
// 2001), from at least 6 measurements. The weaker method: lambda is off by about sigma^2 / lambda
// however many measurements there are, and a lens without distortion is refused or answered with a
// lambda that means nothing. Use ptzcal_radial_alignment.
//   set: The measurements, free of outliers; their own errors in space are not used.
//   centre: 2 numbers: the centre of distortion, pixels; may be left out: the image's centre.
// C: ptzcal_division_eigenproblem
outcome<ptzcal::camera> division_eigenproblem(const ptzcal::correspondences &set,
    ptzcal::view<const double> centre = {});

// Calibrates a camera from views of boards. With a lens that the options keep
// (ptzcal_calibration_options_set_lens) only the boards' poses are found. One view is enough when
// it is tilted; the principal point is then expected near the image's centre.
//   boards: The views.
//   options: The options; may be left out: the defaults.
// C: ptzcal_calibrate_from_boards
outcome<ptzcal::board_calibration> calibrate_from_boards(const ptzcal::boards &boards,
    ptzcal::optional_ref<ptzcal::calibration_options> options = {});

// Calibrates the laser's line. The lens comes from the same corners; or it is known exactly
// (ptzcal_calibration_options_set_lens); or it was measured before, from other images, and its
// covariance is believed. Spots that disagree with most others are set aside.
//   boards: The views, with the spots of two or more.
//   lens: The lens that was measured before; may be left out. A calibration from these same views
//   would count them twice.
//   options: The options; may be left out: the defaults.
// C: ptzcal_calibrate_laser_line
outcome<ptzcal::laser_calibration> calibrate_laser_line(const ptzcal::boards &boards,
    ptzcal::optional_ref<ptzcal::calibration> lens = {},
    ptzcal::optional_ref<ptzcal::calibration_options> options = {});

// Estimates the pose of station b in station a's frame from the roof edges that both measured.
//   station_a: The first station's planes and edges.
//   station_b: The second station's: the same edges in the same order.
//   options: The options; may be left out: the defaults.
// C: ptzcal_estimate_pose_roof_edges
outcome<ptzcal::pose_estimate> estimate_pose_roof_edges(const ptzcal::roof_edges &station_a,
    const ptzcal::roof_edges &station_b, ptzcal::optional_ref<ptzcal::pose_options> options = {});

// Finds the pose between two stations from the planes that both saw. Any number of other planes,
// and of parallel ones, may be among them.
//   station_a: The first station's planes.
//   station_b: The second station's, in any order.
//   options: The options; may be left out: the defaults.
// C: ptzcal_register_stations
outcome<ptzcal::registration> register_stations(const ptzcal::planes &station_a,
    const ptzcal::planes &station_b, const ptzcal_station_options &options = ptzcal::station_options());

// The pose between two stations from planes that are known to be the same.
//   station_a: The first station's planes.
//   station_b: The second station's.
//   pairs: n x 2 numbers: a plane of station a, and the same one of station b.
// C: ptzcal_register_matched_planes
outcome<ptzcal::registration> register_matched_planes(const ptzcal::planes &station_a,
    const ptzcal::planes &station_b, ptzcal::view<const std::uint32_t> pairs);

// Turns a head over its range and learns which angles its numbers are. It takes some minutes. Zoom
// stays as it is: the camera must be the lens's at this zoom. The head is stopped on every way out
// that is an error.
//   head: The head's options: the head, and its camera's frames.
//   camera: The lens of the camera on the head; its pose does not matter.
//   options: How; may be left out: the defaults.
//   progress: Hears of each picture; may be left out.
//   token: Stops the work from another thread; may be left out.
// C: ptzcal_learn_angles
outcome<ptzcal::angle_map> learn_angles(const ptzcal::head_options &head, const ptzcal_camera &camera,
    const ptzcal_angle_learning_options &options = ptzcal::angle_learning_options(),
    const ptzcal::progress_callback &progress = {}, ptzcal::optional_ref<ptzcal::cancel> token = {});

// Finds out what a device is and does. It takes some minutes at most. The head stays within a part
// of its range about where it stands (unless the limits are asked for) and comes back; it is
// stopped on every way out that is an error.
//   head: The head's options: the head, and where they are set its camera's frames and its laser.
//   camera: Lens of the camera on the head, for angles instead of pixels; may be left out.
//   options: How; may be left out: the defaults.
//   token: Stops the work from another thread; may be left out.
// C: ptzcal_probe
outcome<ptzcal::probe_report> probe(const ptzcal::head_options &head,
    ptzcal::optional_ref<ptzcal_camera> camera = {},
    const ptzcal_probe_options &options = ptzcal::probe_options(),
    ptzcal::optional_ref<ptzcal::cancel> token = {});

// Compares the shots of a scan with those fired again. Shots of the earlier scan that were not seen
// by both cameras do not count: only shots at the readings of the later scan are compared.
//   model: The rig.
//   calibration: The fixed camera as it was, in the rig's frame.
//   before: The earlier scan.
//   again: The shots fired again.
//   camera: The fixed camera's number in both.
//   options: The options; may be left out: the defaults.
// C: ptzcal_health_check
outcome<ptzcal::health_report> health_check(const ptzcal_rig_model &model,
    const ptzcal::calibration &calibration, const ptzcal::scan &before, const ptzcal::scan &again,
    std::uint32_t camera, const ptzcal_health_options &options = ptzcal::health_options());

// The same from spots that the host measured itself, at the same readings before and now, without a
// rig and without scans.
//   model: The rig.
//   calibration: The fixed camera as it was, in the rig's frame.
//   readings: 2 n numbers: pan and tilt of each shot, the device's readings, radians.
//   spots: 20 n numbers: for each shot the spot in the head camera and in the fixed one before,
//   then in the head camera and in the fixed one now; of each u, v, pixels, and its covariance xx,
//   xy, yy, px^2, positive definite.
//   seen: 2 n bytes: was the spot of each shot seen now in the head camera, in the fixed one? 0:
//   no, and its numbers do not matter, but for being finite; may be left out: all were seen.
//   options: The options; may be left out: the defaults.
// C: ptzcal_health_check_spots
outcome<ptzcal::health_report> health_check_spots(const ptzcal_rig_model &model,
    const ptzcal::calibration &calibration, ptzcal::view<const double> readings,
    ptzcal::view<const double> spots, ptzcal::view<const std::uint8_t> seen = {},
    const ptzcal_health_options &options = ptzcal::health_options());

// Given what is scanned, where to shoot next so that the fixed camera's position becomes surer.
// Depths at the candidates are predicted from the scanned ones, and so is whether the fixed camera
// sees them. With a target the first shot may be a look at a place of which little is known,
// expected to save several shots later. Asked after every shot, with the target, it needs fewest.
//   site: The site; its camera is the best estimate so far. Surroundings are not used.
//   scanned: n shots of 4 numbers: pan and tilt as read (radians), measured depth along the head's
//   axis (metres), 1 when the fixed camera saw the spot, else 0.
//   candidates: Positions to choose from, 100,000 at most. Each is taken once before its depth is
//   known; one that the fixed camera saw may be shot again and again.
//   head_sigma: Noise of a spot in the head camera, px.
//   fixed_sigma: Noise of a spot in the fixed camera, px.
//   target: Stops where the position's expected root mean square error is below, metres; 0: never.
//   count: Most shots to choose, at least 1.
// C: ptzcal_next_shots
outcome<ptzcal::next_shots_result> next_shots(const ptzcal::site &site, ptzcal::view<const double> scanned,
    const ptzcal_region &candidates, double head_sigma, double fixed_sigma, double target,
    std::uint32_t count);

// The ellipse about a Gaussian's mean that holds it with a probability: of a pixel, or of pan and
// tilt.
//   covariance: 3 numbers: xx, xy, yy, positive semi-definite.
//   probability: Between 0 and 1.
// C: ptzcal_ellipse
outcome<ptzcal::ellipse_result> ellipse(ptzcal::view<const double> covariance, double probability);

// Reads what a calibration was made from, out of a file of ptzcal_calibration_save. With the same
// version of the library on the same kind of machine ptzcal_calibrate_camera makes the same
// calibration of it, to the last bit.
//   path: The file.
// C: ptzcal_calibration_load_inputs
outcome<ptzcal::calibration_load_inputs_result> calibration_load_inputs(ptzcal::c_string path);

inline std::string version()
{
  return ptzcal_version();
}

inline std::uint32_t abi_version()
{
  return ptzcal_abi_version();
}

inline std::string status_name(ptzcal::status status)
{
  return ptzcal_status_name(status);
}

inline outcome<ptzcal::cancel> cancel::make()
{
  detail::call call_;
  ptzcal_cancel *token_ = nullptr;
  const auto code_ = ptzcal_cancel_new(&token_, call_.error());
  return call_.finish(code_, ptzcal::cancel(token_));
}

inline outcome<void> cancel::request() const
{
  detail::call call_;
  const auto code_ = ptzcal_cancel_request(get());
  return call_.finish(code_);
}

inline outcome<void> cancel::reset() const
{
  detail::call call_;
  const auto code_ = ptzcal_cancel_reset(get());
  return call_.finish(code_);
}

inline bool cancel::is_requested() const
{
  return ptzcal_cancel_is_requested(get()) != 0;
}

inline outcome<ptzcal::picture> picture::read(ptzcal::c_string path)
{
  detail::call call_;
  ptzcal_picture *picture_ = nullptr;
  const auto code_ = ptzcal_picture_read(path.get(), &picture_, call_.error());
  return call_.finish(code_, ptzcal::picture(picture_));
}

inline outcome<ptzcal::picture> picture::make(const ptzcal_image &image)
{
  detail::call call_;
  ptzcal_picture *picture_ = nullptr;
  const auto code_ = ptzcal_picture_new(&image, &picture_, call_.error());
  return call_.finish(code_, ptzcal::picture(picture_));
}

inline outcome<ptzcal::picture> picture::beside(const ptzcal_image &left, const ptzcal_image &right)
{
  detail::call call_;
  ptzcal_picture *picture_ = nullptr;
  const auto code_ = ptzcal_picture_beside(&left, &right, &picture_, call_.error());
  return call_.finish(code_, ptzcal::picture(picture_));
}

inline outcome<ptzcal::image> picture::image() const
{
  detail::call call_;
  ptzcal::image image_;
  const auto code_ = ptzcal_picture_image(get(), &image_, call_.error());
  return call_.finish(code_, std::move(image_));
}

inline outcome<void> picture::save(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_picture_save(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> picture::dim(double light)
{
  detail::call call_;
  const auto code_ = ptzcal_picture_dim(get(), light, call_.error());
  return call_.finish(code_);
}

inline outcome<void> picture::draw_lines(ptzcal::view<const double> ends, double width, std::uint32_t colour)
{
  detail::call call_;
  const std::size_t n_ = ends.size() / 4;
  if (!(call_.rows("ends", ends.size(), n_, 4))) return call_.refuse<void>();
  const auto code_ = ptzcal_picture_draw_lines(get(), ends.data(), n_, width, colour, call_.error());
  return call_.finish(code_);
}

inline outcome<void> picture::draw_circles(ptzcal::view<const double> centres, double radius, double width,
    std::uint32_t colour)
{
  detail::call call_;
  const std::size_t n_ = centres.size() / 2;
  if (!(call_.rows("centres", centres.size(), n_, 2))) return call_.refuse<void>();
  const auto code_ = ptzcal_picture_draw_circles(get(), centres.data(), n_, radius, width, colour,
      call_.error());
  return call_.finish(code_);
}

inline outcome<void> picture::draw_board(ptzcal::view<const double> corners,
    ptzcal::view<const std::uint8_t> found, std::size_t columns, std::size_t rows)
{
  detail::call call_;
  if (!(call_.rows("corners", corners.size(), std::size_t(columns) * std::size_t(rows), 2) &&
        call_.rows_or_none("found", found.size(), std::size_t(columns) * std::size_t(rows), 1))) return call_.refuse<void>();
  const auto code_ = ptzcal_picture_draw_board(get(), corners.data(), found.data(), columns, rows,
      call_.error());
  return call_.finish(code_);
}

inline outcome<void> picture::draw_residuals(ptzcal::view<const double> uv,
    ptzcal::view<const double> residuals, ptzcal::view<const std::uint8_t> inliers, double scale)
{
  detail::call call_;
  const std::size_t n_ = uv.size() / 2;
  if (!(call_.rows("uv", uv.size(), n_, 2) &&
        call_.rows("residuals", residuals.size(), n_, 2) &&
        call_.rows_or_none("inliers", inliers.size(), n_, 1))) return call_.refuse<void>();
  const auto code_ = ptzcal_picture_draw_residuals(get(), uv.data(), residuals.data(), inliers.data(), n_,
      scale, call_.error());
  return call_.finish(code_);
}

inline outcome<void> picture::draw_matches(ptzcal::view<const double> left, ptzcal::view<const double> right,
    ptzcal::view<const std::uint8_t> kept, double offset)
{
  detail::call call_;
  const std::size_t n_ = left.size() / 2;
  if (!(call_.rows("left", left.size(), n_, 2) &&
        call_.rows("right", right.size(), n_, 2) &&
        call_.rows_or_none("kept", kept.size(), n_, 1))) return call_.refuse<void>();
  const auto code_ = ptzcal_picture_draw_matches(get(), left.data(), right.data(), kept.data(), n_, offset,
      call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::depth_map> depth_map::from_u16(ptzcal::view<const std::uint16_t> values,
    std::uint32_t width, std::uint32_t height, std::size_t stride, double metres)
{
  detail::call call_;
  if (!(call_.at_least("values", values.size(), height == 0 ? 0 : (height - std::size_t(1)) * stride + width))) return call_.refuse<ptzcal::depth_map>();
  ptzcal_depth_map *map_ = nullptr;
  const auto code_ = ptzcal_depth_map_new_u16(values.data(), width, height, stride, metres, &map_,
      call_.error());
  return call_.finish(code_, ptzcal::depth_map(map_));
}

inline outcome<ptzcal::depth_map> depth_map::from_f32(ptzcal::view<const float> values, std::uint32_t width,
    std::uint32_t height, std::size_t stride, double metres)
{
  detail::call call_;
  if (!(call_.at_least("values", values.size(), height == 0 ? 0 : (height - std::size_t(1)) * stride + width))) return call_.refuse<ptzcal::depth_map>();
  ptzcal_depth_map *map_ = nullptr;
  const auto code_ = ptzcal_depth_map_new_f32(values.data(), width, height, stride, metres, &map_,
      call_.error());
  return call_.finish(code_, ptzcal::depth_map(map_));
}

inline outcome<ptzcal::depth_map> depth_map::read(ptzcal::c_string path, double metres)
{
  detail::call call_;
  ptzcal_depth_map *map_ = nullptr;
  const auto code_ = ptzcal_depth_map_read(path.get(), metres, &map_, call_.error());
  return call_.finish(code_, ptzcal::depth_map(map_));
}

inline outcome<ptzcal::depth_map::size_result> depth_map::size() const
{
  detail::call call_;
  std::uint32_t width_ = 0;
  std::uint32_t height_ = 0;
  std::size_t known_ = 0;
  const auto code_ = ptzcal_depth_map_size(get(), &width_, &height_, &known_, call_.error());
  return call_.finish(code_, ptzcal::depth_map::size_result{std::move(width_), std::move(height_),
      std::move(known_)});
}

inline outcome<std::vector<float>> depth_map::metres() const
{
  detail::call call_;
  std::vector<float> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_depth_map_copy_metres(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<std::vector<float>> depth_map::variances() const
{
  detail::call call_;
  std::vector<float> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_depth_map_copy_variances(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<void> depth_map::save(ptzcal::c_string path, double metres) const
{
  detail::call call_;
  const auto code_ = ptzcal_depth_map_save(get(), path.get(), metres, call_.error());
  return call_.finish(code_);
}

inline outcome<std::array<double, 3>> camera::centre() const
{
  detail::call call_;
  std::array<double, 3> centre_{};
  const auto code_ = ptzcal_camera_centre(this, centre_.data(), call_.error());
  return call_.finish(code_, std::move(centre_));
}

inline outcome<std::vector<double>> camera::project(ptzcal::view<const double> xyz) const
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3))) return call_.refuse<std::vector<double>>();
  std::vector<double> uv_(n_ * 2);
  const auto code_ = ptzcal_camera_project(this, xyz.data(), n_, uv_.data(), call_.error());
  return call_.finish(code_, std::move(uv_));
}

inline outcome<std::vector<double>> camera::back_project(ptzcal::view<const double> uv) const
{
  detail::call call_;
  const std::size_t n_ = uv.size() / 2;
  if (!(call_.rows("uv", uv.size(), n_, 2))) return call_.refuse<std::vector<double>>();
  std::vector<double> directions_(n_ * 3);
  const auto code_ = ptzcal_camera_back_project(this, uv.data(), n_, directions_.data(), call_.error());
  return call_.finish(code_, std::move(directions_));
}

inline outcome<ptzcal::camera> camera::undistorted(double keep) const
{
  detail::call call_;
  ptzcal::camera ideal_;
  const auto code_ = ptzcal_camera_undistorted(this, keep, &ideal_, call_.error());
  return call_.finish(code_, std::move(ideal_));
}

inline outcome<ptzcal::undistorter> undistorter::make(const ptzcal_camera &camera, const ptzcal_camera &ideal)
{
  detail::call call_;
  ptzcal_undistorter *undistorter_ = nullptr;
  const auto code_ = ptzcal_undistorter_new(&camera, &ideal, &undistorter_, call_.error());
  return call_.finish(code_, ptzcal::undistorter(undistorter_));
}

inline outcome<ptzcal::camera> undistorter::camera() const
{
  detail::call call_;
  ptzcal::camera camera_;
  const auto code_ = ptzcal_undistorter_get_camera(get(), &camera_, call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<void> undistorter::apply(const ptzcal_image &image, ptzcal::view<std::uint8_t> pixels,
    std::ptrdiff_t stride) const
{
  detail::call call_;
  const std::size_t n_ = pixels.size() / 1;
  if (!(call_.rows("pixels", pixels.size(), n_, 1))) return call_.refuse<void>();
  const auto code_ = ptzcal_undistorter_apply(get(), &image, pixels.data(), n_, stride, call_.error());
  return call_.finish(code_);
}

inline outcome<void> undistorter::apply_region(const ptzcal_image &image, std::uint32_t x, std::uint32_t y,
    std::uint32_t width, std::uint32_t height, ptzcal::view<const std::uint8_t> border,
    ptzcal::view<std::uint8_t> pixels, std::ptrdiff_t stride) const
{
  detail::call call_;
  const std::size_t n_ = pixels.size() / 1;
  if (!(call_.rows_or_none("border", border.size(), 1, 4) &&
        call_.rows("pixels", pixels.size(), n_, 1))) return call_.refuse<void>();
  const auto code_ = ptzcal_undistorter_apply_region(get(), &image, x, y, width, height, border.data(),
      pixels.data(), n_, stride, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::camera> rig_model::head_camera(double pan, double tilt) const
{
  detail::call call_;
  ptzcal::camera camera_;
  const auto code_ = ptzcal_rig_model_head_camera(this, pan, tilt, &camera_, call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<ptzcal::rig_model::locate_result> rig_model::locate(ptzcal::view<const double> pan_tilt,
    ptzcal::view<const double> spots, ptzcal::view<const double> spot_covariance) const
{
  detail::call call_;
  const std::size_t n_ = pan_tilt.size() / 2;
  if (!(call_.rows("pan_tilt", pan_tilt.size(), n_, 2) &&
        call_.rows("spots", spots.size(), n_, 2) &&
        call_.rows_or_none("spot_covariance", spot_covariance.size(), n_, 3))) return call_.refuse<ptzcal::rig_model::locate_result>();
  std::vector<double> xyz_(n_ * 3);
  std::vector<double> covariance_(n_ * 9);
  const auto code_ = ptzcal_rig_model_locate(this, pan_tilt.data(), spots.data(), spot_covariance.data(), n_,
      xyz_.data(), covariance_.data(), call_.error());
  return call_.finish(code_, ptzcal::rig_model::locate_result{std::move(xyz_), std::move(covariance_)});
}

inline outcome<ptzcal::spot_options> spot_options::make()
{
  detail::call call_;
  ptzcal_spot_options *options_ = nullptr;
  const auto code_ = ptzcal_spot_options_new(&options_, call_.error());
  return call_.finish(code_, ptzcal::spot_options(options_));
}

inline outcome<void> spot_options::set_region(std::uint32_t x, std::uint32_t y, std::uint32_t width,
    std::uint32_t height)
{
  detail::call call_;
  const auto code_ = ptzcal_spot_options_set_region(get(), x, y, width, height, call_.error());
  return call_.finish(code_);
}

inline outcome<void> spot_options::set_band(ptzcal::view<const double> polyline, double half_width)
{
  detail::call call_;
  const std::size_t n_ = polyline.size() / 2;
  if (!(call_.rows("polyline", polyline.size(), n_, 2))) return call_.refuse<void>();
  const auto code_ = ptzcal_spot_options_set_band(get(), polyline.data(), n_, half_width, call_.error());
  return call_.finish(code_);
}

inline outcome<void> spot_options::set_colour(ptzcal::laser_colour colour)
{
  detail::call call_;
  const auto code_ = ptzcal_spot_options_set_colour(get(), colour, call_.error());
  return call_.finish(code_);
}

inline outcome<void> spot_options::set_min_signal_to_noise(double ratio)
{
  detail::call call_;
  const auto code_ = ptzcal_spot_options_set_min_signal_to_noise(get(), ratio, call_.error());
  return call_.finish(code_);
}

inline outcome<void> spot_options::set_max_area(std::uint32_t area)
{
  detail::call call_;
  const auto code_ = ptzcal_spot_options_set_max_area(get(), area, call_.error());
  return call_.finish(code_);
}

inline outcome<void> spot_options::set_ambiguity_ratio(double ratio)
{
  detail::call call_;
  const auto code_ = ptzcal_spot_options_set_ambiguity_ratio(get(), ratio, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::spot> detect_spot(const ptzcal_image &on, ptzcal::optional_ref<ptzcal_image> off,
    ptzcal::optional_ref<ptzcal::spot_options> options)
{
  detail::call call_;
  ptzcal::spot spot_;
  const auto code_ = ptzcal_detect_spot(&on, off.get(), detail::pointer(options), &spot_, call_.error());
  return call_.finish(code_, std::move(spot_));
}

inline outcome<ptzcal::spot> detect_spot_averaged(ptzcal::view<const ptzcal::image> on,
    ptzcal::view<const ptzcal::image> off, ptzcal::optional_ref<ptzcal::spot_options> options)
{
  detail::call call_;
  const std::size_t n_on_ = on.size();
  const std::size_t n_off_ = off.size();
  std::vector<const ptzcal_image *> on_;
  for (const auto &image_ : on) on_.push_back(&image_);
  std::vector<const ptzcal_image *> off_;
  for (const auto &image_ : off) off_.push_back(&image_);
  ptzcal::spot spot_;
  const auto code_ = ptzcal_detect_spot_averaged(on_.data(), n_on_, off_.data(), n_off_,
      detail::pointer(options), &spot_, call_.error());
  return call_.finish(code_, std::move(spot_));
}

inline outcome<ptzcal::spot_detector> spot_detector::make(ptzcal::optional_ref<ptzcal::spot_options> options)
{
  detail::call call_;
  ptzcal_spot_detector *detector_ = nullptr;
  const auto code_ = ptzcal_spot_detector_new(detail::pointer(options), &detector_, call_.error());
  return call_.finish(code_, ptzcal::spot_detector(detector_));
}

inline outcome<ptzcal::spot> spot_detector::detect(ptzcal::view<const ptzcal::image> on,
    ptzcal::view<const ptzcal::image> off)
{
  detail::call call_;
  const std::size_t n_on_ = on.size();
  const std::size_t n_off_ = off.size();
  std::vector<const ptzcal_image *> on_;
  for (const auto &image_ : on) on_.push_back(&image_);
  std::vector<const ptzcal_image *> off_;
  for (const auto &image_ : off) off_.push_back(&image_);
  ptzcal::spot spot_;
  const auto code_ = ptzcal_spot_detector_detect(get(), on_.data(), n_on_, off_.data(), n_off_, &spot_,
      call_.error());
  return call_.finish(code_, std::move(spot_));
}

inline outcome<ptzcal::detect_chessboard_result> detect_chessboard(const ptzcal_image &image,
    const ptzcal_chessboard_options &options)
{
  detail::call call_;
  ptzcal::chessboard board_;
  std::vector<double> corners_;
  std::vector<double> covariance_;
  std::vector<std::uint8_t> found_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(4096, needed_, [&](std::size_t capacity_) {
    corners_.resize(capacity_ * 2);
    covariance_.resize(capacity_ * 3);
    found_.resize(capacity_);
    return ptzcal_detect_chessboard(&image, &options, &board_, corners_.data(), covariance_.data(), found_.data(),
    capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    corners_.resize(needed_ * 2);
    covariance_.resize(needed_ * 3);
    found_.resize(needed_);
  }
  return call_.finish(code_, ptzcal::detect_chessboard_result{std::move(board_), std::move(corners_),
      std::move(covariance_), std::move(found_)});
}

inline outcome<ptzcal::sift_features> detect_sift(const ptzcal_image &image,
    const ptzcal_sift_options &options)
{
  detail::call call_;
  ptzcal_sift_features *features_ = nullptr;
  const auto code_ = ptzcal_detect_sift(&image, &options, &features_, call_.error());
  return call_.finish(code_, ptzcal::sift_features(features_));
}

inline outcome<ptzcal::sift_features> sift_features::make(ptzcal::view<const double> keypoints,
    ptzcal::view<const std::uint8_t> descriptors)
{
  detail::call call_;
  const std::size_t n_ = keypoints.size() / 9;
  if (!(call_.rows("keypoints", keypoints.size(), n_, 9) &&
        call_.rows("descriptors", descriptors.size(), n_, 128))) return call_.refuse<ptzcal::sift_features>();
  ptzcal_sift_features *features_ = nullptr;
  const auto code_ = ptzcal_sift_features_new(keypoints.data(), descriptors.data(), n_, &features_,
      call_.error());
  return call_.finish(code_, ptzcal::sift_features(features_));
}

inline outcome<std::size_t> sift_features::count() const
{
  detail::call call_;
  std::size_t count_ = 0;
  const auto code_ = ptzcal_sift_features_count(get(), &count_, call_.error());
  return call_.finish(code_, std::move(count_));
}

inline outcome<std::vector<double>> sift_features::keypoints() const
{
  detail::call call_;
  std::vector<double> keypoints_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    keypoints_.resize(capacity_);
    return ptzcal_sift_features_copy_keypoints(get(), keypoints_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    keypoints_.resize(needed_);
  }
  return call_.finish(code_, std::move(keypoints_));
}

inline outcome<std::vector<std::uint8_t>> sift_features::descriptors() const
{
  detail::call call_;
  std::vector<std::uint8_t> descriptors_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    descriptors_.resize(capacity_);
    return ptzcal_sift_features_copy_descriptors(get(), descriptors_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    descriptors_.resize(needed_);
  }
  return call_.finish(code_, std::move(descriptors_));
}

inline outcome<ptzcal::match_sift_result> match_sift(const ptzcal::sift_features &a,
    const ptzcal::sift_features &b, const ptzcal_sift_match_options &options)
{
  detail::call call_;
  std::vector<std::uint32_t> pairs_;
  std::vector<double> distances_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(4096, needed_, [&](std::size_t capacity_) {
    pairs_.resize(capacity_ * 2);
    distances_.resize(capacity_ * 2);
    return ptzcal_match_sift(a.get(), b.get(), &options, pairs_.data(), distances_.data(), capacity_, &needed_,
    call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    pairs_.resize(needed_ * 2);
    distances_.resize(needed_ * 2);
  }
  return call_.finish(code_, ptzcal::match_sift_result{std::move(pairs_), std::move(distances_)});
}

inline outcome<std::vector<double>> detect_edges(const ptzcal_image &image, double sigma, double low,
    double high)
{
  detail::call call_;
  std::vector<double> edges_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(4096, needed_, [&](std::size_t capacity_) {
    edges_.resize(capacity_ * 5);
    return ptzcal_detect_edges(&image, sigma, low, high, edges_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    edges_.resize(needed_ * 5);
  }
  return call_.finish(code_, std::move(edges_));
}

inline outcome<ptzcal::detect_line_segments_result> detect_line_segments(const ptzcal_image &image,
    const ptzcal_line_options &options)
{
  detail::call call_;
  std::vector<double> uv_;
  std::vector<double> uv_covariance_;
  std::vector<double> ends_;
  std::vector<double> details_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(4096, needed_, [&](std::size_t capacity_) {
    uv_.resize(capacity_ * 4);
    uv_covariance_.resize(capacity_ * 6);
    ends_.resize(capacity_ * 4);
    details_.resize(capacity_ * 3);
    return ptzcal_detect_line_segments(&image, &options, uv_.data(), uv_covariance_.data(), ends_.data(),
    details_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    uv_.resize(needed_ * 4);
    uv_covariance_.resize(needed_ * 6);
    ends_.resize(needed_ * 4);
    details_.resize(needed_ * 3);
  }
  return call_.finish(code_, ptzcal::detect_line_segments_result{std::move(uv_), std::move(uv_covariance_),
      std::move(ends_), std::move(details_)});
}

inline outcome<ptzcal::fit_line_3d_result> fit_line_3d(ptzcal::view<const double> xyz,
    ptzcal::view<const double> xyz_covariance, const ptzcal_line_fit_options &options)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3) &&
        call_.rows_or_none("xyz_covariance", xyz_covariance.size(), n_, 9))) return call_.refuse<ptzcal::fit_line_3d_result>();
  std::array<double, 6> point_direction_{};
  std::array<double, 36> line_covariance_{};
  std::array<double, 2> extent_{};
  std::vector<std::uint8_t> inliers_(n_);
  double noise_factor_ = 0;
  const auto code_ = ptzcal_fit_line_3d(xyz.data(), xyz_covariance.data(), n_, &options,
      point_direction_.data(), line_covariance_.data(), extent_.data(), inliers_.data(), &noise_factor_,
      call_.error());
  return call_.finish(code_, ptzcal::fit_line_3d_result{std::move(point_direction_),
      std::move(line_covariance_), std::move(extent_), std::move(inliers_), std::move(noise_factor_)});
}

inline outcome<ptzcal::lift_line_segments_result> lift_line_segments(ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance, ptzcal::view<const double> ends, const ptzcal_camera &camera,
    const ptzcal::depth_map &map, double inverse_depth_sigma, double depth_sigma)
{
  detail::call call_;
  const std::size_t n_ = uv.size() / 4;
  if (!(call_.rows("uv", uv.size(), n_, 4) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_, 6) &&
        call_.rows("ends", ends.size(), n_, 4))) return call_.refuse<ptzcal::lift_line_segments_result>();
  std::vector<double> point_direction_(n_ * 6);
  std::vector<double> line_covariance_(n_ * 36);
  std::vector<double> extents_(n_ * 2);
  std::vector<std::uint8_t> found_(n_);
  const auto code_ = ptzcal_lift_line_segments(uv.data(), uv_covariance.data(), ends.data(), n_, &camera,
      map.get(), inverse_depth_sigma, depth_sigma, point_direction_.data(), line_covariance_.data(),
      extents_.data(), found_.data(), call_.error());
  return call_.finish(code_, ptzcal::lift_line_segments_result{std::move(point_direction_),
      std::move(line_covariance_), std::move(extents_), std::move(found_)});
}

inline outcome<ptzcal::match_lines_result> match_lines(ptzcal::view<const double> point_direction,
    ptzcal::view<const double> line_covariance, ptzcal::view<const double> extents,
    const ptzcal_camera &camera, ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance,
    ptzcal::view<const double> ends, const ptzcal_line_match_options &options)
{
  detail::call call_;
  const std::size_t n_lines_ = point_direction.size() / 6;
  const std::size_t n_segments_ = uv.size() / 4;
  if (!(call_.rows("point_direction", point_direction.size(), n_lines_, 6) &&
        call_.rows_or_none("line_covariance", line_covariance.size(), n_lines_, 36) &&
        call_.rows("extents", extents.size(), n_lines_, 2) &&
        call_.rows("uv", uv.size(), n_segments_, 4) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_segments_, 6) &&
        call_.rows("ends", ends.size(), n_segments_, 4))) return call_.refuse<ptzcal::match_lines_result>();
  std::vector<std::uint32_t> pairs_;
  std::vector<double> residuals_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(4096, needed_, [&](std::size_t capacity_) {
    pairs_.resize(capacity_ * 2);
    residuals_.resize(capacity_ * 2);
    return ptzcal_match_lines(point_direction.data(), line_covariance.data(), extents.data(), n_lines_, &camera,
    uv.data(), uv_covariance.data(), ends.data(), n_segments_, &options, pairs_.data(), residuals_.data(),
    capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    pairs_.resize(needed_ * 2);
    residuals_.resize(needed_ * 2);
  }
  return call_.finish(code_, ptzcal::match_lines_result{std::move(pairs_), std::move(residuals_)});
}

inline outcome<ptzcal::correspondences> correspondences::make(std::uint32_t image_width,
    std::uint32_t image_height)
{
  detail::call call_;
  ptzcal_correspondences *set_ = nullptr;
  const auto code_ = ptzcal_correspondences_new(image_width, image_height, &set_, call_.error());
  return call_.finish(code_, ptzcal::correspondences(set_));
}

inline outcome<void> correspondences::add_points(ptzcal::view<const double> xyz,
    ptzcal::view<const double> uv)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3) &&
        call_.rows("uv", uv.size(), n_, 2))) return call_.refuse<void>();
  const auto code_ = ptzcal_correspondences_add_points(get(), xyz.data(), uv.data(), n_, call_.error());
  return call_.finish(code_);
}

inline outcome<void> correspondences::add_points_weighted(ptzcal::view<const double> xyz,
    ptzcal::view<const double> xyz_covariance, ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3) &&
        call_.rows_or_none("xyz_covariance", xyz_covariance.size(), n_, 9) &&
        call_.rows("uv", uv.size(), n_, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_, 3))) return call_.refuse<void>();
  const auto code_ = ptzcal_correspondences_add_points_weighted(get(), xyz.data(), xyz_covariance.data(),
      uv.data(), uv_covariance.data(), n_, call_.error());
  return call_.finish(code_);
}

inline outcome<void> correspondences::add_laser_shots(const ptzcal_rig_model &model,
    ptzcal::view<const double> pan_tilt, ptzcal::view<const double> spots,
    ptzcal::view<const double> spot_covariance, ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance)
{
  detail::call call_;
  const std::size_t n_ = pan_tilt.size() / 2;
  if (!(call_.rows("pan_tilt", pan_tilt.size(), n_, 2) &&
        call_.rows("spots", spots.size(), n_, 2) &&
        call_.rows_or_none("spot_covariance", spot_covariance.size(), n_, 3) &&
        call_.rows("uv", uv.size(), n_, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_, 3))) return call_.refuse<void>();
  const auto code_ = ptzcal_correspondences_add_laser_shots(get(), &model, pan_tilt.data(), spots.data(),
      spot_covariance.data(), uv.data(), uv_covariance.data(), n_, call_.error());
  return call_.finish(code_);
}

inline outcome<void> correspondences::add_lines(ptzcal::view<const double> xyz,
    ptzcal::view<const double> xyz_covariance, ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 6;
  if (!(call_.rows("xyz", xyz.size(), n_, 6) &&
        call_.rows_or_none("xyz_covariance", xyz_covariance.size(), n_, 18) &&
        call_.rows("uv", uv.size(), n_, 4) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_, 6))) return call_.refuse<void>();
  const auto code_ = ptzcal_correspondences_add_lines(get(), xyz.data(), xyz_covariance.data(), uv.data(),
      uv_covariance.data(), n_, call_.error());
  return call_.finish(code_);
}

inline outcome<void> correspondences::add_directed_lines(ptzcal::view<const double> point_direction,
    ptzcal::view<const double> line_covariance, ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance)
{
  detail::call call_;
  const std::size_t n_ = point_direction.size() / 6;
  if (!(call_.rows("point_direction", point_direction.size(), n_, 6) &&
        call_.rows_or_none("line_covariance", line_covariance.size(), n_, 36) &&
        call_.rows("uv", uv.size(), n_, 4) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_, 6))) return call_.refuse<void>();
  const auto code_ = ptzcal_correspondences_add_directed_lines(get(), point_direction.data(),
      line_covariance.data(), uv.data(), uv_covariance.data(), n_, call_.error());
  return call_.finish(code_);
}

inline outcome<std::size_t> correspondences::count() const
{
  detail::call call_;
  std::size_t count_ = 0;
  const auto code_ = ptzcal_correspondences_count(get(), &count_, call_.error());
  return call_.finish(code_, std::move(count_));
}

inline outcome<ptzcal::calibration_options> calibration_options::make()
{
  detail::call call_;
  ptzcal_calibration_options *options_ = nullptr;
  const auto code_ = ptzcal_calibration_options_new(&options_, call_.error());
  return call_.finish(code_, ptzcal::calibration_options(options_));
}

inline outcome<void> calibration_options::set_distortion(ptzcal::distortion_model model)
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_options_set_distortion(get(), model, call_.error());
  return call_.finish(code_);
}

inline outcome<void> calibration_options::set_lens(ptzcal::optional_ref<ptzcal_camera> camera)
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_options_set_lens(get(), camera.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> calibration_options::set_skew_sigma(double sigma)
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_options_set_skew_sigma(get(), sigma, call_.error());
  return call_.finish(code_);
}

inline outcome<void> calibration_options::set_aspect_sigma(double sigma)
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_options_set_aspect_sigma(get(), sigma, call_.error());
  return call_.finish(code_);
}

inline outcome<void> calibration_options::set_pixel_sigma(double sigma)
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_options_set_pixel_sigma(get(), sigma, call_.error());
  return call_.finish(code_);
}

inline outcome<void> calibration_options::set_robust(bool robust)
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_options_set_robust(get(), robust, call_.error());
  return call_.finish(code_);
}

inline outcome<void> calibration_options::set_seed(std::uint64_t seed)
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_options_set_seed(get(), seed, call_.error());
  return call_.finish(code_);
}

inline outcome<void> calibration_options::set_max_focal_deviation(double relative)
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_options_set_max_focal_deviation(get(), relative, call_.error());
  return call_.finish(code_);
}

inline outcome<void> calibration_options::set_max_iterations(std::uint32_t iterations)
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_options_set_max_iterations(get(), iterations, call_.error());
  return call_.finish(code_);
}

inline outcome<void> calibration_options::set_cancel(ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_options_set_cancel(get(), detail::pointer(token), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::calibration> calibrate_camera(const ptzcal::correspondences &set,
    ptzcal::optional_ref<ptzcal::calibration_options> options)
{
  detail::call call_;
  ptzcal_calibration *result_ = nullptr;
  const auto code_ = ptzcal_calibrate_camera(set.get(), detail::pointer(options), &result_, call_.error());
  return call_.finish(code_, ptzcal::calibration(result_));
}

inline outcome<ptzcal::camera> calibration::camera() const
{
  detail::call call_;
  ptzcal::camera camera_;
  const auto code_ = ptzcal_calibration_get_camera(get(), &camera_, call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<ptzcal::calibration_summary> calibration::summary() const
{
  detail::call call_;
  ptzcal::calibration_summary summary_;
  const auto code_ = ptzcal_calibration_get_summary(get(), &summary_, call_.error());
  return call_.finish(code_, std::move(summary_));
}

inline outcome<std::vector<double>> calibration::covariance() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_calibration_copy_covariance(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<std::vector<double>> calibration::residuals() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_calibration_copy_residuals(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<std::vector<std::uint8_t>> calibration::inliers() const
{
  detail::call call_;
  std::vector<std::uint8_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_calibration_copy_inliers(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline std::string calibration::warning(std::size_t index) const
{
  return ptzcal_calibration_warning(get(), index);
}

inline std::string calibration::weakest() const
{
  return ptzcal_calibration_weakest(get());
}

inline outcome<ptzcal::calibration::project_result> calibration::project(ptzcal::view<const double> xyz,
    ptzcal::view<const double> xyz_covariance) const
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3) &&
        call_.rows_or_none("xyz_covariance", xyz_covariance.size(), n_, 9))) return call_.refuse<ptzcal::calibration::project_result>();
  std::vector<double> uv_(n_ * 2);
  std::vector<double> uv_covariance_(n_ * 3);
  const auto code_ = ptzcal_calibration_project(get(), xyz.data(), xyz_covariance.data(), n_, uv_.data(),
      uv_covariance_.data(), call_.error());
  return call_.finish(code_, ptzcal::calibration::project_result{std::move(uv_), std::move(uv_covariance_)});
}

inline outcome<ptzcal::calibration::back_project_result> calibration::back_project(ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance) const
{
  detail::call call_;
  const std::size_t n_ = uv.size() / 2;
  if (!(call_.rows("uv", uv.size(), n_, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_, 3))) return call_.refuse<ptzcal::calibration::back_project_result>();
  std::vector<double> directions_(n_ * 3);
  std::vector<double> ray_covariance_(n_ * 36);
  const auto code_ = ptzcal_calibration_back_project(get(), uv.data(), uv_covariance.data(), n_,
      directions_.data(), ray_covariance_.data(), call_.error());
  return call_.finish(code_, ptzcal::calibration::back_project_result{std::move(directions_),
      std::move(ray_covariance_)});
}

inline outcome<ptzcal::calibration::back_project_to_plane_result> calibration::back_project_to_plane(ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance, ptzcal::view<const double> normal, double distance) const
{
  detail::call call_;
  const std::size_t n_ = uv.size() / 2;
  if (!(call_.rows("uv", uv.size(), n_, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_, 3) &&
        call_.rows("normal", normal.size(), 1, 3))) return call_.refuse<ptzcal::calibration::back_project_to_plane_result>();
  std::vector<double> xyz_(n_ * 3);
  std::vector<double> xyz_covariance_(n_ * 9);
  const auto code_ = ptzcal_calibration_back_project_to_plane(get(), uv.data(), uv_covariance.data(), n_,
      normal.data(), distance, xyz_.data(), xyz_covariance_.data(), call_.error());
  return call_.finish(code_, ptzcal::calibration::back_project_to_plane_result{std::move(xyz_),
      std::move(xyz_covariance_)});
}

inline outcome<ptzcal::camera> radial_alignment(const ptzcal::correspondences &set,
    ptzcal::view<const double> centre)
{
  detail::call call_;
  if (!(call_.rows_or_none("centre", centre.size(), 1, 2))) return call_.refuse<ptzcal::camera>();
  ptzcal::camera camera_;
  const auto code_ = ptzcal_radial_alignment(set.get(), centre.data(), &camera_, call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<ptzcal::camera> division_eigenproblem(const ptzcal::correspondences &set,
    ptzcal::view<const double> centre)
{
  detail::call call_;
  if (!(call_.rows_or_none("centre", centre.size(), 1, 2))) return call_.refuse<ptzcal::camera>();
  ptzcal::camera camera_;
  const auto code_ = ptzcal_division_eigenproblem(set.get(), centre.data(), &camera_, call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<ptzcal::boards> boards::make(std::uint32_t image_width, std::uint32_t image_height)
{
  detail::call call_;
  ptzcal_boards *boards_ = nullptr;
  const auto code_ = ptzcal_boards_new(image_width, image_height, &boards_, call_.error());
  return call_.finish(code_, ptzcal::boards(boards_));
}

inline outcome<void> boards::add_view(ptzcal::view<const double> board_xy, ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance)
{
  detail::call call_;
  const std::size_t n_ = board_xy.size() / 2;
  if (!(call_.rows("board_xy", board_xy.size(), n_, 2) &&
        call_.rows("uv", uv.size(), n_, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_, 3))) return call_.refuse<void>();
  const auto code_ = ptzcal_boards_add_view(get(), board_xy.data(), uv.data(), uv_covariance.data(), n_,
      call_.error());
  return call_.finish(code_);
}

inline outcome<void> boards::set_spot(std::uint32_t view, ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance)
{
  detail::call call_;
  if (!(call_.rows("uv", uv.size(), 1, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), 1, 3))) return call_.refuse<void>();
  const auto code_ = ptzcal_boards_set_spot(get(), view, uv.data(), uv_covariance.data(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> boards::set_bending(double sigma)
{
  detail::call call_;
  const auto code_ = ptzcal_boards_set_bending(get(), sigma, call_.error());
  return call_.finish(code_);
}

inline outcome<std::size_t> boards::count() const
{
  detail::call call_;
  std::size_t count_ = 0;
  const auto code_ = ptzcal_boards_count(get(), &count_, call_.error());
  return call_.finish(code_, std::move(count_));
}

inline outcome<ptzcal::board_calibration> calibrate_from_boards(const ptzcal::boards &boards,
    ptzcal::optional_ref<ptzcal::calibration_options> options)
{
  detail::call call_;
  ptzcal_board_calibration *result_ = nullptr;
  const auto code_ = ptzcal_calibrate_from_boards(boards.get(), detail::pointer(options), &result_,
      call_.error());
  return call_.finish(code_, ptzcal::board_calibration(result_));
}

inline outcome<ptzcal::calibration> board_calibration::camera() const
{
  detail::call call_;
  ptzcal_calibration *camera_ = nullptr;
  const auto code_ = ptzcal_board_calibration_copy_camera(get(), &camera_, call_.error());
  return call_.finish(code_, ptzcal::calibration(camera_));
}

inline outcome<std::size_t> board_calibration::count() const
{
  detail::call call_;
  std::size_t count_ = 0;
  const auto code_ = ptzcal_board_calibration_count(get(), &count_, call_.error());
  return call_.finish(code_, std::move(count_));
}

inline outcome<ptzcal::board_view> board_calibration::view(std::uint32_t number) const
{
  detail::call call_;
  ptzcal::board_view view_;
  const auto code_ = ptzcal_board_calibration_get_view(get(), number, &view_, call_.error());
  return call_.finish(code_, std::move(view_));
}

inline outcome<std::array<double, 3>> board_calibration::bending() const
{
  detail::call call_;
  std::array<double, 3> bending_{};
  const auto code_ = ptzcal_board_calibration_get_bending(get(), bending_.data(), call_.error());
  return call_.finish(code_, std::move(bending_));
}

inline std::string board_calibration::advice() const
{
  return ptzcal_board_calibration_advice(get());
}

inline outcome<ptzcal::laser_calibration> calibrate_laser_line(const ptzcal::boards &boards,
    ptzcal::optional_ref<ptzcal::calibration> lens, ptzcal::optional_ref<ptzcal::calibration_options> options)
{
  detail::call call_;
  ptzcal_laser_calibration *laser_ = nullptr;
  const auto code_ = ptzcal_calibrate_laser_line(boards.get(), detail::pointer(lens),
      detail::pointer(options), &laser_, call_.error());
  return call_.finish(code_, ptzcal::laser_calibration(laser_));
}

inline outcome<ptzcal::laser_line> laser_calibration::line() const
{
  detail::call call_;
  ptzcal::laser_line line_;
  const auto code_ = ptzcal_laser_calibration_get_line(get(), &line_, call_.error());
  return call_.finish(code_, std::move(line_));
}

inline outcome<ptzcal::rig_model> laser_calibration::rig_model() const
{
  detail::call call_;
  ptzcal::rig_model model_;
  const auto code_ = ptzcal_laser_calibration_get_rig_model(get(), &model_, call_.error());
  return call_.finish(code_, std::move(model_));
}

inline outcome<ptzcal::board_calibration> laser_calibration::boards() const
{
  detail::call call_;
  ptzcal_board_calibration *boards_ = nullptr;
  const auto code_ = ptzcal_laser_calibration_copy_boards(get(), &boards_, call_.error());
  return call_.finish(code_, ptzcal::board_calibration(boards_));
}

inline outcome<std::vector<double>> laser_calibration::residuals() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_laser_calibration_copy_residuals(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<std::vector<std::uint8_t>> laser_calibration::inliers() const
{
  detail::call call_;
  std::vector<std::uint8_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_laser_calibration_copy_inliers(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::zoom_curve::rig_model_result> zoom_curve::rig_model(double zoom) const
{
  detail::call call_;
  ptzcal::rig_model model_;
  std::array<double, 49> covariance_{};
  const auto code_ = ptzcal_zoom_curve_get_rig_model(get(), zoom, &model_, covariance_.data(), call_.error());
  return call_.finish(code_, ptzcal::zoom_curve::rig_model_result{std::move(model_), std::move(covariance_)});
}

inline outcome<ptzcal::zoom_curve::range_result> zoom_curve::range() const
{
  detail::call call_;
  double low_ = 0;
  double high_ = 0;
  const auto code_ = ptzcal_zoom_curve_get_range(get(), &low_, &high_, call_.error());
  return call_.finish(code_, ptzcal::zoom_curve::range_result{std::move(low_), std::move(high_)});
}

inline outcome<void> zoom_curve::save(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_zoom_curve_save(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::zoom_curve> zoom_curve::load(ptzcal::c_string path)
{
  detail::call call_;
  ptzcal_zoom_curve *curve_ = nullptr;
  const auto code_ = ptzcal_zoom_curve_load(path.get(), &curve_, call_.error());
  return call_.finish(code_, ptzcal::zoom_curve(curve_));
}

inline outcome<ptzcal::rig_calibrated::count_result> rig_calibrated::count() const
{
  detail::call call_;
  std::uint32_t positions_ = 0;
  std::uint32_t views_ = 0;
  const auto code_ = ptzcal_rig_calibrated_count(get(), &positions_, &views_, call_.error());
  return call_.finish(code_, ptzcal::rig_calibrated::count_result{std::move(positions_), std::move(views_)});
}

inline outcome<ptzcal::zoom_position> rig_calibrated::position(std::uint32_t index) const
{
  detail::call call_;
  ptzcal::zoom_position position_;
  const auto code_ = ptzcal_rig_calibrated_get_position(get(), index, &position_, call_.error());
  return call_.finish(code_, std::move(position_));
}

inline std::string rig_calibrated::position_reason(std::uint32_t index) const
{
  return ptzcal_rig_calibrated_position_reason(get(), index);
}

inline std::string rig_calibrated::laser_reason(std::uint32_t index) const
{
  return ptzcal_rig_calibrated_laser_reason(get(), index);
}

inline outcome<ptzcal::rig_calibrated::rig_model_result> rig_calibrated::rig_model(std::uint32_t index) const
{
  detail::call call_;
  ptzcal::rig_model model_;
  std::array<double, 49> covariance_{};
  const auto code_ = ptzcal_rig_calibrated_get_rig_model(get(), index, &model_, covariance_.data(),
      call_.error());
  return call_.finish(code_, ptzcal::rig_calibrated::rig_model_result{std::move(model_),
      std::move(covariance_)});
}

inline outcome<ptzcal::board_calibration> rig_calibrated::boards(std::uint32_t index) const
{
  detail::call call_;
  ptzcal_board_calibration *boards_ = nullptr;
  const auto code_ = ptzcal_rig_calibrated_copy_boards(get(), index, &boards_, call_.error());
  return call_.finish(code_, ptzcal::board_calibration(boards_));
}

inline outcome<ptzcal::laser_calibration> rig_calibrated::laser(std::uint32_t index) const
{
  detail::call call_;
  ptzcal_laser_calibration *laser_ = nullptr;
  const auto code_ = ptzcal_rig_calibrated_copy_laser(get(), index, &laser_, call_.error());
  return call_.finish(code_, ptzcal::laser_calibration(laser_));
}

inline outcome<ptzcal::common_line> rig_calibrated::common_line() const
{
  detail::call call_;
  ptzcal::common_line line_;
  const auto code_ = ptzcal_rig_calibrated_get_common_line(get(), &line_, call_.error());
  return call_.finish(code_, std::move(line_));
}

inline outcome<ptzcal::zoom_curve> rig_calibrated::curve() const
{
  detail::call call_;
  ptzcal_zoom_curve *curve_ = nullptr;
  const auto code_ = ptzcal_rig_calibrated_get_curve(get(), &curve_, call_.error());
  return call_.finish(code_, ptzcal::zoom_curve(curve_));
}

inline outcome<ptzcal::rig_view> rig_calibrated::view(std::uint32_t view) const
{
  detail::call call_;
  ptzcal::rig_view rig_view_;
  const auto code_ = ptzcal_rig_calibrated_get_view(get(), view, &rig_view_, call_.error());
  return call_.finish(code_, std::move(rig_view_));
}

inline std::string rig_calibrated::view_reason(std::uint32_t view) const
{
  return ptzcal_rig_calibrated_view_reason(get(), view);
}

inline std::string rig_calibrated::spot_reason(std::uint32_t view) const
{
  return ptzcal_rig_calibrated_spot_reason(get(), view);
}

inline outcome<ptzcal::rig_calibrated::corners_result> rig_calibrated::corners(std::uint32_t view) const
{
  detail::call call_;
  std::vector<double> board_xy_;
  std::vector<double> uv_;
  std::vector<double> residuals_;
  std::vector<std::uint8_t> inliers_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    board_xy_.resize(capacity_ * 2);
    uv_.resize(capacity_ * 2);
    residuals_.resize(capacity_ * 2);
    inliers_.resize(capacity_);
    return ptzcal_rig_calibrated_copy_corners(get(), view, board_xy_.data(), uv_.data(), residuals_.data(),
    inliers_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    board_xy_.resize(needed_ * 2);
    uv_.resize(needed_ * 2);
    residuals_.resize(needed_ * 2);
    inliers_.resize(needed_);
  }
  return call_.finish(code_, ptzcal::rig_calibrated::corners_result{std::move(board_xy_), std::move(uv_),
      std::move(residuals_), std::move(inliers_)});
}

inline outcome<ptzcal::rig_calibration> rig_calibration::make(std::uint32_t columns, std::uint32_t rows,
    double square, ptzcal::optional_ref<ptzcal::calibration_options> options,
    ptzcal::optional_ref<ptzcal::spot_options> spot)
{
  detail::call call_;
  ptzcal_rig_calibration *calibration_ = nullptr;
  const auto code_ = ptzcal_rig_calibration_new(columns, rows, square, detail::pointer(options),
      detail::pointer(spot), &calibration_, call_.error());
  return call_.finish(code_, ptzcal::rig_calibration(calibration_));
}

inline outcome<void> rig_calibration::set_board(std::uint32_t columns, std::uint32_t rows, double square)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_calibration_set_board(get(), columns, rows, square, call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_calibration::set_common_line(bool share, double pupil_sigma)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_calibration_set_common_line(get(), share, pupil_sigma, call_.error());
  return call_.finish(code_);
}

inline outcome<std::uint32_t> rig_calibration::add_images(double zoom, const ptzcal_image &off,
    ptzcal::optional_ref<ptzcal_image> on)
{
  detail::call call_;
  std::uint32_t view_ = 0;
  const auto code_ = ptzcal_rig_calibration_add_images(get(), zoom, &off, on.get(), &view_, call_.error());
  return call_.finish(code_, std::move(view_));
}

inline outcome<std::uint32_t> rig_calibration::add_corners(double zoom, std::uint32_t image_width,
    std::uint32_t image_height, ptzcal::view<const double> board_xy, ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance)
{
  detail::call call_;
  const std::size_t n_ = board_xy.size() / 2;
  if (!(call_.rows("board_xy", board_xy.size(), n_, 2) &&
        call_.rows("uv", uv.size(), n_, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_, 3))) return call_.refuse<std::uint32_t>();
  std::uint32_t view_ = 0;
  const auto code_ = ptzcal_rig_calibration_add_corners(get(), zoom, image_width, image_height,
      board_xy.data(), uv.data(), uv_covariance.data(), n_, &view_, call_.error());
  return call_.finish(code_, std::move(view_));
}

inline outcome<void> rig_calibration::set_spot(std::uint32_t view, ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance)
{
  detail::call call_;
  if (!(call_.rows("uv", uv.size(), 1, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), 1, 3))) return call_.refuse<void>();
  const auto code_ = ptzcal_rig_calibration_set_spot(get(), view, uv.data(), uv_covariance.data(),
      call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::rig_calibrated> rig_calibration::solve() const
{
  detail::call call_;
  ptzcal_rig_calibrated *calibrated_ = nullptr;
  const auto code_ = ptzcal_rig_calibration_solve(get(), &calibrated_, call_.error());
  return call_.finish(code_, ptzcal::rig_calibrated(calibrated_));
}

inline outcome<ptzcal::rgbd> rgbd::make(const ptzcal_image &fixed, const ptzcal_rgbd_options &options)
{
  detail::call call_;
  ptzcal_rgbd *rgbd_ = nullptr;
  const auto code_ = ptzcal_rgbd_new(&fixed, &options, &rgbd_, call_.error());
  return call_.finish(code_, ptzcal::rgbd(rgbd_));
}

inline outcome<ptzcal::rgbd_view> rgbd::add_view(const ptzcal_image &colour, const ptzcal::depth_map &depth,
    const ptzcal_camera &camera)
{
  detail::call call_;
  ptzcal::rgbd_view counts_;
  const auto code_ = ptzcal_rgbd_add_view(get(), &colour, depth.get(), &camera, &counts_, call_.error());
  return call_.finish(code_, std::move(counts_));
}

inline outcome<ptzcal::calibration> rgbd::calibrate(ptzcal::optional_ref<ptzcal::calibration_options> options)
{
  detail::call call_;
  ptzcal_calibration *result_ = nullptr;
  const auto code_ = ptzcal_rgbd_calibrate(get(), detail::pointer(options), &result_, call_.error());
  return call_.finish(code_, ptzcal::calibration(result_));
}

inline outcome<std::vector<double>> rgbd::pairs() const
{
  detail::call call_;
  std::vector<double> pairs_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    pairs_.resize(capacity_);
    return ptzcal_rgbd_copy_pairs(get(), pairs_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    pairs_.resize(needed_);
  }
  return call_.finish(code_, std::move(pairs_));
}

inline outcome<std::vector<double>> rgbd::lines() const
{
  detail::call call_;
  std::vector<double> lines_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    lines_.resize(capacity_);
    return ptzcal_rgbd_copy_lines(get(), lines_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    lines_.resize(needed_);
  }
  return call_.finish(code_, std::move(lines_));
}

inline outcome<ptzcal::roof_edges> roof_edges::make()
{
  detail::call call_;
  ptzcal_roof_edges *edges_ = nullptr;
  const auto code_ = ptzcal_roof_edges_new(&edges_, call_.error());
  return call_.finish(code_, ptzcal::roof_edges(edges_));
}

inline outcome<std::uint32_t> roof_edges::add_plane_shots(const ptzcal_rig_model &model,
    ptzcal::view<const double> pan_tilt, ptzcal::view<const double> spots,
    ptzcal::view<const double> spot_covariance)
{
  detail::call call_;
  const std::size_t n_ = pan_tilt.size() / 2;
  if (!(call_.rows("pan_tilt", pan_tilt.size(), n_, 2) &&
        call_.rows("spots", spots.size(), n_, 2) &&
        call_.rows_or_none("spot_covariance", spot_covariance.size(), n_, 3))) return call_.refuse<std::uint32_t>();
  std::uint32_t plane_ = 0;
  const auto code_ = ptzcal_roof_edges_add_plane_shots(get(), &model, pan_tilt.data(), spots.data(),
      spot_covariance.data(), n_, &plane_, call_.error());
  return call_.finish(code_, std::move(plane_));
}

inline outcome<std::uint32_t> roof_edges::add_plane_points(ptzcal::view<const double> xyz, double sigma)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3))) return call_.refuse<std::uint32_t>();
  std::uint32_t plane_ = 0;
  const auto code_ = ptzcal_roof_edges_add_plane_points(get(), xyz.data(), n_, sigma, &plane_, call_.error());
  return call_.finish(code_, std::move(plane_));
}

inline outcome<std::uint32_t> roof_edges::add_plane(ptzcal::view<const double> normal, double distance,
    ptzcal::view<const double> covariance)
{
  detail::call call_;
  if (!(call_.rows("normal", normal.size(), 1, 3) &&
        call_.rows_or_none("covariance", covariance.size(), 1, 9))) return call_.refuse<std::uint32_t>();
  std::uint32_t plane_ = 0;
  const auto code_ = ptzcal_roof_edges_add_plane(get(), normal.data(), distance, covariance.data(), &plane_,
      call_.error());
  return call_.finish(code_, std::move(plane_));
}

inline outcome<void> roof_edges::add_edge(std::uint32_t first, std::uint32_t second)
{
  detail::call call_;
  const auto code_ = ptzcal_roof_edges_add_edge(get(), first, second, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::pose_options> pose_options::make()
{
  detail::call call_;
  ptzcal_pose_options *options_ = nullptr;
  const auto code_ = ptzcal_pose_options_new(&options_, call_.error());
  return call_.finish(code_, ptzcal::pose_options(options_));
}

inline outcome<void> pose_options::set_method(ptzcal::pose_method method)
{
  detail::call call_;
  const auto code_ = ptzcal_pose_options_set_method(get(), method, call_.error());
  return call_.finish(code_);
}

inline outcome<void> pose_options::set_lever(double lever)
{
  detail::call call_;
  const auto code_ = ptzcal_pose_options_set_lever(get(), lever, call_.error());
  return call_.finish(code_);
}

inline outcome<void> pose_options::set_min_angles(double min_plane_angle, double min_edge_angle)
{
  detail::call call_;
  const auto code_ = ptzcal_pose_options_set_min_angles(get(), min_plane_angle, min_edge_angle,
      call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::pose_estimate> estimate_pose_roof_edges(const ptzcal::roof_edges &station_a,
    const ptzcal::roof_edges &station_b, ptzcal::optional_ref<ptzcal::pose_options> options)
{
  detail::call call_;
  ptzcal_pose_estimate *result_ = nullptr;
  const auto code_ = ptzcal_estimate_pose_roof_edges(station_a.get(), station_b.get(),
      detail::pointer(options), &result_, call_.error());
  return call_.finish(code_, ptzcal::pose_estimate(result_));
}

inline outcome<ptzcal::pose> pose_estimate::pose() const
{
  detail::call call_;
  ptzcal::pose pose_;
  const auto code_ = ptzcal_pose_estimate_get(get(), &pose_, call_.error());
  return call_.finish(code_, std::move(pose_));
}

inline outcome<std::vector<double>> pose_estimate::covariance() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_pose_estimate_copy_covariance(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::planes> planes::find_points(ptzcal::view<const double> xyz, double sigma,
    const ptzcal_planes_options &options)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3))) return call_.refuse<ptzcal::planes>();
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_find_points(xyz.data(), n_, sigma, &options, &planes_, call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<ptzcal::planes> planes::find_ranges(ptzcal::view<const double> xyz, double sigma,
    const ptzcal_planes_options &options)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3))) return call_.refuse<ptzcal::planes>();
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_find_ranges(xyz.data(), n_, sigma, &options, &planes_, call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<ptzcal::planes> planes::find_shots(const ptzcal_rig_model &model,
    ptzcal::view<const double> pan_tilt, ptzcal::view<const double> spots,
    ptzcal::view<const double> spot_covariance, const ptzcal_planes_options &options)
{
  detail::call call_;
  const std::size_t n_ = pan_tilt.size() / 2;
  if (!(call_.rows("pan_tilt", pan_tilt.size(), n_, 2) &&
        call_.rows("spots", spots.size(), n_, 2) &&
        call_.rows_or_none("spot_covariance", spot_covariance.size(), n_, 3))) return call_.refuse<ptzcal::planes>();
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_find_shots(&model, pan_tilt.data(), spots.data(), spot_covariance.data(),
      n_, &options, &planes_, call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<ptzcal::planes> planes::find_depths(const ptzcal::depth_map &map, const ptzcal_camera &camera,
    double inverse_depth_sigma, double depth_sigma, const ptzcal_planes_options &options)
{
  detail::call call_;
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_find_depths(map.get(), &camera, inverse_depth_sigma, depth_sigma, &options,
      &planes_, call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<std::uint32_t> planes::count() const
{
  detail::call call_;
  std::uint32_t count_ = 0;
  const auto code_ = ptzcal_planes_count(get(), &count_, call_.error());
  return call_.finish(code_, std::move(count_));
}

inline outcome<ptzcal::plane> planes::plane(std::uint32_t index) const
{
  detail::call call_;
  ptzcal::plane plane_;
  const auto code_ = ptzcal_planes_get(get(), index, &plane_, call_.error());
  return call_.finish(code_, std::move(plane_));
}

inline outcome<std::vector<std::int32_t>> planes::labels() const
{
  detail::call call_;
  std::vector<std::int32_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_planes_copy_labels(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<double> planes::sigma() const
{
  detail::call call_;
  double sigma_ = 0;
  const auto code_ = ptzcal_planes_sigma(get(), &sigma_, call_.error());
  return call_.finish(code_, std::move(sigma_));
}

inline outcome<ptzcal::planes> planes::fit_points(ptzcal::view<const double> xyz, double sigma,
    ptzcal::view<const std::int32_t> region_of, std::uint32_t regions, const ptzcal_planes_options &options)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3) &&
        call_.rows("region_of", region_of.size(), n_, 1))) return call_.refuse<ptzcal::planes>();
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_fit_points(xyz.data(), n_, sigma, region_of.data(), regions, &options,
      &planes_, call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<ptzcal::planes> planes::fit_points_in_boxes(ptzcal::view<const double> xyz, double sigma,
    ptzcal::view<const double> boxes, std::uint32_t regions, const ptzcal_planes_options &options)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3) &&
        call_.rows("boxes", boxes.size(), std::size_t(regions), 6))) return call_.refuse<ptzcal::planes>();
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_fit_points_in_boxes(xyz.data(), n_, sigma, boxes.data(), regions, &options,
      &planes_, call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<ptzcal::planes> planes::fit_shots(const ptzcal_rig_model &model,
    ptzcal::view<const double> pan_tilt, ptzcal::view<const double> spots,
    ptzcal::view<const double> spot_covariance, ptzcal::view<const std::int32_t> region_of,
    std::uint32_t regions, const ptzcal_planes_options &options)
{
  detail::call call_;
  const std::size_t n_ = pan_tilt.size() / 2;
  if (!(call_.rows("pan_tilt", pan_tilt.size(), n_, 2) &&
        call_.rows("spots", spots.size(), n_, 2) &&
        call_.rows_or_none("spot_covariance", spot_covariance.size(), n_, 3) &&
        call_.rows("region_of", region_of.size(), n_, 1))) return call_.refuse<ptzcal::planes>();
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_fit_shots(&model, pan_tilt.data(), spots.data(), spot_covariance.data(),
      n_, region_of.data(), regions, &options, &planes_, call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<ptzcal::planes> planes::fit_shots_in_boxes(const ptzcal_rig_model &model,
    ptzcal::view<const double> pan_tilt, ptzcal::view<const double> spots,
    ptzcal::view<const double> spot_covariance, ptzcal::view<const double> boxes, std::uint32_t regions,
    const ptzcal_planes_options &options)
{
  detail::call call_;
  const std::size_t n_ = pan_tilt.size() / 2;
  if (!(call_.rows("pan_tilt", pan_tilt.size(), n_, 2) &&
        call_.rows("spots", spots.size(), n_, 2) &&
        call_.rows_or_none("spot_covariance", spot_covariance.size(), n_, 3) &&
        call_.rows("boxes", boxes.size(), std::size_t(regions), 6))) return call_.refuse<ptzcal::planes>();
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_fit_shots_in_boxes(&model, pan_tilt.data(), spots.data(),
      spot_covariance.data(), n_, boxes.data(), regions, &options, &planes_, call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<ptzcal::registration> register_stations(const ptzcal::planes &station_a,
    const ptzcal::planes &station_b, const ptzcal_station_options &options)
{
  detail::call call_;
  ptzcal_registration *result_ = nullptr;
  const auto code_ = ptzcal_register_stations(station_a.get(), station_b.get(), &options, &result_,
      call_.error());
  return call_.finish(code_, ptzcal::registration(result_));
}

inline outcome<ptzcal::registration> register_matched_planes(const ptzcal::planes &station_a,
    const ptzcal::planes &station_b, ptzcal::view<const std::uint32_t> pairs)
{
  detail::call call_;
  const std::size_t n_ = pairs.size() / 2;
  if (!(call_.rows("pairs", pairs.size(), n_, 2))) return call_.refuse<ptzcal::registration>();
  ptzcal_registration *result_ = nullptr;
  const auto code_ = ptzcal_register_matched_planes(station_a.get(), station_b.get(), pairs.data(), n_,
      &result_, call_.error());
  return call_.finish(code_, ptzcal::registration(result_));
}

inline outcome<ptzcal::station_pose> registration::station_pose() const
{
  detail::call call_;
  ptzcal::station_pose pose_;
  const auto code_ = ptzcal_registration_get(get(), &pose_, call_.error());
  return call_.finish(code_, std::move(pose_));
}

inline outcome<std::vector<std::uint32_t>> registration::matches() const
{
  detail::call call_;
  std::vector<std::uint32_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_registration_copy_matches(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::registration::roof_edges_result> registration::roof_edges(const ptzcal::planes &station_a,
    const ptzcal::planes &station_b, double min_angle) const
{
  detail::call call_;
  ptzcal_roof_edges *edges_a_ = nullptr;
  ptzcal_roof_edges *edges_b_ = nullptr;
  const auto code_ = ptzcal_registration_roof_edges(get(), station_a.get(), station_b.get(), min_angle,
      &edges_a_, &edges_b_, call_.error());
  return call_.finish(code_, ptzcal::registration::roof_edges_result{ptzcal::roof_edges(edges_a_),
      ptzcal::roof_edges(edges_b_)});
}

inline outcome<ptzcal::simulator> simulator::make(ptzcal::c_string address)
{
  detail::call call_;
  ptzcal_simulator *simulator_ = nullptr;
  const auto code_ = ptzcal_simulator_new(address.get(), &simulator_, call_.error());
  return call_.finish(code_, ptzcal::simulator(simulator_));
}

inline outcome<ptzcal::rig_model> simulator::nominal_rig() const
{
  detail::call call_;
  ptzcal::rig_model model_;
  const auto code_ = ptzcal_simulator_nominal_rig(get(), &model_, call_.error());
  return call_.finish(code_, std::move(model_));
}

inline outcome<ptzcal::rig_model> simulator::true_rig() const
{
  detail::call call_;
  ptzcal::rig_model model_;
  const auto code_ = ptzcal_simulator_true_rig(get(), &model_, call_.error());
  return call_.finish(code_, std::move(model_));
}

inline outcome<std::size_t> simulator::fixed_cameras() const
{
  detail::call call_;
  std::size_t count_ = 0;
  const auto code_ = ptzcal_simulator_fixed_cameras(get(), &count_, call_.error());
  return call_.finish(code_, std::move(count_));
}

inline outcome<ptzcal::camera> simulator::true_camera(std::uint32_t index) const
{
  detail::call call_;
  ptzcal::camera camera_;
  const auto code_ = ptzcal_simulator_true_camera(get(), index, &camera_, call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<ptzcal::pose> simulator::true_station() const
{
  detail::call call_;
  ptzcal::pose pose_;
  const auto code_ = ptzcal_simulator_true_station(get(), &pose_, call_.error());
  return call_.finish(code_, std::move(pose_));
}

inline outcome<void> simulator::move(double pan, double tilt) const
{
  detail::call call_;
  const auto code_ = ptzcal_simulator_move(get(), pan, tilt, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::simulator::position_result> simulator::position() const
{
  detail::call call_;
  double pan_ = 0;
  double tilt_ = 0;
  const auto code_ = ptzcal_simulator_position(get(), &pan_, &tilt_, call_.error());
  return call_.finish(code_, ptzcal::simulator::position_result{std::move(pan_), std::move(tilt_)});
}

inline outcome<ptzcal::motion> simulator::motion() const
{
  detail::call call_;
  std::int32_t motion_ = 0;
  const auto code_ = ptzcal_simulator_motion(get(), &motion_, call_.error());
  return call_.finish(code_, ptzcal::motion(motion_));
}

inline outcome<void> simulator::stop() const
{
  detail::call call_;
  const auto code_ = ptzcal_simulator_stop(get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> simulator::set_laser(bool on) const
{
  detail::call call_;
  const auto code_ = ptzcal_simulator_set_laser(get(), on, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::simulator::next_frame_result> simulator::next_frame(std::uint32_t camera,
    double not_before, double timeout) const
{
  detail::call call_;
  ptzcal::image image_;
  double timestamp_ = 0;
  const auto code_ = ptzcal_simulator_next_frame(get(), camera, not_before, timeout, &image_, &timestamp_,
      call_.error());
  return call_.finish(code_, ptzcal::simulator::next_frame_result{std::move(image_), std::move(timestamp_)});
}

inline outcome<double> simulator::now() const
{
  detail::call call_;
  double now_ = 0;
  const auto code_ = ptzcal_simulator_now(get(), &now_, call_.error());
  return call_.finish(code_, std::move(now_));
}

inline outcome<void> simulator::sleep(double seconds) const
{
  detail::call call_;
  const auto code_ = ptzcal_simulator_sleep(get(), seconds, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::angle_map> angle_map::read(ptzcal::c_string path)
{
  detail::call call_;
  ptzcal_angle_map *map_ = nullptr;
  const auto code_ = ptzcal_angle_map_read(path.get(), &map_, call_.error());
  return call_.finish(code_, ptzcal::angle_map(map_));
}

inline outcome<void> angle_map::save(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_angle_map_save(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::angle_summary> angle_map::summary() const
{
  detail::call call_;
  ptzcal::angle_summary summary_;
  const auto code_ = ptzcal_angle_map_get_summary(get(), &summary_, call_.error());
  return call_.finish(code_, std::move(summary_));
}

inline outcome<ptzcal::angle_map::to_angles_result> angle_map::to_angles(double raw_pan,
    double raw_tilt) const
{
  detail::call call_;
  double pan_ = 0;
  double tilt_ = 0;
  double pan_sigma_ = 0;
  double tilt_sigma_ = 0;
  const auto code_ = ptzcal_angle_map_to_angles(get(), raw_pan, raw_tilt, &pan_, &tilt_, &pan_sigma_,
      &tilt_sigma_, call_.error());
  return call_.finish(code_, ptzcal::angle_map::to_angles_result{std::move(pan_), std::move(tilt_),
      std::move(pan_sigma_), std::move(tilt_sigma_)});
}

inline outcome<ptzcal::angle_map::to_raw_result> angle_map::to_raw(double pan, double tilt) const
{
  detail::call call_;
  double raw_pan_ = 0;
  double raw_tilt_ = 0;
  const auto code_ = ptzcal_angle_map_to_raw(get(), pan, tilt, &raw_pan_, &raw_tilt_, call_.error());
  return call_.finish(code_, ptzcal::angle_map::to_raw_result{std::move(raw_pan_), std::move(raw_tilt_)});
}

inline outcome<ptzcal::rig_options> rig_options::make()
{
  detail::call call_;
  ptzcal_rig_options *options_ = nullptr;
  const auto code_ = ptzcal_rig_options_new(&options_, call_.error());
  return call_.finish(code_, ptzcal::rig_options(options_));
}

inline outcome<void> rig_options::set_address(ptzcal::c_string address)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_address(get(), address.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_options::set_ptz_address(ptzcal::c_string address)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_ptz_address(get(), address.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_options::set_laser_address(ptzcal::c_string address)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_laser_address(get(), address.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_options::set_frames_address(ptzcal::c_string address)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_frames_address(get(), address.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_options::set_angle_map(ptzcal::optional_ref<ptzcal::angle_map> map)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_angle_map(get(), detail::pointer(map), call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_options::set_laser_duty(double duty, double window)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_laser_duty(get(), duty, window, call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_options::set_credentials(ptzcal::c_string user, ptzcal::c_string password)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_credentials(get(), user.get(), password.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_options::set_model(const ptzcal_rig_model &model)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_model(get(), &model, call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_options::set_settle(std::uint32_t readings, double duration, double overshoot,
    double move_timeout, double picture)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_settle(get(), readings, duration, overshoot, move_timeout,
      picture, call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_options::set_frame_wait(double timeout, std::uint32_t stale_frames)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_frame_wait(get(), timeout, stale_frames, call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig_options::set_laser_max_on(double seconds)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_options_set_laser_max_on(get(), seconds, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::head_options> head_options::make()
{
  detail::call call_;
  ptzcal_head_options *options_ = nullptr;
  const auto code_ = ptzcal_head_options_new(&options_, call_.error());
  return call_.finish(code_, ptzcal::head_options(options_));
}

inline outcome<void> head_options::set_address(ptzcal::c_string address)
{
  detail::call call_;
  const auto code_ = ptzcal_head_options_set_address(get(), address.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> head_options::set_frames_address(ptzcal::c_string address)
{
  detail::call call_;
  const auto code_ = ptzcal_head_options_set_frames_address(get(), address.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> head_options::set_laser_address(ptzcal::c_string address)
{
  detail::call call_;
  const auto code_ = ptzcal_head_options_set_laser_address(get(), address.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> head_options::set_angle_map(ptzcal::optional_ref<ptzcal::angle_map> map)
{
  detail::call call_;
  const auto code_ = ptzcal_head_options_set_angle_map(get(), detail::pointer(map), call_.error());
  return call_.finish(code_);
}

inline outcome<void> head_options::set_credentials(ptzcal::c_string user, ptzcal::c_string password)
{
  detail::call call_;
  const auto code_ = ptzcal_head_options_set_credentials(get(), user.get(), password.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::head> head::open(const ptzcal::head_options &options)
{
  detail::call call_;
  ptzcal_head *head_ = nullptr;
  const auto code_ = ptzcal_head_open(options.get(), &head_, call_.error());
  ptzcal::head opened_(head_);
  opened_.share(options);
  return call_.finish(code_, std::move(opened_));
}

inline outcome<ptzcal::head_capabilities> head::capabilities() const
{
  detail::call call_;
  ptzcal::head_capabilities capabilities_;
  const auto code_ = ptzcal_head_get_capabilities(get(), &capabilities_, call_.error());
  hand_over(call_);
  return call_.finish(code_, std::move(capabilities_));
}

inline outcome<std::string> head::identity(ptzcal::identity which) const
{
  detail::call call_;
  std::string buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_head_copy_identity(get(), which, buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  hand_over(call_);
  return call_.finish(code_, detail::text(std::move(buffer_)));
}

inline outcome<ptzcal::head::position_result> head::position() const
{
  detail::call call_;
  double pan_ = 0;
  double tilt_ = 0;
  double zoom_ = 0;
  const auto code_ = ptzcal_head_position(get(), &pan_, &tilt_, &zoom_, call_.error());
  hand_over(call_);
  return call_.finish(code_, ptzcal::head::position_result{std::move(pan_), std::move(tilt_),
      std::move(zoom_)});
}

inline outcome<ptzcal::motion> head::motion() const
{
  detail::call call_;
  std::int32_t motion_ = 0;
  const auto code_ = ptzcal_head_motion(get(), &motion_, call_.error());
  hand_over(call_);
  return call_.finish(code_, ptzcal::motion(motion_));
}

inline outcome<ptzcal::head::wait_result> head::wait(std::uint64_t move_number, double timeout,
    ptzcal::optional_ref<ptzcal::cancel> token) const
{
  detail::call call_;
  std::int32_t end_ = 0;
  std::int32_t status_ = 0;
  const auto code_ = ptzcal_head_wait(get(), move_number, timeout, detail::pointer(token), &end_, &status_,
      call_.error());
  hand_over(call_);
  return call_.finish(code_, ptzcal::head::wait_result{ptzcal::move_end(end_), std::move(status_)});
}

inline outcome<std::uint64_t> head::move(double pan, double tilt) const
{
  detail::call call_;
  std::uint64_t number_ = 0;
  const auto code_ = ptzcal_head_move(get(), pan, tilt, &number_, call_.error());
  hand_over(call_);
  return call_.finish(code_, std::move(number_));
}

inline outcome<std::uint64_t> head::move_by(double pan, double tilt) const
{
  detail::call call_;
  std::uint64_t number_ = 0;
  const auto code_ = ptzcal_head_move_by(get(), pan, tilt, &number_, call_.error());
  hand_over(call_);
  return call_.finish(code_, std::move(number_));
}

inline outcome<std::uint64_t> head::move_in_view(double x, double y) const
{
  detail::call call_;
  std::uint64_t number_ = 0;
  const auto code_ = ptzcal_head_move_in_view(get(), x, y, &number_, call_.error());
  hand_over(call_);
  return call_.finish(code_, std::move(number_));
}

inline outcome<std::uint64_t> head::drive(double pan_speed, double tilt_speed, double zoom_speed,
    double dead_man) const
{
  detail::call call_;
  std::uint64_t number_ = 0;
  const auto code_ = ptzcal_head_drive(get(), pan_speed, tilt_speed, zoom_speed, dead_man, &number_,
      call_.error());
  hand_over(call_);
  return call_.finish(code_, std::move(number_));
}

inline outcome<void> head::stop() const
{
  detail::call call_;
  const auto code_ = ptzcal_head_stop(get(), call_.error());
  hand_over(call_);
  return call_.finish(code_);
}

inline outcome<std::uint64_t> head::home() const
{
  detail::call call_;
  std::uint64_t number_ = 0;
  const auto code_ = ptzcal_head_home(get(), &number_, call_.error());
  hand_over(call_);
  return call_.finish(code_, std::move(number_));
}

inline outcome<std::uint64_t> head::set_zoom(double zoom) const
{
  detail::call call_;
  std::uint64_t number_ = 0;
  const auto code_ = ptzcal_head_set_zoom(get(), zoom, &number_, call_.error());
  hand_over(call_);
  return call_.finish(code_, std::move(number_));
}

inline outcome<void> head::set_focus(ptzcal::focus focus, double at) const
{
  detail::call call_;
  const auto code_ = ptzcal_head_set_focus(get(), focus, at, call_.error());
  hand_over(call_);
  return call_.finish(code_);
}

inline outcome<double> head::focus() const
{
  detail::call call_;
  double at_ = 0;
  const auto code_ = ptzcal_head_focus(get(), &at_, call_.error());
  hand_over(call_);
  return call_.finish(code_, std::move(at_));
}

inline outcome<void> head::lock_exposure(bool locked) const
{
  detail::call call_;
  const auto code_ = ptzcal_head_lock_exposure(get(), locked, call_.error());
  hand_over(call_);
  return call_.finish(code_);
}

inline outcome<void> head::store_preset(std::uint32_t preset) const
{
  detail::call call_;
  const auto code_ = ptzcal_head_store_preset(get(), preset, call_.error());
  hand_over(call_);
  return call_.finish(code_);
}

inline outcome<std::uint64_t> head::recall_preset(std::uint32_t preset) const
{
  detail::call call_;
  std::uint64_t number_ = 0;
  const auto code_ = ptzcal_head_recall_preset(get(), preset, &number_, call_.error());
  hand_over(call_);
  return call_.finish(code_, std::move(number_));
}

inline outcome<void> head::clear_preset(std::uint32_t preset) const
{
  detail::call call_;
  const auto code_ = ptzcal_head_clear_preset(get(), preset, call_.error());
  hand_over(call_);
  return call_.finish(code_);
}

inline outcome<ptzcal::angle_map> learn_angles(const ptzcal::head_options &head, const ptzcal_camera &camera,
    const ptzcal_angle_learning_options &options, const ptzcal::progress_callback &progress,
    ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  ptzcal_angle_map *map_ = nullptr;
  const auto code_ = ptzcal_learn_angles(head.get(), &camera, &options, detail::progress_function(progress),
      detail::progress_user(progress), detail::pointer(token), &map_, call_.error());
  return call_.finish(code_, ptzcal::angle_map(map_));
}

inline outcome<ptzcal::probe_report> probe(const ptzcal::head_options &head,
    ptzcal::optional_ref<ptzcal_camera> camera, const ptzcal_probe_options &options,
    ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  ptzcal_probe_report *report_ = nullptr;
  const auto code_ = ptzcal_probe(head.get(), camera.get(), &options, detail::pointer(token), &report_,
      call_.error());
  return call_.finish(code_, ptzcal::probe_report(report_));
}

inline outcome<ptzcal::figure> probe_report::figure(ptzcal::probe_figure which) const
{
  detail::call call_;
  ptzcal::figure figure_;
  const auto code_ = ptzcal_probe_report_get(get(), which, &figure_, call_.error());
  return call_.finish(code_, std::move(figure_));
}

inline outcome<std::string> probe_report::text() const
{
  detail::call call_;
  std::string buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_probe_report_copy_text(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, detail::text(std::move(buffer_)));
}

inline outcome<ptzcal::rig> rig::open(const ptzcal::rig_options &options)
{
  detail::call call_;
  ptzcal_rig *rig_ = nullptr;
  const auto code_ = ptzcal_rig_open(options.get(), &rig_, call_.error());
  ptzcal::rig opened_(rig_);
  opened_.share(options);
  return call_.finish(code_, std::move(opened_));
}

inline outcome<ptzcal::rig_model> rig::model() const
{
  detail::call call_;
  ptzcal::rig_model model_;
  const auto code_ = ptzcal_rig_get_model(get(), &model_, call_.error());
  return call_.finish(code_, std::move(model_));
}

inline outcome<ptzcal::simulator> rig::simulator() const
{
  detail::call call_;
  ptzcal_simulator *simulator_ = nullptr;
  const auto code_ = ptzcal_rig_simulator(get(), &simulator_, call_.error());
  return call_.finish(code_, ptzcal::simulator(simulator_));
}

inline outcome<void> rig::move(double pan, double tilt, ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_move(get(), pan, tilt, detail::pointer(token), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::rig::position_result> rig::position()
{
  detail::call call_;
  double pan_ = 0;
  double tilt_ = 0;
  const auto code_ = ptzcal_rig_position(get(), &pan_, &tilt_, call_.error());
  return call_.finish(code_, ptzcal::rig::position_result{std::move(pan_), std::move(tilt_)});
}

inline outcome<ptzcal::rig::aim_at_point_result> rig::aim_at_point(ptzcal::view<const double> xyz,
    ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  if (!(call_.rows("xyz", xyz.size(), 1, 3))) return call_.refuse<ptzcal::rig::aim_at_point_result>();
  double pan_ = 0;
  double tilt_ = 0;
  const auto code_ = ptzcal_rig_aim_at_point(get(), xyz.data(), detail::pointer(token), &pan_, &tilt_,
      call_.error());
  return call_.finish(code_, ptzcal::rig::aim_at_point_result{std::move(pan_), std::move(tilt_)});
}

inline outcome<ptzcal::rig::aim_at_pixel_result> rig::aim_at_pixel(double u, double v, double depth,
    ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  double pan_ = 0;
  double tilt_ = 0;
  const auto code_ = ptzcal_rig_aim_at_pixel(get(), u, v, depth, detail::pointer(token), &pan_, &tilt_,
      call_.error());
  return call_.finish(code_, ptzcal::rig::aim_at_pixel_result{std::move(pan_), std::move(tilt_)});
}

inline outcome<ptzcal::rig_model::aim_result> rig_model::aim(ptzcal::view<const double> xyz) const
{
  detail::call call_;
  if (!(call_.rows("xyz", xyz.size(), 1, 3))) return call_.refuse<ptzcal::rig_model::aim_result>();
  double pan_ = 0;
  double tilt_ = 0;
  const auto code_ = ptzcal_rig_model_aim(this, xyz.data(), &pan_, &tilt_, call_.error());
  return call_.finish(code_, ptzcal::rig_model::aim_result{std::move(pan_), std::move(tilt_)});
}

inline outcome<void> rig::set_laser(bool on)
{
  detail::call call_;
  const auto code_ = ptzcal_rig_set_laser(get(), on, call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig::stop() const
{
  detail::call call_;
  const auto code_ = ptzcal_rig_stop(get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig::emergency_off() const
{
  detail::call call_;
  const auto code_ = ptzcal_rig_emergency_off(get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> rig::release() const
{
  detail::call call_;
  const auto code_ = ptzcal_rig_release(get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::scan_options> scan_options::make()
{
  detail::call call_;
  ptzcal_scan_options *options_ = nullptr;
  const auto code_ = ptzcal_scan_options_new(&options_, call_.error());
  return call_.finish(code_, ptzcal::scan_options(options_));
}

inline outcome<std::uint32_t> scan_options::add_camera_address(ptzcal::c_string address)
{
  detail::call call_;
  std::uint32_t index_ = 0;
  const auto code_ = ptzcal_scan_options_add_camera_address(get(), address.get(), &index_, call_.error());
  return call_.finish(code_, std::move(index_));
}

inline outcome<void> scan_options::set_known_camera(std::uint32_t camera,
    ptzcal::optional_ref<ptzcal_camera> known)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_known_camera(get(), camera, known.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan_options::set_distortion(std::uint32_t camera, ptzcal::distortion_model model)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_distortion(get(), camera, model, call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan_options::set_frames_per_state(std::uint32_t frames)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_frames_per_state(get(), frames, call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan_options::set_coarse_shots(std::uint32_t shots)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_coarse_shots(get(), shots, call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan_options::set_target_accuracy(double metres)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_target_accuracy(get(), metres, call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan_options::set_reconnect(double seconds)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_reconnect(get(), seconds, call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan_options::set_spot(ptzcal::optional_ref<ptzcal::spot_options> spot)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_spot(get(), detail::pointer(spot), call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan_options::set_gate(double nearest, double farthest, double half_width,
    double model_sigma)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_gate(get(), nearest, farthest, half_width, model_sigma,
      call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan_options::set_journal(ptzcal::c_string path, bool sync)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_journal(get(), path.get(), sync, call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan_options::set_recording(ptzcal::c_string path)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_recording(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan_options::set_cancel(ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  const auto code_ = ptzcal_scan_options_set_cancel(get(), detail::pointer(token), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::region> rig::recorded_region() const
{
  detail::call call_;
  ptzcal::region region_;
  const auto code_ = ptzcal_rig_recorded_region(get(), &region_, call_.error());
  return call_.finish(code_, std::move(region_));
}

inline outcome<ptzcal::scan> rig::scan_region(const ptzcal_region &region,
    ptzcal::optional_ref<ptzcal::scan_options> options, const ptzcal::progress_callback &progress)
{
  detail::call call_;
  ptzcal_scan *scan_ = nullptr;
  const auto code_ = ptzcal_rig_scan_region(get(), &region, detail::pointer(options),
      detail::progress_function(progress), detail::progress_user(progress), &scan_, call_.error());
  return call_.finish(code_, ptzcal::scan(scan_));
}

inline outcome<ptzcal::scan_summary> scan::summary() const
{
  detail::call call_;
  ptzcal::scan_summary summary_;
  const auto code_ = ptzcal_scan_get_summary(get(), &summary_, call_.error());
  return call_.finish(code_, std::move(summary_));
}

inline outcome<ptzcal::scan::camera_size_result> scan::camera_size(std::uint32_t camera) const
{
  detail::call call_;
  std::uint32_t width_ = 0;
  std::uint32_t height_ = 0;
  const auto code_ = ptzcal_scan_camera_size(get(), camera, &width_, &height_, call_.error());
  return call_.finish(code_, ptzcal::scan::camera_size_result{std::move(width_), std::move(height_)});
}

inline outcome<void> scan::end() const
{
  detail::call call_;
  const auto code_ = ptzcal_scan_end(get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::shot> scan::shot(std::size_t index) const
{
  detail::call call_;
  ptzcal::shot shot_;
  const auto code_ = ptzcal_scan_get_shot(get(), index, &shot_, call_.error());
  return call_.finish(code_, std::move(shot_));
}

inline outcome<ptzcal::spot> scan::spot(std::size_t index, std::uint32_t camera) const
{
  detail::call call_;
  ptzcal::spot spot_;
  const auto code_ = ptzcal_scan_get_spot(get(), index, camera, &spot_, call_.error());
  return call_.finish(code_, std::move(spot_));
}

inline outcome<std::vector<double>> scan::points() const
{
  detail::call call_;
  std::vector<double> xyz_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    xyz_.resize(capacity_);
    return ptzcal_scan_copy_points(get(), xyz_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    xyz_.resize(needed_);
  }
  return call_.finish(code_, std::move(xyz_));
}

inline outcome<void> correspondences::add_scan(const ptzcal::scan &scan, std::uint32_t camera)
{
  detail::call call_;
  const auto code_ = ptzcal_correspondences_add_scan(get(), scan.get(), camera, call_.error());
  return call_.finish(code_);
}

inline outcome<std::uint32_t> roof_edges::add_plane_scan(const ptzcal::scan &scan,
    ptzcal::optional_ref<ptzcal_region> region)
{
  detail::call call_;
  std::uint32_t plane_ = 0;
  const auto code_ = ptzcal_roof_edges_add_plane_scan(get(), scan.get(), region.get(), &plane_,
      call_.error());
  return call_.finish(code_, std::move(plane_));
}

inline outcome<ptzcal::planes> planes::find_scan(const ptzcal::scan &scan,
    const ptzcal_planes_options &options)
{
  detail::call call_;
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_find_scan(scan.get(), &options, &planes_, call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<ptzcal::planes> planes::fit_scan(const ptzcal::scan &scan, ptzcal::view<const double> readings,
    std::uint32_t regions, const ptzcal_planes_options &options)
{
  detail::call call_;
  if (!(call_.rows("readings", readings.size(), std::size_t(regions), 4))) return call_.refuse<ptzcal::planes>();
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_fit_scan(scan.get(), readings.data(), regions, &options, &planes_,
      call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<ptzcal::planes> planes::fit_scan_in_boxes(const ptzcal::scan &scan,
    ptzcal::view<const double> boxes, std::uint32_t regions, const ptzcal_planes_options &options)
{
  detail::call call_;
  if (!(call_.rows("boxes", boxes.size(), std::size_t(regions), 6))) return call_.refuse<ptzcal::planes>();
  ptzcal_planes *planes_ = nullptr;
  const auto code_ = ptzcal_planes_fit_scan_in_boxes(scan.get(), boxes.data(), regions, &options, &planes_,
      call_.error());
  return call_.finish(code_, ptzcal::planes(planes_));
}

inline outcome<ptzcal::cloud> cloud::make()
{
  detail::call call_;
  ptzcal_cloud *cloud_ = nullptr;
  const auto code_ = ptzcal_cloud_new(&cloud_, call_.error());
  return call_.finish(code_, ptzcal::cloud(cloud_));
}

inline outcome<ptzcal::cloud> cloud::from_scan(const ptzcal::scan &scan)
{
  detail::call call_;
  ptzcal_cloud *cloud_ = nullptr;
  const auto code_ = ptzcal_cloud_from_scan(scan.get(), &cloud_, call_.error());
  return call_.finish(code_, ptzcal::cloud(cloud_));
}

inline outcome<ptzcal::cloud> cloud::from_depth_map(const ptzcal::depth_map &map, const ptzcal_camera &camera,
    ptzcal::optional_ref<ptzcal_image> image, double inverse_depth_sigma, double depth_sigma)
{
  detail::call call_;
  ptzcal_cloud *cloud_ = nullptr;
  const auto code_ = ptzcal_cloud_from_depth_map(map.get(), &camera, image.get(), inverse_depth_sigma,
      depth_sigma, &cloud_, call_.error());
  return call_.finish(code_, ptzcal::cloud(cloud_));
}

inline outcome<void> cloud::add_points(ptzcal::view<const double> xyz, ptzcal::view<const std::uint8_t> rgb,
    ptzcal::view<const double> covariances)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3) &&
        call_.rows_or_none("rgb", rgb.size(), n_, 3) &&
        call_.rows_or_none("covariances", covariances.size(), n_, 6))) return call_.refuse<void>();
  const auto code_ = ptzcal_cloud_add_points(get(), xyz.data(), rgb.data(), covariances.data(), n_,
      call_.error());
  return call_.finish(code_);
}

inline outcome<void> cloud::merge(const ptzcal::cloud &other)
{
  detail::call call_;
  const auto code_ = ptzcal_cloud_merge(get(), other.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> cloud::strip()
{
  detail::call call_;
  const auto code_ = ptzcal_cloud_strip(get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> cloud::transform(const ptzcal_pose &pose, ptzcal::view<const double> covariance)
{
  detail::call call_;
  if (!(call_.rows_or_none("covariance", covariance.size(), 1, 36))) return call_.refuse<void>();
  const auto code_ = ptzcal_cloud_transform(get(), &pose, covariance.data(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> cloud::crop(ptzcal::view<const double> least, ptzcal::view<const double> greatest)
{
  detail::call call_;
  if (!(call_.rows("least", least.size(), 1, 3) &&
        call_.rows("greatest", greatest.size(), 1, 3))) return call_.refuse<void>();
  const auto code_ = ptzcal_cloud_crop(get(), least.data(), greatest.data(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> cloud::thin(double voxel)
{
  detail::call call_;
  const auto code_ = ptzcal_cloud_thin(get(), voxel, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::cloud::size_result> cloud::size() const
{
  detail::call call_;
  std::size_t points_ = 0;
  std::uint32_t noise_ = 0;
  std::uint32_t normals_ = 0;
  const auto code_ = ptzcal_cloud_size(get(), &points_, &noise_, &normals_, call_.error());
  return call_.finish(code_, ptzcal::cloud::size_result{std::move(points_), ptzcal::cloud_noise(noise_),
      std::move(normals_)});
}

inline outcome<std::vector<double>> cloud::points() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_cloud_copy_points(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<std::vector<std::uint8_t>> cloud::colours() const
{
  detail::call call_;
  std::vector<std::uint8_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_cloud_copy_colours(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<std::vector<double>> cloud::normals() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_cloud_copy_normals(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<std::vector<double>> cloud::deviations() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_cloud_copy_deviations(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<std::vector<double>> cloud::covariances() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_cloud_copy_covariances(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<void> cloud::save(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_cloud_save(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::cloud::load_result> cloud::load(ptzcal::c_string path)
{
  detail::call call_;
  ptzcal_cloud *cloud_ = nullptr;
  std::size_t skipped_ = 0;
  const auto code_ = ptzcal_cloud_load(path.get(), &cloud_, &skipped_, call_.error());
  return call_.finish(code_, ptzcal::cloud::load_result{ptzcal::cloud(cloud_), std::move(skipped_)});
}

inline outcome<ptzcal::depth_map> cloud::depth_map(const ptzcal_camera &camera) const
{
  detail::call call_;
  ptzcal_depth_map *map_ = nullptr;
  const auto code_ = ptzcal_cloud_depth_map(get(), &camera, &map_, call_.error());
  return call_.finish(code_, ptzcal::depth_map(map_));
}

inline outcome<ptzcal::mesh> mesh::make(const ptzcal::cloud &vertices,
    ptzcal::view<const std::uint32_t> triangles)
{
  detail::call call_;
  const std::size_t n_ = triangles.size() / 3;
  if (!(call_.rows("triangles", triangles.size(), n_, 3))) return call_.refuse<ptzcal::mesh>();
  ptzcal_mesh *mesh_ = nullptr;
  const auto code_ = ptzcal_mesh_new(vertices.get(), triangles.data(), n_, &mesh_, call_.error());
  return call_.finish(code_, ptzcal::mesh(mesh_));
}

inline outcome<ptzcal::mesh> mesh::from_scan(const ptzcal::scan &scan, const ptzcal_surface_options &options)
{
  detail::call call_;
  ptzcal_mesh *mesh_ = nullptr;
  const auto code_ = ptzcal_mesh_from_scan(scan.get(), &options, &mesh_, call_.error());
  return call_.finish(code_, ptzcal::mesh(mesh_));
}

inline outcome<ptzcal::mesh> mesh::from_depth_map(const ptzcal::depth_map &map, const ptzcal_camera &camera,
    ptzcal::optional_ref<ptzcal_image> image, double inverse_depth_sigma, double depth_sigma,
    const ptzcal_surface_options &options)
{
  detail::call call_;
  ptzcal_mesh *mesh_ = nullptr;
  const auto code_ = ptzcal_mesh_from_depth_map(map.get(), &camera, image.get(), inverse_depth_sigma,
      depth_sigma, &options, &mesh_, call_.error());
  return call_.finish(code_, ptzcal::mesh(mesh_));
}

inline outcome<void> mesh::add_picture(const ptzcal_image &image, const ptzcal_camera &camera)
{
  detail::call call_;
  const auto code_ = ptzcal_mesh_add_picture(get(), &image, &camera, call_.error());
  return call_.finish(code_);
}

inline outcome<std::size_t> mesh::texture()
{
  detail::call call_;
  std::size_t covered_ = 0;
  const auto code_ = ptzcal_mesh_texture(get(), &covered_, call_.error());
  return call_.finish(code_, std::move(covered_));
}

inline outcome<ptzcal::mesh::size_result> mesh::size() const
{
  detail::call call_;
  std::size_t vertices_ = 0;
  std::size_t triangles_ = 0;
  std::size_t textures_ = 0;
  const auto code_ = ptzcal_mesh_size(get(), &vertices_, &triangles_, &textures_, call_.error());
  return call_.finish(code_, ptzcal::mesh::size_result{std::move(vertices_), std::move(triangles_),
      std::move(textures_)});
}

inline outcome<ptzcal::cloud> mesh::vertices() const
{
  detail::call call_;
  ptzcal_cloud *cloud_ = nullptr;
  const auto code_ = ptzcal_mesh_vertices(get(), &cloud_, call_.error());
  return call_.finish(code_, ptzcal::cloud(cloud_));
}

inline outcome<std::vector<std::uint32_t>> mesh::triangles() const
{
  detail::call call_;
  std::vector<std::uint32_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_mesh_copy_triangles(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<void> mesh::save(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_mesh_save(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::mesh> mesh::load(ptzcal::c_string path)
{
  detail::call call_;
  ptzcal_mesh *mesh_ = nullptr;
  const auto code_ = ptzcal_mesh_load(path.get(), &mesh_, call_.error());
  return call_.finish(code_, ptzcal::mesh(mesh_));
}

inline outcome<ptzcal::depth_map> mesh::depth_map(const ptzcal_camera &camera) const
{
  detail::call call_;
  ptzcal_depth_map *map_ = nullptr;
  const auto code_ = ptzcal_mesh_depth_map(get(), &camera, &map_, call_.error());
  return call_.finish(code_, ptzcal::depth_map(map_));
}

inline outcome<ptzcal::exploration> rig::explore(const ptzcal_explore_options &options,
    const ptzcal::scan_options &scan_options, const ptzcal::progress_callback &progress)
{
  detail::call call_;
  ptzcal_exploration *exploration_ = nullptr;
  const auto code_ = ptzcal_rig_explore(get(), &options, scan_options.get(),
      detail::progress_function(progress), detail::progress_user(progress), &exploration_, call_.error());
  return call_.finish(code_, ptzcal::exploration(exploration_));
}

inline outcome<ptzcal::exploration::visible_result> exploration::visible(std::uint32_t camera) const
{
  detail::call call_;
  ptzcal::region region_;
  ptzcal::visible visible_;
  const auto code_ = ptzcal_exploration_get_visible(get(), camera, &region_, &visible_, call_.error());
  return call_.finish(code_, ptzcal::exploration::visible_result{std::move(region_), std::move(visible_)});
}

inline outcome<std::vector<std::uint8_t>> exploration::mask(std::uint32_t camera) const
{
  detail::call call_;
  std::vector<std::uint8_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_exploration_copy_mask(get(), camera, buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::scan> exploration::scan() const
{
  detail::call call_;
  ptzcal_scan *scan_ = nullptr;
  const auto code_ = ptzcal_exploration_get_scan(get(), &scan_, call_.error());
  return call_.finish(code_, ptzcal::scan(scan_));
}

inline outcome<ptzcal::scan> rig::fire_again(const ptzcal::scan &before,
    ptzcal::view<const std::size_t> indices, const ptzcal::scan_options &scan_options,
    const ptzcal::progress_callback &progress)
{
  detail::call call_;
  const std::size_t n_ = indices.size() / 1;
  if (!(call_.rows("indices", indices.size(), n_, 1))) return call_.refuse<ptzcal::scan>();
  ptzcal_scan *again_ = nullptr;
  const auto code_ = ptzcal_rig_fire_again(get(), before.get(), indices.data(), n_, scan_options.get(),
      detail::progress_function(progress), detail::progress_user(progress), &again_, call_.error());
  return call_.finish(code_, ptzcal::scan(again_));
}

inline outcome<std::vector<std::size_t>> scan::choose_health_shots(std::uint32_t camera,
    std::size_t count) const
{
  detail::call call_;
  std::vector<std::size_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(4096, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_scan_choose_health_shots(get(), camera, count, buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::health_report> health_check(const ptzcal_rig_model &model,
    const ptzcal::calibration &calibration, const ptzcal::scan &before, const ptzcal::scan &again,
    std::uint32_t camera, const ptzcal_health_options &options)
{
  detail::call call_;
  ptzcal_health_report *report_ = nullptr;
  const auto code_ = ptzcal_health_check(&model, calibration.get(), before.get(), again.get(), camera,
      &options, &report_, call_.error());
  return call_.finish(code_, ptzcal::health_report(report_));
}

inline outcome<ptzcal::health_report> health_check_spots(const ptzcal_rig_model &model,
    const ptzcal::calibration &calibration, ptzcal::view<const double> readings,
    ptzcal::view<const double> spots, ptzcal::view<const std::uint8_t> seen,
    const ptzcal_health_options &options)
{
  detail::call call_;
  const std::size_t n_ = readings.size() / 2;
  if (!(call_.rows("readings", readings.size(), n_, 2) &&
        call_.rows("spots", spots.size(), n_, 20) &&
        call_.rows_or_none("seen", seen.size(), n_, 2))) return call_.refuse<ptzcal::health_report>();
  ptzcal_health_report *report_ = nullptr;
  const auto code_ = ptzcal_health_check_spots(&model, calibration.get(), readings.data(), spots.data(),
      seen.data(), n_, &options, &report_, call_.error());
  return call_.finish(code_, ptzcal::health_report(report_));
}

inline outcome<ptzcal::health> health_report::health() const
{
  detail::call call_;
  ptzcal::health health_;
  const auto code_ = ptzcal_health_report_get(get(), &health_, call_.error());
  return call_.finish(code_, std::move(health_));
}

inline std::string health_report::reason() const
{
  return ptzcal_health_report_reason(get());
}

inline outcome<std::vector<std::uint32_t>> health_report::shots() const
{
  detail::call call_;
  std::vector<std::uint32_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_health_report_copy_shots(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::calibration> health_report::refitted() const
{
  detail::call call_;
  ptzcal_calibration *calibration_ = nullptr;
  const auto code_ = ptzcal_health_report_refitted(get(), &calibration_, call_.error());
  return call_.finish(code_, ptzcal::calibration(calibration_));
}

inline outcome<ptzcal::adjustment> adjustment::make(const ptzcal_rig_model &model)
{
  detail::call call_;
  ptzcal_adjustment *adjustment_ = nullptr;
  const auto code_ = ptzcal_adjustment_new(&model, &adjustment_, call_.error());
  return call_.finish(code_, ptzcal::adjustment(adjustment_));
}

inline outcome<void> adjustment::set_rig_sigmas(ptzcal::view<const double> sigmas)
{
  detail::call call_;
  if (!(call_.rows("sigmas", sigmas.size(), 1, PTZCAL_RIG_PARAMETERS))) return call_.refuse<void>();
  const auto code_ = ptzcal_adjustment_set_rig_sigmas(get(), sigmas.data(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> adjustment::set_rig_covariance(ptzcal::view<const double> covariance)
{
  detail::call call_;
  if (!(call_.rows("covariance", covariance.size(), 1, 225))) return call_.refuse<void>();
  const auto code_ = ptzcal_adjustment_set_rig_covariance(get(), covariance.data(), call_.error());
  return call_.finish(code_);
}

inline outcome<std::uint32_t> adjustment::add_station(ptzcal::optional_ref<ptzcal_pose> pose,
    ptzcal::view<const double> covariance)
{
  detail::call call_;
  if (!(call_.rows_or_none("covariance", covariance.size(), 1, 36))) return call_.refuse<std::uint32_t>();
  std::uint32_t station_ = 0;
  const auto code_ = ptzcal_adjustment_add_station(get(), pose.get(), covariance.data(), &station_,
      call_.error());
  return call_.finish(code_, std::move(station_));
}

inline outcome<std::uint32_t> adjustment::add_camera(std::uint32_t width, std::uint32_t height,
    ptzcal::optional_ref<ptzcal::calibration_options> options)
{
  detail::call call_;
  std::uint32_t camera_ = 0;
  const auto code_ = ptzcal_adjustment_add_camera(get(), width, height, detail::pointer(options), &camera_,
      call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<std::uint32_t> adjustment::add_calibrated_camera(const ptzcal::calibration &calibration)
{
  detail::call call_;
  std::uint32_t camera_ = 0;
  const auto code_ = ptzcal_adjustment_add_calibrated_camera(get(), calibration.get(), &camera_,
      call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<std::uint32_t> adjustment::add_known_camera(const ptzcal_camera &known,
    ptzcal::view<const double> sigmas)
{
  detail::call call_;
  const std::size_t n_ = sigmas.size() / 1;
  if (!(call_.rows("sigmas", sigmas.size(), n_, 1))) return call_.refuse<std::uint32_t>();
  std::uint32_t camera_ = 0;
  const auto code_ = ptzcal_adjustment_add_known_camera(get(), &known, sigmas.data(), n_, &camera_,
      call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<std::size_t> adjustment::add_shots(std::uint32_t station, ptzcal::view<const double> pan_tilt,
    ptzcal::view<const double> spots, ptzcal::view<const double> spot_covariance,
    ptzcal::view<const std::uint8_t> seen)
{
  detail::call call_;
  const std::size_t n_ = pan_tilt.size() / 2;
  if (!(call_.rows("pan_tilt", pan_tilt.size(), n_, 2) &&
        call_.rows_or_none("spots", spots.size(), n_, 2) &&
        call_.rows_or_none("spot_covariance", spot_covariance.size(), n_, 3) &&
        call_.rows_or_none("seen", seen.size(), n_, 1))) return call_.refuse<std::size_t>();
  std::size_t first_ = 0;
  const auto code_ = ptzcal_adjustment_add_shots(get(), station, pan_tilt.data(), spots.data(),
      spot_covariance.data(), seen.data(), n_, &first_, call_.error());
  return call_.finish(code_, std::move(first_));
}

inline outcome<void> adjustment::add_sightings(std::uint32_t camera, ptzcal::view<const std::size_t> shots,
    ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance)
{
  detail::call call_;
  const std::size_t n_ = shots.size() / 1;
  if (!(call_.rows("shots", shots.size(), n_, 1) &&
        call_.rows("uv", uv.size(), n_, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), n_, 3))) return call_.refuse<void>();
  const auto code_ = ptzcal_adjustment_add_sightings(get(), camera, shots.data(), uv.data(),
      uv_covariance.data(), n_, call_.error());
  return call_.finish(code_);
}

inline outcome<std::size_t> adjustment::add_scan(std::uint32_t station, const ptzcal::scan &scan,
    ptzcal::view<const std::uint32_t> cameras)
{
  detail::call call_;
  const std::size_t n_ = cameras.size() / 1;
  if (!(call_.rows("cameras", cameras.size(), n_, 1))) return call_.refuse<std::size_t>();
  std::size_t first_ = 0;
  const auto code_ = ptzcal_adjustment_add_scan(get(), station, scan.get(), cameras.data(), n_, &first_,
      call_.error());
  return call_.finish(code_, std::move(first_));
}

inline outcome<ptzcal::adjusted_summary> adjusted::summary() const
{
  detail::call call_;
  ptzcal::adjusted_summary summary_;
  const auto code_ = ptzcal_adjusted_get_summary(get(), &summary_, call_.error());
  return call_.finish(code_, std::move(summary_));
}

inline outcome<ptzcal::rig_model> adjusted::rig_model() const
{
  detail::call call_;
  ptzcal::rig_model model_;
  const auto code_ = ptzcal_adjusted_get_rig_model(get(), &model_, call_.error());
  return call_.finish(code_, std::move(model_));
}

inline outcome<ptzcal::pose> adjusted::station(std::uint32_t station) const
{
  detail::call call_;
  ptzcal::pose pose_;
  const auto code_ = ptzcal_adjusted_get_station(get(), station, &pose_, call_.error());
  return call_.finish(code_, std::move(pose_));
}

inline outcome<ptzcal::calibration> adjusted::calibration(std::uint32_t camera) const
{
  detail::call call_;
  ptzcal_calibration *calibration_ = nullptr;
  const auto code_ = ptzcal_adjusted_get_calibration(get(), camera, &calibration_, call_.error());
  return call_.finish(code_, ptzcal::calibration(calibration_));
}

inline outcome<std::vector<double>> adjusted::covariance() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_adjusted_copy_covariance(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline std::string adjusted::parameter_name(std::size_t index) const
{
  return ptzcal_adjusted_parameter_name(get(), index);
}

inline outcome<ptzcal::adjusted> adjusted::resolve(ptzcal::optional_ref<ptzcal::cancel> cancel) const
{
  detail::call call_;
  ptzcal_adjusted *result_ = nullptr;
  const auto code_ = ptzcal_adjusted_resolve(get(), detail::pointer(cancel), &result_, call_.error());
  return call_.finish(code_, ptzcal::adjusted(result_));
}

inline std::string adjusted::warning(std::size_t index) const
{
  return ptzcal_adjusted_warning(get(), index);
}

inline std::string adjusted::weakest() const
{
  return ptzcal_adjusted_weakest(get());
}

inline std::string adjusted::prior_only(std::size_t index) const
{
  return ptzcal_adjusted_prior_only(get(), index);
}

inline outcome<ptzcal::suspect> adjusted::suspect(std::size_t index) const
{
  detail::call call_;
  ptzcal::suspect suspect_;
  const auto code_ = ptzcal_adjusted_get_suspect(get(), index, &suspect_, call_.error());
  return call_.finish(code_, std::move(suspect_));
}

inline std::string adjusted::suspect_name(std::size_t index) const
{
  return ptzcal_adjusted_suspect_name(get(), index);
}

inline outcome<std::vector<std::uint8_t>> adjusted::head_inliers() const
{
  detail::call call_;
  std::vector<std::uint8_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_adjusted_copy_head_inliers(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::adjusted::shot_point_result> adjusted::shot_point(std::size_t shot) const
{
  detail::call call_;
  std::array<double, 3> xyz_{};
  std::array<double, 9> covariance_{};
  const auto code_ = ptzcal_adjusted_shot_point(get(), shot, xyz_.data(), covariance_.data(), call_.error());
  return call_.finish(code_, ptzcal::adjusted::shot_point_result{std::move(xyz_), std::move(covariance_)});
}

inline outcome<ptzcal::adjusted::measure_result> adjusted::measure(std::uint32_t station,
    ptzcal::view<const double> pan_tilt, ptzcal::view<const double> spots,
    ptzcal::view<const double> spot_covariance) const
{
  detail::call call_;
  const std::size_t n_ = pan_tilt.size() / 2;
  if (!(call_.rows("pan_tilt", pan_tilt.size(), n_, 2) &&
        call_.rows("spots", spots.size(), n_, 2) &&
        call_.rows_or_none("spot_covariance", spot_covariance.size(), n_, 3))) return call_.refuse<ptzcal::adjusted::measure_result>();
  std::vector<double> xyz_(n_ * 3);
  std::vector<double> covariance_(n_ * 9);
  const auto code_ = ptzcal_adjusted_measure(get(), station, pan_tilt.data(), spots.data(),
      spot_covariance.data(), n_, xyz_.data(), covariance_.data(), call_.error());
  return call_.finish(code_, ptzcal::adjusted::measure_result{std::move(xyz_), std::move(covariance_)});
}

inline outcome<std::uint32_t> adjustment::add_plane(double flatness)
{
  detail::call call_;
  std::uint32_t plane_ = 0;
  const auto code_ = ptzcal_adjustment_add_plane(get(), flatness, &plane_, call_.error());
  return call_.finish(code_, std::move(plane_));
}

inline outcome<void> adjustment::set_planes(std::size_t first, ptzcal::view<const std::uint32_t> hits)
{
  detail::call call_;
  const std::size_t n_ = hits.size() / 1;
  if (!(call_.rows("hits", hits.size(), n_, 1))) return call_.refuse<void>();
  const auto code_ = ptzcal_adjustment_set_planes(get(), first, hits.data(), n_, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::adjusted::plane_result> adjusted::plane(std::uint32_t plane) const
{
  detail::call call_;
  std::array<double, 4> values_{};
  std::array<double, 16> covariance_{};
  const auto code_ = ptzcal_adjusted_get_plane(get(), plane, values_.data(), covariance_.data(),
      call_.error());
  return call_.finish(code_, ptzcal::adjusted::plane_result{std::move(values_), std::move(covariance_)});
}

inline outcome<std::vector<std::uint8_t>> adjusted::plane_inliers() const
{
  detail::call call_;
  std::vector<std::uint8_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_adjusted_copy_plane_inliers(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::ties> adjustment::tie_stations(const ptzcal_tie_options &options,
    const ptzcal::progress_callback &progress, ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  ptzcal_ties *ties_ = nullptr;
  const auto code_ = ptzcal_adjustment_tie_stations(get(), &options, detail::progress_function(progress),
      detail::progress_user(progress), detail::pointer(token), &ties_, call_.error());
  return call_.finish(code_, ptzcal::ties(ties_));
}

inline outcome<ptzcal::ties_summary> ties::summary() const
{
  detail::call call_;
  ptzcal::ties_summary summary_;
  const auto code_ = ptzcal_ties_get_summary(get(), &summary_, call_.error());
  return call_.finish(code_, std::move(summary_));
}

inline outcome<ptzcal::link> ties::link(std::uint32_t index) const
{
  detail::call call_;
  ptzcal::link link_;
  const auto code_ = ptzcal_ties_get_link(get(), index, &link_, call_.error());
  return call_.finish(code_, std::move(link_));
}

inline std::string ties::link_reason(std::uint32_t index) const
{
  return ptzcal_ties_link_reason(get(), index);
}

inline outcome<ptzcal::registration> ties::registration(std::uint32_t index) const
{
  detail::call call_;
  ptzcal_registration *registration_ = nullptr;
  const auto code_ = ptzcal_ties_get_registration(get(), index, &registration_, call_.error());
  return call_.finish(code_, ptzcal::registration(registration_));
}

inline outcome<ptzcal::loop> ties::loop(std::uint32_t index) const
{
  detail::call call_;
  ptzcal::loop closure_;
  const auto code_ = ptzcal_ties_get_loop(get(), index, &closure_, call_.error());
  return call_.finish(code_, std::move(closure_));
}

inline outcome<std::vector<std::uint32_t>> ties::copy_loop(std::uint32_t index) const
{
  detail::call call_;
  std::vector<std::uint32_t> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_ties_copy_loop(get(), index, buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::adjusted> adjustment::solve(const ptzcal_adjust_options &options,
    ptzcal::optional_ref<ptzcal::cancel> cancel) const
{
  detail::call call_;
  ptzcal_adjusted *result_ = nullptr;
  const auto code_ = ptzcal_adjustment_solve(get(), &options, detail::pointer(cancel), &result_,
      call_.error());
  return call_.finish(code_, ptzcal::adjusted(result_));
}

inline outcome<ptzcal::site> site::make(const ptzcal_rig_model &model, const ptzcal_camera &camera)
{
  detail::call call_;
  ptzcal_site *site_ = nullptr;
  const auto code_ = ptzcal_site_new(&model, &camera, &site_, call_.error());
  return call_.finish(code_, ptzcal::site(site_));
}

inline outcome<void> site::set_rig_sigmas(ptzcal::view<const double> sigmas)
{
  detail::call call_;
  if (!(call_.rows("sigmas", sigmas.size(), 1, 15))) return call_.refuse<void>();
  const auto code_ = ptzcal_site_set_rig_sigmas(get(), sigmas.data(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> site::set_pointing_sigma(double sigma_pan, double sigma_tilt)
{
  detail::call call_;
  const auto code_ = ptzcal_site_set_pointing_sigma(get(), sigma_pan, sigma_tilt, call_.error());
  return call_.finish(code_);
}

inline outcome<void> site::set_estimate(ptzcal::optional_ref<ptzcal::calibration_options> options)
{
  detail::call call_;
  const auto code_ = ptzcal_site_set_estimate(get(), detail::pointer(options), call_.error());
  return call_.finish(code_);
}

inline outcome<void> site::set_plane(ptzcal::view<const double> normal, double distance)
{
  detail::call call_;
  if (!(call_.rows("normal", normal.size(), 1, 3))) return call_.refuse<void>();
  const auto code_ = ptzcal_site_set_plane(get(), normal.data(), distance, call_.error());
  return call_.finish(code_);
}

inline outcome<void> site::set_room(ptzcal::view<const double> room, ptzcal::view<const double> boxes)
{
  detail::call call_;
  const std::size_t n_ = boxes.size() / 6;
  if (!(call_.rows("room", room.size(), 1, 6) &&
        call_.rows("boxes", boxes.size(), n_, 6))) return call_.refuse<void>();
  const auto code_ = ptzcal_site_set_room(get(), room.data(), boxes.data(), n_, call_.error());
  return call_.finish(code_);
}

inline outcome<void> site::set_depths(double nearest, double farthest)
{
  detail::call call_;
  const auto code_ = ptzcal_site_set_depths(get(), nearest, farthest, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::set_up> set_up::from_region(const ptzcal::site &site, const ptzcal_region &region)
{
  detail::call call_;
  ptzcal_set_up *set_up_ = nullptr;
  const auto code_ = ptzcal_set_up_from_region(site.get(), &region, &set_up_, call_.error());
  return call_.finish(code_, ptzcal::set_up(set_up_));
}

inline outcome<ptzcal::set_up> set_up::from_scan(const ptzcal::site &site, const ptzcal::scan &scan)
{
  detail::call call_;
  ptzcal_set_up *set_up_ = nullptr;
  const auto code_ = ptzcal_set_up_from_scan(site.get(), scan.get(), &set_up_, call_.error());
  return call_.finish(code_, ptzcal::set_up(set_up_));
}

inline outcome<ptzcal::set_up> set_up::from_points(const ptzcal::site &site, ptzcal::view<const double> xyz)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3))) return call_.refuse<ptzcal::set_up>();
  ptzcal_set_up *set_up_ = nullptr;
  const auto code_ = ptzcal_set_up_from_points(site.get(), xyz.data(), n_, &set_up_, call_.error());
  return call_.finish(code_, ptzcal::set_up(set_up_));
}

inline outcome<void> set_up::set_control(ptzcal::view<const double> xyz)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3))) return call_.refuse<void>();
  const auto code_ = ptzcal_set_up_set_control(get(), xyz.data(), n_, call_.error());
  return call_.finish(code_);
}

inline outcome<std::size_t> set_up::count() const
{
  detail::call call_;
  std::size_t count_ = 0;
  const auto code_ = ptzcal_set_up_get_count(get(), &count_, call_.error());
  return call_.finish(code_, std::move(count_));
}

inline outcome<ptzcal::study> study::run(const ptzcal::set_up &set_up, ptzcal::view<const double> levels,
    ptzcal::view<const double> distances, const ptzcal_study_options &options,
    const ptzcal::progress_callback &progress, ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  const std::size_t n_ = levels.size() / 2;
  const std::size_t m_ = distances.size() / 1;
  if (!(call_.rows("levels", levels.size(), n_, 2) &&
        call_.rows("distances", distances.size(), m_, 1))) return call_.refuse<ptzcal::study>();
  ptzcal_study *study_ = nullptr;
  const auto code_ = ptzcal_study_run(set_up.get(), levels.data(), n_, distances.data(), m_, &options,
      detail::progress_function(progress), detail::progress_user(progress), detail::pointer(token), &study_,
      call_.error());
  return call_.finish(code_, ptzcal::study(study_));
}

inline outcome<ptzcal::study_cell> study::cell(ptzcal::study_method method, std::size_t level) const
{
  detail::call call_;
  ptzcal::study_cell cell_;
  const auto code_ = ptzcal_study_get_cell(get(), method, level, &cell_, call_.error());
  return call_.finish(code_, std::move(cell_));
}

inline outcome<std::vector<double>> study::handoff(ptzcal::study_method method, std::size_t level) const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_study_copy_handoff(get(), method, level, buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<void> study::save_json(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_study_save_json(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> study::save_csv(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_study_save_csv(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> study::save_plot(ptzcal::study_plot plot, std::uint32_t of, ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_study_save_plot(get(), plot, of, path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::label> label::make(const ptzcal::set_up &set_up, ptzcal::view<const double> distances,
    ptzcal::view<const double> levels, const ptzcal_study_options &options,
    const ptzcal::progress_callback &progress, ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  const std::size_t m_ = distances.size() / 1;
  const std::size_t n_ = levels.size() / 2;
  if (!(call_.rows("distances", distances.size(), m_, 1) &&
        call_.rows("levels", levels.size(), n_, 2))) return call_.refuse<ptzcal::label>();
  ptzcal_label *label_ = nullptr;
  const auto code_ = ptzcal_label_make(set_up.get(), distances.data(), m_, levels.data(), n_, &options,
      detail::progress_function(progress), detail::progress_user(progress), detail::pointer(token), &label_,
      call_.error());
  return call_.finish(code_, ptzcal::label(label_));
}

inline outcome<std::size_t> label::count() const
{
  detail::call call_;
  std::size_t count_ = 0;
  const auto code_ = ptzcal_label_get_count(get(), &count_, call_.error());
  return call_.finish(code_, std::move(count_));
}

inline outcome<ptzcal::label_row> label::row(std::size_t index) const
{
  detail::call call_;
  ptzcal::label_row row_;
  const auto code_ = ptzcal_label_get_row(get(), index, &row_, call_.error());
  return call_.finish(code_, std::move(row_));
}

inline outcome<void> label::save_json(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_label_save_json(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> label::save_csv(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_label_save_csv(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> label::save_plot(std::uint32_t of, ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_label_save_plot(get(), of, path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::plan> plan::make(const ptzcal::site &site, const ptzcal_plan_options &options,
    ptzcal::optional_ref<ptzcal::cancel> token)
{
  detail::call call_;
  ptzcal_plan *result_ = nullptr;
  const auto code_ = ptzcal_plan_make(site.get(), &options, detail::pointer(token), &result_, call_.error());
  return call_.finish(code_, ptzcal::plan(result_));
}

inline outcome<ptzcal::plan_summary> plan::summary() const
{
  detail::call call_;
  ptzcal::plan_summary summary_;
  const auto code_ = ptzcal_plan_get_summary(get(), &summary_, call_.error());
  return call_.finish(code_, std::move(summary_));
}

inline outcome<std::vector<double>> plan::shots() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_plan_copy_shots(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::next_shots_result> next_shots(const ptzcal::site &site,
    ptzcal::view<const double> scanned, const ptzcal_region &candidates, double head_sigma,
    double fixed_sigma, double target, std::uint32_t count)
{
  detail::call call_;
  const std::size_t n_ = scanned.size() / 4;
  if (!(call_.rows("scanned", scanned.size(), n_, 4))) return call_.refuse<ptzcal::next_shots_result>();
  std::array<double, 2> now_{};
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(4096, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_next_shots(site.get(), scanned.data(), n_, &candidates, head_sigma, fixed_sigma, target, count,
    now_.data(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, ptzcal::next_shots_result{std::move(now_), std::move(buffer_)});
}

inline outcome<ptzcal::pointing> pointing::make(const ptzcal::calibration &calibration,
    const ptzcal_rig_model &model)
{
  detail::call call_;
  ptzcal_pointing *pointing_ = nullptr;
  const auto code_ = ptzcal_pointing_new(calibration.get(), &model, &pointing_, call_.error());
  return call_.finish(code_, ptzcal::pointing(pointing_));
}

inline outcome<ptzcal::pointing> pointing::from_adjusted(const ptzcal::adjusted &adjusted,
    std::uint32_t camera, std::uint32_t station)
{
  detail::call call_;
  ptzcal_pointing *pointing_ = nullptr;
  const auto code_ = ptzcal_pointing_new_adjusted(adjusted.get(), camera, station, &pointing_, call_.error());
  return call_.finish(code_, ptzcal::pointing(pointing_));
}

inline outcome<void> pointing::set_rig_covariance(ptzcal::view<const double> covariance)
{
  detail::call call_;
  if (!(call_.rows("covariance", covariance.size(), 1, 225))) return call_.refuse<void>();
  const auto code_ = ptzcal_pointing_set_rig_covariance(get(), covariance.data(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> pointing::set_station(const ptzcal_pose &pose, ptzcal::view<const double> covariance)
{
  detail::call call_;
  if (!(call_.rows_or_none("covariance", covariance.size(), 1, 36))) return call_.refuse<void>();
  const auto code_ = ptzcal_pointing_set_station(get(), &pose, covariance.data(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> pointing::set_head_deviation(double pan, double tilt)
{
  detail::call call_;
  const auto code_ = ptzcal_pointing_set_head_deviation(get(), pan, tilt, call_.error());
  return call_.finish(code_);
}

inline outcome<void> pointing::set_zoom_curve(const ptzcal::zoom_curve &curve)
{
  detail::call call_;
  const auto code_ = ptzcal_pointing_set_zoom_curve(get(), curve.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> pointing::set_reach(double pan_min, double pan_max, double tilt_min, double tilt_max)
{
  detail::call call_;
  const auto code_ = ptzcal_pointing_set_reach(get(), pan_min, pan_max, tilt_min, tilt_max, call_.error());
  return call_.finish(code_);
}

inline outcome<void> pointing::set_plane(ptzcal::view<const double> normal, double distance,
    ptzcal::view<const double> covariance, ptzcal::measured_by measured_by)
{
  detail::call call_;
  if (!(call_.rows("normal", normal.size(), 1, 3) &&
        call_.rows_or_none("covariance", covariance.size(), 1, 16))) return call_.refuse<void>();
  const auto code_ = ptzcal_pointing_set_plane(get(), normal.data(), distance, covariance.data(), measured_by,
      call_.error());
  return call_.finish(code_);
}

inline outcome<void> pointing::set_cloud(ptzcal::view<const double> xyz,
    ptzcal::view<const double> covariances, ptzcal::measured_by measured_by)
{
  detail::call call_;
  const std::size_t n_ = xyz.size() / 3;
  if (!(call_.rows("xyz", xyz.size(), n_, 3) &&
        call_.rows_or_none("covariances", covariances.size(), n_, 9))) return call_.refuse<void>();
  const auto code_ = ptzcal_pointing_set_cloud(get(), xyz.data(), covariances.data(), n_, measured_by,
      call_.error());
  return call_.finish(code_);
}

inline outcome<void> pointing::set_distance(double metres, double sigma)
{
  detail::call call_;
  const auto code_ = ptzcal_pointing_set_distance(get(), metres, sigma, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::aim> pointing::aim(ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance, double probability, double target_size) const
{
  detail::call call_;
  if (!(call_.rows("uv", uv.size(), 1, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), 1, 3))) return call_.refuse<ptzcal::aim>();
  ptzcal::aim aim_;
  const auto code_ = ptzcal_pointing_aim(get(), uv.data(), uv_covariance.data(), probability, target_size,
      &aim_, call_.error());
  return call_.finish(code_, std::move(aim_));
}

inline outcome<ptzcal::located> pointing::locate(double pan, double tilt, double zoom,
    ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance) const
{
  detail::call call_;
  if (!(call_.rows("uv", uv.size(), 1, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), 1, 3))) return call_.refuse<ptzcal::located>();
  ptzcal::located located_;
  const auto code_ = ptzcal_pointing_locate(get(), pan, tilt, zoom, uv.data(), uv_covariance.data(),
      &located_, call_.error());
  return call_.finish(code_, std::move(located_));
}

inline outcome<std::vector<double>> pointing::located_along(double pan, double tilt, double zoom,
    ptzcal::view<const double> uv, ptzcal::view<const double> uv_covariance, double nearest,
    double farthest) const
{
  detail::call call_;
  if (!(call_.rows("uv", uv.size(), 1, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), 1, 3))) return call_.refuse<std::vector<double>>();
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_pointing_copy_located_along(get(), pan, tilt, zoom, uv.data(), uv_covariance.data(), nearest, farthest,
    buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::ellipse_result> ellipse(ptzcal::view<const double> covariance, double probability)
{
  detail::call call_;
  if (!(call_.rows("covariance", covariance.size(), 1, 3))) return call_.refuse<ptzcal::ellipse_result>();
  std::array<double, 2> semi_axes_{};
  double angle_ = 0;
  const auto code_ = ptzcal_ellipse(covariance.data(), probability, semi_axes_.data(), &angle_,
      call_.error());
  return call_.finish(code_, ptzcal::ellipse_result{std::move(semi_axes_), std::move(angle_)});
}

inline outcome<ptzcal::sweep> pointing::sweep(ptzcal::view<const double> uv,
    ptzcal::view<const double> uv_covariance, double nearest, double farthest, double probability,
    double target_size) const
{
  detail::call call_;
  if (!(call_.rows("uv", uv.size(), 1, 2) &&
        call_.rows_or_none("uv_covariance", uv_covariance.size(), 1, 3))) return call_.refuse<ptzcal::sweep>();
  ptzcal_sweep *sweep_ = nullptr;
  const auto code_ = ptzcal_pointing_sweep(get(), uv.data(), uv_covariance.data(), nearest, farthest,
      probability, target_size, &sweep_, call_.error());
  return call_.finish(code_, ptzcal::sweep(sweep_));
}

inline outcome<ptzcal::sweep_summary> sweep::summary() const
{
  detail::call call_;
  ptzcal::sweep_summary summary_;
  const auto code_ = ptzcal_sweep_get_summary(get(), &summary_, call_.error());
  return call_.finish(code_, std::move(summary_));
}

inline outcome<std::vector<double>> sweep::steps() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_sweep_copy_steps(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<std::vector<double>> sweep::curve() const
{
  detail::call call_;
  std::vector<double> buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_sweep_copy_curve(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, std::move(buffer_));
}

inline outcome<ptzcal::camera> camera::read(ptzcal::c_string path, ptzcal::camera_format format)
{
  detail::call call_;
  ptzcal::camera camera_;
  const auto code_ = ptzcal_camera_read(path.get(), format, &camera_, call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<void> camera::write(ptzcal::c_string path, ptzcal::camera_format format) const
{
  detail::call call_;
  const auto code_ = ptzcal_camera_write(this, path.get(), format, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::camera_list> camera_list::make()
{
  detail::call call_;
  ptzcal_camera_list *list_ = nullptr;
  const auto code_ = ptzcal_camera_list_new(&list_, call_.error());
  return call_.finish(code_, ptzcal::camera_list(list_));
}

inline outcome<void> camera_list::add(const ptzcal_camera &camera, ptzcal::c_string name)
{
  detail::call call_;
  const auto code_ = ptzcal_camera_list_add(get(), &camera, name.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::camera_list> camera_list::read(ptzcal::c_string path, ptzcal::camera_format format)
{
  detail::call call_;
  ptzcal_camera_list *list_ = nullptr;
  const auto code_ = ptzcal_camera_list_read(path.get(), format, &list_, call_.error());
  return call_.finish(code_, ptzcal::camera_list(list_));
}

inline outcome<void> camera_list::write(ptzcal::c_string path, ptzcal::camera_format format) const
{
  detail::call call_;
  const auto code_ = ptzcal_camera_list_write(get(), path.get(), format, call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::camera_list::count_result> camera_list::count() const
{
  detail::call call_;
  std::size_t count_ = 0;
  std::uint32_t format_ = 0;
  const auto code_ = ptzcal_camera_list_count(get(), &count_, &format_, call_.error());
  return call_.finish(code_, ptzcal::camera_list::count_result{std::move(count_), std::move(format_)});
}

inline outcome<ptzcal::camera_list::camera_result> camera_list::camera(std::size_t index) const
{
  detail::call call_;
  ptzcal::camera camera_;
  std::uint32_t has_pose_ = 0;
  const auto code_ = ptzcal_camera_list_get(get(), index, &camera_, &has_pose_, call_.error());
  return call_.finish(code_, ptzcal::camera_list::camera_result{std::move(camera_), std::move(has_pose_)});
}

inline std::string camera_list::name(std::size_t index) const
{
  return ptzcal_camera_list_name(get(), index);
}

inline outcome<ptzcal::report> report::make(ptzcal::c_string title)
{
  detail::call call_;
  ptzcal_report *report_ = nullptr;
  const auto code_ = ptzcal_report_new(title.get(), &report_, call_.error());
  return call_.finish(code_, ptzcal::report(report_));
}

inline outcome<void> report::set_up(ptzcal::view<const double> up)
{
  detail::call call_;
  if (!(call_.rows("up", up.size(), 1, 3))) return call_.refuse<void>();
  const auto code_ = ptzcal_report_set_up(get(), up.data(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> report::add_note(ptzcal::c_string note)
{
  detail::call call_;
  const auto code_ = ptzcal_report_add_note(get(), note.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> report::add_calibration(ptzcal::c_string name, const ptzcal::calibration &calibration,
    ptzcal::optional_ref<ptzcal::correspondences> set, ptzcal::optional_ref<ptzcal_image> picture)
{
  detail::call call_;
  const auto code_ = ptzcal_report_add_calibration(get(), name.get(), calibration.get(), detail::pointer(set),
      picture.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> report::add_board_calibration(ptzcal::c_string name,
    const ptzcal::board_calibration &calibration, const ptzcal::boards &boards)
{
  detail::call call_;
  const auto code_ = ptzcal_report_add_board_calibration(get(), name.get(), calibration.get(), boards.get(),
      call_.error());
  return call_.finish(code_);
}

inline outcome<void> report::add_scan(ptzcal::c_string name, const ptzcal::scan &scan)
{
  detail::call call_;
  const auto code_ = ptzcal_report_add_scan(get(), name.get(), scan.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> report::add_adjusted(ptzcal::c_string name, const ptzcal::adjusted &adjusted)
{
  detail::call call_;
  const auto code_ = ptzcal_report_add_adjusted(get(), name.get(), adjusted.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> report::add_input(ptzcal::c_string name, ptzcal::view<const std::uint8_t> bytes)
{
  detail::call call_;
  const std::size_t n_ = bytes.size() / 1;
  if (!(call_.rows("bytes", bytes.size(), n_, 1))) return call_.refuse<void>();
  const auto code_ = ptzcal_report_add_input(get(), name.get(), bytes.data(), n_, call_.error());
  return call_.finish(code_);
}

inline outcome<std::string> report::html() const
{
  detail::call call_;
  std::string buffer_;
  std::size_t needed_ = 0;
  const auto code_ = detail::fill(0, needed_, [&](std::size_t capacity_) {
    buffer_.resize(capacity_);
    return ptzcal_report_copy_html(get(), buffer_.data(), capacity_, &needed_, call_.error());
  });
  if (code_ == PTZCAL_STATUS_OK) {
    buffer_.resize(needed_);
  }
  return call_.finish(code_, detail::text(std::move(buffer_)));
}

inline outcome<void> report::save(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_report_save(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> calibration::save(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_calibration_save(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> camera::save(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_camera_save(this, path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::camera> camera::load(ptzcal::c_string path)
{
  detail::call call_;
  ptzcal::camera camera_;
  const auto code_ = ptzcal_camera_load(path.get(), &camera_, call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<void> camera::save_opencv(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_camera_save_opencv(this, path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<ptzcal::camera> camera::load_opencv(ptzcal::c_string path)
{
  detail::call call_;
  ptzcal::camera camera_;
  const auto code_ = ptzcal_camera_load_opencv(path.get(), &camera_, call_.error());
  return call_.finish(code_, std::move(camera_));
}

inline outcome<ptzcal::calibration_load_inputs_result> calibration_load_inputs(ptzcal::c_string path)
{
  detail::call call_;
  ptzcal_correspondences *set_ = nullptr;
  ptzcal_calibration_options *options_ = nullptr;
  const auto code_ = ptzcal_calibration_load_inputs(path.get(), &set_, &options_, call_.error());
  return call_.finish(code_, ptzcal::calibration_load_inputs_result{ptzcal::correspondences(set_),
      ptzcal::calibration_options(options_)});
}

inline outcome<std::size_t> correspondences::add_csv(ptzcal::c_string path)
{
  detail::call call_;
  std::size_t added_ = 0;
  const auto code_ = ptzcal_correspondences_add_csv(get(), path.get(), &added_, call_.error());
  return call_.finish(code_, std::move(added_));
}

inline outcome<void> correspondences::save_csv(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_correspondences_save_csv(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> scan::save_ply(ptzcal::c_string path) const
{
  detail::call call_;
  const auto code_ = ptzcal_scan_save_ply(get(), path.get(), call_.error());
  return call_.finish(code_);
}

inline outcome<void> head::close()
{
  detail::call call_;
  const auto code_ = ptzcal_head_close(detach(), call_.error());
  hand_over(call_);
  return call_.finish(code_);
}

inline outcome<void> rig::close()
{
  detail::call call_;
  const auto code_ = ptzcal_rig_close(detach(), call_.error());
  hand_over(call_);
  return call_.finish(code_);
}

PTZCAL_END

#endif
