// cv::Mat: views are of the same memory, conversions agree with OpenCV's own functions.
#include "check.hpp"

#include <ptzcal/opencv.hpp>

#include <opencv2/calib3d.hpp>

#include <vector>

static void images_are_views()
{
  cv::Mat bgr(6, 5, CV_8UC3, cv::Scalar(1, 2, 3));
  const cv::Mat part = bgr(cv::Rect(1, 2, 3, 4));
  const ptzcal::image image = ptzcal::image_of(part);
  CHECK(image.format == PTZCAL_PIXEL_FORMAT_BGR24 && image.width == 3 && image.height == 4);
  CHECK(image.plane[0] == part.data && image.stride[0] == 15 && image.size[0] == 3 * 15 + 9);
  CHECK(ptzcal::image(ptzcal::image_of(part, ptzcal::pixel_format(ptzcal::pixel_format::rgb24))).format ==
        PTZCAL_PIXEL_FORMAT_RGB24);
  const cv::Mat back = ptzcal::mat_of(image);
  CHECK(back.data == part.data && back.size() == part.size() && back.type() == CV_8UC3 && back.step[0] == 15);
  CHECK(ptzcal::image(ptzcal::image_of(cv::Mat(2, 2, CV_8UC1))).format == PTZCAL_PIXEL_FORMAT_GRAY8);
  CHECK(ptzcal::image(ptzcal::image_of(cv::Mat(2, 2, CV_8UC4))).format == PTZCAL_PIXEL_FORMAT_BGRA32);
  CHECK_FAILS(invalid_argument, ptzcal::image_of(cv::Mat(2, 2, CV_16UC1)));
  CHECK_FAILS(invalid_argument, ptzcal::image_of(cv::Mat(2, 2, CV_8UC2)));
  ptzcal::image planar = image;
  planar.format = ptzcal::pixel_format::nv12;
  CHECK_FAILS(invalid_argument, ptzcal::mat_of(planar));
}

static void cameras_project_alike()
{
  const cv::Matx33d matrix(800, 0, 410.5, 0, 790, 295.25, 0, 0, 1);
  const cv::Vec3d turn(0.1, -0.3, 0.05), translation(0.2, -0.1, 0.4);
  cv::Matx33d rotation;
  cv::Rodrigues(turn, rotation);
  const std::vector<cv::Point3d> points = {{0, 0, 4}, {1, -0.5, 5}, {-1, 0.7, 6}};
  for (const std::vector<double> &lens : {std::vector<double>{}, {-0.2, 0.05, 1e-3, -2e-3}, {-0.2, 0.05, 1e-3, -2e-3, 0.01}}) {
    const ptzcal::camera camera = ptzcal::camera_of(matrix, lens, {800, 600}, rotation, translation);
    std::vector<cv::Point2d> theirs;
    cv::projectPoints(points, turn, translation, matrix, lens, theirs);
    const auto ours = ptzcal::points2(camera.project(ptzcal::numbers(points)));
    for (std::size_t i = 0; i < points.size(); i++) CHECK(cv::norm(ours[i] - theirs[i]) < 1e-9);
    CHECK(ptzcal::camera_matrix(camera) == matrix && ptzcal::rotation(camera) == rotation);
    CHECK(ptzcal::translation(camera) == translation);
    const std::vector<double> back = ptzcal::distortion_coefficients(camera);
    CHECK(back.size() == (lens.empty() ? 0 : 5) && std::equal(lens.begin(), lens.end(), back.begin()));
  }
  const std::vector<double> fisheye = {0.05, -0.01, 0.002, -3e-4};
  const ptzcal::camera wide = ptzcal::camera_of(matrix, fisheye, {800, 600}, rotation, translation, true);
  std::vector<cv::Point2d> theirs;
  cv::fisheye::projectPoints(points, theirs, turn, translation, matrix, fisheye);
  const auto ours = ptzcal::points2(wide.project(ptzcal::numbers(points)));
  for (std::size_t i = 0; i < points.size(); i++) CHECK(cv::norm(ours[i] - theirs[i]) < 1e-9);

  CHECK_FAILS(invalid_argument, ptzcal::camera_of(matrix, {1, 2, 3}, {800, 600}));
  CHECK_FAILS(invalid_argument, ptzcal::camera_of(matrix, {1, 2, 3, 4, 5}, {800, 600}, rotation, translation, true));
  ptzcal::camera division = wide;
  division.distortion_model = ptzcal::distortion_model::division;
  CHECK_FAILS(invalid_argument, ptzcal::distortion_coefficients(division));
}

static void depths_and_points()
{
  cv::Mat all(4, 6, CV_16UC1, cv::Scalar(2000));
  all.at<std::uint16_t>(1, 2) = 0;
  const ptzcal::depth_map map = ptzcal::depth_map_of(all(cv::Rect(1, 0, 4, 4)), 1e-3);
  CHECK(map.size().width == 4 && map.size().known == 15);
  const std::vector<float> metres = map.metres();
  CHECK(metres[0] == 2.0f && metres[5] == 0.0f);
  CHECK(ptzcal::depth_map(ptzcal::depth_map_of(cv::Mat(2, 3, CV_32FC1, cv::Scalar(1.5)), 1)).size().known == 6);
  CHECK_FAILS(invalid_argument, ptzcal::depth_map_of(cv::Mat(2, 3, CV_8UC1), 1));
  CHECK(ptzcal::points3({1, 2, 3, 4, 5, 6})[1] == cv::Point3d(4, 5, 6));
  CHECK(ptzcal::numbers(std::vector<cv::Point2d>{{1, 2}, {3, 4}})[3] == 4);
}

int main()
{
  images_are_views();
  cameras_project_alike();
  depths_and_points();
}
