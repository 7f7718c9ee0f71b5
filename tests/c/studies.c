/* Noise study, precision label, plan, next best shots: before and while a rig works. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

static const double ROOM[6] = {-1.9, -1.3, -1.0, 2.0, 1.2, 4.6};
static const double BOXES[18] = {-0.7, 0.15, 1.7, 0.2, 1.2, 2.5, -0.48, -0.45, 1.05, -0.28, 0.1, 1.3, 0.25, 0.3, 1.35, 0.5, 1.2, 1.7};

static const double zeros[3] = {0, 0, 0}, ahead[3] = {0, 0, 2}, upside_down[6] = {1, 1, 1, 0, 0, 0};

static void rig(ptzcal_rig_model *model)
{
  CHECK_OK(ptzcal_rig_model_init(model, sizeof *model));
  model->width = 720;
  model->height = 576;
  model->fx = model->fy = 800.0;
  model->cx = 360.0;
  model->cy = 288.0;
  model->laser_x0 = 0.1;
  model->laser_y0 = 0.005;
  model->laser_vx = -0.005;
  model->laser_vy = 0.003;
}

static void near(ptzcal_camera *camera)
{
  CHECK_OK(ptzcal_camera_init(camera, sizeof *camera));
  camera->width = 800;
  camera->height = 600;
  camera->fx = camera->fy = 845.0;
  camera->cx = 427.0;
  camera->cy = 285.0;
  camera->translation[0] = 0.157;
  camera->translation[1] = -0.05;
}

static ptzcal_region region(uint32_t pan_steps, uint32_t tilt_steps)
{
  ptzcal_region r;
  CHECK_OK(ptzcal_region_init(&r, sizeof r));
  r.pan_min = -0.5;
  r.pan_max = 0.43;
  r.tilt_min = -0.36;
  r.tilt_max = 0.33;
  r.pan_steps = pan_steps;
  r.tilt_steps = tilt_steps;
  return r;
}

static ptzcal_site *site_in_room(void)
{
  ptzcal_rig_model model;
  ptzcal_camera camera;
  ptzcal_site *site;
  rig(&model);
  near(&camera);
  CHECK_OK(ptzcal_site_new(&model, &camera, &site, NULL));
  CHECK_OK(ptzcal_site_set_room(site, ROOM, BOXES, 3, NULL));
  return site;
}

static int32_t heard;
static int32_t hear(void *user, const ptzcal_progress *progress)
{
  CHECK(progress->done >= 1 && progress->done <= progress->total);
  heard++;
  return *(int32_t *)user;
}

static void a_study_is_made_and_read(void)
{
  ptzcal_site *site = site_in_room();
  ptzcal_region where = region(16, 12);
  ptzcal_set_up *set_up;
  ptzcal_study *study, *again;
  ptzcal_study_options options;
  ptzcal_study_cell cell, other;
  ptzcal_error *error = NULL;
  const double levels[6] = {0.0, 0.0, 0.2, 0.2, 1.0, 1.0}, distances[2] = {1.0, 4.0};
  double handoff[2];
  size_t count = 0, needed = 0;
  int32_t stop = 0;
  uint32_t method;
  CHECK_OK(ptzcal_set_up_from_region(site, &where, &set_up, NULL));
  CHECK_OK(ptzcal_set_up_get_count(set_up, &count, NULL));
  CHECK(count > 60 && count < 16 * 12);
  CHECK_OK(ptzcal_study_options_init(&options, sizeof options));
  CHECK(options.methods == 0x1d && options.trials == 100 && options.threads == 1 && options.seed == 1);
  options.trials = 8;
  CHECK_OK(ptzcal_study_run(set_up, levels, 3, distances, 2, &options, hear, &stop, NULL, &study, NULL));
  CHECK(heard == 8);
  CHECK_OK(ptzcal_study_cell_init(&cell, sizeof cell));
  CHECK_OK(ptzcal_study_cell_init(&other, sizeof other));
  for (method = 0; method < 5; method++) {
    if (method == PTZCAL_STUDY_METHOD_DLT_CASCADE_PRINTED) continue;
    CHECK_OK(ptzcal_study_get_cell(study, method, 0, &cell, NULL));
    CHECK(cell.used == 8 && cell.failures == 0 && cell.rms[PTZCAL_STUDY_QUANTITY_POSITION] < 1e-6);
    CHECK_OK(ptzcal_study_get_cell(study, method, 2, &cell, NULL));
    CHECK(cell.head_sigma == 1.0 && cell.fixed_sigma == 1.0);
    CHECK(cell.mean[0] > 1e-4 && cell.mean[0] <= cell.rms[0] && cell.bias[0] <= cell.rms[0]);
  }
  /* The cell is that of maximum likelihood now: its covariance says what to expect. */
  CHECK(cell.rms[0] > 0.3 * cell.expected[0] && cell.rms[0] < 3.0 * cell.expected[0]);
  CHECK_OK(ptzcal_study_copy_handoff(study, PTZCAL_STUDY_METHOD_JOINT_ML, 2, handoff, 2, &needed, NULL));
  CHECK(needed == 2 && handoff[0] > 0.0 && handoff[1] > 0.0);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL,
               ptzcal_study_copy_handoff(study, PTZCAL_STUDY_METHOD_JOINT_ML, 2, handoff, 1, &needed, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_study_copy_handoff(study, 9, 2, handoff, 2, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_study_get_cell(study, PTZCAL_STUDY_METHOD_DLT_CASCADE_PRINTED, 0, &cell, &error));
  CHECK(strstr(ptzcal_error_message(error), "printed"));
  ptzcal_error_free(error);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_study_get_cell(study, 7, 0, &cell, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_study_get_cell(study, 0, 3, &cell, NULL));
  CHECK_OK(ptzcal_study_save_csv(study, "study.csv", NULL));
  CHECK_OK(ptzcal_study_save_json(study, "study.json", NULL));
  CHECK_OK(ptzcal_study_save_plot(study, PTZCAL_STUDY_PLOT_ERRORS, PTZCAL_STUDY_QUANTITY_FOCAL, "errors.svg", NULL));
  CHECK_OK(ptzcal_study_save_plot(study, PTZCAL_STUDY_PLOT_GRID, PTZCAL_STUDY_METHOD_JOINT_ML, "grid.svg", NULL));
  CHECK_OK(ptzcal_study_save_plot(study, PTZCAL_STUDY_PLOT_SCATTER, 2, "scatter.svg", NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_study_save_plot(study, 3, 0, "no.svg", NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_study_save_plot(study, PTZCAL_STUDY_PLOT_ERRORS, 4, "no.svg", NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_study_save_plot(study, PTZCAL_STUDY_PLOT_GRID, 1, "no.svg", NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_study_save_plot(study, PTZCAL_STUDY_PLOT_SCATTER, 3, "no.svg", NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_study_save_csv(study, "no/such/folder.csv", NULL));

  /* Any number of threads gives the same bits. */
  options.threads = 3;
  CHECK_OK(ptzcal_study_run(set_up, levels, 3, NULL, 0, &options, NULL, NULL, NULL, &again, NULL));
  CHECK_OK(ptzcal_study_get_cell(again, PTZCAL_STUDY_METHOD_JOINT_ML, 2, &other, NULL));
  CHECK(!memcmp(&cell, &other, sizeof cell));
  ptzcal_study_free(again);

  /* It can be stopped. */
  stop = 1;
  options.threads = 1;
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_study_run(set_up, levels, 3, NULL, 0, &options, hear, &stop, NULL, &again, NULL));
  CHECK(again == NULL);
  {
    ptzcal_cancel *token;
    CHECK_OK(ptzcal_cancel_new(&token, NULL));
    CHECK_OK(ptzcal_cancel_request(token));
    CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_study_run(set_up, levels, 3, NULL, 0, &options, NULL, NULL, token, &again, NULL));
    ptzcal_cancel_free(token);
  }
  ptzcal_study_free(study);
  ptzcal_set_up_free(set_up);
  ptzcal_site_free(site);
}

static void bad_studies_are_refused(void)
{
  ptzcal_site *site = site_in_room(), *empty;
  ptzcal_region where = region(8, 6);
  ptzcal_set_up *set_up;
  ptzcal_study *study;
  ptzcal_study_options options, good;
  ptzcal_rig_model model;
  ptzcal_camera camera;
  double levels[2] = {0.2, 0.2}, distance = 1.0, sigmas[15] = {0.0};
  double points[3 * 10];
  int i;
  CHECK_OK(ptzcal_set_up_from_region(site, &where, &set_up, NULL));
  CHECK_OK(ptzcal_study_options_init(&good, sizeof good));
  good.trials = 1;
#define REFUSED(status, member, value) \
  do { options = good; options.member = value; \
       CHECK_STATUS(status, ptzcal_study_run(set_up, levels, 1, &distance, 1, &options, NULL, NULL, NULL, &study, NULL)); \
       CHECK(study == NULL); } while (0)
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, trials, 0);
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, trials, UINT32_MAX);
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, threads, 0);
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, threads, UINT32_MAX);
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, methods, 0);
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, methods, 1u << 5);
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, draws, 2);
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, methods, 1u << PTZCAL_STUDY_METHOD_DLT_CASCADE_PRINTED); /* no control points */
  levels[0] = -0.1;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, trials, 1);
  levels[0] = 1e6;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, trials, 1);
  levels[0] = NAN;
  REFUSED(PTZCAL_STATUS_NOT_FINITE, trials, 1);
  levels[0] = 0.2;
  distance = 0.0;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, trials, 1);
  distance = INFINITY;
  REFUSED(PTZCAL_STATUS_NOT_FINITE, trials, 1);
  distance = 1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_study_run(set_up, levels, 0, NULL, 0, &good, NULL, NULL, NULL, &study, NULL));
  /* With control points the cascade can be had as printed. */
  for (i = 0; i < 10; i++) {
    points[3 * i] = 0.3 * (i % 3 - 1);
    points[3 * i + 1] = 0.2 * (i % 4 - 1.5);
    points[3 * i + 2] = 1.5 + 0.3 * i + 0.1 * (i % 2);
  }
  CHECK_OK(ptzcal_set_up_set_control(set_up, points, 10, NULL));
  options = good;
  options.methods = 1u << PTZCAL_STUDY_METHOD_DLT_CASCADE_PRINTED;
  CHECK_OK(ptzcal_study_run(set_up, levels, 1, NULL, 0, &options, NULL, NULL, NULL, &study, NULL));
  ptzcal_study_free(study);

  /* Sites. */
  rig(&model);
  near(&camera);
  CHECK_OK(ptzcal_site_new(&model, &camera, &empty, NULL));
  {
    ptzcal_set_up *nothing;
    CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_set_up_from_region(empty, &where, &nothing, NULL));
    CHECK(nothing == NULL);
  }
  sigmas[3] = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_site_set_rig_sigmas(site, sigmas, NULL));
  sigmas[3] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_site_set_rig_sigmas(site, sigmas, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_site_set_pointing_sigma(site, -1.0, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_site_set_depths(site, 3.0, 2.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_site_set_depths(site, 0.0, 2.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_site_set_plane(site, zeros, 1.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_site_set_room(site, upside_down, NULL, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_site_set_room(site, ROOM, NULL, 1, NULL));
  {
    ptzcal_calibration_options *other;
    CHECK_OK(ptzcal_calibration_options_new(&other, NULL));
    CHECK_OK(ptzcal_calibration_options_set_distortion(other, PTZCAL_DISTORTION_MODEL_DIVISION, NULL));
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_site_set_estimate(site, other, NULL));
    ptzcal_calibration_options_free(other);
    CHECK_OK(ptzcal_site_set_estimate(site, NULL, NULL));
  }
  camera.width = 0;
  {
    ptzcal_site *nowhere;
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_site_new(&model, &camera, &nowhere, NULL));
    CHECK(nowhere == NULL);
  }
  {
    ptzcal_set_up *few;
    CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_set_up_from_points(site, points, 5, &few, NULL));
    CHECK(few == NULL);
    points[4] = NAN;
    CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_set_up_from_points(site, points, 10, &few, NULL));
    CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_set_up_set_control(set_up, points, 10, NULL));
    where.pan_steps = 0;
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_set_up_from_region(site, &where, &few, NULL));
  }
  ptzcal_set_up_free(set_up);
  ptzcal_site_free(empty);
  ptzcal_site_free(site);
}

static void a_label_is_made_and_read(void)
{
  ptzcal_site *site = site_in_room();
  ptzcal_region where = region(16, 12);
  ptzcal_set_up *set_up;
  ptzcal_label *label;
  ptzcal_label_row row;
  ptzcal_study_options options;
  const double distances[3] = {0.5, 3.0, 5.0}, levels[4] = {0.2, 0.2, 1.0, 1.0};
  const double none[1] = {0.5}, negative[1] = {-1.0};
  size_t count = 0;
  CHECK_OK(ptzcal_set_up_from_region(site, &where, &set_up, NULL));
  CHECK_OK(ptzcal_study_options_init(&options, sizeof options));
  options.trials = 10;
  CHECK_OK(ptzcal_label_make(set_up, distances, 3, levels, 2, &options, NULL, NULL, NULL, &label, NULL));
  CHECK_OK(ptzcal_label_get_count(label, &count, NULL));
  CHECK(count == 4); /* nothing is nearer than half a metre */
  CHECK_OK(ptzcal_label_row_init(&row, sizeof row));
  CHECK_OK(ptzcal_label_get_row(label, 3, &row, NULL));
  CHECK(row.distance == 5.0 && row.head_sigma == 1.0 && row.failures == 0 && row.shots > 60);
  CHECK(row.expected[0] > 0.0 && row.simulated[0] < 3.0 * row.expected[0] && row.handoff_expected > 0.0);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_label_get_row(label, 4, &row, NULL));
  CHECK_OK(ptzcal_label_save_csv(label, "label.csv", NULL));
  CHECK_OK(ptzcal_label_save_json(label, "label.json", NULL));
  CHECK_OK(ptzcal_label_save_plot(label, PTZCAL_STUDY_QUANTITY_POSITION, "label.svg", NULL));
  CHECK_OK(ptzcal_label_save_plot(label, PTZCAL_LABEL_HANDOFF, "handoff.svg", NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_label_save_plot(label, 5, "no.svg", NULL));
  ptzcal_label_free(label);
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_label_make(set_up, none, 1, levels, 2, &options, NULL, NULL, NULL, &label, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_label_make(set_up, negative, 1, levels, 2, &options, NULL, NULL, NULL, &label, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_label_make(set_up, NULL, 0, levels, 2, &options, NULL, NULL, NULL, &label, NULL));
  options.methods = 0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_label_make(set_up, distances, 3, levels, 2, &options, NULL, NULL, NULL, &label, NULL));
  CHECK(label == NULL);
  ptzcal_set_up_free(set_up);
  ptzcal_site_free(site);
}

static void a_scan_is_planned_and_continued(void)
{
  ptzcal_site *site = site_in_room();
  ptzcal_region where = region(40, 30);
  ptzcal_plan_options options;
  ptzcal_plan_summary summary;
  ptzcal_plan *plan;
  ptzcal_error *error = NULL;
  double *shots, scanned[4 * 12], next[5 * 10], now[2], sigmas[15] = {0.0};
  size_t needed = 0, i;
  CHECK_OK(ptzcal_plan_options_init(&options, sizeof options));
  CHECK(options.target == 0.01 && options.max_positions == 20000);
  options.pan_min = where.pan_min;
  options.pan_max = where.pan_max;
  options.tilt_min = where.tilt_min;
  options.tilt_max = where.tilt_max;
  options.target = 0.002;
  CHECK_OK(ptzcal_plan_make(site, &options, NULL, &plan, NULL));
  CHECK_OK(ptzcal_plan_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_plan_get_summary(plan, &summary, NULL));
  CHECK(summary.grid_rms <= 0.002 && summary.grid_semi_axis <= summary.grid_rms && summary.limited_by == -1);
  CHECK(summary.shots >= 6 && summary.shots < summary.grid_seen);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_plan_copy_shots(plan, NULL, 0, &needed, NULL));
  CHECK(needed == 5u * summary.shots);
  shots = (double *)malloc(needed * sizeof *shots);
  CHECK(shots != NULL);
  CHECK_OK(ptzcal_plan_copy_shots(plan, shots, needed, NULL, NULL));
  CHECK(shots[needed - 2] <= 0.002);

  /* The first dozen of them are taken; what next? */
  for (i = 0; i < 12; i++) {
    size_t k = i % summary.shots;
    scanned[4 * i] = shots[5 * k];
    scanned[4 * i + 1] = shots[5 * k + 1] + 1e-3 * (double)(i / summary.shots);
    scanned[4 * i + 2] = shots[5 * k + 2];
    scanned[4 * i + 3] = 1.0;
  }
  free(shots);
  CHECK_OK(ptzcal_next_shots(site, scanned, 12, &where, 0.2, 0.2, 0.0, 10, now, next, 50, &needed, NULL));
  CHECK(needed == 50 && now[0] > next[3] && next[3] > next[48]);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_next_shots(site, scanned, 12, &where, 0.2, 0.2, 0.0, 10, NULL, next, 49, &needed, NULL));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_next_shots(site, NULL, 0, &where, 0.2, 0.2, 0.0, 10, NULL, next, 50, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_next_shots(site, scanned, 12, &where, 0.0, 0.2, 0.0, 10, NULL, next, 50, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_next_shots(site, scanned, 12, &where, 0.2, 0.2, -1.0, 10, NULL, next, 50, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_next_shots(site, scanned, 12, &where, 0.2, 0.2, 0.0, 0, NULL, next, 50, NULL, NULL));
  scanned[3] = 0.5;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_next_shots(site, scanned, 12, &where, 0.2, 0.2, 0.0, 10, NULL, next, 50, NULL, NULL));
  scanned[3] = 1.0;
  scanned[2] = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_next_shots(site, scanned, 12, &where, 0.2, 0.2, 0.0, 10, NULL, next, 50, NULL, NULL));
  where.pan_steps = where.tilt_steps = 1000;
  scanned[2] = 2.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_next_shots(site, scanned, 12, &where, 0.2, 0.2, 0.0, 10, NULL, next, 50, NULL, NULL));
  ptzcal_plan_free(plan);

  /* What cannot be reached says why. */
  sigmas[PTZCAL_RIG_PARAMETER_LASER_X0] = sigmas[PTZCAL_RIG_PARAMETER_LASER_Y0] = 0.005;
  CHECK_OK(ptzcal_site_set_rig_sigmas(site, sigmas, NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNREACHABLE, ptzcal_plan_make(site, &options, NULL, &plan, &error));
  CHECK(plan == NULL && strstr(ptzcal_error_message(error), "laser"));
  ptzcal_error_free(error);
  options.target = 0.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_plan_make(site, &options, NULL, &plan, NULL));
  options.target = 0.01;
  options.max_positions = 0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_plan_make(site, &options, NULL, &plan, NULL));
  options.max_positions = 100;
  options.pan_min = 1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_plan_make(site, &options, NULL, &plan, NULL));
  options.pan_min = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_plan_make(site, &options, NULL, &plan, NULL));
  options.pan_min = -0.5;
  options.head_sigma = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_plan_make(site, &options, NULL, &plan, NULL));
  options.head_sigma = 0.2;
  CHECK_OK(ptzcal_site_set_plane(site, ahead, 6.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_plan_make(site, &options, NULL, &plan, NULL));
  ptzcal_site_free(site);
}

static void a_target_accuracy_is_checked(void)
{
  ptzcal_scan_options *options;
  CHECK_OK(ptzcal_scan_options_new(&options, NULL));
  CHECK_OK(ptzcal_scan_options_set_target_accuracy(options, 0.01, NULL));
  CHECK_OK(ptzcal_scan_options_set_target_accuracy(options, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_scan_options_set_target_accuracy(options, -0.01, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_scan_options_set_target_accuracy(options, NAN, NULL));
  ptzcal_scan_options_free(options);
}

int main(void)
{
  a_target_accuracy_is_checked();
  a_study_is_made_and_read();
  bad_studies_are_refused();
  a_label_is_made_and_read();
  a_scan_is_planned_and_continued();
  return 0;
}
