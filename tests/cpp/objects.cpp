// Ownership, views and structs.
#include "check.hpp"

#include <array>
#include <cstring>
#include <fstream>
#include <list>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

template <class T>
constexpr bool moves_only = std::is_nothrow_move_constructible_v<T> && std::is_nothrow_move_assignable_v<T> &&
                            !std::is_copy_constructible_v<T> && !std::is_copy_assignable_v<T>;
static_assert(moves_only<ptzcal::cloud> && moves_only<ptzcal::rig> && moves_only<ptzcal::rig_options>);
static_assert(std::is_copy_constructible_v<ptzcal::camera> && std::is_copy_assignable_v<ptzcal::camera>);
static_assert(std::is_nothrow_copy_constructible_v<ptzcal::error>);
static_assert(std::is_convertible_v<std::vector<double> &, ptzcal::view<const double>> &&
              std::is_convertible_v<const std::array<double, 3> &, ptzcal::view<const double>> &&
              std::is_convertible_v<double (&)[3], ptzcal::view<const double>>);
static_assert(!std::is_convertible_v<std::vector<float> &, ptzcal::view<const double>> &&
              !std::is_convertible_v<std::list<double> &, ptzcal::view<const double>> &&
              !std::is_convertible_v<const std::vector<double> &, ptzcal::view<double>>);
static_assert(!std::is_convertible_v<std::uint32_t, ptzcal::distortion_model> &&
              std::is_convertible_v<ptzcal::distortion_model, std::uint32_t>);
static_assert(ptzcal::head_camera == PTZCAL_HEAD_CAMERA && ptzcal::rig_parameters == 15);

static void handles_move()
{
  ptzcal::cloud cloud;
  cloud.add_points({0, 0, 1, 0, 0, 2});
  ptzcal::cloud other = std::move(cloud);
  CHECK(other && !cloud && other.size().points == 2);
  CHECK_FAILS(null_pointer, cloud.size());
  cloud = std::move(other);
  CHECK(cloud.size().points == 2);
  ptzcal::cloud &itself = cloud;
  cloud = std::move(itself);
  CHECK(cloud.size().points == 2);

  // To the C API and back.
  ptzcal_cloud *raw = cloud.detach();
  CHECK(raw && !cloud);
  cloud = ptzcal::cloud(raw);
  CHECK(cloud.get() == raw && cloud.size().points == 2);
  ptzcal::scan empty;
  CHECK(!empty);
  CHECK_FAILS(null_pointer, empty.summary());
}

static void views_are_of_anything_contiguous()
{
  ptzcal::cloud cloud;
  const std::vector<std::array<double, 3>> points = {{0, 0, 1}, {1, 0, 1}, {0, 1, 2}};
  cloud.add_points(ptzcal::numbers(points));
  const double plain[] = {1, 2, 3};
  cloud.add_points(plain);
  cloud.add_points({plain, 3});
  cloud.add_points({4, 5, 6}, {255, 0, 1});
  const std::vector<double> copied = cloud.points();
  CHECK(copied.size() == 18 && copied[8] == 2 && copied[17] == 6 && cloud.colours()[15] == 255);
  const ptzcal::view<const double> view(copied);
  CHECK(view.part(3, 3)[0] == 1 && view.size() == 18 && !view.empty() && view.end() - view.begin() == 18);
}

static void structs_are_the_c_ones()
{
  ptzcal::camera camera;
  CHECK(camera.struct_size == sizeof(ptzcal_camera) && camera.distortion_model == ptzcal::distortion_model::none);
  camera.width = 640, camera.height = 480;
  camera.fx = camera.fy = 500, camera.cx = 319.5, camera.cy = 239.5;
  camera.distortion_model = ptzcal::distortion_model::brown_conrady;
  camera.distortion[0] = -0.1;
  CHECK(ptzcal::distortion_model(camera.distortion_model) == ptzcal::distortion_model::brown_conrady);
  const ptzcal_camera c = camera;
  const ptzcal::camera back = c;
  CHECK(std::memcmp(&c, static_cast<const ptzcal_camera *>(&back), sizeof c) == 0);

  double uv[2];
  const double xyz[] = {0.4, -0.3, 2};
  CHECK_OK(ptzcal_camera_project(&c, xyz, 1, uv, nullptr));
  CHECK(camera.project(xyz) == std::vector<double>(uv, uv + 2));
}

static void files_and_strings(const std::string &folder)
{
  ptzcal::camera camera;
  camera.width = 640, camera.height = 480;
  camera.fx = 500, camera.fy = 501, camera.cx = 319.5, camera.cy = 239.5;
  const std::string path = folder + "/camera.json";
  camera.save(path);
  CHECK(ptzcal::camera::load(path.c_str()).fy == 501);

  const std::vector<std::uint8_t> pixels(4 * 3 * 5, 77);
  const auto image = ptzcal::packed_image(ptzcal::pixel_format::rgb24, pixels.data(), 4, 5);
  CHECK(image.stride[0] == 12 && image.size[0] == 60);
  const auto upside_down = ptzcal::packed_image(ptzcal::pixel_format::gray8, pixels.data() + 16, 4, 5, -4);
  CHECK(upside_down.size[0] == 20);
  ptzcal::picture picture(image);
  picture.draw_circles({2, 2}, 1, 1, 0xff0000);
  picture.save(folder + "/picture.png");
  const ptzcal::picture read = ptzcal::picture::read(folder + "/picture.png");
  CHECK(ptzcal::image(read.image()).width == 4);
  CHECK_FAILS(invalid_argument, ptzcal::picture(ptzcal::packed_image(ptzcal::pixel_format::rgb24, pixels.data(), 0, 5)));
}

static void pictures_go_into_the_callers_memory()
{
  ptzcal::camera camera;
  camera.width = 40, camera.height = 30, camera.fx = camera.fy = 35, camera.cx = 19.5, camera.cy = 14.5;
  camera.distortion_model = ptzcal::distortion_model::brown_conrady, camera.distortion[0] = -0.2;
  const std::vector<std::uint8_t> pixels(40 * 30, 200);
  const auto image = ptzcal::packed_image(ptzcal::pixel_format::gray8, pixels.data(), 40, 30, 40);
  const ptzcal::undistorter filled(camera, camera.undistorted(0.0)), all(camera, camera.undistorted(1.0));
  CHECK(filled.camera().fx > all.camera().fx && filled.camera().distortion_model == ptzcal::distortion_model::none);

  std::vector<std::uint8_t> picture(40 * 30);
  filled.apply(image, picture, 40);
  CHECK(picture == pixels);
  std::array<std::uint8_t, 4 * 3> part{};
  all.apply_region(image, 18, 0, 3, 3, {}, part, -4);
  CHECK(part[8] == 0 && part[3] == 0);
  const std::uint8_t border[] = {7, 0, 0, 0};
  all.apply_region(image, 18, 0, 3, 3, border, part, -4);
  CHECK(part[8] == 7 && part[3] == 0);
  CHECK_FAILS(buffer_too_small, filled.apply(image, {picture.data(), picture.size() - 1}, 40));
  CHECK_FAILS(invalid_argument, all.apply_region(image, 18, 0, 3, 3, {border, 3}, part, 4));
}

int main(int, char **arguments)
{
  pictures_go_into_the_callers_memory();
  handles_move();
  views_are_of_anything_contiguous();
  structs_are_the_c_ones();
  files_and_strings(arguments[2]);
}
