// ptzcal in a program that lives on cv::Mat: detects the laser's spot in frames, and hands a calibrated
// camera to OpenCV's functions. Needs OpenCV's core, imgproc and calib3d.
#include <ptzcal/opencv.hpp>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cstdio>
#include <vector>

int main()
try {
  const ptzcal::simulator room("sim:room");
  const ptzcal::camera camera = room.true_camera(0);

  // Frames as a decoder delivers them: a grey cv::Mat each, with the laser on and off. clone(): the
  // simulator keeps one frame only.
  const auto frame = [&](bool laser) {
    room.set_laser(laser);
    const auto taken = room.next_frame(0, room.now(), 5);
    return ptzcal::mat_of(taken.image).clone();
  };
  room.move(0, 0);
  room.sleep(10);
  const cv::Mat off = frame(false), on = frame(true);
  const auto spot = ptzcal::detect_spot(ptzcal::image_of(on), ptzcal::image_of(off));
  std::printf("spot at (%.2f, %.2f), %.0f times the noise\n", spot.x, spot.y, spot.signal_to_noise);

  // The camera in OpenCV's terms: points pass through cv::projectPoints as through ptzcal.
  const cv::Matx33d matrix = ptzcal::camera_matrix(camera), rotation = ptzcal::rotation(camera);
  const std::vector<double> distortion = ptzcal::distortion_coefficients(camera);
  cv::Mat rotation_vector;
  cv::Rodrigues(rotation, rotation_vector);
  const std::vector<cv::Point3d> world = {{-0.5, 0.2, 4.0}, {0.5, 0.4, 5.0}, {0.2, -0.3, 4.5}};
  std::vector<cv::Point2d> theirs;
  cv::projectPoints(world, rotation_vector, ptzcal::translation(camera), matrix, distortion, theirs);
  const auto ours = ptzcal::points2(camera.project(ptzcal::numbers(world)));
  double apart = 0;
  for (std::size_t i = 0; i < ours.size(); i++) apart = std::max(apart, cv::norm(ours[i] - theirs[i]));
  std::printf("cv::projectPoints and ptzcal differ by %.1e px\n", apart);

  cv::Mat straight;
  cv::undistort(off, straight, matrix, distortion);
  std::printf("undistorted %d x %d pixels\n", straight.cols, straight.rows);
} catch (const ptzcal::error &error) {
  std::fprintf(stderr, "%s\n  %s\n", error.what(), error.hint().c_str());
  return 1;
}
