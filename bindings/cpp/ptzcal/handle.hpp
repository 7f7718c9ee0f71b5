// Ownership of a handle, and a call of the library from its arguments' checks to its outcome.
#ifndef PTZCAL_HANDLE_HPP
#define PTZCAL_HANDLE_HPP

#include "error.hpp"
#include "view.hpp"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>
#include <utility>

PTZCAL_BEGIN
namespace detail {

// Owns a handle of the C API.
template <class T, void (*Free)(T *) noexcept>
class handle {
 public:
  handle() noexcept = default;
  // Takes a handle of the C API over.
  explicit handle(T *owned) noexcept : owned_(owned) {}
  handle(handle &&other) noexcept : owned_(other.detach()) {}
  // By exchange: what this one held ends with `other`, after whatever its callbacks need.
  handle &operator=(handle &&other) noexcept
  {
    std::swap(owned_, other.owned_);
    return *this;
  }
  handle(const handle &) = delete;
  handle &operator=(const handle &) = delete;
  ~handle() { Free(owned_); }

  // For the C API; it stays owned.
  T *get() const noexcept { return owned_; }
  // For the C API; it is the caller's from now on.
  T *detach() noexcept { return std::exchange(owned_, nullptr); }
  explicit operator bool() const noexcept { return owned_ != nullptr; }

 private:
  T *owned_ = nullptr;
};

// A call of the library. Callbacks find the innermost one of their thread, to leave their exceptions.
class call {
 public:
  call() noexcept : outer_(innermost()) { innermost() = this; }
  ~call()
  {
    innermost() = outer_;
    ptzcal_error_free(error_);
  }
  call(const call &) = delete;
  call &operator=(const call &) = delete;

  static call *&innermost() noexcept
  {
    static thread_local call *current = nullptr;
    return current;
  }

  // For the last argument of a function.
  ptzcal_error **error() noexcept
  {
    ptzcal_error_free(std::exchange(error_, nullptr));
    return &error_;
  }

  // Has `name` `each` numbers for each of `rows`?
  bool rows(const char *name, std::size_t size, std::size_t rows, std::size_t each)
  {
    return has(name, size, size % each == 0 && size / each == rows, each, rows, "");
  }
  // The same of an array that may be left out.
  bool rows_or_none(const char *name, std::size_t size, std::size_t rows, std::size_t each)
  {
    return size == 0 || this->rows(name, size, rows, each);
  }
  bool at_least(const char *name, std::size_t size, std::size_t least)
  {
    return has(name, size, size >= least, 1, least, "at least ");
  }

  // The outcome of a call whose arguments were refused above.
  template <class T>
  outcome<T> refuse()
  {
    return fail<T>(ptzcal::error(status::invalid_argument, refusal_));
  }

  outcome<void> finish(std::int32_t status)
  {
    rethrow();
    if (status != PTZCAL_STATUS_OK) return fail<void>(failure(status));
    return outcome<void>();
  }
  template <class T>
  outcome<T> finish(std::int32_t status, T &&value)
  {
    rethrow();
    if (status != PTZCAL_STATUS_OK) return fail<T>(failure(status));
    return std::move(value);
  }

#ifdef PTZCAL_NO_EXCEPTIONS
  bool has_exception() const noexcept { return false; }
#else
  bool has_exception() const noexcept { return kept_ != nullptr; }
  // The first one counts.
  void keep(std::exception_ptr thrown) noexcept
  {
    if (!kept_) kept_ = std::move(thrown);
  }
#endif

 private:
  bool has(const char *name, std::size_t size, bool holds, std::size_t each, std::size_t rows, const char *how)
  {
    if (holds) return true;
    refusal_ = std::string(name) + " has " + std::to_string(size) + " numbers, not " + how +
               std::to_string(each) + " for each of " + std::to_string(rows);
    return false;
  }
  ptzcal::error failure(std::int32_t status) const
  {
    if (!error_) return ptzcal::error(ptzcal::status(status), ptzcal_status_name(status));
    return ptzcal::error(ptzcal::status(ptzcal_error_status(error_)), ptzcal_error_message(error_),
                         ptzcal_error_hint(error_), ptzcal_error_index(error_));
  }
  template <class T>
  static outcome<T> fail(ptzcal::error error)
  {
#ifdef PTZCAL_NO_EXCEPTIONS
    return result<T>(std::move(error));
#else
    throw error;
#endif
  }
  void rethrow()
  {
#ifndef PTZCAL_NO_EXCEPTIONS
    if (kept_) std::rethrow_exception(std::exchange(kept_, nullptr));
#endif
  }

  call *outer_;
  ptzcal_error *error_ = nullptr;
  std::string refusal_;
#ifndef PTZCAL_NO_EXCEPTIONS
  std::exception_ptr kept_;
#endif
};

// Output of unknown size: `copy(capacity)` with a guess, and again with what it needs.
template <class F>
std::int32_t fill(std::size_t guess, const std::size_t &needed, F &&copy)
{
  const std::int32_t status = copy(guess);
  return status == PTZCAL_STATUS_BUFFER_TOO_SMALL && needed > guess ? copy(needed) : status;
}

// A handle that needs nothing to be made. Without exceptions an empty one when that fails.
template <class T>
T *make(ptzcal_status (*create)(T **, ptzcal_error **))
{
  call call;
  T *made = nullptr;
  [[maybe_unused]] const auto status = create(&made, call.error());
#ifndef PTZCAL_NO_EXCEPTIONS
  call.finish(status);
#endif
  return made;
}

// The C handle of an input that may be left out.
template <class H>
auto pointer(const optional_ref<H> &input) noexcept -> decltype(input.get()->get())
{
  return input.get() ? input.get()->get() : nullptr;
}

// A C string that was copied out, without its NUL.
inline std::string text(std::string copied)
{
  while (!copied.empty() && copied.back() == '\0') copied.pop_back();
  return copied;
}

}  // namespace detail
PTZCAL_END

#endif
