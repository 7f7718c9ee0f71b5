// Callbacks: any callables, kept as long as whoever calls them.
//
// An exception in a callback cannot pass through the library. It is caught at the border and kept,
// the work is told to stop, callbacks are not called again (but for the laser's "off" and the head's
// "stop", which always are), and the exception leaves the call of the library that it happened in. A
// head's own thread has no such call: what is thrown there leaves the next call of that head.
// Without exceptions a callback that throws ends the program.
//
// A device's callback may return nothing, or a status (status::device, device_lost, device_timeout,
// unsupported): a failure that the library deals with, by the scan's rules. An exception is none of
// these: it ends the call.
#ifndef PTZCAL_CALLBACKS_HPP
#define PTZCAL_CALLBACKS_HPP

#include "handle.hpp"

#include <functional>
#include <memory>
#include <mutex>
#include <type_traits>
#include <utility>
#include <vector>

PTZCAL_BEGIN

enum class flow { go_on, stop };

namespace detail {

inline std::int32_t to_status(std::int32_t status) noexcept { return status; }
template <class T>
std::int32_t to_status(const result<T> &r) noexcept
{
  return r.status();
}

template <class F, class Self, class... A>
using if_callable = std::enable_if_t<!std::is_same_v<std::decay_t<F>, Self> && std::is_invocable_v<F &, A...>>;

}  // namespace detail

// A callback of a device: returns nothing or a status.
template <class... A>
class device_function {
 public:
  device_function() = default;
  template <class F, class = detail::if_callable<F, device_function, A...>>
  device_function(F call)
  {
    using R = std::invoke_result_t<F &, A...>;
    static_assert(!std::is_same_v<R, bool>, "return a status, or nothing");
    call_ = [call = std::move(call)](A... arguments) mutable -> std::int32_t {
      if constexpr (std::is_void_v<R>)
        return call(static_cast<A>(arguments)...), PTZCAL_STATUS_OK;
      else
        return detail::to_status(call(static_cast<A>(arguments)...));
    };
  }
  explicit operator bool() const noexcept { return static_cast<bool>(call_); }
  std::int32_t operator()(A... arguments) const { return call_(static_cast<A>(arguments)...); }

 private:
  std::function<std::int32_t(A...)> call_;
};

// Hears how far long work is; returns nothing, or flow::stop to end it (status::cancelled).
class progress_callback {
 public:
  progress_callback() = default;
  progress_callback(std::nullptr_t) noexcept {}
  template <class F, class = detail::if_callable<F, progress_callback, const ptzcal_progress &>>
  progress_callback(F call)
  {
    using R = std::invoke_result_t<F &, const ptzcal_progress &>;
    static_assert(std::is_void_v<R> || std::is_same_v<R, flow>, "return ptzcal::flow, or nothing");
    call_ = [call = std::move(call)](const ptzcal_progress &progress) mutable {
      if constexpr (std::is_void_v<R>)
        return call(progress), flow::go_on;
      else
        return call(progress);
    };
  }
  explicit operator bool() const noexcept { return static_cast<bool>(call_); }
  flow operator()(const ptzcal_progress &progress) const { return call_(progress); }

 private:
  std::function<flow(const ptzcal_progress &)> call_;
};

// Frames: fill in the image and when its exposure began (NAN: unknown); see ptzcal_frame_fn.
using frame_callback = device_function<double /*not_before*/, double /*timeout*/, ptzcal_image &, double & /*timestamp*/>;
using laser_callback = device_function<bool /*on*/>;
using log_callback = std::function<void(log_level, const char *message)>;
using clock_now_callback = std::function<double()>;
using clock_sleep_callback = std::function<void(double seconds)>;
using move_end_callback =
    std::function<void(std::uint64_t number, move_end end, status status, double pan, double tilt)>;

// A pan-tilt head of the host; radians, or what raw_units says. `motion` may be left out.
struct ptz {
  bool raw_units = false;
  double pan_min = 0, pan_max = 0, tilt_min = 0, tilt_max = 0;
  double pan_step = 0, tilt_step = 0;
  device_function<double /*pan*/, double /*tilt*/> move_absolute;
  device_function<double & /*pan*/, double & /*tilt*/, double & /*zoom*/> position;
  device_function<std::int32_t & /*ptzcal::motion*/> motion;
  device_function<> stop;
};

namespace detail {

// Keeps callbacks alive, and what they threw where no call could hear it.
class keeper {
 public:
  template <class T>
  T *hold(std::shared_ptr<T> callback)
  {
    held_.push_back(callback);
    return callback.get();
  }
#ifndef PTZCAL_NO_EXCEPTIONS
  void keep(std::exception_ptr thrown) noexcept
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!thrown_) thrown_ = std::move(thrown);
  }
  std::exception_ptr take() noexcept
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(thrown_, nullptr);
  }

 private:
  std::mutex mutex_;
  std::exception_ptr thrown_;
#endif

 private:
  std::vector<std::shared_ptr<void>> held_;
};

// Of what has callbacks: options, and what was opened with them. A base before the handle, so that
// the handle goes first.
class holder {
 public:
  holder() noexcept = default;
  holder(holder &&) noexcept = default;
  holder &operator=(holder &&other) noexcept
  {
    keeper_.swap(other.keeper_);
    return *this;
  }
  keeper &callbacks()
  {
    if (!keeper_) keeper_ = std::make_shared<keeper>();
    return *keeper_;
  }
  void share(const holder &other) noexcept { keeper_ = other.keeper_; }
  // What was thrown on a thread of the library leaves the call at hand.
  void hand_over([[maybe_unused]] call &call) const noexcept
  {
#ifndef PTZCAL_NO_EXCEPTIONS
    if (!keeper_) return;
    if (auto thrown = keeper_->take()) call.keep(std::move(thrown));
#endif
  }

 private:
  std::shared_ptr<keeper> keeper_;
};

enum class when { unless_failed, always };

// Runs a callback at the border to C.
template <class F>
std::int32_t guarded([[maybe_unused]] keeper *keeper, [[maybe_unused]] when when, F &&callback) noexcept
{
#ifdef PTZCAL_NO_EXCEPTIONS
  return callback();
#else
  call *at_work = call::innermost();
  if (when == when::unless_failed && at_work && at_work->has_exception()) return PTZCAL_STATUS_DEVICE;
  try {
    return callback();
  } catch (...) {
    if (at_work)
      at_work->keep(std::current_exception());
    else if (keeper)
      keeper->keep(std::current_exception());
    return PTZCAL_STATUS_DEVICE;
  }
#endif
}

// A callback and whose it is: what `user` of the C API points at.
template <class F>
struct kept_callback {
  keeper *owner;
  F call;
};

template <class F>
kept_callback<F> *keep(holder &holder, F callback)
{
  keeper &keeper = holder.callbacks();
  return keeper.hold(std::make_shared<kept_callback<F>>(kept_callback<F>{&keeper, std::move(callback)}));
}

inline std::int32_t on_progress(void *user, const ptzcal_progress *progress) noexcept
{
  const auto &callback = *static_cast<const progress_callback *>(user);
  return guarded(nullptr, when::unless_failed, [&] { return callback(*progress) == flow::stop ? 1 : 0; });
}

inline ptzcal_progress_fn progress_function(const progress_callback &callback) noexcept
{
  return callback ? on_progress : nullptr;
}
inline void *progress_user(const progress_callback &callback) noexcept
{
  return const_cast<progress_callback *>(&callback);
}

}  // namespace detail
PTZCAL_END

#endif
