/* Assertions for the programs of tests/c: each ends with 0 when all of them held. */
#ifndef CHECK_H
#define CHECK_H

#include <ptzcal.h>
#include <stdio.h>
#include <stdlib.h>

#define CHECK(condition)                                                   \
  do {                                                                     \
    if (!(condition)) {                                                    \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);      \
      exit(1);                                                             \
    }                                                                      \
  } while (0)

#define CHECK_STATUS(wanted, call) check_status(__FILE__, __LINE__, #call, wanted, call)
#define CHECK_OK(call) CHECK_STATUS(PTZCAL_STATUS_OK, call)

/* `|a - b| <= tolerance`; false for NaN. */
#define CHECK_NEAR(a, b, tolerance) check_near(__FILE__, __LINE__, #a, a, b, tolerance)

static inline void check_status(const char *file, int line, const char *call, ptzcal_status wanted, ptzcal_status got)
{
  if (got != wanted) {
    fprintf(stderr, "%s:%d: %s is %s, not %s\n", file, line, call, ptzcal_status_name(got), ptzcal_status_name(wanted));
    exit(1);
  }
}

static inline void check_near(const char *file, int line, const char *what, double a, double b, double tolerance)
{
  if (!(a - b <= tolerance && b - a <= tolerance)) {
    fprintf(stderr, "%s:%d: %s is %.12g, not %.12g +- %g\n", file, line, what, a, b, tolerance);
    exit(1);
  }
}

/* Fills memory with a pattern, and tells whether it is still there: outputs of a failed call. */
static inline void taint(void *memory, size_t size)
{
  unsigned char *bytes = (unsigned char *)memory;
  size_t i;
  for (i = 0; i < size; i++) bytes[i] = 0xA5;
}

static inline int is_tainted(const void *memory, size_t size)
{
  const unsigned char *bytes = (const unsigned char *)memory;
  size_t i;
  for (i = 0; i < size; i++)
    if (bytes[i] != 0xA5) return 0;
  return 1;
}

#endif
