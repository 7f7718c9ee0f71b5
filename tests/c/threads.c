/* Handles and threads: readers share, a writer is alone, cancelling works from outside. */
#include "fixtures.h"
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <string.h>
#include <time.h>

#define MANY 20000

static ptzcal_cancel *token;
static ptzcal_correspondences *set;
static ptzcal_calibration_options *options;

static void pause_ms(long ms)
{
  struct timespec t;
  t.tv_sec = 0;
  t.tv_nsec = ms * 1000000L;
  nanosleep(&t, NULL);
}

static void *calibrate_until_cancelled(void *status)
{
  ptzcal_calibration *result;
  do {
    *(ptzcal_status *)status = ptzcal_calibrate_camera(set, options, &result, NULL);
    ptzcal_calibration_free(result);
  } while (*(ptzcal_status *)status != PTZCAL_STATUS_CANCELLED);
  return NULL;
}

static void on_signal(int number)
{
  (void)number;
  (void)ptzcal_cancel_request(token);
}

static void make_set(size_t n)
{
  double *xyz = (double *)malloc(3 * n * sizeof *xyz), *uv = (double *)malloc(2 * n * sizeof *uv);
  CHECK(xyz && uv);
  make_camera(fixture_camera);
  make_points(fixture_camera, xyz, uv, n, 0.5);
  CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
  CHECK_OK(ptzcal_correspondences_add_points(set, xyz, uv, n, NULL));
  free(xyz);
  free(uv);
}

/* Two threads calibrate from one set at the same time; a third cannot add to it meanwhile. */
static void sharing_and_cancelling(void)
{
  pthread_t workers[2];
  ptzcal_status ends[2];
  ptzcal_error *error = NULL;
  const double xyz[3] = {0, 0, 1}, uv[2] = {1, 2};
  size_t count;
  int i, busy = 0;
  for (i = 0; i < 2; i++) CHECK(pthread_create(&workers[i], NULL, calibrate_until_cancelled, &ends[i]) == 0);
  for (i = 0; i < 2000 && !busy; i++) {
    ptzcal_status status = ptzcal_correspondences_add_points(set, xyz, uv, 1, &error);
    CHECK(status == PTZCAL_STATUS_OK || status == PTZCAL_STATUS_BUSY);
    busy = status == PTZCAL_STATUS_BUSY;
    ptzcal_error_free(error);
    pause_ms(1);
  }
  CHECK(busy);
  CHECK_OK(ptzcal_correspondences_count(set, &count, NULL));
  CHECK(count >= MANY);
  CHECK_OK(ptzcal_cancel_request(token));
  for (i = 0; i < 2; i++) CHECK(pthread_join(workers[i], NULL) == 0 && ends[i] == PTZCAL_STATUS_CANCELLED);
}

static void cancelled_by_a_signal(void)
{
  pthread_t worker;
  ptzcal_status end;
  struct sigaction action;
  CHECK_OK(ptzcal_cancel_reset(token));
  CHECK(!ptzcal_cancel_is_requested(token));
  memset(&action, 0, sizeof action);
  action.sa_handler = on_signal;
  CHECK(sigaction(SIGUSR1, &action, NULL) == 0);
  CHECK(pthread_create(&worker, NULL, calibrate_until_cancelled, &end) == 0);
  pause_ms(20);
  CHECK(raise(SIGUSR1) == 0);
  CHECK(ptzcal_cancel_is_requested(token));
  CHECK(pthread_join(worker, NULL) == 0 && end == PTZCAL_STATUS_CANCELLED);
}

/* The options keep what they need of the token. */
static void a_freed_token(void)
{
  ptzcal_calibration *result;
  ptzcal_cancel_free(token);
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_calibrate_camera(set, options, &result, NULL));
  CHECK(result == NULL);
  CHECK_OK(ptzcal_calibration_options_set_cancel(options, NULL, NULL));
  CHECK_OK(ptzcal_calibrate_camera(set, options, &result, NULL));
  ptzcal_calibration_free(result);
}

static void *free_elsewhere(void *calibration)
{
  ptzcal_camera camera;
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  CHECK_OK(ptzcal_calibration_get_camera((ptzcal_calibration *)calibration, &camera, NULL));
  ptzcal_calibration_free((ptzcal_calibration *)calibration);
  return NULL;
}

/* A handle may end on another thread than it began on. */
static void moving(void)
{
  pthread_t other;
  ptzcal_calibration *result;
  CHECK_OK(ptzcal_calibrate_camera(set, NULL, &result, NULL));
  CHECK(pthread_create(&other, NULL, free_elsewhere, result) == 0 && pthread_join(other, NULL) == 0);
}

int main(void)
{
  make_set(MANY);
  CHECK_OK(ptzcal_cancel_new(&token, NULL));
  CHECK_OK(ptzcal_calibration_options_new(&options, NULL));
  CHECK_OK(ptzcal_calibration_options_set_cancel(options, token, NULL));
  sharing_and_cancelling();
  cancelled_by_a_signal();
  ptzcal_correspondences_free(set);
  make_set(200);
  CHECK_OK(ptzcal_cancel_request(token));
  a_freed_token();
  moving();
  ptzcal_correspondences_free(set);
  ptzcal_calibration_options_free(options);
  return 0;
}
