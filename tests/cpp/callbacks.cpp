// Exceptions in callbacks end the work and leave the call; the laser is off then, and the rig still works.
#include "check.hpp"

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

namespace {

// Few positions: it is run often.
ptzcal::region few_positions()
{
  ptzcal::region region = small_region();
  region.pan_steps = 4, region.tilt_steps = 3;
  return region;
}

struct trouble : std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class part { none, move, position, motion, stop, laser, frames, fixed, now, sleep, log, progress };

// The host's devices, any of which throws after some calls.
struct host {
  ptzcal::simulator room{"sim:room?seed=3"};
  part broken = part::none;
  int patience = 0;
  bool laser_is_on = false;
  int after_the_throw = 0;
  bool thrown = false;

  void reach(part p, bool needed = false)
  {
    if (thrown && !needed) after_the_throw++;
    if (p != broken || patience-- > 0) return;
    broken = part::none;
    thrown = true;
    throw trouble("the host's own trouble");
  }

  ptzcal::frame_callback frames(std::uint32_t camera, part p)
  {
    return [this, camera, p](double not_before, double timeout, ptzcal_image &image, double &timestamp) {
      reach(p);
      const auto frame = room.next_frame(camera, not_before, timeout);
      image = frame.image;
      timestamp = frame.timestamp;
    };
  }

  ptzcal::rig_options options()
  {
    ptzcal::ptz head;
    head.pan_min = -1.7, head.pan_max = 1.7, head.tilt_min = -0.43, head.tilt_max = 0.43;
    head.pan_step = head.tilt_step = 0.0012;
    head.move_absolute = [this](double pan, double tilt) { reach(part::move), room.move(pan, tilt); };
    head.position = [this](double &pan, double &tilt, double &) {
      reach(part::position);
      const auto at = room.position();
      pan = at.pan, tilt = at.tilt;
    };
    head.motion = [this](std::int32_t &motion) { reach(part::motion), motion = room.motion(); };
    head.stop = [this] { reach(part::stop, true), room.stop(); };
    ptzcal::rig_options options;
    options.set_model(room.nominal_rig());
    options.set_ptz(head);
    options.set_laser([this](bool on) {
      reach(part::laser, !on);
      room.set_laser(on);
      laser_is_on = on;
    });
    options.set_frames(frames(ptzcal::head_camera, part::frames));
    options.set_clock([this] { return reach(part::now, true), room.now(); },
                      [this](double seconds) { reach(part::sleep, true), room.sleep(seconds); });
    options.set_log([this](ptzcal::log_level, const char *) { reach(part::log); });
    return options;
  }
};

void an_exception_leaves_the_call(part p, const char *name)
{
  host devices;
  ptzcal::rig rig = ptzcal::rig::open(devices.options());
  ptzcal::scan_options options;
  options.add_camera(devices.frames(0, part::fixed), 800, 600);
  devices.broken = p;
  devices.patience = p == part::progress || p == part::log ? 0 : 7;
  bool caught = false;
  try {
    rig.scan_region(few_positions(), options, [&](const ptzcal_progress &) { devices.reach(part::progress); });
  } catch (const trouble &e) {
    caught = std::string(e.what()) == "the host's own trouble";
  }
  if (p == part::log && !devices.thrown) return;  // a scan without anything to say
  if (!caught) std::fprintf(stderr, "%s\n", name);
  CHECK(caught && !devices.laser_is_on);
  if (devices.after_the_throw != 0) std::fprintf(stderr, "%s: %d calls\n", name, devices.after_the_throw);
  CHECK(devices.after_the_throw == 0);

  // The same rig, once the host is well again.
  devices.thrown = false;
  rig.move(0.1, 0.1);
  CHECK_NEAR(rig.position().pan, 0.1, 2e-3);
  rig.scan_region(few_positions(), options).end();
  rig.close();
  CHECK(!devices.laser_is_on);
}

void statuses_of_callbacks_are_the_librarys_matter()
{
  host devices;
  ptzcal::rig_options options = devices.options();
  ptzcal::status answer = ptzcal::status::ok;
  options.set_laser([&](bool on) { return on ? answer : ptzcal::status(ptzcal::status::ok); });
  ptzcal::rig rig = ptzcal::rig::open(options);
  rig.set_laser(true);
  rig.set_laser(false);
  answer = ptzcal::status::device_timeout;
  CHECK_FAILS(device_timeout, rig.set_laser(true));
  // What a callback throws is thrown as it is, also an error of the library's own kind.
  options.set_laser([&](bool on) {
    if (on) throw ptzcal::error(ptzcal::status::laser_refused, "the host says no", "ask it");
  });
  rig.close();
  rig = ptzcal::rig::open(options);
  const auto error = CHECK_FAILS(laser_refused, rig.set_laser(true));
  CHECK(error.message() == "the host says no" && error.hint() == "ask it");
}

void flow_stop_ends_the_work()
{
  ptzcal::rig_options options;
  options.set_address("sim:room");
  ptzcal::rig rig = ptzcal::rig::open(options);
  int heard = 0;
  const auto progress = [&](const ptzcal_progress &p) {
    heard++;
    return p.done >= 3 ? ptzcal::flow::stop : ptzcal::flow::go_on;
  };
  const ptzcal::scan scan = rig.scan_region(few_positions(), ptzcal::scan_options(), progress);  // heard of 0, 1, 2, 3
  CHECK(heard == 4 && scan.summary().shots == 3 && !scan.summary().complete);
  CHECK_FAILS(cancelled, scan.end());

  ptzcal::cancel token;
  ptzcal::scan_options cancelled;
  cancelled.set_cancel(token);
  token.request();
  CHECK(token.is_requested());
  CHECK_FAILS(cancelled, rig.scan_region(few_positions(), cancelled).end());
}

// A callback may itself call the library, and what throws in there is the inner call's.
void calls_nest()
{
  host devices;
  ptzcal::rig_options options = devices.options();
  int inner = 0;
  options.set_laser([&](bool) {
    CHECK_FAILS(file_io, ptzcal::camera::load("/no/such/file.json"));
    inner++;
  });
  ptzcal::rig rig = ptzcal::rig::open(options);
  rig.set_laser(true);
  CHECK(inner >= 2);
}

// The head's own thread has no call to leave: the next call of the head is told.
void a_heads_thread_hands_its_exception_over()
{
  host devices;
  ptzcal::head_options options;
  options.set_address("sim:room");
  std::atomic<int> ends{0};
  options.set_on_move_end([&](std::uint64_t, ptzcal::move_end, ptzcal::status, double, double) {
    ends++;
    throw trouble("heard of an end");
  });
  ptzcal::head head = ptzcal::head::open(options);
  bool caught = false;
  try {
    const std::uint64_t number = head.move(0.05, 0.02);
    head.wait(number, 10);
    for (int i = 0; i < 500 && ends == 0; i++) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    for (int i = 0; i < 100; i++) {
      head.position();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  } catch (const trouble &e) {
    caught = std::string(e.what()) == "heard of an end";
  }
  CHECK(caught && ends > 0);
  head.position();
  head.close();
}

// Callbacks live as long as what was opened with them, whoever goes first.
void callbacks_outlive_their_options()
{
  host devices;
  auto alive = std::make_shared<int>(0);
  const std::weak_ptr<int> watch = alive;
  {
    ptzcal::rig rig;
    {
      ptzcal::rig_options options = devices.options();
      options.set_log([alive](ptzcal::log_level, const char *) { ++*alive; });
      alive.reset();
      rig = ptzcal::rig::open(options);
    }
    CHECK(!watch.expired());
    rig.move(0.1, 0);
    ptzcal::rig moved = std::move(rig);
    moved.set_laser(true);
    // By exchange: the old one closes with its callbacks at hand.
    moved = ptzcal::rig::open(devices.options());
    CHECK(!devices.laser_is_on);
    moved.set_laser(true);
  }
  CHECK(watch.expired() && !devices.laser_is_on);
}

}  // namespace

int main()
{
  const std::pair<part, const char *> parts[] = {
      {part::move, "move"},     {part::position, "position"}, {part::motion, "motion"}, {part::laser, "laser"},
      {part::frames, "frames"}, {part::fixed, "fixed"},       {part::now, "now"},       {part::sleep, "sleep"},
      {part::log, "log"},       {part::progress, "progress"}};
  for (const auto &[p, name] : parts) an_exception_leaves_the_call(p, name);
  statuses_of_callbacks_are_the_librarys_matter();
  flow_stop_ends_the_work();
  calls_nest();
  a_heads_thread_hands_its_exception_over();
  callbacks_outlive_their_options();
}
