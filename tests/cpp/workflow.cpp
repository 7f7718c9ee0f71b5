// From a scan of the simulated room to cameras, planes, clouds, pointing and a survey, against its truth.
#include "check.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

static double distance(const std::array<double, 3> &a, const std::array<double, 3> &b)
{
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

static void planes_and_clouds(const ptzcal::scan &scan, const std::string &folder)
{
  const std::vector<double> points = scan.points();
  std::size_t found = 0;
  for (std::uint64_t i = 0; i < scan.summary().shots; i++) {
    const ptzcal::shot shot = scan.shot(i);
    CHECK(shot.index == i);
    found += shot.found;
  }
  CHECK(found == scan.summary().found && points.size() / 3 <= found && points.size() > 150);

  ptzcal::cloud cloud = ptzcal::cloud::from_scan(scan);
  const auto size = cloud.size();
  CHECK(size.points * 3 == points.size() && size.noise == ptzcal::cloud_noise::covariances);
  cloud.save(folder + "/cloud.ply");
  const auto loaded = ptzcal::cloud::load(folder + "/cloud.ply");
  CHECK(loaded.skipped == 0 && loaded.cloud.size().points == size.points);
  cloud.merge(loaded.cloud);
  CHECK(cloud.size().points == 2 * size.points);

  // A wall of 1 mm of noise: its plane, and the points' labels.
  std::vector<double> wall;
  for (int i = 0; i < 400; i++)
    wall.insert(wall.end(), {0.1 * (i % 20), 0.1 * (i / 20), 3 + 1e-3 * std::sin(7.0 * i * i)});
  const ptzcal::planes planes = ptzcal::planes::find_points(wall, 1e-3);
  CHECK(planes.count() == 1 && planes.labels().size() == 400);
  const ptzcal::plane plane = planes.plane(0);
  CHECK_NEAR(plane.centre[2], 3, 1e-3);
  CHECK_FAILS(invalid_argument, planes.plane(1));
}

static ptzcal::calibration calibrate(const ptzcal::scan &scan, const ptzcal::camera &truth)
{
  ptzcal::correspondences set(truth.width, truth.height);
  set.add_scan(scan, 0);
  ptzcal::calibration_options options;
  options.set_distortion(ptzcal::distortion_model::radial2);
  ptzcal::calibration calibration = ptzcal::calibrate_camera(set, options);
  const ptzcal::camera camera = calibration.camera();
  CHECK_NEAR(camera.fx, truth.fx, 0.003 * truth.fx);
  CHECK(distance(camera.centre(), truth.centre()) < 5e-3);
  const auto summary = calibration.summary();
  CHECK(calibration.covariance().size() == summary.parameters * summary.parameters);
  CHECK(calibration.inliers().size() == summary.measurements && !calibration.weakest().empty());

  const auto [uv, uv_covariance] = calibration.project({0, 0.4, 4});
  CHECK(uv.size() == 2 && uv_covariance.size() == 3 && uv == camera.project({0, 0.4, 4}));
  const auto back = calibration.back_project_to_plane(uv, {0.25, 0, 0.25}, {0, 0, 1}, 4);
  CHECK_NEAR(back.xyz[1], 0.4, 1e-9);
  CHECK(back.xyz_covariance[0] > 0);
  return calibration;
}

static void point(const ptzcal::calibration &calibration, const ptzcal::rig &rig)
{
  ptzcal::pointing pointing(calibration, rig.model());
  pointing.set_plane({0, 1, 0}, 1.2, {}, ptzcal::measured_by::others);
  const ptzcal::aim aim = pointing.aim({430, 560}, {}, 0.95, 0);
  CHECK_NEAR(aim.point[1], 1.2, 1e-9);
  const auto aimed = ptzcal::rig_model(rig.model()).aim(aim.point);
  CHECK(std::isfinite(aimed.pan) && std::fabs(aimed.tilt - aim.tilt) < 0.1);
  const ptzcal::sweep sweep = pointing.sweep({430, 560}, {}, 2, 6, 0.95, 0);
  CHECK(sweep.steps().size() == 2 * sweep.summary().steps && sweep.summary().steps > 0);
}

static void survey(const ptzcal::scan &scan, const ptzcal::rig &rig, const ptzcal::camera &truth)
{
  ptzcal::adjustment adjustment(rig.model());
  const std::uint32_t station = adjustment.add_station(ptzcal::pose());  // the first station is the world
  ptzcal::calibration_options lens;
  lens.set_distortion(ptzcal::distortion_model::radial2);
  const std::uint32_t camera = adjustment.add_camera(truth.width, truth.height, lens);
  CHECK(adjustment.add_scan(station, scan, {camera}) == 0);
  const std::vector<std::uint32_t> two = {camera, camera};
  CHECK_FAILS(invalid_argument, adjustment.add_scan(station, scan, two));
  const ptzcal::adjusted adjusted = adjustment.solve();
  const ptzcal::camera found = ptzcal::calibration(adjusted.calibration(camera)).camera();
  CHECK(distance(found.centre(), truth.centre()) < 5e-3);
  const auto summary = adjusted.summary();
  CHECK(adjusted.covariance().size() == summary.parameters * summary.parameters);
  CHECK(!adjusted.parameter_name(0).empty() && adjusted.parameter_name(1u << 30).empty());
}

// Detectors offer a buffer and are asked again when it is too small.
static void detectors(const ptzcal::simulator &room)
{
  const auto frame = room.next_frame(0, room.now(), 5);
  const ptzcal::sift_features features = ptzcal::detect_sift(frame.image);
  const std::size_t n = features.count();
  CHECK(n > 20 && features.keypoints().size() == n * ptzcal::sift_keypoint_size &&
        features.descriptors().size() == n * ptzcal::sift_descriptor_size);
  const auto matches = ptzcal::match_sift(features, features);
  CHECK(matches.pairs.size() == matches.distances.size() && matches.pairs.size() > 20);
  for (std::size_t i = 0; i < matches.pairs.size(); i += 2) CHECK(matches.pairs[i] == matches.pairs[i + 1]);
  const auto edges = ptzcal::detect_edges(frame.image, 1, 2, 4);
  CHECK(edges.size() % 5 == 0 && edges.size() > 5 * 4096);
  const auto segments = ptzcal::detect_line_segments(frame.image);
  CHECK(segments.uv.size() == segments.ends.size() && segments.uv_covariance.size() * 4 == segments.uv.size() * 6);
  CHECK_FAILS(not_found, ptzcal::detect_chessboard(frame.image, [] {
    ptzcal::chessboard_options board;
    board.columns = 7, board.rows = 5;
    return board;
  }()));
}

int main(int, char **arguments)
{
  ptzcal::rig_options options;
  options.set_address("sim:room");
  ptzcal::rig rig = ptzcal::rig::open(options);
  ptzcal::scan_options watched;
  CHECK(watched.add_camera_address("sim:fixed/0") == 0);
  const ptzcal::scan scan = rig.scan_region(small_region(), watched);
  scan.end();
  const ptzcal::simulator room = rig.simulator();
  const ptzcal::camera truth = room.true_camera(0);
  planes_and_clouds(scan, arguments[2]);
  point(calibrate(scan, truth), rig);
  survey(scan, rig, truth);
  detectors(room);
  rig.close();
}
