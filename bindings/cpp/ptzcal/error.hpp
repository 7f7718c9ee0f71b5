// Failures: error, result, outcome, attempt.
#ifndef PTZCAL_ERROR_HPP
#define PTZCAL_ERROR_HPP

#include "constants.hpp"

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

PTZCAL_BEGIN

// Why a call failed: decide by status(); the rest is for people.
class error : public std::exception {
 public:
  error(ptzcal::status status, std::string message, std::string hint = {}, std::int64_t index = -1)
      : details_(std::make_shared<const details>(details{status, std::move(message), std::move(hint), index}))
  {
  }

  ptzcal::status status() const noexcept { return details_->status; }
  // What went wrong, with the offending value in it.
  const char *what() const noexcept override { return details_->message.c_str(); }
  const std::string &message() const noexcept { return details_->message; }
  // What can be done about it; may be empty.
  const std::string &hint() const noexcept { return details_->hint; }
  // Which point, view or sample is at fault, from 0; -1: no single one.
  std::int64_t index() const noexcept { return details_->index; }

 private:
  struct details {
    ptzcal::status status;
    std::string message, hint;
    std::int64_t index;
  };
  // Shared, so that copying does not throw.
  std::shared_ptr<const details> details_;
};

namespace detail {

[[noreturn]] inline void raise([[maybe_unused]] const error &e)
{
#ifdef PTZCAL_NO_EXCEPTIONS
  std::terminate();
#else
  throw e;
#endif
}

}  // namespace detail

// A value, or why there is none. Asking for the value of an error throws it (ends the program where
// there are no exceptions).
template <class T>
class [[nodiscard]] result {
 public:
  using value_type = T;

  result(T value) : content_(std::in_place_index<0>, std::move(value)) {}
  result(ptzcal::error error) : content_(std::in_place_index<1>, std::move(error)) {}

  bool has_value() const noexcept { return content_.index() == 0; }
  explicit operator bool() const noexcept { return has_value(); }
  ptzcal::status status() const noexcept { return has_value() ? ptzcal::status(status::ok) : error().status(); }
  // Only of a result without a value.
  const ptzcal::error &error() const noexcept { return *std::get_if<1>(&content_); }

  T &value() & { return check(), *std::get_if<0>(&content_); }
  const T &value() const & { return check(), *std::get_if<0>(&content_); }
  T &&value() && { return check(), std::move(*std::get_if<0>(&content_)); }
  T &operator*() & { return value(); }
  const T &operator*() const & { return value(); }
  T &&operator*() && { return std::move(*this).value(); }
  T *operator->() { return &value(); }
  const T *operator->() const { return &value(); }

 private:
  void check() const
  {
    if (!has_value()) detail::raise(error());
  }
  std::variant<T, ptzcal::error> content_;
};

template <>
class [[nodiscard]] result<void> {
 public:
  using value_type = void;

  result() noexcept = default;
  result(ptzcal::error error) : error_(std::move(error)) {}

  bool has_value() const noexcept { return !error_; }
  explicit operator bool() const noexcept { return has_value(); }
  ptzcal::status status() const noexcept { return error_ ? error_->status() : ptzcal::status(status::ok); }
  const ptzcal::error &error() const noexcept { return *error_; }
  void value() const
  {
    if (error_) detail::raise(*error_);
  }

 private:
  std::optional<ptzcal::error> error_;
};

// What a function of this header returns: T, with exceptions; result<T> without.
#ifdef PTZCAL_NO_EXCEPTIONS
template <class T>
using outcome = result<T>;
#else
template <class T>
using outcome = T;
#endif

// Calls `work`, and turns a ptzcal::error that leaves it into a result; other exceptions pass.
template <class F>
auto attempt(F &&work)
{
#ifdef PTZCAL_NO_EXCEPTIONS
  return std::forward<F>(work)();
#else
  using T = std::decay_t<std::invoke_result_t<F>>;
  try {
    if constexpr (std::is_void_v<T>) {
      std::forward<F>(work)();
      return result<void>();
    } else {
      return result<T>(std::forward<F>(work)());
    }
  } catch (const error &e) {
    return result<T>(e);
  }
#endif
}

PTZCAL_END

#endif
