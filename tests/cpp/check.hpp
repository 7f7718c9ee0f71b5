// Assertions for the programs of tests/cpp, besides those of tests/c/check.h.
#ifndef CHECK_HPP
#define CHECK_HPP

#include <check.h>
#include <ptzcal.hpp>

// The call fails with the status; gives its error.
template <class F>
ptzcal::error failure(const char *file, int line, ptzcal::status wanted, F &&call)
{
  const auto answer = ptzcal::attempt(call);
  check_status(file, line, "the call", wanted, answer.status());
  return answer.error();
}
#define CHECK_FAILS(wanted, ...) failure(__FILE__, __LINE__, ptzcal::status::wanted, [&] { return __VA_ARGS__; })

inline ptzcal::region small_region()
{
  ptzcal::region region;
  region.pan_min = -0.45, region.pan_max = 0.25, region.pan_steps = 12;
  region.tilt_min = -0.33, region.tilt_max = 0.28, region.tilt_steps = 8;
  return region;
}

#endif
