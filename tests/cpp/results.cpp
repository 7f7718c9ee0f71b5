// Without exceptions: every function answers a result. Built with -fno-exceptions too.
#define PTZCAL_NO_EXCEPTIONS
#include "check.hpp"

#include <type_traits>
#include <utility>
#include <vector>

static_assert(std::is_same_v<decltype(std::declval<ptzcal::camera>().centre()), ptzcal::result<std::array<double, 3>>>);
static_assert(std::is_same_v<decltype(std::declval<ptzcal::rig>().stop()), ptzcal::result<void>>);
static_assert(!std::is_constructible_v<ptzcal::correspondences, int, int>, "a constructor could not tell of a failure");

int main()
{
  CHECK_FAILS(invalid_argument, ptzcal::correspondences::make(0, 480));
  auto made = ptzcal::correspondences::make(640, 480);
  CHECK(made);
  ptzcal::correspondences set = std::move(*made);
  CHECK(set.add_points({0, 0, 4}, {319.5, 239.5}));
  CHECK_FAILS(invalid_argument, set.add_points({0, 0, 4}, {319.5}));
  CHECK(set.count().value() == 1);
  const auto calibration = ptzcal::calibrate_camera(set);
  CHECK(!calibration && calibration.status() == ptzcal::status::too_few_points && !calibration.error().hint().empty());

  // A rig on the host's callbacks, which fail as devices do.
  auto room = ptzcal::simulator::make("sim:room");
  CHECK(room);
  int lasers = 0;
  bool broken = false;
  ptzcal::ptz head;
  head.pan_min = head.tilt_min = -1, head.pan_max = head.tilt_max = 1;
  head.move_absolute = [&](double pan, double tilt) { return broken ? ptzcal::status(ptzcal::status::device_lost) : room->move(pan, tilt).status(); };
  head.position = [&](double &pan, double &tilt, double &) {
    const auto at = room->position();
    if (at) pan = at->pan, tilt = at->tilt;
    return at.status();
  };
  head.motion = [&](std::int32_t &motion) { motion = *room->motion(); };
  head.stop = [&] { return room->stop(); };
  ptzcal::rig_options options;
  CHECK(options.set_ptz(head));
  CHECK(options.set_model(*room->nominal_rig()));
  CHECK(options.set_laser([&](bool on) { lasers++; return room->set_laser(on); }));
  CHECK(options.set_frames([&](double not_before, double timeout, ptzcal_image &image, double &timestamp) {
    const auto frame = room->next_frame(ptzcal::head_camera, not_before, timeout);
    if (frame) image = frame->image, timestamp = frame->timestamp;
    return frame.status();
  }));
  CHECK(options.set_clock([&] { return room->now().value(); }, [&](double seconds) { CHECK(room->sleep(seconds)); }));
  auto opened = ptzcal::rig::open(options);
  CHECK(opened && lasers > 0);
  ptzcal::rig rig = std::move(*opened);
  CHECK(rig.move(0.1, 0.05));
  const auto at = rig.position();
  CHECK(at);
  CHECK_NEAR(at->pan, 0.1, 1e-2);
  broken = true;
  CHECK_FAILS(device_lost, rig.move(0.2, 0.05));
  broken = false;
  int heard = 0;
  const auto stopped = rig.scan_region(small_region(), ptzcal::scan_options(), [&](const ptzcal_progress &) {
    return ++heard == 2 ? ptzcal::flow::stop : ptzcal::flow::go_on;
  });
  CHECK(heard == 2 && stopped);
  CHECK_FAILS(cancelled, stopped->end());
  CHECK(rig.close());
  return 0;
}
