// Calibrates a fixed surveillance camera from a host's point of view: the host owns the cameras and the
// PTZ control, and hands both in as lambdas. Build and run, with the library installed:
//
//     c++ -std=c++17 calibrate_fixed_camera.cpp $(pkg-config --cflags --libs ptzcal) -o calibrate && ./calibrate
//
// The lambdas ask a simulated room, so that the program runs anywhere. In your program they ask your
// decoder, your PTZ protocol and your laser: nothing else changes.
#include <ptzcal.hpp>

#include <cmath>
#include <cstdio>

constexpr double degrees = 3.14159265358979323846 / 180;

static void calibrate()
{
  const ptzcal::simulator room("sim:room?seed=5");

  // Frames: fill in the image, say when its exposure began.
  const auto frames_of = [&room](std::uint32_t camera) {
    return [&room, camera](double not_before, double timeout, ptzcal_image &image, double &timestamp) {
      const auto frame = room.next_frame(camera, not_before, timeout);
      image = frame.image;
      timestamp = frame.timestamp;
    };
  };

  // Your PTZ.
  ptzcal::ptz head;
  head.pan_min = -100 * degrees, head.pan_max = 100 * degrees;
  head.tilt_min = -25 * degrees, head.tilt_max = 25 * degrees;
  head.pan_step = head.tilt_step = 0.07 * degrees;
  head.move_absolute = [&room](double pan, double tilt) { room.move(pan, tilt); };
  head.position = [&room](double &pan, double &tilt, double &) {
    const auto at = room.position();
    pan = at.pan, tilt = at.tilt;
  };
  head.motion = [&room](std::int32_t &motion) { motion = room.motion(); };
  head.stop = [&room] { room.stop(); };

  // The rig: its model (from its own calibration), its devices, the clock that stamps its frames.
  ptzcal::rig_options rig_options;
  rig_options.set_model(room.nominal_rig());
  rig_options.set_ptz(head);
  rig_options.set_laser([&room](bool on) { room.set_laser(on); });
  rig_options.set_frames(frames_of(ptzcal::head_camera));
  rig_options.set_clock([&room] { return room.now(); }, [&room](double seconds) { room.sleep(seconds); });
  ptzcal::rig rig = ptzcal::rig::open(rig_options);

  // The scan: 20 x 18 positions, watched by the fixed camera.
  ptzcal::scan_options scan_options;
  scan_options.add_camera(frames_of(0), 800, 600);
  ptzcal::region region;
  region.pan_min = -26 * degrees, region.pan_max = 14 * degrees, region.pan_steps = 20;
  region.tilt_min = -19 * degrees, region.tilt_max = 16 * degrees, region.tilt_steps = 18;
  const ptzcal::scan scan = rig.scan_region(region, scan_options, [](const ptzcal_progress &progress) {
    if (progress.done % 20 != 0 && progress.done != progress.total) return;
    std::printf("\r%llu of %llu shots", static_cast<unsigned long long>(progress.done),
                static_cast<unsigned long long>(progress.total));
    std::fflush(stdout);
  });
  std::printf("\n");
  scan.end();  // throws if it is not complete

  // The calibration: the shots that both cameras saw.
  ptzcal::correspondences shots(800, 600);
  shots.add_scan(scan, 0);
  ptzcal::calibration_options options;
  options.set_distortion(ptzcal::distortion_model::radial2);
  const ptzcal::calibration calibration = ptzcal::calibrate_camera(shots, options);

  const ptzcal::calibration_summary summary = calibration.summary();
  const ptzcal::camera camera = calibration.camera(), truth = room.true_camera(0);
  const auto centre = camera.centre(), true_centre = truth.centre();
  double off = 0;
  for (int i = 0; i < 3; i++) off += (centre[i] - true_centre[i]) * (centre[i] - true_centre[i]);
  std::printf("fixed camera: f %.1f px (truth %.1f), centre within %.1f mm, %llu of %llu shots used, rms %.2f px\n",
              camera.fx, truth.fx, std::sqrt(off) * 1e3, static_cast<unsigned long long>(summary.inliers),
              static_cast<unsigned long long>(summary.measurements), summary.rms);
  rig.close();  // the laser is off for good; the destructor does the same, and says nothing
}

int main()
{
  try {
    calibrate();
  } catch (const ptzcal::error &error) {
    std::fprintf(stderr, "%s: %s\n  %s\n", ptzcal_status_name(error.status()), error.what(), error.hint().c_str());
    return 1;
  }
}
