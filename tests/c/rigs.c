/* Rigs: opened on an address and on callbacks, moved, lit, stopped, closed; the laser is off on every
   way out. */
#include "fixtures.h"
#include <math.h>
#include <pthread.h>
#include <string.h>

/* A host's rig that remembers what was asked of it. */
typedef struct host {
  double pan, tilt, time;
  int laser, moves, stops, moved_with_laser_on, fail, disturb;
  ptzcal_rig *rig;
  ptzcal_cancel *token;
} host;

static void *meanwhile(void *user);

static int32_t host_move(void *user, double pan, double tilt)
{
  host *h = (host *)user;
  h->moves++;
  h->moved_with_laser_on |= h->laser;
  if (h->disturb) {
    pthread_t other;
    CHECK(pthread_create(&other, NULL, meanwhile, h) == 0 && pthread_join(other, NULL) == 0);
  }
  if (h->fail) return h->fail;
  h->pan = pan;
  h->tilt = tilt;
  return PTZCAL_STATUS_OK;
}

static int32_t host_position(void *user, double *pan, double *tilt, double *zoom)
{
  host *h = (host *)user;
  *pan = h->pan;
  *tilt = h->tilt;
  *zoom = 0.0;
  return PTZCAL_STATUS_OK;
}

static int32_t host_stop(void *user)
{
  ((host *)user)->stops++;
  return PTZCAL_STATUS_OK;
}

static int32_t host_laser(void *user, int32_t on)
{
  ((host *)user)->laser = on;
  return PTZCAL_STATUS_OK;
}

static uint8_t pixels[16 * 12];

static int32_t host_frame(void *user, double not_before, double timeout, ptzcal_image *image, double *timestamp)
{
  host *h = (host *)user;
  (void)timeout;
  if (not_before > h->time) h->time = not_before;
  make_image(image, pixels, 16, 12);
  *timestamp = h->time;
  return PTZCAL_STATUS_OK;
}

static double host_now(void *user)
{
  return ((host *)user)->time;
}

static void host_sleep(void *user, double seconds)
{
  ((host *)user)->time += seconds;
}

static ptzcal_rig_options *options_of(host *h)
{
  ptzcal_rig_options *options;
  ptzcal_rig_model model;
  ptzcal_ptz ptz;
  make_ptz(&ptz);
  ptz.user = h;
  ptz.move_absolute = host_move;
  ptz.position = host_position;
  ptz.stop = host_stop;
  make_rig_model(&model);
  model.width = 16;
  model.height = 12;
  model.fx = model.fy = 20.0;
  model.cx = 7.5;
  model.cy = 5.5;
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_OK(ptzcal_rig_options_set_model(options, &model, NULL));
  CHECK_OK(ptzcal_rig_options_set_ptz(options, &ptz, NULL));
  CHECK_OK(ptzcal_rig_options_set_laser(options, host_laser, h, NULL));
  CHECK_OK(ptzcal_rig_options_set_frames(options, host_frame, h, NULL));
  CHECK_OK(ptzcal_rig_options_set_clock(options, host_now, host_sleep, h, NULL));
  return options;
}

static void on_callbacks(void)
{
  host h;
  ptzcal_rig *rig;
  ptzcal_rig_options *options;
  ptzcal_simulator *simulator;
  const double target[3] = {0.5, -0.2, 3.0};
  double pan, tilt, wanted_pan, wanted_tilt;
  memset(&h, 0, sizeof h);
  h.laser = 1; /* left on by somebody */
  options = options_of(&h);
  CHECK_OK(ptzcal_rig_open(options, &rig, NULL));
  ptzcal_rig_options_free(options); /* the rig does not need them any more */
  CHECK(h.laser == 0 && h.moves == 0);
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_rig_simulator(rig, &simulator, NULL));
  CHECK(simulator == NULL);

  CHECK_OK(ptzcal_rig_move(rig, 0.3, -0.1, NULL, NULL));
  CHECK_OK(ptzcal_rig_position(rig, &pan, &tilt, NULL));
  CHECK_NEAR(pan, 0.3, 1e-12);
  CHECK_NEAR(tilt, -0.1, 1e-12);

  CHECK_OK(ptzcal_rig_set_laser(rig, 1, NULL));
  CHECK(h.laser == 1);
  CHECK_OK(ptzcal_rig_aim_at_point(rig, target, NULL, &wanted_pan, &wanted_tilt, NULL));
  CHECK(h.laser == 0 && !h.moved_with_laser_on);
  CHECK_NEAR(h.pan, wanted_pan, 1e-12);
  CHECK_NEAR(h.tilt, wanted_tilt, 1e-12);

  CHECK_STATUS(PTZCAL_STATUS_UNREACHABLE, ptzcal_rig_move(rig, 1.5, 0.0, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_set_laser(rig, 7, NULL));

  /* An emergency holds until it is released. */
  CHECK_OK(ptzcal_rig_set_laser(rig, 1, NULL));
  CHECK_OK(ptzcal_rig_emergency_off(rig, NULL));
  CHECK(h.laser == 0);
  CHECK_STATUS(PTZCAL_STATUS_LASER_REFUSED, ptzcal_rig_set_laser(rig, 1, NULL));
  CHECK_OK(ptzcal_rig_release(rig, NULL));
  CHECK_OK(ptzcal_rig_set_laser(rig, 1, NULL));
  CHECK(h.laser == 1);

  /* A device that fails. */
  h.fail = PTZCAL_STATUS_DEVICE_LOST;
  CHECK_STATUS(PTZCAL_STATUS_DEVICE_LOST, ptzcal_rig_move(rig, 0.0, 0.0, NULL, NULL));
  CHECK(h.laser == 0);
  h.fail = 12345; /* no status at all */
  CHECK_STATUS(PTZCAL_STATUS_DEVICE, ptzcal_rig_move(rig, 0.0, 0.0, NULL, NULL));
  h.fail = 0;
  CHECK_OK(ptzcal_rig_set_laser(rig, 1, NULL));
  CHECK_OK(ptzcal_rig_close(rig, NULL));
  CHECK(h.laser == 0);
  CHECK_OK(ptzcal_rig_close(NULL, NULL));
}

static void what_does_not_open(void)
{
  host h;
  ptzcal_rig *rig;
  ptzcal_rig_options *options;
  ptzcal_ptz ptz;
  memset(&h, 0, sizeof h);
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_open(options, &rig, NULL)); /* nothing set */
  CHECK(rig == NULL);
  make_ptz(&ptz);
  ptz.stop = NULL;
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_rig_options_set_ptz(options, &ptz, NULL));
  make_ptz(&ptz);
  CHECK_OK(ptzcal_rig_options_set_ptz(options, &ptz, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_open(options, &rig, NULL)); /* no laser */
  CHECK_OK(ptzcal_rig_options_set_address(options, "gopher://rig", NULL));
  CHECK(ptzcal_rig_open(options, &rig, NULL) != PTZCAL_STATUS_OK && rig == NULL);
  ptzcal_rig_options_free(options);

  options = options_of(&h);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_options_set_laser_max_on(options, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_options_set_settle(options, 3, -1.0, 0.01, 30.0, 5.0, NULL));
  CHECK_OK(ptzcal_rig_options_set_settle(options, 0, 0.1, 0.01, 30.0, 5.0, NULL)); /* no reading at all */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_open(options, &rig, NULL));
  ptzcal_rig_options_free(options);
}

/* A call is at work: another thread is told so, and stops it. */
static void *meanwhile(void *user)
{
  host *h = (host *)user;
  double pan, tilt;
  ptzcal_error *error = NULL;
  CHECK_STATUS(PTZCAL_STATUS_BUSY, ptzcal_rig_position(h->rig, &pan, &tilt, &error));
  CHECK(*ptzcal_error_hint(error));
  ptzcal_error_free(error);
  CHECK_STATUS(PTZCAL_STATUS_BUSY, ptzcal_rig_set_laser(h->rig, 1, NULL));
  if (h->token)
    CHECK_OK(ptzcal_cancel_request(h->token));
  else
    CHECK_OK(ptzcal_rig_stop(h->rig, NULL));
  return NULL;
}

static void with_threads(void)
{
  host h;
  ptzcal_rig_options *options;
  double pan, tilt;
  memset(&h, 0, sizeof h);
  options = options_of(&h);
  CHECK_OK(ptzcal_rig_open(options, &h.rig, NULL));
  ptzcal_rig_options_free(options);
  CHECK_OK(ptzcal_cancel_new(&h.token, NULL));
  h.disturb = 1;
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_rig_move(h.rig, 0.2, 0.0, h.token, NULL));
  CHECK(h.stops > 0 && !h.laser);
  ptzcal_cancel_free(h.token);
  h.token = NULL;
  h.stops = 0;
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_rig_move(h.rig, -0.2, 0.0, NULL, NULL));
  CHECK(h.stops > 0);
  h.disturb = 0;
  CHECK_OK(ptzcal_rig_move(h.rig, 0.1, 0.0, NULL, NULL));
  CHECK_OK(ptzcal_rig_position(h.rig, &pan, &tilt, NULL));
  CHECK_NEAR(pan, 0.1, 1e-12);
  CHECK_OK(ptzcal_rig_close(h.rig, NULL));
}

static void on_an_address(void)
{
  ptzcal_rig *rig;
  ptzcal_rig_options *options;
  ptzcal_simulator *simulator;
  ptzcal_rig_model model, truth;
  double pan, tilt;
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_OK(ptzcal_rig_options_set_address(options, "sim:room?seed=5", NULL));
  CHECK_OK(ptzcal_rig_options_set_settle(options, 2, 0.1, 0.0, 30.0, 0.0, NULL));
  CHECK_OK(ptzcal_rig_open(options, &rig, NULL));
  ptzcal_rig_options_free(options);
  CHECK_OK(ptzcal_rig_model_init(&model, sizeof model));
  CHECK_OK(ptzcal_rig_model_init(&truth, sizeof truth));
  CHECK_OK(ptzcal_rig_get_model(rig, &model, NULL));
  CHECK_OK(ptzcal_rig_simulator(rig, &simulator, NULL));
  CHECK_OK(ptzcal_simulator_true_rig(simulator, &truth, NULL));
  CHECK_NEAR(model.fx, truth.fx, 0.05 * truth.fx);
  CHECK_OK(ptzcal_rig_move(rig, 0.2, -0.1, NULL, NULL));
  CHECK_OK(ptzcal_rig_position(rig, &pan, &tilt, NULL));
  CHECK_NEAR(pan, 0.2, 0.01);
  CHECK_OK(ptzcal_rig_close(rig, NULL));
  CHECK_OK(ptzcal_simulator_stop(simulator, NULL)); /* the simulator outlives the rig */
  ptzcal_simulator_free(simulator);
}

static void aiming(void)
{
  ptzcal_rig_model model;
  const double ahead[3] = {0.1, 0.005, 4.0}, near[3] = {0.0, 0.0, 0.0};
  double pan, tilt;
  make_rig_model(&model);
  CHECK_OK(ptzcal_rig_model_aim(&model, ahead, &pan, &tilt, NULL));
  CHECK_NEAR(pan, 0.0, 1e-9);
  CHECK_NEAR(tilt, 0.0, 1e-9);
  CHECK_STATUS(PTZCAL_STATUS_UNREACHABLE, ptzcal_rig_model_aim(&model, near, &pan, &tilt, NULL));
}

int main(void)
{
  on_callbacks();
  what_does_not_open();
  with_threads();
  on_an_address();
  aiming();
  return 0;
}
