/*
 * One good value for every type that an argument can have, by the name fixture_<type>: the tests
 * that try bad values (tests/c_api/hostile.rs) leave the other arguments good. A new type of the
 * header gets one here.
 */
#ifndef FIXTURES_H
#define FIXTURES_H

#include "check.h"
#include <math.h>
#include <string.h>

#define FIXTURE_POINTS 80
#define FIXTURE_VIEWS 6
#define FIXTURE_CORNERS 20

static ptzcal_camera fixture_camera[1];
static ptzcal_rig_model fixture_rig_model[1];
static ptzcal_image fixture_image[1];
static const ptzcal_image *fixture_images[4];
static ptzcal_spot fixture_spot[1];
static ptzcal_chessboard_options fixture_chessboard_options[1];
static ptzcal_chessboard fixture_chessboard[1];
static ptzcal_sift_options fixture_sift_options[1];
static ptzcal_sift_match_options fixture_sift_match_options[1];
static ptzcal_line_options fixture_line_options[1];
static ptzcal_line_fit_options fixture_line_fit_options[1];
static ptzcal_line_match_options fixture_line_match_options[1];
static ptzcal_calibration_summary fixture_calibration_summary[1];
static ptzcal_board_view fixture_board_view[1];
static ptzcal_laser_line fixture_laser_line[1];
static ptzcal_zoom_position fixture_zoom_position[1];
static ptzcal_rig_view fixture_rig_view[1];
static ptzcal_common_line fixture_common_line[1];
static ptzcal_rgbd_options fixture_rgbd_options[1];
static ptzcal_rgbd_view fixture_rgbd_view[1];

static ptzcal_pose fixture_pose[1];
static ptzcal_planes_options fixture_planes_options[1];
static ptzcal_plane fixture_plane[1];
static ptzcal_station_options fixture_station_options[1];
static ptzcal_station_pose fixture_station_pose[1];
static ptzcal_ptz fixture_ptz[1];
static ptzcal_head_capabilities fixture_head_capabilities[1];
static ptzcal_angle_summary fixture_angle_summary[1];
static ptzcal_angle_learning_options fixture_angle_learning_options[1];
static ptzcal_probe_options fixture_probe_options[1];
static ptzcal_figure fixture_figure[1];
static ptzcal_region fixture_region[1];
static ptzcal_shot fixture_shot[1];
static ptzcal_scan_summary fixture_scan_summary[1];
static ptzcal_surface_options fixture_surface_options[1];

static ptzcal_adjust_options fixture_adjust_options[1];
static ptzcal_adjusted_summary fixture_adjusted_summary[1];
static ptzcal_suspect fixture_suspect[1];
static ptzcal_tie_options fixture_tie_options[1];
static ptzcal_ties_summary fixture_ties_summary[1];
static ptzcal_link fixture_link[1];
static ptzcal_loop fixture_loop[1];
static ptzcal_study_options fixture_study_options[1];
static ptzcal_study_cell fixture_study_cell[1];
static ptzcal_label_row fixture_label_row[1];
static ptzcal_plan_options fixture_plan_options[1];
static ptzcal_plan_summary fixture_plan_summary[1];

static ptzcal_aim fixture_aim[1];
static ptzcal_located fixture_located[1];
static ptzcal_sweep_summary fixture_sweep_summary[1];
static ptzcal_explore_options fixture_explore_options[1];
static ptzcal_visible fixture_visible[1];
static ptzcal_health_options fixture_health_options[1];
static ptzcal_health fixture_health[1];

static ptzcal_error *fixture_error;
static ptzcal_cancel *fixture_cancel;
static ptzcal_spot_options *fixture_spot_options;
static ptzcal_spot_detector *fixture_spot_detector;
static ptzcal_sift_features *fixture_sift_features;
static ptzcal_picture *fixture_picture;
static ptzcal_depth_map *fixture_depth_map;
static ptzcal_undistorter *fixture_undistorter;
static ptzcal_rgbd *fixture_rgbd;
static ptzcal_correspondences *fixture_correspondences;
static ptzcal_calibration_options *fixture_calibration_options;
static ptzcal_calibration *fixture_calibration;
static ptzcal_boards *fixture_boards;
static ptzcal_board_calibration *fixture_board_calibration;
static ptzcal_laser_calibration *fixture_laser_calibration;
static ptzcal_zoom_curve *fixture_zoom_curve;
static ptzcal_rig_calibration *fixture_rig_calibration;
static ptzcal_rig_calibrated *fixture_rig_calibrated;
static ptzcal_roof_edges *fixture_roof_edges;
static ptzcal_pose_options *fixture_pose_options;
static ptzcal_pose_estimate *fixture_pose_estimate;
static ptzcal_planes *fixture_planes;
static ptzcal_registration *fixture_registration;
static ptzcal_simulator *fixture_simulator;
static ptzcal_rig_options *fixture_rig_options;
static ptzcal_rig *fixture_rig;
static ptzcal_head_options *fixture_head_options;
static ptzcal_head *fixture_head;
static ptzcal_angle_map *fixture_angle_map;
static ptzcal_camera_list *fixture_camera_list;
static ptzcal_probe_report *fixture_probe_report;
static ptzcal_scan_options *fixture_scan_options;
static ptzcal_scan *fixture_scan;
static ptzcal_cloud *fixture_cloud;
static ptzcal_mesh *fixture_mesh;
static ptzcal_adjustment *fixture_adjustment;
static ptzcal_adjusted *fixture_adjusted;
static ptzcal_ties *fixture_ties;
static ptzcal_site *fixture_site;
static ptzcal_set_up *fixture_set_up;
static ptzcal_study *fixture_study;
static ptzcal_label *fixture_label;
static ptzcal_plan *fixture_plan;
static ptzcal_pointing *fixture_pointing;
static ptzcal_sweep *fixture_sweep;
static ptzcal_exploration *fixture_exploration;
static ptzcal_health_report *fixture_health_report;
static ptzcal_report *fixture_report;

static unsigned char fixture_pixels[16 * 12];
static const uint16_t fixture_millimetres[64] = {1000};
static const float fixture_metres[64] = {1.0f};
static double fixture_xyz[FIXTURE_POINTS * 3];
static double fixture_uv[FIXTURE_POINTS * 2];
/* As descriptors, four of them. */
static const uint32_t fixture_pairs[8] = {0, 0, 1, 1, 2, 2, 3, 3};
static const int32_t fixture_region_of[4] = {0, 0, -1, 0};
static uint8_t fixture_flags[4 * PTZCAL_SIFT_DESCRIPTOR_SIZE];
static size_t fixture_shots[4];
static size_t fixture_indices[4];
static uint32_t fixture_cameras[4];
static uint32_t fixture_hits[4];
static const uint32_t fixture_triangles[12] = {0, 1, 2, 0, 2, 3};

/* Uniform in [-1, 1], the same on every machine. */
static inline double fixture_random(uint32_t *state)
{
  *state = *state * 1664525u + 1013904223u;
  return (double)(*state >> 8) / 8388608.0 - 1.0;
}

/* A camera at (0.5, -0.2, -1), turned by about 16 degrees about y, without distortion. */
static inline void make_camera(ptzcal_camera *camera)
{
  const double s = 0.28, c = 0.96;
  CHECK_OK(ptzcal_camera_init(camera, sizeof *camera));
  camera->width = 800;
  camera->height = 600;
  camera->fx = 845.0;
  camera->fy = 845.5;
  camera->cx = 410.0;
  camera->cy = 295.0;
  camera->rotation[0] = c;
  camera->rotation[2] = s;
  camera->rotation[6] = -s;
  camera->rotation[8] = c;
  /* t = -R (0.5, -0.2, -1) */
  camera->translation[0] = -(c * 0.5 - s);
  camera->translation[1] = 0.2;
  camera->translation[2] = -(-s * 0.5 - c);
}

static inline void make_rig_model(ptzcal_rig_model *model)
{
  CHECK_OK(ptzcal_rig_model_init(model, sizeof *model));
  model->width = 720;
  model->height = 576;
  model->fx = model->fy = 800.0;
  model->cx = 360.0;
  model->cy = 288.0;
  model->laser_x0 = 0.1;
  model->laser_y0 = 0.005;
}

/* Points in front of the camera of make_camera, at depths of 2 to 5 m, with their pixels. */
static inline void make_points(const ptzcal_camera *camera, double *xyz, double *uv, size_t n, double noise)
{
  uint32_t state = 7;
  size_t i;
  for (i = 0; i < n; i++) {
    double z = 2.5 + 1.5 * fixture_random(&state);
    xyz[3 * i] = -0.4 + 0.35 * (z + 1.0) * fixture_random(&state) - 0.2 * z;
    xyz[3 * i + 1] = 0.25 * (z + 1.0) * fixture_random(&state);
    xyz[3 * i + 2] = z;
  }
  CHECK_OK(ptzcal_camera_project(camera, xyz, n, uv, NULL));
  for (i = 0; i < 2 * n; i++) uv[i] += noise * fixture_random(&state);
}

/* Corners of a board of 5 x 4 at 0.1 m, 1 to 3.5 m in front of the rig's head camera, tilted one way and
   another, and the laser's spot on it. */
static inline void make_board_view(uint32_t view, double noise, ptzcal_camera *pose, double *board_xy, double *uv, double *spot)
{
  static const double turns[FIXTURE_VIEWS][4] = {/* cos, sin about y; cos, sin about x */
    {0.8, 0.6, 1, 0}, {0.8, -0.6, 0.96, 0.28}, {1, 0, 0.8, 0.6}, {0.96, 0.28, 0.8, -0.6}, {0.8, 0.6, 0.8, 0.6}, {0.96, -0.28, 0.96, 0.28}};
  const double *turn = turns[view], z = 1.0 + 0.5 * view;
  ptzcal_rig_model model;
  ptzcal_camera head;
  double xyz[3 * FIXTURE_CORNERS], point[3], *R = pose->rotation, depth;
  uint32_t state = 11 + view;
  size_t i;
  make_rig_model(&model);
  CHECK_OK(ptzcal_camera_init(pose, sizeof *pose));
  CHECK_OK(ptzcal_rig_model_head_camera(&model, 0.0, 0.0, pose, NULL));
  for (i = 0; i < FIXTURE_CORNERS; i++) {
    board_xy[2 * i] = xyz[3 * i] = 0.1 * ((double)(i % 5) - 2.0);
    board_xy[2 * i + 1] = xyz[3 * i + 1] = 0.1 * ((double)(i / 5) - 1.5);
    xyz[3 * i + 2] = 0.0;
  }
  R[0] = turn[0], R[1] = turn[1] * turn[3], R[2] = turn[1] * turn[2];
  R[3] = 0.0, R[4] = turn[2], R[5] = -turn[3];
  R[6] = -turn[1], R[7] = turn[0] * turn[3], R[8] = turn[0] * turn[2];
  pose->translation[0] = 0.12 * ((double)(view % 3) - 1.0) * z;
  pose->translation[1] = 0.1 * ((double)(view % 2) - 0.5) * z;
  pose->translation[2] = z;
  CHECK_OK(ptzcal_camera_project(pose, xyz, FIXTURE_CORNERS, uv, NULL));
  for (i = 0; i < 2 * FIXTURE_CORNERS; i++) uv[i] += noise * fixture_random(&state);
  /* n . ((x0, y0, 0) + Z (0, 0, 1) - t) = 0 */
  depth = pose->translation[2] + (R[2] * (pose->translation[0] - model.laser_x0) + R[5] * (pose->translation[1] - model.laser_y0)) / R[8];
  point[0] = model.laser_x0, point[1] = model.laser_y0, point[2] = depth;
  CHECK_OK(ptzcal_camera_init(&head, sizeof head));
  CHECK_OK(ptzcal_rig_model_head_camera(&model, 0.0, 0.0, &head, NULL));
  CHECK_OK(ptzcal_camera_project(&head, point, 1, spot, NULL));
  for (i = 0; i < 2; i++) spot[i] += noise * fixture_random(&state);
}

static inline void make_boards(ptzcal_boards **boards, double noise)
{
  ptzcal_camera pose;
  double board_xy[2 * FIXTURE_CORNERS], uv[2 * FIXTURE_CORNERS], spot[2];
  uint32_t view;
  CHECK_OK(ptzcal_boards_new(720, 576, boards, NULL));
  for (view = 0; view < FIXTURE_VIEWS; view++) {
    make_board_view(view, noise, &pose, board_xy, uv, spot);
    CHECK_OK(ptzcal_boards_add_view(*boards, board_xy, uv, NULL, FIXTURE_CORNERS, NULL));
    CHECK_OK(ptzcal_boards_set_spot(*boards, view, spot, NULL, NULL));
  }
}

/* The same views at zoom 0, and at zoom 1 with twice the focal length. */
static inline void make_rig_views(ptzcal_rig_calibration **calibration, double noise)
{
  const double centre[2] = {360.0, 288.0};
  ptzcal_camera pose;
  double board_xy[2 * FIXTURE_CORNERS], uv[2 * FIXTURE_CORNERS], spot[2];
  uint32_t view, zoom, added;
  size_t i;
  CHECK_OK(ptzcal_rig_calibration_new(5, 4, 0.1, NULL, NULL, calibration, NULL));
  for (zoom = 0; zoom < 2; zoom++) {
    for (view = 0; view < FIXTURE_VIEWS; view++) {
      make_board_view(view, noise, &pose, board_xy, uv, spot);
      for (i = 0; i < 2 * FIXTURE_CORNERS; i++) uv[i] += (uv[i] - centre[i % 2]) * zoom;
      for (i = 0; i < 2; i++) spot[i] += (spot[i] - centre[i]) * zoom;
      CHECK_OK(ptzcal_rig_calibration_add_corners(*calibration, zoom, 720, 576, board_xy, uv, NULL, FIXTURE_CORNERS, &added, NULL));
      CHECK(added == zoom * FIXTURE_VIEWS + view);
      CHECK_OK(ptzcal_rig_calibration_set_spot(*calibration, added, spot, NULL, NULL));
    }
  }
}

static inline void make_image(ptzcal_image *image, const void *pixels, uint32_t width, uint32_t height)
{
  CHECK_OK(ptzcal_image_init(image, sizeof *image));
  image->format = PTZCAL_PIXEL_FORMAT_GRAY8;
  image->width = width;
  image->height = height;
  image->plane[0] = pixels;
  image->stride[0] = (ptrdiff_t)width;
  image->size[0] = (size_t)width * height;
}

/* Where the laser of a rig at `station` hits at `depth` along the head camera's axis, in the world,
 * and where the head camera sees it. */
static inline void make_shot(const ptzcal_rig_model *rig, const ptzcal_pose *station, const double *pan_tilt,
                             double depth, double *point, double *spot)
{
  ptzcal_camera head;
  double beam[3], here[3];
  int i, k;
  CHECK_OK(ptzcal_camera_init(&head, sizeof head));
  CHECK_OK(ptzcal_rig_model_head_camera(rig, pan_tilt[0], pan_tilt[1], &head, NULL));
  beam[0] = rig->laser_x0 + rig->laser_vx * depth - head.translation[0];
  beam[1] = rig->laser_y0 + rig->laser_vy * depth - head.translation[1];
  beam[2] = depth - head.translation[2];
  for (i = 0; i < 3; i++)
    for (k = 0, here[i] = 0.0; k < 3; k++) here[i] += head.rotation[3 * k + i] * beam[k];
  CHECK_OK(ptzcal_camera_project(&head, here, 1, spot, NULL));
  for (i = 0; i < 3; i++)
    for (k = 0, point[i] = station->translation[i]; k < 3; k++) point[i] += station->rotation[3 * i + k] * here[k];
}

/* A survey from one station: what `rig` shoots, believed to be `model`, seen by the cameras. Noise is
 * uniform of half width `noise`; covariances say so. */
static inline void make_survey(ptzcal_adjustment **survey, const ptzcal_rig_model *model, const ptzcal_rig_model *rig,
                               const ptzcal_camera *cameras, uint32_t n_cameras, size_t n, double noise)
{
  const double variance = noise * noise / 3.0, covariance[3] = {variance, 0.0, variance};
  ptzcal_pose world;
  uint32_t state = 11, camera, station;
  size_t i, first;
  int k;
  CHECK_OK(ptzcal_pose_init(&world, sizeof world));
  CHECK_OK(ptzcal_adjustment_new(model, survey, NULL));
  CHECK_OK(ptzcal_adjustment_add_station(*survey, &world, NULL, &station, NULL));
  for (camera = 0; camera < n_cameras; camera++) {
    uint32_t index;
    CHECK_OK(ptzcal_adjustment_add_camera(*survey, cameras[camera].width, cameras[camera].height, NULL, &index, NULL));
    CHECK(index == camera);
  }
  for (i = 0; i < n; i++) {
    double pan_tilt[2], spot[2], point[3], uv[2], depth = 3.0 + 1.5 * fixture_random(&state);
    pan_tilt[0] = -0.15 + 0.25 * fixture_random(&state);
    pan_tilt[1] = 0.2 * fixture_random(&state);
    make_shot(rig, &world, pan_tilt, depth, point, spot);
    for (k = 0; k < 2; k++) spot[k] += noise * fixture_random(&state);
    CHECK_OK(ptzcal_adjustment_add_shots(*survey, station, pan_tilt, spot, covariance, NULL, 1, &first, NULL));
    CHECK(first == i);
    for (camera = 0; camera < n_cameras; camera++) {
      CHECK_OK(ptzcal_camera_project(&cameras[camera], point, 1, uv, NULL));
      for (k = 0; k < 2; k++) uv[k] += noise * fixture_random(&state);
      CHECK_OK(ptzcal_adjustment_add_sightings(*survey, camera, &first, uv, covariance, 1, NULL));
    }
  }
}

/* A corner of a room, seen from (x, 0, 0) in its frame: three planes, and their three edges. */
static inline void make_corner(ptzcal_roof_edges **edges, double x)
{
  static const double normals[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const double distances[3] = {2.0, 1.5, 3.0};
  uint32_t planes[3], i;
  CHECK_OK(ptzcal_roof_edges_new(edges, NULL));
  for (i = 0; i < 3; i++)
    CHECK_OK(ptzcal_roof_edges_add_plane(*edges, normals + 3 * i, distances[i] - (i == 0 ? x : 0.0), NULL, &planes[i], NULL));
  for (i = 0; i < 3; i++) CHECK_OK(ptzcal_roof_edges_add_edge(*edges, planes[i], planes[(i + 1) % 3], NULL));
}

/* Where a ray from `from` leaves (inside = 1) or enters a box, and 1e9 where it does not. */
static inline double hit_box(const double *low, const double *high, int inside, const double *from, const double *ray)
{
  double in = -1e9, out = 1e9;
  int k;
  for (k = 0; k < 3; k++) {
    double a = (low[k] - from[k]) / ray[k], b = (high[k] - from[k]) / ray[k];
    in = fmax(in, fmin(a, b));
    out = fmin(out, fmax(a, b));
  }
  if (inside) return out;
  return in < out && in > 0.0 ? in : 1e9;
}

/* `n` points of a room with a cupboard, a table, a pillar and a crate, measured to 5 mm by a station at
 * (x, 0, z) that is turned to the right by `turn`, in its frame; y points down. */
static inline void make_room(double x, double z, double turn, int furniture, size_t n, double *xyz)
{
  static const double boxes[5][6] = {{-3, -1.5, -2, 3, 1.1, 2.4}, {-3, -0.7, 1.4, -1.8, 1.1, 2.4}, {1.2, 0.3, -2, 2.4, 1.1, -1.2},
    {2.5, -1.5, 1.7, 3, 1.1, 2.4}, {-2.6, 0.6, -1.8, -1.9, 1.1, -1.1}};
  const double from[3] = {x, 0.0, z}, s = sin(turn), c = cos(turn);
  uint32_t state = 5;
  size_t i = 0;
  while (i < n) {
    double ray[3], v[3], square, range;
    int k;
    for (k = 0; k < 3; k++) v[k] = fixture_random(&state);
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    if (square > 1.0 || square < 1e-3) continue;
    for (k = 0; k < 3; k++) v[k] /= sqrt(square);
    ray[0] = c * v[0] + s * v[2], ray[1] = v[1], ray[2] = c * v[2] - s * v[0];
    range = hit_box(boxes[0], boxes[0] + 3, 1, from, ray);
    for (k = 1; furniture && k < 5; k++) range = fmin(range, hit_box(boxes[k], boxes[k] + 3, 0, from, ray));
    range += 0.005 * fixture_random(&state);
    for (k = 0; k < 3; k++) xyz[3 * i + (size_t)k] = v[k] * range;
    i++;
  }
}

/* A survey of that room from stations at (x, 0, z), turned to the right by a third number, tipped down by a
 * fourth: the first one fixed, the others without a pose. `n` shots each on a grid all around. */
static inline void make_walk(const ptzcal_rig_model *model, const double *places, uint32_t stations, size_t n,
                             ptzcal_adjustment **survey)
{
  static const double boxes[5][6] = {{-3, -1.5, -2, 3, 1.1, 2.4}, {-3, -0.7, 1.4, -1.8, 1.1, 2.4}, {1.2, 0.3, -2, 2.4, 1.1, -1.2},
    {2.5, -1.5, 1.7, 3, 1.1, 2.4}, {-2.6, 0.6, -1.8, -1.9, 1.1, -1.1}};
  const double sigma = 0.05, covariance[3] = {sigma * sigma, 0.0, sigma * sigma};
  uint32_t state = 3, k, index;
  size_t i;
  CHECK_OK(ptzcal_adjustment_new(model, survey, NULL));
  for (k = 0; k < stations; k++) {
    const double *at = places + 4 * k, s = sin(at[2]), c = cos(at[2]), t = sin(at[3]), u = cos(at[3]);
    const double turn[9] = {c, s * t, s * u, 0, u, -t, -s, c * t, c * u};
    ptzcal_pose pose;
    CHECK_OK(ptzcal_pose_init(&pose, sizeof pose));
    memcpy(pose.rotation, turn, sizeof turn);
    pose.translation[0] = at[0], pose.translation[2] = at[1];
    CHECK_OK(ptzcal_adjustment_add_station(*survey, k ? NULL : &pose, NULL, &index, NULL));
    for (i = 0; i < n; i++) {
      /* Evenly over the sphere but for its poles: the golden angle. */
      double pan_tilt[2], spot[2], near[3], far[3], ray[3], depth;
      int m;
      pan_tilt[0] = fmod(2.39996323 * (double)i, 6.28318531) - 3.14159265;
      pan_tilt[1] = asin(0.9 * (2.0 * ((double)i + 0.5) / (double)n - 1.0));
      make_shot(model, &pose, pan_tilt, 1.0, near, spot);
      make_shot(model, &pose, pan_tilt, 2.0, far, spot);
      for (m = 0; m < 3; m++) ray[m] = far[m] - near[m], near[m] -= ray[m];
      depth = hit_box(boxes[0], boxes[0] + 3, 1, near, ray);
      for (m = 1; m < 5; m++) depth = fmin(depth, hit_box(boxes[m], boxes[m] + 3, 0, near, ray));
      make_shot(model, &pose, pan_tilt, depth, far, spot);
      for (m = 0; m < 2; m++) spot[m] += 1.7320508 * sigma * fixture_random(&state);
      CHECK_OK(ptzcal_adjustment_add_shots(*survey, k, pan_tilt, spot, covariance, NULL, 1, NULL, NULL));
    }
  }
}

#define FIXTURE_ROOM 8000
static double fixture_room[3 * FIXTURE_ROOM];

/* The planes of that room. */
static inline void make_planes(double x, double z, double turn, int furniture, ptzcal_planes **planes)
{
  ptzcal_planes_options options;
  make_room(x, z, turn, furniture, FIXTURE_ROOM, fixture_room);
  CHECK_OK(ptzcal_planes_options_init(&options, sizeof options));
  options.flatness = 0.0;
  CHECK_OK(ptzcal_planes_find_points(fixture_room, FIXTURE_ROOM, 0.004, &options, planes, NULL));
}

/* A host's devices that do nothing, well. */
static inline int32_t fixture_ptz_move_fn(void *user, double pan, double tilt)
{
  (void)user, (void)pan, (void)tilt;
  return PTZCAL_STATUS_OK;
}

static inline int32_t fixture_ptz_position_fn(void *user, double *pan, double *tilt, double *zoom)
{
  (void)user;
  *pan = *tilt = *zoom = 0.0;
  return PTZCAL_STATUS_OK;
}

static inline int32_t fixture_ptz_stop_fn(void *user)
{
  (void)user;
  return PTZCAL_STATUS_OK;
}

static inline int32_t fixture_laser_fn(void *user, int32_t on)
{
  (void)user, (void)on;
  return PTZCAL_STATUS_OK;
}

static inline int32_t fixture_frame_fn(void *user, double not_before, double timeout, ptzcal_image *image, double *timestamp)
{
  (void)user, (void)not_before, (void)timeout, (void)image, (void)timestamp;
  return PTZCAL_STATUS_DEVICE_TIMEOUT;
}

static inline double fixture_clock_now_fn(void *user)
{
  (void)user;
  return 0.0;
}

static inline void fixture_clock_sleep_fn(void *user, double seconds)
{
  (void)user, (void)seconds;
}

static inline void fixture_log_fn(void *user, int32_t level, const char *message)
{
  (void)user, (void)level, (void)message;
}

static inline void fixture_move_end_fn(void *user, uint64_t number, int32_t end, int32_t status, double pan, double tilt)
{
  (void)user, (void)number, (void)end, (void)status, (void)pan, (void)tilt;
}

/* Stops at once. */
static inline int32_t fixture_progress_fn(void *user, const ptzcal_progress *progress)
{
  (void)user, (void)progress;
  return 1;
}

static inline void make_ptz(ptzcal_ptz *ptz)
{
  CHECK_OK(ptzcal_ptz_init(ptz, sizeof *ptz));
  ptz->pan_min = ptz->tilt_min = -1.0;
  ptz->pan_max = ptz->tilt_max = 1.0;
  ptz->move_absolute = fixture_ptz_move_fn;
  ptz->position = fixture_ptz_position_fn;
  ptz->stop = fixture_ptz_stop_fn;
}

/* Numbers from -1 to 1 for pan from -1.5 to 1.5 and tilt from -0.4 to 0.4 rad. */
static inline void make_angle_map(ptzcal_angle_map **map)
{
  FILE *file = fopen("fixture-angles.json", "w");
  CHECK(file);
  CHECK(fputs("{\"format\": \"ptzcal-angle-map\", \"version\": 1,"
              "\"pan\": {\"nodes\": [[-1, -1.5], [1, 1.5]], \"covariance\": [[1e-8, 0], [0, 1e-8]], \"roughness\": 0},"
              "\"tilt\": {\"nodes\": [[-1, -0.4], [1, 0.4]], \"covariance\": [[1e-8, 0], [0, 1e-8]], \"roughness\": 0},"
              "\"mounting\": {\"collimation\": 0, \"roll\": 0, \"trunnion\": 0, \"sigma\": [0, 0, 0]}}\n", file) >= 0);
  CHECK(fclose(file) == 0);
  CHECK_OK(ptzcal_angle_map_read("fixture-angles.json", map, NULL));
  CHECK(remove("fixture-angles.json") == 0);
}

/* A room with one box, a rig and a camera beside it, and a dozen shots: little work. */
static inline void make_study(void)
{
  const double room[6] = {-2.0, -1.5, -1.0, 2.0, 1.5, 4.0}, box[6] = {-0.4, -0.3, 1.5, 0.4, 0.5, 1.9};
  const double level[2] = {0.2, 0.2}, distance[1] = {5.0};
  ptzcal_camera camera = *fixture_camera;
  ptzcal_rig_model model;
  ptzcal_region region;
  CHECK_OK(ptzcal_rig_model_init(&model, sizeof model));
  model.width = 720;
  model.height = 576;
  model.fx = model.fy = 800.0;
  model.cx = 360.0;
  model.cy = 288.0;
  model.laser_x0 = 0.1;
  model.laser_vx = -0.005;
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  camera.width = 800;
  camera.height = 600;
  camera.fx = camera.fy = 600.0;
  camera.cx = 400.0;
  camera.cy = 300.0;
  camera.translation[0] = 0.2;
  CHECK_OK(ptzcal_site_new(&model, &camera, &fixture_site, NULL));
  CHECK_OK(ptzcal_site_set_room(fixture_site, room, box, 1, NULL));
  CHECK_OK(ptzcal_region_init(&region, sizeof region));
  region.pan_min = -0.45;
  region.pan_max = 0.45;
  region.tilt_min = -0.35;
  region.tilt_max = 0.35;
  region.pan_steps = 5;
  region.tilt_steps = 4;
  CHECK_OK(ptzcal_set_up_from_region(fixture_site, &region, &fixture_set_up, NULL));
  CHECK_OK(ptzcal_study_options_init(fixture_study_options, sizeof *fixture_study_options));
  CHECK_OK(ptzcal_study_cell_init(fixture_study_cell, sizeof *fixture_study_cell));
  CHECK_OK(ptzcal_label_row_init(fixture_label_row, sizeof *fixture_label_row));
  fixture_study_options->trials = 1;
  CHECK_OK(ptzcal_study_run(fixture_set_up, level, 1, distance, 1, fixture_study_options, NULL, NULL, NULL, &fixture_study, NULL));
  CHECK_OK(ptzcal_label_make(fixture_set_up, distance, 1, level, 1, fixture_study_options, NULL, NULL, NULL, &fixture_label, NULL));
  CHECK_OK(ptzcal_plan_options_init(fixture_plan_options, sizeof *fixture_plan_options));
  CHECK_OK(ptzcal_plan_summary_init(fixture_plan_summary, sizeof *fixture_plan_summary));
  fixture_plan_options->pan_min = region.pan_min;
  fixture_plan_options->pan_max = region.pan_max;
  fixture_plan_options->tilt_min = region.tilt_min;
  fixture_plan_options->tilt_max = region.tilt_max;
  fixture_plan_options->target = 0.05;
  CHECK_OK(ptzcal_plan_make(fixture_site, fixture_plan_options, NULL, &fixture_plan, NULL));
}

/* The camera of make_camera and the rig of make_rig_model above a floor at y = 1.2. */
static inline void make_pointing(void)
{
  const double down[3] = {0, 1, 0}, centre[2] = {400, 300};
  CHECK_OK(ptzcal_pointing_new(fixture_calibration, fixture_rig_model, &fixture_pointing, NULL));
  CHECK_OK(ptzcal_pointing_set_plane(fixture_pointing, down, 1.2, NULL, 0, NULL));
  CHECK_OK(ptzcal_pointing_sweep(fixture_pointing, centre, NULL, 2.0, 50.0, 0.95, 0.0, &fixture_sweep, NULL));
  CHECK_OK(ptzcal_aim_init(fixture_aim, sizeof *fixture_aim));
  CHECK_OK(ptzcal_located_init(fixture_located, sizeof *fixture_located));
  CHECK_OK(ptzcal_sweep_summary_init(fixture_sweep_summary, sizeof *fixture_sweep_summary));
}

/* Four shots of a simulated rig, and a check with none of its cameras' shots: "cannot tell". */
static inline void make_exploration(void)
{
  ptzcal_rig_options *options;
  ptzcal_scan_options *scan_options;
  ptzcal_rig *rig;
  ptzcal_scan *scan;
  CHECK_OK(ptzcal_explore_options_init(fixture_explore_options, sizeof *fixture_explore_options));
  CHECK_OK(ptzcal_visible_init(fixture_visible, sizeof *fixture_visible));
  CHECK_OK(ptzcal_health_options_init(fixture_health_options, sizeof *fixture_health_options));
  CHECK_OK(ptzcal_health_init(fixture_health, sizeof *fixture_health));
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_OK(ptzcal_rig_options_set_address(options, "sim:room", NULL));
  CHECK_OK(ptzcal_rig_open(options, &rig, NULL));
  CHECK_OK(ptzcal_scan_options_new(&scan_options, NULL));
  CHECK_OK(ptzcal_scan_options_add_camera_address(scan_options, "sim:fixed/0", NULL, NULL));
  fixture_explore_options->pan_min = -0.2, fixture_explore_options->pan_max = 0.2;
  fixture_explore_options->tilt_min = -0.2, fixture_explore_options->tilt_max = 0.1;
  fixture_explore_options->max_shots = 5;
  CHECK_OK(ptzcal_rig_explore(rig, fixture_explore_options, scan_options, NULL, NULL, &fixture_exploration, NULL));
  CHECK_OK(ptzcal_exploration_get_scan(fixture_exploration, &scan, NULL));
  CHECK_OK(ptzcal_health_check(fixture_rig_model, fixture_calibration, scan, scan, 0, NULL, &fixture_health_report, NULL));
  ptzcal_scan_free(scan);
  ptzcal_scan_options_free(scan_options);
  CHECK_OK(ptzcal_rig_close(rig, NULL));
  ptzcal_rig_options_free(options);
}

static inline void make_fixtures(void)
{
  uint32_t i;
  CHECK_OK(ptzcal_planes_options_init(fixture_planes_options, sizeof *fixture_planes_options));
  CHECK_OK(ptzcal_plane_init(fixture_plane, sizeof *fixture_plane));
  CHECK_OK(ptzcal_station_options_init(fixture_station_options, sizeof *fixture_station_options));
  CHECK_OK(ptzcal_station_pose_init(fixture_station_pose, sizeof *fixture_station_pose));
  make_planes(0.0, 0.0, 0.0, 1, &fixture_planes);
  CHECK_OK(ptzcal_register_stations(fixture_planes, fixture_planes, NULL, &fixture_registration, NULL));
  for (i = 0; i < 4; i++) {
    fixture_flags[i] = i != 1;
    fixture_shots[i] = fixture_cameras[i] = fixture_hits[i] = i;
  }
  make_camera(fixture_camera);
  make_rig_model(fixture_rig_model);
  make_image(fixture_image, fixture_pixels, 16, 12);
  fixture_images[0] = fixture_images[1] = fixture_images[2] = fixture_images[3] = fixture_image;
  CHECK_OK(ptzcal_spot_init(fixture_spot, sizeof *fixture_spot));
  CHECK_OK(ptzcal_chessboard_options_init(fixture_chessboard_options, sizeof *fixture_chessboard_options));
  CHECK_OK(ptzcal_chessboard_init(fixture_chessboard, sizeof *fixture_chessboard));
  CHECK_OK(ptzcal_sift_options_init(fixture_sift_options, sizeof *fixture_sift_options));
  CHECK_OK(ptzcal_line_options_init(fixture_line_options, sizeof *fixture_line_options));
  CHECK_OK(ptzcal_line_fit_options_init(fixture_line_fit_options, sizeof *fixture_line_fit_options));
  CHECK_OK(ptzcal_line_match_options_init(fixture_line_match_options, sizeof *fixture_line_match_options));
  CHECK_OK(ptzcal_sift_match_options_init(fixture_sift_match_options, sizeof *fixture_sift_match_options));
  CHECK_OK(ptzcal_detect_sift(fixture_image, NULL, &fixture_sift_features, NULL));
  CHECK_OK(ptzcal_picture_new(fixture_image, &fixture_picture, NULL));
  CHECK_OK(ptzcal_undistorter_new(fixture_camera, fixture_camera, &fixture_undistorter, NULL));
  CHECK_OK(ptzcal_depth_map_new_u16(fixture_millimetres, 8, 8, 8, 0.001, &fixture_depth_map, NULL));
  CHECK_OK(ptzcal_rgbd_options_init(fixture_rgbd_options, sizeof *fixture_rgbd_options));
  CHECK_OK(ptzcal_rgbd_view_init(fixture_rgbd_view, sizeof *fixture_rgbd_view));
  CHECK_OK(ptzcal_rgbd_new(fixture_image, NULL, &fixture_rgbd, NULL));
  CHECK_OK(ptzcal_calibration_summary_init(fixture_calibration_summary, sizeof *fixture_calibration_summary));
  CHECK_OK(ptzcal_cancel_new(&fixture_cancel, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_cancel_new(NULL, &fixture_error));
  CHECK_OK(ptzcal_spot_options_new(&fixture_spot_options, NULL));
  CHECK_OK(ptzcal_spot_detector_new(fixture_spot_options, &fixture_spot_detector, NULL));
  CHECK_OK(ptzcal_calibration_options_new(&fixture_calibration_options, NULL));
  make_points(fixture_camera, fixture_xyz, fixture_uv, FIXTURE_POINTS, 0.3);
  CHECK_OK(ptzcal_correspondences_new(800, 600, &fixture_correspondences, NULL));
  CHECK_OK(ptzcal_correspondences_add_points(fixture_correspondences, fixture_xyz, fixture_uv, FIXTURE_POINTS, NULL));
  CHECK_OK(ptzcal_calibrate_camera(fixture_correspondences, NULL, &fixture_calibration, NULL));
  CHECK_OK(ptzcal_board_view_init(fixture_board_view, sizeof *fixture_board_view));
  CHECK_OK(ptzcal_laser_line_init(fixture_laser_line, sizeof *fixture_laser_line));
  make_boards(&fixture_boards, 0.2);
  CHECK_OK(ptzcal_calibrate_from_boards(fixture_boards, NULL, &fixture_board_calibration, NULL));
  CHECK_OK(ptzcal_calibrate_laser_line(fixture_boards, NULL, NULL, &fixture_laser_calibration, NULL));
  CHECK_OK(ptzcal_zoom_position_init(fixture_zoom_position, sizeof *fixture_zoom_position));
  CHECK_OK(ptzcal_rig_view_init(fixture_rig_view, sizeof *fixture_rig_view));
  CHECK_OK(ptzcal_common_line_init(fixture_common_line, sizeof *fixture_common_line));
  make_rig_views(&fixture_rig_calibration, 0.2);
  CHECK_OK(ptzcal_rig_calibration_solve(fixture_rig_calibration, &fixture_rig_calibrated, NULL));
  CHECK_OK(ptzcal_rig_calibrated_get_curve(fixture_rig_calibrated, &fixture_zoom_curve, NULL));
  CHECK_OK(ptzcal_pose_init(fixture_pose, sizeof *fixture_pose));
  CHECK_OK(ptzcal_pose_options_new(&fixture_pose_options, NULL));
  make_corner(&fixture_roof_edges, 0.0);
  CHECK_OK(ptzcal_estimate_pose_roof_edges(fixture_roof_edges, fixture_roof_edges, NULL, &fixture_pose_estimate, NULL));
  make_ptz(fixture_ptz);
  CHECK_OK(ptzcal_simulator_new("sim:room", &fixture_simulator, NULL));
  CHECK_OK(ptzcal_rig_options_new(&fixture_rig_options, NULL));
  CHECK_OK(ptzcal_rig_options_set_address(fixture_rig_options, "sim:room", NULL));
  CHECK_OK(ptzcal_rig_options_set_settle(fixture_rig_options, 2, 0.1, 0.0, 30.0, 0.0, NULL));
  CHECK_OK(ptzcal_rig_open(fixture_rig_options, &fixture_rig, NULL));
  CHECK_OK(ptzcal_head_options_new(&fixture_head_options, NULL));
  CHECK_OK(ptzcal_head_options_set_address(fixture_head_options, "sim:room", NULL));
  CHECK_OK(ptzcal_head_open(fixture_head_options, &fixture_head, NULL));
  CHECK_OK(ptzcal_angle_summary_init(fixture_angle_summary, sizeof *fixture_angle_summary));
  CHECK_OK(ptzcal_angle_learning_options_init(fixture_angle_learning_options, sizeof *fixture_angle_learning_options));
  CHECK_OK(ptzcal_probe_options_init(fixture_probe_options, sizeof *fixture_probe_options));
  CHECK_OK(ptzcal_figure_init(fixture_figure, sizeof *fixture_figure));
  make_angle_map(&fixture_angle_map);
  CHECK_OK(ptzcal_camera_list_new(&fixture_camera_list, NULL));
  CHECK_OK(ptzcal_camera_list_add(fixture_camera_list, fixture_camera, "camera", NULL));
  /* Only a little is measured in so little time. */
  fixture_probe_options->max_time = 5.0;
  CHECK_OK(ptzcal_head_options_set_address(fixture_head_options, "sim:room?real_time=100", NULL));
  CHECK_OK(ptzcal_probe(fixture_head_options, NULL, fixture_probe_options, NULL, &fixture_probe_report, NULL));
  /* From here on without a device: what opens one fails at once. */
  CHECK_OK(ptzcal_head_options_set_address(fixture_head_options, NULL, NULL));
  CHECK_OK(ptzcal_head_capabilities_init(fixture_head_capabilities, sizeof *fixture_head_capabilities));
  CHECK_OK(ptzcal_region_init(fixture_region, sizeof *fixture_region));
  CHECK_OK(ptzcal_shot_init(fixture_shot, sizeof *fixture_shot));
  CHECK_OK(ptzcal_scan_summary_init(fixture_scan_summary, sizeof *fixture_scan_summary));
  CHECK_OK(ptzcal_scan_options_new(&fixture_scan_options, NULL));
  CHECK_OK(ptzcal_rig_scan_region(fixture_rig, fixture_region, NULL, NULL, NULL, &fixture_scan, NULL));
  CHECK_OK(ptzcal_surface_options_init(fixture_surface_options, sizeof *fixture_surface_options));
  CHECK_OK(ptzcal_cloud_new(&fixture_cloud, NULL));
  CHECK_OK(ptzcal_cloud_add_points(fixture_cloud, fixture_xyz, NULL, NULL, FIXTURE_POINTS, NULL));
  CHECK_OK(ptzcal_mesh_new(fixture_cloud, fixture_triangles, 2, &fixture_mesh, NULL));
  {
    ptzcal_camera cameras[2];
    cameras[0] = cameras[1] = *fixture_camera;
    make_survey(&fixture_adjustment, fixture_rig_model, fixture_rig_model, cameras, 2, FIXTURE_POINTS, 0.3);
  }
  CHECK_OK(ptzcal_adjust_options_init(fixture_adjust_options, sizeof *fixture_adjust_options));
  CHECK_OK(ptzcal_adjusted_summary_init(fixture_adjusted_summary, sizeof *fixture_adjusted_summary));
  CHECK_OK(ptzcal_suspect_init(fixture_suspect, sizeof *fixture_suspect));
  CHECK_OK(ptzcal_adjustment_solve(fixture_adjustment, NULL, NULL, &fixture_adjusted, NULL));
  CHECK_OK(ptzcal_tie_options_init(fixture_tie_options, sizeof *fixture_tie_options));
  CHECK_OK(ptzcal_ties_summary_init(fixture_ties_summary, sizeof *fixture_ties_summary));
  CHECK_OK(ptzcal_link_init(fixture_link, sizeof *fixture_link));
  CHECK_OK(ptzcal_loop_init(fixture_loop, sizeof *fixture_loop));
  /* A survey of one station needs no ties. */
  CHECK_OK(ptzcal_adjustment_tie_stations(fixture_adjustment, NULL, NULL, NULL, NULL, &fixture_ties, NULL));
  make_study();
  fixture_indices[0] = 0;
  make_pointing();
  make_exploration();
  CHECK_OK(ptzcal_report_new("fixture", &fixture_report, NULL));
}

static inline void free_fixtures(void)
{
  ptzcal_report_free(fixture_report);
  ptzcal_plan_free(fixture_plan);
  ptzcal_label_free(fixture_label);
  ptzcal_study_free(fixture_study);
  ptzcal_set_up_free(fixture_set_up);
  ptzcal_site_free(fixture_site);
  ptzcal_health_report_free(fixture_health_report);
  ptzcal_exploration_free(fixture_exploration);
  ptzcal_sweep_free(fixture_sweep);
  ptzcal_pointing_free(fixture_pointing);
  ptzcal_registration_free(fixture_registration);
  ptzcal_planes_free(fixture_planes);
  ptzcal_ties_free(fixture_ties);
  ptzcal_adjusted_free(fixture_adjusted);
  ptzcal_adjustment_free(fixture_adjustment);
  ptzcal_mesh_free(fixture_mesh);
  ptzcal_cloud_free(fixture_cloud);
  ptzcal_scan_free(fixture_scan);
  ptzcal_scan_options_free(fixture_scan_options);
  CHECK_OK(ptzcal_rig_close(fixture_rig, NULL));
  CHECK_OK(ptzcal_head_close(fixture_head, NULL));
  ptzcal_head_options_free(fixture_head_options);
  ptzcal_angle_map_free(fixture_angle_map);
  ptzcal_camera_list_free(fixture_camera_list);
  ptzcal_probe_report_free(fixture_probe_report);
  ptzcal_rig_options_free(fixture_rig_options);
  ptzcal_simulator_free(fixture_simulator);
  ptzcal_pose_estimate_free(fixture_pose_estimate);
  ptzcal_roof_edges_free(fixture_roof_edges);
  ptzcal_pose_options_free(fixture_pose_options);
  ptzcal_zoom_curve_free(fixture_zoom_curve);
  ptzcal_rig_calibrated_free(fixture_rig_calibrated);
  ptzcal_rig_calibration_free(fixture_rig_calibration);
  ptzcal_laser_calibration_free(fixture_laser_calibration);
  ptzcal_board_calibration_free(fixture_board_calibration);
  ptzcal_boards_free(fixture_boards);
  ptzcal_calibration_free(fixture_calibration);
  ptzcal_correspondences_free(fixture_correspondences);
  ptzcal_calibration_options_free(fixture_calibration_options);
  ptzcal_rgbd_free(fixture_rgbd);
  ptzcal_undistorter_free(fixture_undistorter);
  ptzcal_depth_map_free(fixture_depth_map);
  ptzcal_picture_free(fixture_picture);
  ptzcal_sift_features_free(fixture_sift_features);
  ptzcal_spot_detector_free(fixture_spot_detector);
  ptzcal_spot_options_free(fixture_spot_options);
  ptzcal_cancel_free(fixture_cancel);
  ptzcal_error_free(fixture_error);
}

#endif
