/* How scans end: stopped, cancelled from another thread, resumed from a journal, on a head
   that is unplugged; nothing that was measured is lost. And the files that come of it. */
#include "fixtures.h"
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

static char folder[1024];

static const char *file(const char *name)
{
  static char path[2][2048];
  static int turn;
  turn = !turn;
  snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
  return path[turn];
}

static void open_room(const char *address, ptzcal_rig **rig)
{
  ptzcal_rig_options *options;
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_OK(ptzcal_rig_options_set_address(options, address, NULL));
  CHECK_OK(ptzcal_rig_open(options, rig, NULL));
  ptzcal_rig_options_free(options);
}

static void make_region(ptzcal_region *region, uint32_t pan_steps, uint32_t tilt_steps)
{
  CHECK_OK(ptzcal_region_init(region, sizeof *region));
  region->pan_min = -0.4;
  region->pan_max = 0.2;
  region->tilt_min = -0.3;
  region->tilt_max = 0.25;
  region->pan_steps = pan_steps;
  region->tilt_steps = tilt_steps;
}

typedef struct watcher {
  uint64_t stop_at, done;
  ptzcal_cancel *token;
  ptzcal_rig *rig;
  int shots, busy;
} watcher;

static int32_t watch(void *user, const ptzcal_progress *progress)
{
  watcher *w = (watcher *)user;
  CHECK(progress->struct_size >= sizeof *progress);
  CHECK(progress->done <= progress->total && progress->pass >= 1 && progress->pass <= progress->passes);
  w->done = progress->done;
  if (progress->shot) {
    w->shots++;
    CHECK(isfinite(progress->shot->pan) && progress->shot->time >= 0.0);
  }
  if (w->rig && progress->done == 2) {
    /* The handle at work is busy, but the emergency stop is always there. */
    double pan, tilt;
    w->busy = ptzcal_rig_position(w->rig, &pan, &tilt, NULL);
  }
  if (w->token && progress->done == w->stop_at) CHECK_OK(ptzcal_cancel_request(w->token));
  return !w->token && w->stop_at && progress->done >= w->stop_at;
}

static ptzcal_scan_summary summary_of(const ptzcal_scan *scan)
{
  ptzcal_scan_summary summary;
  CHECK_OK(ptzcal_scan_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_scan_get_summary(scan, &summary, NULL));
  return summary;
}

/* Stopped by its callback, gone on from the journal, and complete. */
static void stopped_and_resumed(void)
{
  ptzcal_rig *rig;
  ptzcal_scan_options *options;
  ptzcal_region region;
  ptzcal_scan *scan;
  ptzcal_scan_summary summary;
  ptzcal_shot shot;
  ptzcal_spot spot;
  ptzcal_error *error;
  watcher w;
  size_t needed;
  double *points;
  open_room("sim:room?seed=2", &rig);
  make_region(&region, 6, 5);
  CHECK_OK(ptzcal_scan_options_new(&options, NULL));
  CHECK_OK(ptzcal_scan_options_add_camera_address(options, "sim:fixed/0", NULL, NULL));
  CHECK_OK(ptzcal_scan_options_set_journal(options, file("scan.journal"), 0, NULL));
  memset(&w, 0, sizeof w);
  w.stop_at = 7;
  w.rig = rig;
  CHECK_OK(ptzcal_rig_scan_region(rig, &region, options, watch, &w, &scan, NULL));
  summary = summary_of(scan);
  CHECK(!summary.complete && summary.shots == 7 && summary.positions == 30 && summary.resumed == 0);
  CHECK(w.shots == 7 && w.busy == PTZCAL_STATUS_BUSY);
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_scan_end(scan, &error));
  CHECK(strlen(ptzcal_error_message(error)) > 0);
  ptzcal_error_free(error);
  ptzcal_scan_free(scan);

  memset(&w, 0, sizeof w);
  CHECK_OK(ptzcal_rig_scan_region(rig, &region, options, watch, &w, &scan, NULL));
  summary = summary_of(scan);
  CHECK(summary.complete && summary.shots == 30 && summary.resumed == 7 && w.done == 30);
  CHECK(summary.found > 25 && summary.fixed_cameras == 1);
  CHECK(summary.journal_cut == 0 && summary.journal_damaged == 0);
  CHECK_OK(ptzcal_scan_end(scan, NULL));

  CHECK_OK(ptzcal_shot_init(&shot, sizeof shot));
  CHECK_OK(ptzcal_scan_get_shot(scan, 29, &shot, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_scan_get_shot(scan, 30, &shot, NULL));
  CHECK_OK(ptzcal_spot_init(&spot, sizeof spot));
  if (shot.found) CHECK_OK(ptzcal_scan_get_spot(scan, 29, PTZCAL_HEAD_CAMERA, &spot, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_scan_get_spot(scan, 29, 1, &spot, NULL));

  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_scan_copy_points(scan, NULL, 0, &needed, NULL));
  CHECK(needed == 3 * summary.found);
  points = (double *)malloc(needed * sizeof *points);
  CHECK_OK(ptzcal_scan_copy_points(scan, points, needed, NULL, NULL));
  for (size_t i = 0; i < needed; i++) CHECK(fabs(points[i]) < 10.0);
  free(points);

  CHECK_OK(ptzcal_scan_save_ply(scan, file("cloud.ply"), NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_scan_save_ply(scan, file("no/such/folder.ply"), NULL));
  ptzcal_scan_free(scan);

  /* Another region is another scan; a file that is no journal is not touched. */
  region.pan_steps = 7;
  CHECK_STATUS(PTZCAL_STATUS_FILE_MISMATCH, ptzcal_rig_scan_region(rig, &region, options, NULL, NULL, &scan, &error));
  CHECK(scan == NULL && ptzcal_error_hint(error) != NULL);
  ptzcal_error_free(error);
  CHECK_OK(ptzcal_scan_options_set_journal(options, file("cloud.ply"), 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_FORMAT, ptzcal_rig_scan_region(rig, &region, options, NULL, NULL, &scan, NULL));
  CHECK_OK(ptzcal_scan_options_set_journal(options, file("no/such/folder"), 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_rig_scan_region(rig, &region, options, NULL, NULL, &scan, NULL));

  /* Out of reach: refused before anything moves. */
  region.pan_max = 10.0;
  CHECK_STATUS(PTZCAL_STATUS_UNREACHABLE, ptzcal_rig_scan_region(rig, &region, NULL, NULL, NULL, &scan, NULL));
  ptzcal_scan_options_free(options);
  CHECK_OK(ptzcal_rig_close(rig, NULL));
}

/* A token that is requested while the scan runs. */
static void cancelled(void)
{
  ptzcal_rig *rig;
  ptzcal_scan_options *options;
  ptzcal_region region;
  ptzcal_scan *scan;
  watcher w;
  open_room("sim:room?cameras=0", &rig);
  make_region(&region, 30, 30);
  memset(&w, 0, sizeof w);
  CHECK_OK(ptzcal_cancel_new(&w.token, NULL));
  w.stop_at = 4;
  CHECK_OK(ptzcal_scan_options_new(&options, NULL));
  CHECK_OK(ptzcal_scan_options_set_cancel(options, w.token, NULL));
  CHECK_OK(ptzcal_rig_scan_region(rig, &region, options, watch, &w, &scan, NULL));
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_scan_end(scan, NULL));
  CHECK(summary_of(scan).shots == 4);
  ptzcal_scan_free(scan);
  ptzcal_scan_options_free(options);
  ptzcal_cancel_free(w.token);
  CHECK_OK(ptzcal_rig_close(rig, NULL));
}

static void *stop_it(void *user)
{
  ptzcal_rig *rig = (ptzcal_rig *)user;
  CHECK_OK(ptzcal_rig_stop(rig, NULL));
  CHECK_OK(ptzcal_rig_emergency_off(rig, NULL));
  return NULL;
}

typedef struct race {
  ptzcal_rig *rig;
  pthread_t thread;
  int started;
} race;

static int32_t start_thread(void *user, const ptzcal_progress *progress)
{
  race *r = (race *)user;
  if (progress->done == 3 && !r->started) {
    r->started = 1;
    CHECK(pthread_create(&r->thread, NULL, stop_it, r->rig) == 0);
  }
  if (r->started) {
    /* Lets the other thread run: valgrind runs one at a time. */
    const struct timespec moment = {0, 5000000};
    nanosleep(&moment, NULL);
  }
  return 0;
}

/* ptzcal_rig_stop and the emergency stop from another thread end a scan early. */
static void stopped_from_another_thread(void)
{
  ptzcal_rig *rig;
  ptzcal_region region;
  ptzcal_scan *scan;
  ptzcal_status end;
  race r;
  open_room("sim:room?cameras=0", &rig);
  make_region(&region, 100, 100);
  memset(&r, 0, sizeof r);
  r.rig = rig;
  CHECK_OK(ptzcal_rig_scan_region(rig, &region, NULL, start_thread, &r, &scan, NULL));
  CHECK(r.started && pthread_join(r.thread, NULL) == 0);
  end = ptzcal_scan_end(scan, NULL);
  CHECK(end == PTZCAL_STATUS_CANCELLED || end == PTZCAL_STATUS_LASER_REFUSED);
  CHECK(summary_of(scan).shots >= 3 && summary_of(scan).shots < 10000);
  ptzcal_scan_free(scan);
  CHECK_STATUS(PTZCAL_STATUS_LASER_REFUSED, ptzcal_rig_set_laser(rig, 1, NULL));
  CHECK_OK(ptzcal_rig_close(rig, NULL));
}

/* The head's cable is pulled in the middle of a scan. */
static void unplugged(void)
{
  ptzcal_rig *rig;
  ptzcal_region region;
  ptzcal_scan *scan;
  ptzcal_error *error;
  double pan, tilt;
  open_room("sim:room?cameras=0&unplug_after=120", &rig);
  make_region(&region, 10, 10);
  CHECK_OK(ptzcal_rig_scan_region(rig, &region, NULL, NULL, NULL, &scan, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEVICE_LOST, ptzcal_scan_end(scan, &error));
  CHECK(ptzcal_error_hint(error) != NULL);
  ptzcal_error_free(error);
  CHECK(summary_of(scan).shots > 0 && summary_of(scan).shots < 100);
  ptzcal_scan_free(scan);
  CHECK_STATUS(PTZCAL_STATUS_DEVICE_LOST, ptzcal_rig_position(rig, &pan, &tilt, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEVICE_LOST, ptzcal_rig_close(rig, NULL));
}

/* What is written is read back to the last bit; what is damaged is refused. */
static void files(void)
{
  ptzcal_camera camera, again;
  FILE *f;
  make_camera(&camera);
  CHECK_OK(ptzcal_camera_init(&again, sizeof again));
  CHECK_OK(ptzcal_camera_save(&camera, file("camera.json"), NULL));
  CHECK_OK(ptzcal_camera_load(file("camera.json"), &again, NULL));
  CHECK(memcmp(&camera, &again, sizeof camera) == 0);
  CHECK_OK(ptzcal_camera_save_opencv(&camera, file("camera.yaml"), NULL));
  CHECK_OK(ptzcal_camera_load_opencv(file("camera.yaml"), &again, NULL));
  CHECK_NEAR(again.fx, camera.fx, 0.0);
  camera.skew = 1.0;
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_camera_save_opencv(&camera, file("camera.yaml"), NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_camera_load(file("absent.json"), &again, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_camera_save(&camera, file("no/such/camera.json"), NULL));
  f = fopen(file("broken.json"), "w");
  CHECK(f && fputs("{\"format\": \"ptzcal", f) >= 0 && fclose(f) == 0);
  memcpy(&camera, &again, sizeof camera);
  CHECK_STATUS(PTZCAL_STATUS_FILE_FORMAT, ptzcal_camera_load(file("broken.json"), &again, NULL));
  CHECK(memcmp(&camera, &again, sizeof camera) == 0);
}

int main(int argc, char **argv)
{
  CHECK(argc == 3);
  snprintf(folder, sizeof folder, "%s", argv[2]);
  stopped_and_resumed();
  cancelled();
  stopped_from_another_thread();
  unplugged();
  files();
  return 0;
}
