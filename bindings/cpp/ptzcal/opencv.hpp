// cv::Mat and ptzcal: views without copies, camera matrices, poses, points. Needs OpenCV's core only.
//
// Both count pixels from the centre of the top-left one, order distortion coefficients k1 k2 p1 p2 k3,
// and have world-to-camera poses: numbers pass unchanged.
#ifndef PTZCAL_OPENCV_HPP
#define PTZCAL_OPENCV_HPP

#if !__has_include(<opencv2/core/mat.hpp>)
#error "ptzcal/opencv.hpp needs OpenCV's headers (Debian: libopencv-dev)"
#endif

#include <opencv2/core.hpp>

#include "../ptzcal.hpp"

#include <algorithm>
#include <iterator>
#include <vector>

PTZCAL_BEGIN
namespace detail {

template <class T>
outcome<T> refused(const char *message)
{
#ifdef PTZCAL_NO_EXCEPTIONS
  return result<T>(error(status::invalid_argument, message));
#else
  throw error(status::invalid_argument, message);
#endif
}

}  // namespace detail

// The pixels of a matrix of 8 bits, where they are: 1 channel is grey, 3 are BGR, 4 BGRA, or what
// `format` says. The matrix must outlive the view.
inline outcome<image> image_of(const cv::Mat &mat, optional_ref<pixel_format> format = {})
{
  static const pixel_format usual[5] = {pixel_format(), pixel_format::gray8, pixel_format(), pixel_format::bgr24,
                                        pixel_format::bgra32};
  const int channels = mat.channels();
  if (mat.dims != 2 || mat.depth() != CV_8U || channels > 4 || channels == 2)
    return detail::refused<image>("an image is a matrix of 8-bit pixels with 1, 3 or 4 channels");
  const pixel_format chosen = format.get() ? *format.get() : usual[channels];
  return packed_image(chosen, mat.data, static_cast<std::uint32_t>(mat.cols), static_cast<std::uint32_t>(mat.rows),
                      static_cast<std::ptrdiff_t>(mat.step[0]));
}

// The pixels of a packed image, where they are, for reading only; valid as long as they are.
inline outcome<cv::Mat> mat_of(const ptzcal_image &image)
{
  const pixel_format format(image.format);
  const int type = format == pixel_format::gray8                                         ? CV_8UC1
                   : format == pixel_format::rgb24 || format == pixel_format::bgr24      ? CV_8UC3
                   : format == pixel_format::rgba32 || format == pixel_format::bgra32    ? CV_8UC4
                                                                                         : -1;
  if (type < 0 || image.stride[0] < 0)
    return detail::refused<cv::Mat>("only packed images that are stored from the top are matrices");
  return cv::Mat(static_cast<int>(image.height), static_cast<int>(image.width), type,
                 const_cast<void *>(image.plane[0]), static_cast<std::size_t>(image.stride[0]));
}

// fx, skew, cx; 0, fy, cy; 0, 0, 1. Of a camera or a rig model.
template <class C>
cv::Matx33d camera_matrix(const C &camera)
{
  return {camera.fx, camera.skew, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
}

// k1 k2 p1 p2 k3 for OpenCV's functions; k1 k2 k3 k4 for cv::fisheye's when the lens is one; none
// without distortion. The division model has no equal in OpenCV.
template <class C>
outcome<std::vector<double>> distortion_coefficients(const C &camera)
{
  const double *k = camera.distortion;
  switch (camera.distortion_model) {
    case distortion_model::none: return std::vector<double>();
    case distortion_model::radial1: return std::vector<double>{k[0], 0, 0, 0, 0};
    case distortion_model::radial2: return std::vector<double>{k[0], k[1], 0, 0, 0};
    case distortion_model::brown_conrady: return std::vector<double>(k, k + 5);
    case distortion_model::fisheye: return std::vector<double>(k, k + 4);
    default: return detail::refused<std::vector<double>>("OpenCV has no such lens model");
  }
}

// World to camera, of whatever has a rotation and a translation: cameras, poses, views.
template <class P>
cv::Matx33d rotation(const P &pose)
{
  return cv::Matx33d(pose.rotation);
}
template <class P>
cv::Vec3d translation(const P &pose)
{
  return cv::Vec3d(pose.translation);
}

// A camera of OpenCV's numbers: none, 4 (k1 k2 p1 p2) or 5 coefficients (of a fisheye lens: k1 k2 k3 k4).
// A rotation vector becomes a matrix by cv::Rodrigues.
inline outcome<camera> camera_of(const cv::Matx33d &matrix, const std::vector<double> &distortion, const cv::Size &size,
                                 const cv::Matx33d &rotation = cv::Matx33d::eye(), const cv::Vec3d &translation = {},
                                 bool fisheye = false)
{
  const std::size_t n = distortion.size();
  if (fisheye ? n != 4 : n != 0 && n != 4 && n != 5)
    return detail::refused<camera>("distortion has not 0, 4 or 5 coefficients (a fisheye lens: 4)");
  camera made;
  made.width = static_cast<std::uint32_t>(size.width), made.height = static_cast<std::uint32_t>(size.height);
  made.fx = matrix(0, 0), made.skew = matrix(0, 1), made.cx = matrix(0, 2);
  made.fy = matrix(1, 1), made.cy = matrix(1, 2);
  made.distortion_model = fisheye  ? distortion_model(distortion_model::fisheye)
                          : n == 0 ? distortion_model(distortion_model::none)
                                   : distortion_model(distortion_model::brown_conrady);
  std::fill(std::begin(made.distortion), std::end(made.distortion), 0.0);
  std::copy(distortion.begin(), distortion.end(), made.distortion);
  std::copy(std::begin(rotation.val), std::end(rotation.val), made.rotation);
  std::copy(std::begin(translation.val), std::end(translation.val), made.translation);
  return made;
}

// A depth map of a matrix of 16 bits or floats in units of `metres`, such as 0.001.
inline outcome<depth_map> depth_map_of(const cv::Mat &mat, double metres)
{
  const auto rows = static_cast<std::uint32_t>(mat.rows), columns = static_cast<std::uint32_t>(mat.cols);
  if (mat.dims != 2 || (mat.type() != CV_16UC1 && mat.type() != CV_32FC1))
    return detail::refused<depth_map>("depths are a matrix of 16 bits or floats with one channel");
  const std::size_t stride = mat.step[0] / mat.elemSize();
  const std::size_t all = rows == 0 ? 0 : (rows - std::size_t(1)) * stride + columns;
  if (mat.type() == CV_16UC1)
    return depth_map::from_u16({mat.ptr<std::uint16_t>(), all}, columns, rows, stride, metres);
  return depth_map::from_f32({mat.ptr<float>(), all}, columns, rows, stride, metres);
}

// Interleaved numbers as points; numbers(points) is the way back.
inline std::vector<cv::Point2d> points2(view<const double> numbers)
{
  std::vector<cv::Point2d> points;
  for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) points.emplace_back(numbers[i], numbers[i + 1]);
  return points;
}
inline std::vector<cv::Point3d> points3(view<const double> numbers)
{
  std::vector<cv::Point3d> points;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
    points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return points;
}

PTZCAL_END

#endif
