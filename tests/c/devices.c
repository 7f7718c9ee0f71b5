/* Devices that are not there, do not answer, talk nonsense, are something else, or go away: each has its
   own status in bounded time, and a laser that was on is off. */
#define _XOPEN_SOURCE 700
#include "fixtures.h"
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <pthread.h>
#include <string.h>
#include <sys/socket.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

static double seconds(void)
{
  struct timespec t;
  CHECK(clock_gettime(CLOCK_MONOTONIC, &t) == 0);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static ptzcal_status open_head(const char *address, ptzcal_head **head)
{
  ptzcal_head_options *options;
  ptzcal_error *error = NULL;
  ptzcal_status status;
  double begin = seconds();
  CHECK_OK(ptzcal_head_options_new(&options, NULL));
  CHECK_OK(ptzcal_head_options_set_address(options, address, NULL));
  status = ptzcal_head_open(options, head, &error);
  ptzcal_head_options_free(options);
  CHECK((status == PTZCAL_STATUS_OK) == (error == NULL));
  if (error) {
    CHECK(*head == NULL && *ptzcal_error_message(error));
    ptzcal_error_free(error);
  }
  CHECK(seconds() - begin < 60.0);
  return status;
}

static void refused(ptzcal_status wanted, const char *address)
{
  ptzcal_head *head;
  ptzcal_status got = open_head(address, &head);
  if (got != wanted) {
    fprintf(stderr, "%s: %s, not %s\n", address, ptzcal_status_name(got), ptzcal_status_name(wanted));
    exit(1);
  }
}

/* The device's side of a serial line. */
typedef struct line {
  int device;
  char address[256];
  enum { SILENT, NOISE, CAMERA } manner;
  volatile int end;
  pthread_t thread;
} line;

/* The version of a Sony EVI-D100, the answers to positions and registers, and acknowledgements. */
static void answer(line *l, const unsigned char *packet, int n)
{
  static const unsigned char version[] = {0x90, 0x50, 0x00, 0x01, 0x04, 0x0D, 0x01, 0x00, 0x02, 0xFF};
  static const unsigned char place[] = {0x90, 0x50, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF};
  static const unsigned char value[] = {0x90, 0x50, 0, 0, 0, 0, 0xFF};
  static const unsigned char mode[] = {0x90, 0x50, 0x08, 0x00, 0xFF};
  static const unsigned char done[] = {0x90, 0x41, 0xFF, 0x90, 0x51, 0xFF};
  static const unsigned char chain[] = {0x88, 0x30, 0x02, 0xFF};
  const unsigned char *reply = done;
  size_t size = sizeof done;
  if (n >= 4 && packet[0] == 0x88 && packet[1] == 0x30) reply = chain, size = sizeof chain;
  else if (packet[0] == 0x88) reply = packet, size = (size_t)n;
  else if (n >= 5 && packet[1] == 0x09 && packet[2] == 0x00) reply = version, size = sizeof version;
  else if (n >= 5 && packet[1] == 0x09 && packet[2] == 0x06 && packet[3] == 0x12) reply = place, size = sizeof place;
  else if (n >= 5 && packet[1] == 0x09 && packet[2] == 0x06) reply = mode, size = sizeof mode;
  else if (packet[1] == 0x09) reply = value, size = sizeof value;
  CHECK(write(l->device, reply, size) == (ssize_t)size);
}

static void *serve(void *user)
{
  line *l = (line *)user;
  unsigned char packet[64], byte;
  int n = 0;
  while (!l->end) {
    struct timespec pause = {0, 1000000};
    ssize_t got = read(l->device, &byte, 1);
    if (got != 1) {
      nanosleep(&pause, NULL);
      continue;
    }
    if (l->manner == NOISE) {
      static const unsigned char noise[] = {0x13, 0xA7, 0x55, 0x00, 0x81, 0x3C, 0xFF, 0xFF, 0x12};
      if (write(l->device, noise, sizeof noise) < 0) break;
    }
    if (l->manner != CAMERA) continue;
    if (n < (int)sizeof packet) packet[n++] = byte;
    if (byte == 0xFF) answer(l, packet, n), n = 0;
  }
  return NULL;
}

static void begin(line *l, int manner)
{
  memset(l, 0, sizeof *l);
  l->manner = manner;
  l->device = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
  CHECK(l->device >= 0 && grantpt(l->device) == 0 && unlockpt(l->device) == 0);
  CHECK(snprintf(l->address, sizeof l->address, "visca://%s", ptsname(l->device)) < (int)sizeof l->address);
  CHECK(pthread_create(&l->thread, NULL, serve, l) == 0);
}

static void unplug(line *l)
{
  l->end = 1;
  CHECK(pthread_join(l->thread, NULL) == 0 && close(l->device) == 0);
}

static int32_t laser = 1;

static int32_t set_laser(void *user, int32_t on)
{
  (void)user;
  laser = on;
  return PTZCAL_STATUS_OK;
}

/* A rig on a line that does not answer: it does not open, and the laser is off. */
static void rig_on(const char *address, ptzcal_status wanted)
{
  ptzcal_rig_options *options;
  ptzcal_rig_model model;
  ptzcal_rig *rig;
  make_rig_model(&model);
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_OK(ptzcal_rig_options_set_model(options, &model, NULL));
  CHECK_OK(ptzcal_rig_options_set_ptz_address(options, address, NULL));
  CHECK_OK(ptzcal_rig_options_set_laser(options, set_laser, NULL, NULL));
  CHECK_OK(ptzcal_rig_options_set_frames(options, fixture_frame_fn, NULL, NULL));
  laser = 1;
  CHECK_STATUS(wanted, ptzcal_rig_open(options, &rig, NULL));
  CHECK(laser == 0);
  ptzcal_rig_options_free(options);
}

/* A port on which nobody listens, and one where somebody says what no camera would. */
static void over_the_network(void)
{
  struct sockaddr_in where;
  socklen_t size = sizeof where;
  char address[128];
  int listener = socket(AF_INET, SOCK_STREAM, 0);
  memset(&where, 0, sizeof where);
  where.sin_family = AF_INET;
  where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  CHECK(listener >= 0 && bind(listener, (struct sockaddr *)&where, sizeof where) == 0);
  CHECK(getsockname(listener, (struct sockaddr *)&where, &size) == 0);
  CHECK(snprintf(address, sizeof address, "visca+tcp://127.0.0.1:%d", ntohs(where.sin_port)) > 0);
  refused(PTZCAL_STATUS_DEVICE_NOT_FOUND, address);
  CHECK(snprintf(address, sizeof address, "onvif://127.0.0.1:%d", ntohs(where.sin_port)) > 0);
  refused(PTZCAL_STATUS_DEVICE_NOT_FOUND, address);
  CHECK(close(listener) == 0);
}

int main(void)
{
  line l;
  ptzcal_head *head;
  double pan, tilt;
  ptzcal_status status;
  int i;

  refused(PTZCAL_STATUS_DEVICE_NOT_FOUND, "visca:///dev/no-such-line");
  refused(PTZCAL_STATUS_DEVICE_MISMATCH, "visca:///dev/null");
  refused(PTZCAL_STATUS_DEVICE_NOT_FOUND, "pelco-d:///dev/no-such-line");
  refused(PTZCAL_STATUS_DEVICE_MISMATCH, "pelco-p:///dev/null");
  refused(PTZCAL_STATUS_INVALID_ADDRESS, "visca:///dev/null?model=vcr");
  refused(PTZCAL_STATUS_INVALID_ADDRESS, "visca:///dev/null?address=9");
  refused(PTZCAL_STATUS_INVALID_ADDRESS, "visca:///dev/null?speed=3");
  refused(PTZCAL_STATUS_INVALID_ADDRESS, "visca+udp://");
  refused(PTZCAL_STATUS_UNSUPPORTED, "gpio:///dev/gpiochip0/laser");
  over_the_network();

  begin(&l, SILENT);
  refused(PTZCAL_STATUS_DEVICE_TIMEOUT, l.address);
  rig_on(l.address, PTZCAL_STATUS_DEVICE_TIMEOUT);
  unplug(&l);

  begin(&l, NOISE);
  refused(PTZCAL_STATUS_DEVICE_GARBLED, l.address);
  unplug(&l);

  begin(&l, CAMERA);
  strcat(l.address, "?model=evi-d70"); /* it says that it is an EVI-D100 */
  refused(PTZCAL_STATUS_DEVICE_MISMATCH, l.address);
  l.address[strlen(l.address) - strlen("?model=evi-d70")] = '\0';
  CHECK_OK(open_head(l.address, &head));
  CHECK_OK(ptzcal_head_position(head, &pan, &tilt, NULL, NULL));
  CHECK(pan == 0.0 && tilt == 0.0);
  unplug(&l);
  for (i = 0, status = PTZCAL_STATUS_OK; i < 3 && status != PTZCAL_STATUS_DEVICE_LOST; i++)
    status = ptzcal_head_position(head, &pan, &tilt, NULL, NULL);
  CHECK_STATUS(PTZCAL_STATUS_DEVICE_LOST, status);
  CHECK(ptzcal_head_move(head, 0.1, 0.0, NULL, NULL) < 0);
  (void)ptzcal_head_close(head, NULL); /* whatever it says, the head is gone */
  rig_on("visca:///dev/no-such-line", PTZCAL_STATUS_DEVICE_NOT_FOUND);
  return 0;
}
