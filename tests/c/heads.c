/* Heads: moves that end, events, a stop from another thread, the dead man, addresses that are wrong. */
#include "fixtures.h"
#include <math.h>
#include <pthread.h>
#include <string.h>
#include <time.h>

/* A host's head that moves at 1 rad/s of real time. */
typedef struct host {
  pthread_mutex_t lock;
  double from, to, since;
  int stops, fail;
} host;

static double seconds(void)
{
  struct timespec t;
  CHECK(clock_gettime(CLOCK_MONOTONIC, &t) == 0);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double at(const host *h)
{
  double gone = seconds() - h->since, way = h->to - h->from;
  return fabs(way) <= gone ? h->to : h->from + (way > 0 ? gone : -gone);
}

static int32_t host_move(void *user, double pan, double tilt)
{
  host *h = (host *)user;
  (void)tilt;
  pthread_mutex_lock(&h->lock);
  h->from = at(h);
  h->since = seconds();
  h->to = pan;
  pthread_mutex_unlock(&h->lock);
  return h->fail;
}

static int32_t host_position(void *user, double *pan, double *tilt, double *zoom)
{
  host *h = (host *)user;
  pthread_mutex_lock(&h->lock);
  *pan = at(h);
  pthread_mutex_unlock(&h->lock);
  *tilt = *zoom = 0.0;
  return h->fail;
}

static int32_t host_motion(void *user, int32_t *motion)
{
  host *h = (host *)user;
  pthread_mutex_lock(&h->lock);
  *motion = at(h) == h->to ? PTZCAL_MOTION_IDLE : PTZCAL_MOTION_MOVING;
  pthread_mutex_unlock(&h->lock);
  return h->fail;
}

static int32_t host_stop(void *user)
{
  host *h = (host *)user;
  pthread_mutex_lock(&h->lock);
  h->from = h->to = at(h);
  h->stops++;
  pthread_mutex_unlock(&h->lock);
  return h->fail;
}

/* The ends that were heard, by the move's number. */
typedef struct ends {
  pthread_mutex_t lock;
  int32_t end[16], status[16];
  double pan[16];
  int count;
} ends;

static void on_end(void *user, uint64_t number, int32_t end, int32_t status, double pan, double tilt)
{
  ends *e = (ends *)user;
  (void)tilt;
  pthread_mutex_lock(&e->lock);
  CHECK(number < 16);
  e->end[number] = end;
  e->status[number] = status;
  e->pan[number] = pan;
  e->count++;
  pthread_mutex_unlock(&e->lock);
}

static ptzcal_head *open_host(host *h, ends *e)
{
  ptzcal_head_options *options;
  ptzcal_head *head;
  ptzcal_ptz ptz;
  memset(h, 0, sizeof *h);
  memset(e, 0, sizeof *e);
  pthread_mutex_init(&h->lock, NULL);
  pthread_mutex_init(&e->lock, NULL);
  make_ptz(&ptz);
  ptz.user = h;
  ptz.move_absolute = host_move;
  ptz.position = host_position;
  ptz.motion = host_motion;
  ptz.stop = host_stop;
  CHECK_OK(ptzcal_head_options_new(&options, NULL));
  CHECK_OK(ptzcal_head_options_set_ptz(options, &ptz, NULL));
  CHECK_OK(ptzcal_head_options_set_on_move_end(options, on_end, e, NULL));
  CHECK_OK(ptzcal_head_open(options, &head, NULL));
  ptzcal_head_options_free(options);
  return head;
}

static int32_t ended(ptzcal_head *head, uint64_t number, int32_t *status)
{
  int32_t end = -1;
  CHECK_OK(ptzcal_head_wait(head, number, 20.0, NULL, &end, status, NULL));
  return end;
}

static void *stop(void *head)
{
  CHECK_OK(ptzcal_head_stop((ptzcal_head *)head, NULL));
  return NULL;
}

static void moves(void)
{
  host h;
  ends e;
  ptzcal_head *head = open_host(&h, &e);
  ptzcal_head_capabilities capabilities;
  pthread_t other;
  uint64_t first = 0, second = 0;
  double pan, tilt, zoom;
  int32_t end = -1, status = -1, motion = -1;

  CHECK_OK(ptzcal_head_capabilities_init(&capabilities, sizeof capabilities));
  CHECK_OK(ptzcal_head_get_capabilities(head, &capabilities, NULL));
  CHECK(capabilities.pan_max == 1.0 && capabilities.reports_motion == 1 && capabilities.has_drive == 0);

  CHECK_OK(ptzcal_head_move(head, 0.2, 0.0, &first, NULL));
  CHECK(ended(head, first, &status) == PTZCAL_MOVE_END_ARRIVED && status == PTZCAL_STATUS_OK);
  CHECK_OK(ptzcal_head_position(head, &pan, &tilt, &zoom, NULL));
  CHECK_NEAR(pan, 0.2, 1e-9);
  CHECK_OK(ptzcal_head_move_by(head, -0.1, 0.0, &second, NULL));
  CHECK(second == first + 1 && ended(head, second, NULL) == PTZCAL_MOVE_END_ARRIVED);
  CHECK_OK(ptzcal_head_position(head, &pan, &tilt, NULL, NULL));
  CHECK_NEAR(pan, 0.1, 1e-9);

  /* The host's own head cannot move within its picture; what is beyond the picture is refused first. */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_head_move_in_view(head, 1.01, 0.0, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_head_move_in_view(head, 0.0, NAN, NULL, NULL));

  /* A move that another replaces, and one that is stopped from another thread. */
  CHECK_OK(ptzcal_head_move(head, -1.0, 0.0, &first, NULL));
  CHECK_OK(ptzcal_head_move(head, 1.0, 0.0, &second, NULL));
  CHECK(ended(head, first, NULL) == PTZCAL_MOVE_END_REPLACED);
  CHECK_STATUS(PTZCAL_STATUS_DEVICE_TIMEOUT, ptzcal_head_wait(head, second, 0.0, NULL, &end, NULL, NULL));
  CHECK(end == -1);
  CHECK(pthread_create(&other, NULL, stop, head) == 0 && pthread_join(other, NULL) == 0);
  CHECK(ended(head, second, NULL) == PTZCAL_MOVE_END_STOPPED && h.stops >= 1);
  CHECK_OK(ptzcal_head_motion(head, &motion, NULL));
  CHECK(motion == PTZCAL_MOTION_IDLE);

  /* The device fails during a move. */
  CHECK_OK(ptzcal_head_move(head, 0.9, 0.0, &first, NULL));
  h.fail = PTZCAL_STATUS_DEVICE_LOST;
  CHECK(ended(head, first, &status) == PTZCAL_MOVE_END_FAILED && status == PTZCAL_STATUS_DEVICE_LOST);
  CHECK_STATUS(PTZCAL_STATUS_DEVICE_LOST, ptzcal_head_move(head, 0.0, 0.0, NULL, NULL));
  h.fail = 0;

  CHECK_STATUS(PTZCAL_STATUS_UNREACHABLE, ptzcal_head_move(head, 1.5, 0.0, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_head_wait(head, 999, 0.0, NULL, &end, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_head_wait(head, 0, 0.0, NULL, &end, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_head_drive(head, 0.1, 0.0, 0.0, 1.0, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_head_drive(head, 0.1, 0.0, 0.0, 1e9, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_head_home(head, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_head_move_in_view(head, 0.1, 0.1, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_head_recall_preset(head, 0, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_head_set_focus(head, PTZCAL_FOCUS_AUTO, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_head_set_focus(head, 77, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_head_lock_exposure(head, 2, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_head_set_zoom(head, 1.5, NULL, NULL));

  end = h.stops;
  CHECK_OK(ptzcal_head_close(head, NULL));
  CHECK(h.stops > end);
  /* Every move's end was heard. */
  CHECK(e.end[1] == PTZCAL_MOVE_END_ARRIVED && e.end[2] == PTZCAL_MOVE_END_ARRIVED && e.end[3] == PTZCAL_MOVE_END_REPLACED);
  CHECK(e.end[4] == PTZCAL_MOVE_END_STOPPED && e.end[5] == PTZCAL_MOVE_END_FAILED && e.status[5] == PTZCAL_STATUS_DEVICE_LOST);
  CHECK_NEAR(e.pan[1], 0.2, 1e-9);
  CHECK(isnan(e.pan[3]) && e.count == 5);
}

/* The simulated head, by itself and as a VISCA camera behind its bytes; its time is the system's. */
static void simulated(const char *address, const char *protocol)
{
  ptzcal_head_options *options;
  ptzcal_head *head;
  ptzcal_head_capabilities capabilities;
  uint64_t number, again;
  double pan, later, tilt, began;
  char text[64];
  size_t needed = 99;
  CHECK_OK(ptzcal_head_options_new(&options, NULL));
  CHECK_OK(ptzcal_head_options_set_address(options, address, NULL));
  CHECK_OK(ptzcal_head_open(options, &head, NULL));
  CHECK_OK(ptzcal_head_copy_identity(head, PTZCAL_IDENTITY_PROTOCOL, text, sizeof text, &needed, NULL));
  CHECK(needed == strlen(protocol) && memcmp(text, protocol, needed) == 0);
  if (needed) CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_head_copy_identity(head, PTZCAL_IDENTITY_PROTOCOL, text, 1, &needed, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_head_copy_identity(head, 9, text, sizeof text, &needed, NULL));
  CHECK_OK(ptzcal_head_capabilities_init(&capabilities, sizeof capabilities));
  CHECK_OK(ptzcal_head_get_capabilities(head, &capabilities, NULL));
  CHECK(capabilities.has_drive == 1 && capabilities.pan_speed > 0.0);

  /* What is half way to the right edge comes to the centre. */
  if (capabilities.has_view_moves) {
    CHECK_OK(ptzcal_head_move_in_view(head, 0.5, 0.0, &number, NULL));
    CHECK(ended(head, number, NULL) == PTZCAL_MOVE_END_ARRIVED);
    CHECK_OK(ptzcal_head_position(head, &pan, &tilt, NULL, NULL));
    CHECK(pan > 0.2 && pan < 0.3 && fabs(tilt) < 1e-9);
    CHECK_OK(ptzcal_head_move(head, 0.0, 0.0, &number, NULL));
    CHECK(ended(head, number, NULL) == PTZCAL_MOVE_END_ARRIVED);
  } else {
    CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_head_move_in_view(head, 0.5, 0.0, NULL, NULL));
  }

  /* A drive that is renewed goes on, and stops by itself when it is not. */
  began = seconds();
  CHECK_OK(ptzcal_head_drive(head, 0.2, 0.0, 0.0, 0.5, &number, NULL));
  while (seconds() - began < 0.8) {
    struct timespec pause = {0, 100000000};
    nanosleep(&pause, NULL);
    CHECK_OK(ptzcal_head_drive(head, 0.2, 0.0, 0.0, 0.5, &again, NULL));
    CHECK(again == number);
  }
  CHECK(ended(head, number, NULL) == PTZCAL_MOVE_END_DEAD_MAN);
  CHECK(seconds() - began >= 1.2);
  CHECK_OK(ptzcal_head_position(head, &pan, &tilt, NULL, NULL));
  CHECK(pan > 0.1);
  CHECK_OK(ptzcal_head_position(head, &later, &tilt, NULL, NULL));
  CHECK(pan == later);
  CHECK_OK(ptzcal_head_drive(head, -0.1, 0.1, 0.0, 10.0, &number, NULL));
  CHECK_OK(ptzcal_head_stop(head, NULL));
  CHECK(ended(head, number, NULL) == PTZCAL_MOVE_END_STOPPED);
  CHECK_OK(ptzcal_head_drive(head, 0.1, 0.0, 0.0, 10.0, &number, NULL));
  CHECK_OK(ptzcal_head_drive(head, 0.0, 0.0, 0.0, 10.0, NULL, NULL));
  CHECK(ended(head, number, NULL) == PTZCAL_MOVE_END_STOPPED);
  CHECK_OK(ptzcal_head_move(head, 0.1, 0.05, &number, NULL));
  CHECK(ended(head, number, NULL) == PTZCAL_MOVE_END_ARRIVED);
  CHECK_OK(ptzcal_head_close(head, NULL));
  ptzcal_head_options_free(options);
  CHECK_OK(ptzcal_head_close(NULL, NULL));
}

/* Each wrong address has its own status, and a hint. */
static void addresses(void)
{
  static const struct {
    const char *address;
    ptzcal_status status;
  } wrong[] = {
    {"room", PTZCAL_STATUS_INVALID_ADDRESS},
    {"visca:/dev/ttyUSB0", PTZCAL_STATUS_INVALID_ADDRESS},
    {"onvif://admin:secret@camera.lan/", PTZCAL_STATUS_INVALID_ADDRESS},
    {"onvif://[::1/", PTZCAL_STATUS_INVALID_ADDRESS},
    {"onvif://camera.lan:99999/", PTZCAL_STATUS_INVALID_ADDRESS},
    {"nonsense:///dev/null", PTZCAL_STATUS_UNSUPPORTED},
    {"v4l2:///dev/video0", PTZCAL_STATUS_UNSUPPORTED},
    {"sim:room?speed=fast", PTZCAL_STATUS_INVALID_ARGUMENT},
    {"folder:///no/such/folder", PTZCAL_STATUS_FILE_IO},
  };
  size_t i;
  for (i = 0; i < sizeof wrong / sizeof *wrong; i++) {
    ptzcal_head_options *options;
    ptzcal_head *head;
    ptzcal_error *error = NULL;
    CHECK_OK(ptzcal_head_options_new(&options, NULL));
    CHECK_OK(ptzcal_head_options_set_address(options, wrong[i].address, NULL));
    CHECK_STATUS(wrong[i].status, ptzcal_head_open(options, &head, &error));
    CHECK(head == NULL && error && *ptzcal_error_message(error));
    CHECK(strstr(ptzcal_error_message(error), "secret") == NULL);
    if (wrong[i].status == PTZCAL_STATUS_INVALID_ADDRESS) CHECK(strstr(ptzcal_error_hint(error), "addresses"));
    ptzcal_error_free(error);
    CHECK_OK(ptzcal_head_options_set_address(options, NULL, NULL));
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_head_open(options, &head, NULL));
    ptzcal_head_options_free(options);
  }
}

int main(void)
{
  moves();
  simulated("sim:room", "");
  simulated("sim:room?visca=evi-d100", "VISCA");
  addresses();
  return 0;
}
