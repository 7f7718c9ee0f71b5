/* Cameras and laser lines from views of boards. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

static ptzcal_boards *boards;
static double board_xy[2 * FIXTURE_CORNERS], uv[2 * FIXTURE_CORNERS], spot[2];

static void a_camera(void)
{
  ptzcal_board_calibration *found;
  ptzcal_calibration *calibration;
  ptzcal_calibration_summary summary;
  ptzcal_camera camera, truth;
  ptzcal_board_view view;
  double covariance[121], bending[3];
  size_t needed, count;
  uint32_t v, i;
  CHECK_OK(ptzcal_calibrate_from_boards(boards, NULL, &found, NULL));
  CHECK_OK(ptzcal_board_calibration_copy_camera(found, &calibration, NULL));
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  CHECK_OK(ptzcal_calibration_get_camera(calibration, &camera, NULL));
  CHECK_OK(ptzcal_calibration_copy_covariance(calibration, covariance, 121, &needed, NULL));
  CHECK(needed == 121 && covariance[0] > 0.0 && covariance[5 * 11 + 5] == 0.0);
  CHECK_NEAR(camera.fx, 800.0, 4.0 * sqrt(covariance[0]));
  CHECK_NEAR(camera.cx, 360.0, 4.0 * sqrt(covariance[3 * 11 + 3]));
  CHECK(camera.translation[2] == 0.0 && camera.rotation[0] == 1.0);
  CHECK_OK(ptzcal_calibration_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_calibration_get_summary(calibration, &summary, NULL));
  CHECK(summary.measurements == FIXTURE_VIEWS * FIXTURE_CORNERS && summary.rms < 0.3);

  CHECK_OK(ptzcal_board_calibration_count(found, &count, NULL));
  CHECK(count == FIXTURE_VIEWS);
  CHECK_OK(ptzcal_board_view_init(&view, sizeof view));
  for (v = 0; v < FIXTURE_VIEWS; v++) {
    make_board_view(v, 0.0, &truth, board_xy, uv, spot);
    CHECK_OK(ptzcal_board_calibration_get_view(found, v, &view, NULL));
    CHECK(view.used == 1 && view.corners == FIXTURE_CORNERS && view.inliers > 15 && view.rms < 0.3);
    for (i = 0; i < 9; i++) CHECK_NEAR(view.rotation[i], truth.rotation[i], 0.03);
    CHECK_NEAR(view.translation[2], truth.translation[2], 0.03 * truth.translation[2]);
    for (i = 0; i < 6; i++) CHECK(view.covariance[7 * i] > 0.0);
  }
  taint(&view, sizeof view);
  CHECK_OK(ptzcal_board_view_init(&view, sizeof view));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_board_calibration_get_view(found, FIXTURE_VIEWS, &view, NULL));
  CHECK(view.corners == 0);
  CHECK_OK(ptzcal_board_calibration_get_bending(found, bending, NULL));
  CHECK(bending[0] == 0.0 && bending[1] == 0.0 && bending[2] == 0.0);
  CHECK(strstr(ptzcal_board_calibration_advice(found), "no corners in") != NULL);
  CHECK(*ptzcal_board_calibration_advice(NULL) == '\0');

  /* Copies live on their own. */
  ptzcal_board_calibration_free(found);
  CHECK_OK(ptzcal_calibration_get_camera(calibration, &camera, NULL));
  ptzcal_calibration_free(calibration);
  ptzcal_board_calibration_free(NULL);
}

static void a_laser(void)
{
  ptzcal_calibration_options *options;
  ptzcal_laser_calibration *laser;
  ptzcal_board_calibration *posed;
  ptzcal_calibration *lens;
  ptzcal_camera camera;
  ptzcal_laser_line line;
  ptzcal_rig_model model;
  double residuals[2 * FIXTURE_VIEWS], sigma;
  uint8_t used[FIXTURE_VIEWS];
  size_t needed, i;
  CHECK_OK(ptzcal_laser_line_init(&line, sizeof line));
  CHECK_OK(ptzcal_rig_model_init(&model, sizeof model));
  CHECK_OK(ptzcal_calibrate_laser_line(boards, NULL, NULL, &laser, NULL));
  CHECK_OK(ptzcal_laser_calibration_get_line(laser, &line, NULL));
  CHECK_OK(ptzcal_laser_calibration_get_rig_model(laser, &model, NULL));
  CHECK(line.spots >= 5 && line.rms < 0.5);
  CHECK_NEAR(line.x0, 0.1, 4.0 * sqrt(line.covariance[0]));
  CHECK_NEAR(line.vy, 0.0, 4.0 * sqrt(line.covariance[3 * 8]));
  CHECK_NEAR(log(model.fx / 800.0), 0.0, 4.0 * sqrt(line.covariance[4 * 8]));
  CHECK(line.covariance[4 * 8] > 0.0 && line.covariance[4] == line.covariance[4 * 7] && line.covariance[4] != 0.0);
  CHECK(model.laser_x0 == line.x0 && model.width == 720 && model.pan_scale == 1.0);
  CHECK_OK(ptzcal_laser_calibration_copy_residuals(laser, residuals, 2 * FIXTURE_VIEWS, &needed, NULL));
  CHECK(needed == 2 * FIXTURE_VIEWS);
  CHECK_OK(ptzcal_laser_calibration_copy_inliers(laser, used, FIXTURE_VIEWS, &needed, NULL));
  for (i = 0; i < FIXTURE_VIEWS; i++) CHECK(used[i] == 0 || fabs(residuals[2 * i]) < 1.0);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_laser_calibration_copy_inliers(laser, used, 1, &needed, NULL));
  CHECK(needed == FIXTURE_VIEWS);
  sigma = line.covariance[0];
  CHECK_OK(ptzcal_laser_calibration_copy_boards(laser, &posed, NULL));
  ptzcal_laser_calibration_free(laser);

  /* The lens measured before, and known exactly: the line gets surer. */
  CHECK_OK(ptzcal_board_calibration_copy_camera(posed, &lens, NULL));
  ptzcal_board_calibration_free(posed);
  CHECK_OK(ptzcal_calibrate_laser_line(boards, lens, NULL, &laser, NULL));
  CHECK_OK(ptzcal_laser_calibration_get_line(laser, &line, NULL));
  CHECK(line.covariance[0] <= 1.01 * sigma);
  ptzcal_laser_calibration_free(laser);
  CHECK_OK(ptzcal_calibration_options_new(&options, NULL));
  make_rig_model(&model);
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  CHECK_OK(ptzcal_rig_model_head_camera(&model, 0.0, 0.0, &camera, NULL));
  CHECK_OK(ptzcal_calibration_options_set_lens(options, &camera, NULL));
  CHECK_OK(ptzcal_calibrate_laser_line(boards, NULL, options, &laser, NULL));
  CHECK_OK(ptzcal_laser_calibration_get_line(laser, &line, NULL));
  CHECK(line.covariance[0] <= sigma && line.covariance[4 * 8] == 0.0);
  ptzcal_laser_calibration_free(laser);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibrate_laser_line(boards, lens, options, &laser, NULL));
  CHECK(laser == NULL);
  ptzcal_calibration_free(lens);
  ptzcal_calibration_options_free(options);
  ptzcal_laser_calibration_free(NULL);
}

static void bad_views(void)
{
  ptzcal_boards *set, *none;
  ptzcal_board_calibration *found;
  ptzcal_laser_calibration *laser;
  ptzcal_camera pose;
  ptzcal_error *error;
  double covariance[3 * FIXTURE_CORNERS] = {0};
  size_t count, i;
  uint32_t v;
  none = boards;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_boards_new(0, 576, &none, NULL));
  CHECK(none == NULL);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_boards_new(720, 65537, &none, NULL));
  CHECK_OK(ptzcal_boards_new(720, 576, &set, NULL));
  make_board_view(0, 0.0, &pose, board_xy, uv, spot);
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_boards_add_view(set, board_xy, uv, NULL, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_boards_add_view(set, board_xy, uv, NULL, 3, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_boards_add_view(set, board_xy, uv, NULL, 5, NULL)); /* one row */
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_boards_add_view(set, board_xy, uv, NULL, 6, NULL)); /* and one */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_boards_add_view(set, board_xy, uv, covariance, FIXTURE_CORNERS, NULL));
  uv[9] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_boards_add_view(set, board_xy, uv, NULL, FIXTURE_CORNERS, &error));
  CHECK(ptzcal_error_index(error) == 4);
  ptzcal_error_free(error);
  CHECK_OK(ptzcal_boards_count(set, &count, NULL));
  CHECK(count == 0);

  /* None; one that is all alone; boards that are parallel; no spots. */
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_calibrate_from_boards(set, NULL, &found, NULL));
  CHECK(found == NULL);
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_calibrate_laser_line(set, NULL, NULL, &laser, NULL));
  CHECK(laser == NULL);
  for (v = 0; v < 3; v++) {
    for (i = 0; i < FIXTURE_CORNERS; i++) {
      uv[2 * i] = 360.0 + 800.0 * (board_xy[2 * i] + 0.1 * v) / (1.0 + v);
      uv[2 * i + 1] = 288.0 + 800.0 * board_xy[2 * i + 1] / (1.0 + v);
    }
    CHECK_OK(ptzcal_boards_add_view(set, board_xy, uv, NULL, FIXTURE_CORNERS, NULL));
    CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_calibrate_from_boards(set, NULL, &found, &error));
    CHECK(found == NULL && strstr(ptzcal_error_hint(error), "tilted") != NULL);
    ptzcal_error_free(error);
  }
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_calibrate_laser_line(set, NULL, NULL, &laser, NULL));

  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_boards_set_spot(set, 3, spot, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_boards_set_spot(set, 0, spot, covariance, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_boards_set_bending(set, -0.1, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_boards_set_bending(set, INFINITY, NULL));
  CHECK_OK(ptzcal_boards_set_bending(set, 0.0, NULL));
  ptzcal_boards_free(set);
  ptzcal_boards_free(NULL);
}

/* A view whose corners were paired in mirrored order is named. */
static void a_mirrored_view(void)
{
  ptzcal_boards *set;
  ptzcal_board_calibration *found;
  ptzcal_camera pose;
  ptzcal_error *error;
  uint32_t v;
  size_t i;
  CHECK_OK(ptzcal_boards_new(720, 576, &set, NULL));
  for (v = 0; v < FIXTURE_VIEWS; v++) {
    make_board_view(v, 0.1, &pose, board_xy, uv, spot);
    for (i = 0; i < FIXTURE_CORNERS; i++)
      if (v == 2) board_xy[2 * i] = -board_xy[2 * i];
    CHECK_OK(ptzcal_boards_add_view(set, board_xy, uv, NULL, FIXTURE_CORNERS, NULL));
  }
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibrate_from_boards(set, NULL, &found, &error));
  CHECK(strstr(ptzcal_error_message(error), "view 2 is mirrored") != NULL);
  ptzcal_error_free(error);
  ptzcal_boards_free(set);
}

int main(void)
{
  make_boards(&boards, 0.2);
  a_camera();
  a_laser();
  bad_views();
  a_mirrored_view();
  ptzcal_boards_free(boards);
  return 0;
}
