// Click into a fixed camera's picture, and the pan-tilt camera looks there; on the simulated rig.
//
// The head surveys the room with its laser and calibrates the fixed camera with it; each click on the
// floor then turns the head. The simulator's truth says what the head camera has at its picture's centre.
#include <ptzcal.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

constexpr double floor_below = 1.2;  // metres below the rig
constexpr double degrees = 3.14159265358979323846 / 180;

int main()
try {
  ptzcal::rig_options rig_options;
  rig_options.set_address("sim:room");
  ptzcal::rig rig = ptzcal::rig::open(rig_options);

  ptzcal::scan_options scan_options;
  scan_options.add_camera_address("sim:fixed/0");
  ptzcal::region region;
  region.pan_min = -0.5, region.pan_max = 0.43, region.pan_steps = 24;
  region.tilt_min = -0.36, region.tilt_max = 0.33, region.tilt_steps = 16;
  const ptzcal::scan scan = rig.scan_region(region, scan_options);
  scan.end();

  const ptzcal::simulator simulator = rig.simulator();
  const ptzcal::camera truth = simulator.true_camera(0);
  ptzcal::correspondences shots(truth.width, truth.height);
  shots.add_scan(scan, 0);
  ptzcal::calibration_options options;
  options.set_distortion(ptzcal::distortion_model::radial2);
  const ptzcal::calibration calibration = ptzcal::calibrate_camera(shots, options);

  ptzcal::pointing pointing(calibration, rig.model());
  pointing.set_head_deviation(4e-4, 4e-4);  // steps of 0.07 degrees
  pointing.set_plane({0, 1, 0}, floor_below, {}, ptzcal::measured_by::others);

  double worst = 0;
  for (const std::array<double, 2> click : {std::array<double, 2>{150, 500}, {430, 560}, {640, 520}, {560, 590}}) {
    const ptzcal::aim aim = pointing.aim(click, {0.25, 0, 0.25}, 0.95, 0);
    const auto ellipse = ptzcal::ellipse(aim.uv_covariance, 0.95);
    rig.move(aim.pan, aim.tilt);

    // What was truly clicked on, and where the true head camera sees it now.
    const auto from = truth.centre();
    const auto ray = truth.back_project(click);
    const double far = (floor_below - from[1]) / ray[1];
    const auto at = rig.position();
    const auto seen = ptzcal::rig_model(simulator.true_rig())
                          .head_camera(at.pan, at.tilt)
                          .project({from[0] + far * ray[0], from[1] + far * ray[1], from[2] + far * ray[2]});
    const double off = std::hypot(seen[0] - 359.5, seen[1] - 287.5);
    worst = std::max(worst, off);
    std::printf("click (%.0f, %.0f): %.2f m away, pan %.2f, tilt %.2f degrees; %.1f px from the picture's centre, "
                "95 %% within %.1f x %.1f px\n",
                click[0], click[1], aim.distance, aim.pan / degrees, aim.tilt / degrees, off, ellipse.semi_axes[0],
                ellipse.semi_axes[1]);
  }
  std::printf("the head looks there: within %.1f px of 720 x 576\n", worst);
} catch (const ptzcal::error &error) {
  std::fprintf(stderr, "%s\n  %s\n", error.what(), error.hint().c_str());
  return 1;
}
