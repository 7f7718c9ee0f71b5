// Setters of callbacks: the host's devices, clock and log.
#ifndef PTZCAL_DEVICES_HPP
#define PTZCAL_DEVICES_HPP

#include "api.hpp"

#include <cmath>

PTZCAL_BEGIN
namespace detail {

using kept_ptz = kept_callback<ptz>;

inline std::int32_t on_move(void *user, double pan, double tilt) noexcept
{
  auto &p = *static_cast<kept_ptz *>(user);
  return guarded(p.owner, when::unless_failed, [&] { return p.call.move_absolute(pan, tilt); });
}
inline std::int32_t on_position(void *user, double *pan, double *tilt, double *zoom) noexcept
{
  auto &p = *static_cast<kept_ptz *>(user);
  *zoom = 0;
  return guarded(p.owner, when::unless_failed, [&] { return p.call.position(*pan, *tilt, *zoom); });
}
inline std::int32_t on_motion(void *user, std::int32_t *motion) noexcept
{
  auto &p = *static_cast<kept_ptz *>(user);
  return guarded(p.owner, when::unless_failed, [&] { return p.call.motion(*motion); });
}
inline std::int32_t on_stop(void *user) noexcept
{
  auto &p = *static_cast<kept_ptz *>(user);
  return guarded(p.owner, when::always, [&] { return p.call.stop(); });
}
inline std::int32_t on_laser(void *user, std::int32_t on) noexcept
{
  auto &laser = *static_cast<kept_callback<laser_callback> *>(user);
  return guarded(laser.owner, on ? when::unless_failed : when::always, [&] { return laser.call(on != 0); });
}
inline std::int32_t on_frame(void *user, double not_before, double timeout, ptzcal_image *image, double *timestamp) noexcept
{
  auto &frames = *static_cast<kept_callback<frame_callback> *>(user);
  *timestamp = std::nan("");
  return guarded(frames.owner, when::unless_failed,
                 [&] { return frames.call(not_before, timeout, *image, *timestamp); });
}
inline void on_log(void *user, std::int32_t level, const char *message) noexcept
{
  auto &log = *static_cast<kept_callback<log_callback> *>(user);
  guarded(log.owner, when::unless_failed, [&] { return log.call(log_level(level), message), PTZCAL_STATUS_OK; });
}
inline void on_move_end(void *user, std::uint64_t number, std::int32_t end, std::int32_t status, double pan,
                        double tilt) noexcept
{
  auto &hears = *static_cast<kept_callback<move_end_callback> *>(user);
  guarded(hears.owner, when::always, [&] {
    return hears.call(number, move_end(end), ptzcal::status(status), pan, tilt), PTZCAL_STATUS_OK;
  });
}

struct host_clock {
  clock_now_callback now;
  clock_sleep_callback sleep;
  double last = 0;
};
inline double on_now(void *user) noexcept
{
  auto &clock = *static_cast<kept_callback<host_clock> *>(user);
  const auto told = guarded(clock.owner, when::unless_failed,
                            [&] { return clock.call.last = clock.call.now(), PTZCAL_STATUS_OK; });
  // A clock that failed runs away, so that nothing waits for it.
  if (told != PTZCAL_STATUS_OK) clock.call.last += 3600;
  return clock.call.last;
}
inline void on_sleep(void *user, double seconds) noexcept
{
  auto &clock = *static_cast<kept_callback<host_clock> *>(user);
  guarded(clock.owner, when::unless_failed, [&] { return clock.call.sleep(seconds), PTZCAL_STATUS_OK; });
}

inline ptzcal_ptz c_ptz(holder &holder, ptz head)
{
  ptzcal_ptz c;
  ptzcal_ptz_init(&c, sizeof c);
  c.raw_units = head.raw_units;
  c.pan_min = head.pan_min, c.pan_max = head.pan_max, c.pan_step = head.pan_step;
  c.tilt_min = head.tilt_min, c.tilt_max = head.tilt_max, c.tilt_step = head.tilt_step;
  c.move_absolute = head.move_absolute ? on_move : nullptr;
  c.position = head.position ? on_position : nullptr;
  c.motion = head.motion ? on_motion : nullptr;
  c.stop = head.stop ? on_stop : nullptr;
  c.user = keep(holder, std::move(head));
  return c;
}

}  // namespace detail

inline outcome<void> rig_options::set_ptz(ptz head)
{
  detail::call call;
  const ptzcal_ptz c = detail::c_ptz(*this, std::move(head));
  return call.finish(ptzcal_rig_options_set_ptz(get(), &c, call.error()));
}

inline outcome<void> rig_options::set_laser(laser_callback set)
{
  detail::call call;
  const auto function = set ? detail::on_laser : nullptr;
  return call.finish(ptzcal_rig_options_set_laser(get(), function, detail::keep(*this, std::move(set)), call.error()));
}

inline outcome<void> rig_options::set_frames(frame_callback next_frame)
{
  detail::call call;
  const auto function = next_frame ? detail::on_frame : nullptr;
  return call.finish(
      ptzcal_rig_options_set_frames(get(), function, detail::keep(*this, std::move(next_frame)), call.error()));
}

inline outcome<void> rig_options::set_clock(clock_now_callback now, clock_sleep_callback sleep)
{
  detail::call call;
  const auto now_function = now ? detail::on_now : nullptr;
  const auto sleep_function = sleep ? detail::on_sleep : nullptr;
  auto *user = detail::keep(*this, detail::host_clock{std::move(now), std::move(sleep)});
  return call.finish(ptzcal_rig_options_set_clock(get(), now_function, sleep_function, user, call.error()));
}

inline outcome<void> rig_options::set_log(log_callback log)
{
  detail::call call;
  const auto function = log ? detail::on_log : nullptr;
  return call.finish(ptzcal_rig_options_set_log(get(), function, detail::keep(*this, std::move(log)), call.error()));
}

inline outcome<void> head_options::set_ptz(ptz head)
{
  detail::call call;
  const ptzcal_ptz c = detail::c_ptz(*this, std::move(head));
  return call.finish(ptzcal_head_options_set_ptz(get(), &c, call.error()));
}

inline outcome<void> head_options::set_laser(laser_callback set)
{
  detail::call call;
  const auto function = set ? detail::on_laser : nullptr;
  return call.finish(ptzcal_head_options_set_laser(get(), function, detail::keep(*this, std::move(set)), call.error()));
}

inline outcome<void> head_options::set_frames(frame_callback next_frame)
{
  detail::call call;
  const auto function = next_frame ? detail::on_frame : nullptr;
  return call.finish(
      ptzcal_head_options_set_frames(get(), function, detail::keep(*this, std::move(next_frame)), call.error()));
}

inline outcome<void> head_options::set_log(log_callback log)
{
  detail::call call;
  const auto function = log ? detail::on_log : nullptr;
  return call.finish(ptzcal_head_options_set_log(get(), function, detail::keep(*this, std::move(log)), call.error()));
}

inline outcome<void> head_options::set_on_move_end(move_end_callback hears)
{
  detail::call call;
  const auto function = hears ? detail::on_move_end : nullptr;
  return call.finish(
      ptzcal_head_options_set_on_move_end(get(), function, detail::keep(*this, std::move(hears)), call.error()));
}

inline outcome<std::uint32_t> scan_options::add_camera(frame_callback next_frame, std::uint32_t width, std::uint32_t height)
{
  detail::call call;
  std::uint32_t index = 0;
  const auto function = next_frame ? detail::on_frame : nullptr;
  auto *user = detail::keep(*this, std::move(next_frame));
  const auto status = ptzcal_scan_options_add_camera(get(), function, user, width, height, &index, call.error());
  return call.finish(status, std::move(index));
}

PTZCAL_END

#endif
