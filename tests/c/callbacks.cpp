// From C++17 on a callback that may throw is not accepted where the library calls it: an exception
// that left it would end the program. This is how a host carries one past the library.
#include "check.h"
#include <exception>
#include <stdexcept>
#include <string>
#include <type_traits>

extern "C" {
typedef int32_t (*throwing_progress)(void *, const ptzcal_progress *);
typedef void (*throwing_log)(void *, int32_t, const char *);
}
static_assert(!std::is_convertible<throwing_progress, ptzcal_progress_fn>::value, "a progress callback must be noexcept");
static_assert(!std::is_convertible<throwing_log, ptzcal_log_fn>::value, "a log callback must be noexcept");
static_assert(noexcept(ptzcal_error_free(nullptr)), "functions of the library do not throw");

static std::exception_ptr kept;

extern "C" int32_t careful(void *, const ptzcal_progress *progress) noexcept
{
  try {
    if (progress->done > 3) throw std::runtime_error("the host's own trouble");
    return 0;
  } catch (...) {
    kept = std::current_exception();
    return 1;
  }
}

int main()
{
  ptzcal_progress_fn callback = careful;
  ptzcal_progress progress = {};
  progress.struct_size = sizeof progress;
  CHECK(callback(nullptr, &progress) == 0 && !kept);
  progress.done = 4;
  CHECK(callback(nullptr, &progress) != 0);
  try {
    std::rethrow_exception(kept);
  } catch (const std::runtime_error &e) {
    CHECK(std::string(e.what()) == "the host's own trouble");
  }
  return 0;
}
