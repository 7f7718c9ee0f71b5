/* A scan that is recorded, and scanned again from its folder: the same spots. */
#include "fixtures.h"
#include <string.h>

static ptzcal_rig *open_rig(const char *address)
{
  ptzcal_rig_options *options;
  ptzcal_rig *rig;
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_OK(ptzcal_rig_options_set_address(options, address, NULL));
  CHECK_OK(ptzcal_rig_options_set_settle(options, 2, 0.1, 0.0, 30.0, 0.0, NULL));
  CHECK_OK(ptzcal_rig_open(options, &rig, NULL));
  ptzcal_rig_options_free(options);
  return rig;
}

static ptzcal_scan *scan(ptzcal_rig *rig, const ptzcal_region *region, const char *camera, const char *folder)
{
  ptzcal_scan_options *options;
  ptzcal_scan *scan;
  CHECK_OK(ptzcal_scan_options_new(&options, NULL));
  CHECK_OK(ptzcal_scan_options_add_camera_address(options, camera, NULL, NULL));
  CHECK_OK(ptzcal_scan_options_set_recording(options, folder, NULL));
  CHECK_OK(ptzcal_rig_scan_region(rig, region, options, NULL, NULL, &scan, NULL));
  ptzcal_scan_options_free(options);
  return scan;
}

int main(int count, char **words)
{
  char folder[4096], address[4200];
  ptzcal_region region, recorded;
  ptzcal_rig *rig;
  ptzcal_scan *first, *again;
  ptzcal_scan_options *options;
  ptzcal_shot a, b;
  size_t i;
  CHECK(count == 3);
  CHECK(snprintf(folder, sizeof folder, "%s/recorded scan", words[2]) < (int)sizeof folder);
  CHECK(snprintf(address, sizeof address, "folder://%s/recorded%%20scan", words[2]) < (int)sizeof address);
  CHECK_OK(ptzcal_region_init(&region, sizeof region));
  region.pan_min = -0.1;
  region.pan_max = 0.1;
  region.pan_steps = 3;
  rig = open_rig("sim:room?seed=4");
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_rig_recorded_region(rig, &region, NULL));
  first = scan(rig, &region, "sim:fixed/0", folder);
  CHECK_STATUS(PTZCAL_STATUS_OK, ptzcal_scan_end(first, NULL));
  CHECK_OK(ptzcal_rig_close(rig, NULL));

  rig = open_rig(address);
  CHECK_OK(ptzcal_region_init(&recorded, sizeof recorded));
  CHECK_OK(ptzcal_rig_recorded_region(rig, &recorded, NULL));
  CHECK(recorded.pan_steps == 3 && recorded.tilt_steps == 1 && recorded.pan_min == -0.1 && recorded.tilt_max == 0.0);
  again = scan(rig, &recorded, "folder:fixed/0", NULL);
  CHECK_STATUS(PTZCAL_STATUS_OK, ptzcal_scan_end(again, NULL));
  CHECK_OK(ptzcal_shot_init(&a, sizeof a));
  CHECK_OK(ptzcal_shot_init(&b, sizeof b));
  for (i = 0; i < 3; i++) {
    CHECK_OK(ptzcal_scan_get_shot(first, i, &a, NULL));
    CHECK_OK(ptzcal_scan_get_shot(again, i, &b, NULL));
    CHECK(a.pan == b.pan && a.tilt == b.tilt && memcmp(a.point, b.point, sizeof a.point) == 0);
  }
  ptzcal_scan_free(first);
  ptzcal_scan_free(again);

  /* Where nothing was recorded the scan ends, and says so. */
  region.pan_max = 0.07;
  again = scan(rig, &region, "folder:fixed/0", NULL);
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_scan_end(again, NULL));
  ptzcal_scan_free(again);

  /* Folders with other things in them are left alone; cameras that are not there are refused. */
  CHECK_OK(ptzcal_scan_options_new(&options, NULL));
  CHECK_OK(ptzcal_scan_options_set_recording(options, words[2], NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_MISMATCH, ptzcal_rig_scan_region(rig, &region, options, NULL, NULL, &again, NULL));
  ptzcal_scan_options_free(options);
  CHECK_OK(ptzcal_scan_options_new(&options, NULL));
  CHECK_OK(ptzcal_scan_options_add_camera_address(options, "folder:fixed/9", NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_scan_region(rig, &region, options, NULL, NULL, &again, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_scan_options_add_camera_address(options, "sim:fixed/x", NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ADDRESS, ptzcal_scan_options_add_camera_address(options, "video0", NULL, NULL));
  ptzcal_scan_options_free(options);
  CHECK_OK(ptzcal_rig_close(rig, NULL));
  return 0;
}
