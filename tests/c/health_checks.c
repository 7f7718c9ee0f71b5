/* In the simulator: where the fixed camera sees the laser, and whether it is where it was. */
#include "check.h"
#include <math.h>
#include <string.h>

static int stop_at_once(void *user, const ptzcal_progress *progress)
{
  (void)progress;
  return ++*(int *)user > 2;
}

/* The same shots, as a host that measured the spots itself hands them in. */
static void from_spots(const ptzcal_rig_model *model, const ptzcal_calibration *calibration, const ptzcal_scan *before,
                       const size_t *chosen)
{
  double readings[20], spots[200];
  uint8_t seen[20];
  ptzcal_health_report *report;
  ptzcal_health health;
  ptzcal_shot shot;
  ptzcal_spot head, fixed;
  size_t i, k;
  CHECK_OK(ptzcal_health_init(&health, sizeof health));
  CHECK_OK(ptzcal_shot_init(&shot, sizeof shot));
  CHECK_OK(ptzcal_spot_init(&head, sizeof head));
  CHECK_OK(ptzcal_spot_init(&fixed, sizeof fixed));
  for (i = 0; i < 10; i++) {
    double *of = spots + 20 * i;
    CHECK_OK(ptzcal_scan_get_shot(before, chosen[i], &shot, NULL));
    CHECK_OK(ptzcal_scan_get_spot(before, chosen[i], PTZCAL_HEAD_CAMERA, &head, NULL));
    CHECK_OK(ptzcal_scan_get_spot(before, chosen[i], 0, &fixed, NULL));
    readings[2 * i] = shot.pan, readings[2 * i + 1] = shot.tilt;
    for (k = 0; k < 4; k++) {
      of[5 * k] = k % 2 ? fixed.x : head.x;
      of[5 * k + 1] = k % 2 ? fixed.y : head.y;
      of[5 * k + 2] = of[5 * k + 4] = 0.09;
      of[5 * k + 3] = 0.0;
    }
    seen[2 * i] = seen[2 * i + 1] = 1;
  }
  CHECK_OK(ptzcal_health_check_spots(model, calibration, readings, spots, NULL, 10, NULL, &report, NULL));
  CHECK_OK(ptzcal_health_report_get(report, &health, NULL));
  CHECK(health.verdict == PTZCAL_VERDICT_UNCHANGED && health.shots == 10 && health.used == 10);
  CHECK_NEAR(health.chi2, 0.0, 1e-12);
  ptzcal_health_report_free(report);
  /* Three shots that are seen again tell nothing. */
  for (i = 3; i < 10; i++) seen[2 * i + 1] = 0;
  CHECK_OK(ptzcal_health_check_spots(model, calibration, readings, spots, seen, 10, NULL, &report, NULL));
  CHECK_OK(ptzcal_health_report_get(report, &health, NULL));
  CHECK(health.verdict == PTZCAL_VERDICT_CANNOT_TELL && health.not_seen == 7 && health.has_statistic == 0);
  ptzcal_health_report_free(report);
  /* All spots of the fixed camera five pixels to the right: it was turned. */
  for (i = 0; i < 10; i++) spots[20 * i + 15] += 5.0;
  CHECK_OK(ptzcal_health_check_spots(model, calibration, readings, spots, NULL, 10, NULL, &report, NULL));
  CHECK_OK(ptzcal_health_report_get(report, &health, NULL));
  CHECK(health.verdict != PTZCAL_VERDICT_UNCHANGED && health.probability < 1e-6);
  ptzcal_health_report_free(report);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_health_check_spots(model, calibration, readings, spots, NULL, 0, NULL, &report, NULL));
  spots[2] = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_health_check_spots(model, calibration, readings, spots, NULL, 10, NULL, &report, NULL));
  spots[2] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE,
               ptzcal_health_check_spots(model, calibration, readings, spots, NULL, 10, NULL, &report, NULL));
  spots[2] = 0.09, readings[3] = INFINITY;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE,
               ptzcal_health_check_spots(model, calibration, readings, spots, NULL, 10, NULL, &report, NULL));
  CHECK(report == NULL);
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
  explore.max_shots = 501;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_explore(rig, &explore, scan_options, NULL, NULL, &exploration, NULL));
  explore.max_shots = 12, explore.tolerance = 0.001;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_explore(rig, &explore, scan_options, NULL, NULL, &exploration, NULL));
  explore.tolerance = 0.04, explore.pan_min = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_rig_explore(rig, &explore, scan_options, NULL, NULL, &exploration, NULL));
  explore.pan_min = 1.4, explore.pan_max = 1.7; /* where the camera sees nothing */
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_rig_explore(rig, &explore, scan_options, NULL, NULL, &exploration, NULL));
  CHECK(exploration == NULL);
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

  from_spots(&model, calibration, before, chosen);

  ptzcal_scan_free(again);
  ptzcal_scan_free(before);
  ptzcal_calibration_free(calibration);
  ptzcal_correspondences_free(set);
  ptzcal_scan_options_free(scan_options);
  CHECK_OK(ptzcal_rig_close(rig, NULL));
  ptzcal_rig_options_free(options);
  return 0;
}
