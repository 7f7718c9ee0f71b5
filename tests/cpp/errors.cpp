// Failures: what an error says, results, lengths that contradict each other.
#include "check.hpp"

#include <array>
#include <cmath>
#include <string>
#include <type_traits>
#include <vector>

static ptzcal::camera pinhole()
{
  ptzcal::camera camera;
  camera.width = 640, camera.height = 480;
  camera.fx = camera.fy = 500, camera.cx = 319.5, camera.cy = 239.5;
  return camera;
}

static void errors_say_what_where_and_what_to_do()
{
  const ptzcal::camera camera = pinhole();
  const std::vector<double> points = {0, 0, 4, 0, 0, -1};
  try {
    camera.project(points);
    CHECK(!"a point behind the camera has no image");
  } catch (const std::exception &caught) {
    const auto &error = dynamic_cast<const ptzcal::error &>(caught);
    CHECK(error.status() == ptzcal::status::behind_camera && error.index() == 1);
    CHECK(std::string(error.what()) == error.message() && !error.message().empty());
    const ptzcal::error copy = error;
    CHECK(copy.what() == error.what());
  }
  ptzcal::correspondences few(640, 480);
  few.add_points({0, 0, 4}, {319.5, 239.5});
  const auto error = CHECK_FAILS(too_few_points, ptzcal::calibrate_camera(few));
  CHECK(!error.hint().empty() && error.index() == -1);
  CHECK_FAILS(file_io, ptzcal::camera::load("/no/such/file.json"));
  CHECK_FAILS(not_finite, camera.project({0, NAN, 1}));
}

static void a_status_is_a_number_and_a_name()
{
  ptzcal::status status = ptzcal::status::not_found;
  CHECK(status == PTZCAL_STATUS_NOT_FOUND && status == ptzcal::status::not_found && status != ptzcal::status::ok);
  switch (status) {
    case ptzcal::status::not_found: break;
    default: CHECK(!"the case above");
  }
  CHECK(ptzcal::status_name(status) == "PTZCAL_STATUS_NOT_FOUND");
  CHECK(ptzcal::status(-12345) == -12345);
  CHECK(ptzcal::version() == ptzcal_version() && ptzcal::abi_version() == PTZCAL_ABI_VERSION);
}

static void results_hold_a_value_or_an_error()
{
  const ptzcal::camera camera = pinhole();
  const auto good = ptzcal::attempt([&] { return camera.centre(); });
  static_assert(std::is_same_v<decltype(good), const ptzcal::result<std::array<double, 3>>>);
  CHECK(good && good.has_value() && good.status() == ptzcal::status::ok && good.value()[2] == 0 && (*good)[0] == 0);
  const auto bad = ptzcal::attempt([&] { return camera.project({0, 0, -1}); });
  CHECK(!bad && bad.status() == ptzcal::status::behind_camera);
  try {
    (void)bad.value();
    CHECK(!"there is none");
  } catch (const ptzcal::error &error) {
    CHECK(error.status() == ptzcal::status::behind_camera);
  }
  const auto nothing = ptzcal::attempt([&] { camera.save("/no/such/folder/camera.json"); });
  static_assert(std::is_same_v<decltype(nothing), const ptzcal::result<void>>);
  CHECK(!nothing && nothing.status() == ptzcal::status::file_io);
}

static void lengths_that_contradict_each_other_are_refused()
{
  ptzcal::correspondences set(640, 480);
  const std::vector<double> six(6), five(5), four(4), three(3);
  CHECK_FAILS(invalid_argument, set.add_points(six, three));
  CHECK_FAILS(invalid_argument, set.add_points(five, four));
  CHECK_FAILS(invalid_argument, set.add_points(six, {}));
  const auto error = CHECK_FAILS(invalid_argument, set.add_points_weighted(six, four, four));
  CHECK(error.message() == "xyz_covariance has 4 numbers, not 9 for each of 2");
  CHECK_FAILS(invalid_argument, ptzcal::rig_model().aim(four));
  CHECK_FAILS(invalid_argument, ptzcal::ellipse(four, 0.95));
  CHECK(set.count() == 0);
  const std::vector<std::uint16_t> depths(11);
  CHECK_FAILS(invalid_argument, ptzcal::depth_map::from_u16(depths, 4, 3, 4, 0.001));
  CHECK(ptzcal::depth_map::from_u16({depths.data(), 11}, 3, 3, 4, 0.001).size().width == 3);
}

int main()
{
  errors_say_what_where_and_what_to_do();
  a_status_is_a_number_and_a_name();
  results_hold_a_value_or_an_error();
  lengths_that_contradict_each_other_are_refused();
}
