/* From views of boards at two zooms to a rig over zoom, and what becomes of bad ones. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

static ptzcal_rig_calibration *set;
static ptzcal_rig_calibrated *answer;
static unsigned char pixels[720 * 576];

static void positions(void)
{
  ptzcal_zoom_position position;
  ptzcal_common_line line;
  ptzcal_rig_model model;
  ptzcal_laser_calibration *laser;
  ptzcal_board_calibration *boards;
  ptzcal_laser_line own;
  double covariance[49];
  uint32_t n, views, i;
  CHECK_OK(ptzcal_rig_calibrated_count(answer, &n, &views, NULL));
  CHECK(n == 2 && views == 2 * FIXTURE_VIEWS);
  CHECK_OK(ptzcal_zoom_position_init(&position, sizeof position));
  CHECK_OK(ptzcal_rig_model_init(&model, sizeof model));
  CHECK_OK(ptzcal_laser_line_init(&own, sizeof own));
  for (i = 0; i < n; i++) {
    CHECK_OK(ptzcal_rig_calibrated_get_position(answer, i, &position, NULL));
    CHECK(position.status == PTZCAL_STATUS_OK && position.laser_status == PTZCAL_STATUS_OK && position.has_model == 1);
    CHECK(position.zoom == (double)i && position.views == FIXTURE_VIEWS && position.views_used == FIXTURE_VIEWS);
    CHECK(position.spots_used >= 5 && position.rms > 0.05 && position.rms < 0.6);
    CHECK(*ptzcal_rig_calibrated_position_reason(answer, i) == '\0' && *ptzcal_rig_calibrated_laser_reason(answer, i) == '\0');
    CHECK_OK(ptzcal_rig_calibrated_get_rig_model(answer, i, &model, covariance, NULL));
    CHECK_NEAR(log(model.fx / (800.0 * (1 + i))), 0.0, 4.0 * sqrt(covariance[4 * 8]));
    CHECK_NEAR(model.laser_x0, 0.1, 4.0 * sqrt(covariance[0]));
    CHECK(covariance[0] > 0.0 && covariance[1] == covariance[7] && model.width == 720 && model.pan_scale == 1.0);
    CHECK_OK(ptzcal_rig_calibrated_copy_laser(answer, i, &laser, NULL));
    CHECK_OK(ptzcal_laser_calibration_get_line(laser, &own, NULL));
    /* Together they know the line better than each by itself. */
    CHECK(covariance[0] < own.covariance[0]);
    ptzcal_laser_calibration_free(laser);
    CHECK_OK(ptzcal_rig_calibrated_copy_boards(answer, i, &boards, NULL));
    ptzcal_board_calibration_free(boards);
  }
  CHECK_OK(ptzcal_rig_calibrated_get_rig_model(answer, 0, &model, NULL, NULL));
  CHECK_OK(ptzcal_common_line_init(&line, sizeof line));
  CHECK_OK(ptzcal_rig_calibrated_get_common_line(answer, &line, NULL));
  CHECK(line.agrees == 1 && line.positions == 2 && line.degrees_of_freedom == 4 && line.probability > 1e-3);
  CHECK(line.x0 == model.laser_x0 && isnan(line.odd_zoom));

  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibrated_get_position(answer, 2, &position, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibrated_get_rig_model(answer, 2, &model, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibrated_copy_laser(answer, 2, &laser, NULL));
  CHECK(laser == NULL);
  CHECK(*ptzcal_rig_calibrated_position_reason(answer, 2) == '\0' && *ptzcal_rig_calibrated_position_reason(NULL, 0) == '\0');
}

static void views(void)
{
  ptzcal_rig_view view;
  double xy[2 * FIXTURE_CORNERS], uv[2 * FIXTURE_CORNERS], residuals[2 * FIXTURE_CORNERS];
  uint8_t inliers[FIXTURE_CORNERS];
  size_t needed = 0, i;
  CHECK_OK(ptzcal_rig_view_init(&view, sizeof view));
  CHECK_OK(ptzcal_rig_calibrated_get_view(answer, 7, &view, NULL));
  CHECK(view.status == PTZCAL_STATUS_OK && view.has_pose == 1 && view.has_spot == 1 && view.zoom == 1.0);
  CHECK(view.corners == FIXTURE_CORNERS && view.inliers >= 16 && view.spot[0] > 360.0);
  CHECK_NEAR(view.translation[2], 1.5, 0.1);
  CHECK_OK(ptzcal_rig_calibrated_copy_corners(answer, 7, xy, uv, residuals, inliers, FIXTURE_CORNERS, &needed, NULL));
  CHECK(needed == FIXTURE_CORNERS);
  for (i = 0; i < FIXTURE_CORNERS; i++) CHECK(inliers[i] == 0 || hypot(residuals[2 * i], residuals[2 * i + 1]) < 1.5);
  CHECK_NEAR(xy[2], -0.1, 1e-12);
  needed = 0;
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL,
               ptzcal_rig_calibrated_copy_corners(answer, 7, xy, NULL, NULL, NULL, 3, &needed, NULL));
  CHECK(needed == FIXTURE_CORNERS);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_rig_calibrated_copy_corners(answer, 99, NULL, NULL, NULL, NULL, 0, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibrated_get_view(answer, 12, &view, NULL));
}

static void curves(const char *folder)
{
  ptzcal_zoom_curve *curve, *loaded;
  ptzcal_rig_model a, b, middle;
  double low, high, c[49], d[49];
  char path[1024];
  CHECK_OK(ptzcal_rig_calibrated_get_curve(answer, &curve, NULL));
  CHECK_OK(ptzcal_zoom_curve_get_range(curve, &low, &high, NULL));
  CHECK(low == 0.0 && high == 1.0);
  CHECK_OK(ptzcal_rig_model_init(&a, sizeof a));
  CHECK_OK(ptzcal_rig_model_init(&b, sizeof b));
  CHECK_OK(ptzcal_rig_model_init(&middle, sizeof middle));
  CHECK_OK(ptzcal_rig_calibrated_get_rig_model(answer, 1, &a, c, NULL));
  CHECK_OK(ptzcal_zoom_curve_get_rig_model(curve, 1.0, &b, d, NULL));
  CHECK_NEAR(a.fx, b.fx, 1e-9 * a.fx);
  CHECK_NEAR(c[0], d[0], 1e-9 * c[0]);
  CHECK_OK(ptzcal_zoom_curve_get_rig_model(curve, 0.5, &middle, d, NULL));
  CHECK(middle.fx > 1000.0 && middle.fx < 1300.0 && d[4 * 8] > c[4 * 8]);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_zoom_curve_get_rig_model(curve, 1.01, &b, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_zoom_curve_get_rig_model(curve, NAN, &b, NULL, NULL));

  CHECK((size_t)snprintf(path, sizeof path, "%s/zoom.json", folder) < sizeof path);
  CHECK_OK(ptzcal_zoom_curve_save(curve, path, NULL));
  CHECK_OK(ptzcal_zoom_curve_load(path, &loaded, NULL));
  CHECK_OK(ptzcal_zoom_curve_get_rig_model(loaded, 0.5, &b, NULL, NULL));
  CHECK(memcmp(&b, &middle, sizeof b) == 0);
  ptzcal_zoom_curve_free(loaded);
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_zoom_curve_load("no/such/file", &loaded, NULL));
  CHECK(loaded == NULL);
  ptzcal_zoom_curve_free(curve);
  ptzcal_zoom_curve_free(NULL);
}

static void bad_views(void)
{
  ptzcal_rig_calibration *bad;
  ptzcal_rig_calibrated *found;
  ptzcal_calibration_options *options;
  ptzcal_zoom_curve *curve;
  ptzcal_rig_view seen;
  ptzcal_zoom_position position;
  ptzcal_common_line line;
  ptzcal_rig_model model;
  ptzcal_camera lens;
  ptzcal_image image, small;
  double xy[8] = {0, 0, 1, 0, 0, 1, 1, 1}, spot[2] = {3.0, 4.0};
  uint32_t view = 77;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_new(2, 6, 0.03, NULL, NULL, &bad, NULL));
  CHECK(bad == NULL);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_new(9, 129, 0.03, NULL, NULL, &bad, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_new(9, 6, -0.03, NULL, NULL, &bad, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_rig_calibration_new(9, 6, INFINITY, NULL, NULL, &bad, NULL));
  CHECK_OK(ptzcal_calibration_options_new(&options, NULL));
  make_camera(&lens);
  CHECK_OK(ptzcal_calibration_options_set_lens(options, &lens, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_new(9, 6, 0.03, options, NULL, &bad, NULL));
  ptzcal_calibration_options_free(options);

  CHECK_OK(ptzcal_rig_calibration_new(9, 6, 0.03, NULL, NULL, &bad, NULL));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_rig_calibration_solve(bad, &found, NULL));
  CHECK(found == NULL);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_set_board(bad, 9, 0, 0.03, NULL));
  CHECK_OK(ptzcal_rig_calibration_set_board(bad, 7, 5, 0.02, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_set_common_line(bad, 1, -1.0, NULL));
  CHECK_OK(ptzcal_rig_calibration_set_common_line(bad, 0, 0.05, NULL));
  make_image(&image, pixels, 720, 576);
  make_image(&small, pixels, 360, 288);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_add_images(bad, 0.0, &image, &small, &view, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_rig_calibration_add_images(bad, NAN, &image, NULL, &view, NULL));
  CHECK(view == 77);
  CHECK_OK(ptzcal_rig_calibration_add_images(bad, 0.0, &image, &image, &view, NULL));
  CHECK(view == 0);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_add_images(bad, 0.0, &small, NULL, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_set_spot(bad, 0, spot, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_set_spot(bad, 5, spot, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_rig_calibration_add_corners(bad, 0.0, 720, 576, xy, xy, NULL, 3, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rig_calibration_add_corners(bad, 0.0, 360, 288, xy, xy, NULL, 4, NULL, NULL));

  /* A view without a board: the answer says so, and of nothing else is there any. */
  CHECK_OK(ptzcal_rig_calibration_solve(bad, &found, NULL));
  CHECK_OK(ptzcal_rig_view_init(&seen, sizeof seen));
  CHECK_OK(ptzcal_rig_calibrated_get_view(found, 0, &seen, NULL));
  CHECK(seen.status == PTZCAL_STATUS_NOT_FOUND && seen.corners == 0 && seen.has_pose == 0);
  CHECK(strstr(ptzcal_rig_calibrated_view_reason(found, 0), "no chessboard") != NULL);
  CHECK(*ptzcal_rig_calibrated_spot_reason(found, 0) == '\0' && *ptzcal_rig_calibrated_view_reason(found, 1) == '\0');
  CHECK_OK(ptzcal_zoom_position_init(&position, sizeof position));
  CHECK_OK(ptzcal_rig_calibrated_get_position(found, 0, &position, NULL));
  CHECK(position.status == PTZCAL_STATUS_NOT_FOUND && position.has_model == 0 && position.views_used == 0);
  CHECK(strstr(ptzcal_rig_calibrated_position_reason(found, 0), "no view") != NULL);
  CHECK_OK(ptzcal_rig_model_init(&model, sizeof model));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_rig_calibrated_get_rig_model(found, 0, &model, NULL, NULL));
  CHECK_OK(ptzcal_common_line_init(&line, sizeof line));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_rig_calibrated_get_common_line(found, &line, NULL));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_rig_calibrated_get_curve(found, &curve, NULL));
  CHECK(curve == NULL);
  ptzcal_rig_calibrated_free(found);
  ptzcal_rig_calibration_free(bad);
}

int main(int count, char **words)
{
  CHECK(count == 3);
  memset(pixels, 90, sizeof pixels);
  make_rig_views(&set, 0.2);
  CHECK_OK(ptzcal_rig_calibration_solve(set, &answer, NULL));
  /* The answer lives on its own. */
  ptzcal_rig_calibration_free(set);
  positions();
  views();
  curves(words[2]);
  bad_views();
  ptzcal_rig_calibrated_free(answer);
  ptzcal_rig_calibrated_free(NULL);
  ptzcal_rig_calibration_free(NULL);
  return 0;
}
