/* Scanning a region: progress, stopping, the journal, and regions that cannot be scanned. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

static ptzcal_rig *rig;
static ptzcal_region region;

typedef struct listener {
  int heard, stop_after;
} listener;

static int32_t listen(void *user, const ptzcal_progress *progress)
{
  listener *l = (listener *)user;
  double pan, tilt;
  CHECK(progress->struct_size >= sizeof *progress);
  CHECK(progress->pass >= 1 && progress->pass <= progress->passes && progress->done <= progress->total);
  /* The rig is at work. */
  CHECK_STATUS(PTZCAL_STATUS_BUSY, ptzcal_rig_position(rig, &pan, &tilt, NULL));
  l->heard++;
  return l->stop_after && l->heard >= l->stop_after;
}

static ptzcal_scan_summary scan(const char *journal, listener *l, ptzcal_status wanted_end, ptzcal_scan **result)
{
  ptzcal_scan_options *options;
  ptzcal_scan_summary summary;
  uint32_t camera = 99;
  CHECK_OK(ptzcal_scan_options_new(&options, NULL));
  CHECK_OK(ptzcal_scan_options_add_camera_address(options, "sim:fixed/0", &camera, NULL));
  CHECK(camera == 0);
  CHECK_OK(ptzcal_scan_options_set_journal(options, journal, 0, NULL));
  CHECK_OK(ptzcal_rig_scan_region(rig, &region, options, listen, l, result, NULL));
  ptzcal_scan_options_free(options);
  CHECK_OK(ptzcal_scan_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_scan_get_summary(*result, &summary, NULL));
  CHECK_STATUS(wanted_end, ptzcal_scan_end(*result, NULL));
  CHECK((summary.complete == 1) == (wanted_end == PTZCAL_STATUS_OK));
  CHECK(summary.positions == 4 && summary.fixed_cameras == 1);
  return summary;
}

static void stopped_and_resumed(const char *journal)
{
  listener l = {0, 3}; /* once at the start, once for each shot */
  ptzcal_scan *result;
  ptzcal_scan_summary summary;
  FILE *file;
  long length;
  char *bytes;

  summary = scan(journal, &l, PTZCAL_STATUS_CANCELLED, &result);
  CHECK(summary.shots == 2 && l.heard == 3);
  ptzcal_scan_free(result);

  /* A journal that lost its end, as a pulled plug leaves it: the last whole shot counts. */
  file = fopen(journal, "rb");
  CHECK(file && fseek(file, 0, SEEK_END) == 0);
  length = ftell(file);
  rewind(file);
  bytes = (char *)malloc((size_t)length);
  CHECK(bytes && fread(bytes, 1, (size_t)length, file) == (size_t)length && fclose(file) == 0);
  file = fopen(journal, "wb");
  CHECK(file && fwrite(bytes, 1, (size_t)length - 5, file) == (size_t)length - 5 && fclose(file) == 0);
  free(bytes);

  l.stop_after = 0;
  summary = scan(journal, &l, PTZCAL_STATUS_OK, &result);
  CHECK(summary.shots == 4 && summary.resumed == 1 && summary.journal_cut > 0);

  {
    double points[12];
    size_t needed, i;
    ptzcal_shot shot;
    ptzcal_spot spot;
    ptzcal_correspondences *set;
    CHECK_OK(ptzcal_shot_init(&shot, sizeof shot));
    CHECK_OK(ptzcal_spot_init(&spot, sizeof spot));
    for (i = 0; i < 4; i++) CHECK_OK(ptzcal_scan_get_shot(result, i, &shot, NULL));
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_scan_get_shot(result, 4, &shot, NULL));
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_scan_get_shot(result, SIZE_MAX, &shot, NULL));
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_scan_get_spot(result, 0, 1, &spot, NULL));
    CHECK(summary.found > 0);
    CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_scan_copy_points(result, NULL, 0, &needed, NULL));
    CHECK(needed == 3 * summary.found);
    CHECK_OK(ptzcal_scan_copy_points(result, points, 12, NULL, NULL));
    CHECK(points[2] > 0.5 && points[2] < 20.0);
    {
      uint32_t width = 7, height = 7;
      CHECK_OK(ptzcal_scan_camera_size(result, 0, &width, &height, NULL));
      CHECK(width > 17 && height > 13);
      CHECK_OK(ptzcal_correspondences_new(width, height, &set, NULL));
      CHECK_OK(ptzcal_correspondences_add_scan(set, result, 0, NULL));
      ptzcal_correspondences_free(set);
      width = height = 7;
      CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_scan_camera_size(result, 1, &width, &height, NULL));
      CHECK(width == 7 && height == 7);
    }
    CHECK_OK(ptzcal_correspondences_new(17, 13, &set, NULL));
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_scan(set, result, 0, NULL));
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_scan(set, result, 7, NULL));
    ptzcal_correspondences_free(set);
  }
  ptzcal_scan_free(result);
}

static void files_that_are_no_journal(const char *path)
{
  static const char text[] = "my thesis, the only copy";
  char kept[sizeof text];
  ptzcal_scan_options *options;
  ptzcal_scan *result;
  ptzcal_error *error = NULL;
  FILE *file = fopen(path, "wb");
  CHECK(file && fwrite(text, 1, sizeof text, file) == sizeof text && fclose(file) == 0);
  CHECK_OK(ptzcal_scan_options_new(&options, NULL));
  CHECK_OK(ptzcal_scan_options_set_journal(options, path, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_FORMAT, ptzcal_rig_scan_region(rig, &region, options, NULL, NULL, &result, &error));
  CHECK(result == NULL && strstr(ptzcal_error_message(error), path));
  ptzcal_error_free(error);
  file = fopen(path, "rb");
  CHECK(file && fread(kept, 1, sizeof kept, file) == sizeof kept && fclose(file) == 0);
  CHECK(memcmp(kept, text, sizeof text) == 0);
  CHECK_OK(ptzcal_scan_options_set_journal(options, "/nowhere/at/all", 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_rig_scan_region(rig, &region, options, NULL, NULL, &result, NULL));
  ptzcal_scan_options_free(options);
}

static void bad_regions(void)
{
  ptzcal_region r;
  ptzcal_scan *result;
#define BAD(change, status) \
  (r = region, change, check_status(__FILE__, __LINE__, #change, status, ptzcal_rig_scan_region(rig, &r, NULL, NULL, NULL, &result, NULL)))
  BAD(r.pan_steps = 0, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(r.tilt_steps = 0, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(r.pan_steps = r.tilt_steps = UINT32_MAX, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(r.pan_min = r.pan_max + 1.0, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(r.tilt_max = -INFINITY, PTZCAL_STATUS_NOT_FINITE);
  BAD(r.pan_max = NAN, PTZCAL_STATUS_NOT_FINITE);
  BAD(r.pan_max = 100.0, PTZCAL_STATUS_UNREACHABLE);
}

int main(int count, char **words)
{
  char path[4096];
  ptzcal_rig_options *options;
  CHECK(count == 3);
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_OK(ptzcal_rig_options_set_address(options, "sim:room?seed=2", NULL));
  CHECK_OK(ptzcal_rig_options_set_settle(options, 2, 0.1, 0.0, 30.0, 0.0, NULL));
  CHECK_OK(ptzcal_rig_open(options, &rig, NULL));
  ptzcal_rig_options_free(options);
  CHECK_OK(ptzcal_region_init(&region, sizeof region));
  region.pan_min = -0.1;
  region.pan_max = 0.1;
  region.tilt_min = -0.05;
  region.tilt_max = 0.05;
  region.pan_steps = region.tilt_steps = 2;
  CHECK(snprintf(path, sizeof path, "%s/scan.journal", words[2]) < (int)sizeof path);
  remove(path);
  stopped_and_resumed(path);
  CHECK(snprintf(path, sizeof path, "%s/thesis.txt", words[2]) < (int)sizeof path);
  files_that_are_no_journal(path);
  bad_regions();
  CHECK_OK(ptzcal_rig_close(rig, NULL));
  return 0;
}
