/* In the simulator: where the fixed camera sees the laser, and whether it is where it was. */
#include "check.h"
#include <math.h>
#include <string.h>

static int stop_at_once(void *user, const ptzcal_progress *progress)
{
  (void)progress;
  return ++*(int *)user > 2;
}

int main(void)
{
  ptzcal_rig_options *options;
  ptzcal_scan_options *scan_options;
  ptzcal_rig *rig;
  ptzcal_scan *before, *again, *shots;
  ptzcal_exploration *exploration;
  ptzcal_explore_options explore;
  ptzcal_visible visible;
  ptzcal_region region;
  ptzcal_rig_model model;
  ptzcal_correspondences *set;
  ptzcal_calibration *calibration, *refitted;
  ptzcal_health_report *report;
  ptzcal_health_options health_options;
  ptzcal_health health;
  static uint8_t mask[100000];
  size_t chosen[10], n, bad = 100000;
  uint32_t states[10];
  int calls = 0;
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_OK(ptzcal_rig_options_set_address(options, "sim:room?seed=5", NULL));
  CHECK_OK(ptzcal_rig_open(options, &rig, NULL));
  CHECK_OK(ptzcal_scan_options_new(&scan_options, NULL));
  CHECK_OK(ptzcal_explore_options_init(&explore, sizeof explore));
  CHECK_OK(ptzcal_visible_init(&visible, sizeof visible));
  CHECK_OK(ptzcal_region_init(&region, sizeof region));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_explore(rig, &explore, scan_options, NULL, NULL, &exploration, NULL));
  CHECK_OK(ptzcal_scan_options_add_camera_address(scan_options, "sim:fixed/0", NULL, NULL));
  explore.max_shots = 0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_explore(rig, &explore, scan_options, NULL, NULL, &exploration, NULL));
  explore.max_shots = 12;
  explore.pan_min = -0.5, explore.pan_max = 0.4, explore.tilt_min = -0.35, explore.tilt_max = 0.3;
  CHECK_OK(ptzcal_rig_explore(rig, &explore, scan_options, stop_at_once, &calls, &exploration, NULL));
  CHECK_OK(ptzcal_exploration_get_scan(exploration, &shots, NULL));
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_scan_end(shots, NULL));
  ptzcal_scan_free(shots);
  ptzcal_exploration_free(exploration);
  CHECK_OK(ptzcal_rig_explore(rig, &explore, scan_options, NULL, NULL, &exploration, NULL));
  CHECK_OK(ptzcal_exploration_get_visible(exploration, 0, &region, &visible, NULL));
  CHECK(visible.seen >= 3 && visible.shots <= 12 && visible.share > 0.2 && region.pan_min < region.pan_max);
  CHECK_OK(ptzcal_exploration_copy_mask(exploration, 0, mask, sizeof mask, &n, NULL));
  CHECK(n == (size_t)region.pan_steps * region.tilt_steps);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_exploration_get_visible(exploration, 1, &region, &visible, NULL));
  ptzcal_exploration_free(exploration);

  region.pan_steps = 9, region.tilt_steps = 7;
  CHECK_OK(ptzcal_rig_scan_region(rig, &region, scan_options, NULL, NULL, &before, NULL));
  CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
  CHECK_OK(ptzcal_correspondences_add_scan(set, before, 0, NULL));
  CHECK_OK(ptzcal_calibrate_camera(set, NULL, &calibration, NULL));
  CHECK_OK(ptzcal_rig_model_init(&model, sizeof model));
  CHECK_OK(ptzcal_rig_get_model(rig, &model, NULL));
  CHECK_OK(ptzcal_scan_choose_health_shots(before, 0, 10, chosen, 10, &n, NULL));
  CHECK(n == 10 && chosen[0] < chosen[9]);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_scan_choose_health_shots(before, 3, 10, chosen, 10, &n, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_scan_choose_health_shots(before, 0, 0, chosen, 10, &n, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_fire_again(rig, before, &bad, 1, scan_options, NULL, NULL, &again, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_fire_again(rig, before, chosen, 0, scan_options, NULL, NULL, &again, NULL));
  CHECK_OK(ptzcal_rig_fire_again(rig, before, chosen, 10, scan_options, NULL, NULL, &again, NULL));
  CHECK_OK(ptzcal_scan_end(again, NULL));

  CHECK_OK(ptzcal_health_init(&health, sizeof health));
  CHECK_OK(ptzcal_health_options_init(&health_options, sizeof health_options));
  CHECK_OK(ptzcal_health_check(&model, calibration, before, again, 0, NULL, &report, NULL));
  CHECK_OK(ptzcal_health_report_get(report, &health, NULL));
  CHECK(strlen(ptzcal_health_report_reason(report)) > 10);
  CHECK(health.verdict == PTZCAL_VERDICT_UNCHANGED && health.has_statistic == 1 && health.has_refit == 0);
  CHECK(health.shots == 10 && health.probability > 0.005 && health.degrees_of_freedom == 6.0);
  CHECK_OK(ptzcal_health_report_copy_shots(report, states, 10, &n, NULL));
  CHECK(n == 10);
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_health_report_refitted(report, &refitted, NULL));
  ptzcal_health_report_free(report);
  health_options.false_alarm = 0.7;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_health_check(&model, calibration, before, again, 0, &health_options, &report, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_health_check(&model, calibration, before, again, 4, NULL, &report, NULL));
  CHECK(report == NULL);

  ptzcal_scan_free(again);
  ptzcal_scan_free(before);
  ptzcal_calibration_free(calibration);
  ptzcal_correspondences_free(set);
  ptzcal_scan_options_free(scan_options);
  CHECK_OK(ptzcal_rig_close(rig, NULL));
  ptzcal_rig_options_free(options);
  return 0;
}
