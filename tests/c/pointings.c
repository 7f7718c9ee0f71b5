/* Pointing: a fixed camera's pixel as pan and tilt, and back; every refusal. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

static const double down[3] = {0, 2, 0}; /* y = 1.2, below camera and rig */

static void head_sees(const ptzcal_aim *aim, double *uv)
{
  ptzcal_camera head;
  CHECK_OK(ptzcal_camera_init(&head, sizeof head));
  CHECK_OK(ptzcal_rig_model_head_camera(fixture_rig_model, aim->pan, aim->tilt, &head, NULL));
  CHECK_OK(ptzcal_camera_project(&head, aim->point, 1, uv, NULL));
}

static void there_and_back(ptzcal_pointing *pointing)
{
  const double of_uv[3] = {1, 0, 1};
  ptzcal_aim aim;
  ptzcal_located located;
  double uv[2] = {300, 520}, seen[2], exact, axes[2], angle;
  CHECK_OK(ptzcal_aim_init(&aim, sizeof aim));
  CHECK_OK(ptzcal_located_init(&located, sizeof located));
  CHECK_OK(ptzcal_pointing_set_plane(pointing, down, 2.4, NULL, PTZCAL_MEASURED_BY_OTHERS, NULL));
  CHECK_OK(ptzcal_pointing_aim(pointing, uv, NULL, 0.95, 0.0, &aim, NULL));
  CHECK_NEAR(aim.point[1], 1.2, 1e-9);
  CHECK(aim.has_zoom == 0 && aim.edge == 0 && aim.distance > 1.0 && aim.probability > 0.999);
  /* The picture's centre. */
  head_sees(&aim, seen);
  CHECK_NEAR(seen[0], 359.5, 1e-6);
  CHECK_NEAR(seen[1], 287.5, 1e-6);
  CHECK_NEAR(aim.uv[0], 359.5, 1e-6);
  exact = aim.uv_covariance[0];
  CHECK_OK(ptzcal_pointing_aim(pointing, uv, of_uv, 0.95, 0.0, &aim, NULL));
  CHECK(aim.uv_covariance[0] > exact && exact > 0.0);
  CHECK_OK(ptzcal_ellipse(aim.uv_covariance, 0.95, axes, &angle, NULL));
  CHECK(axes[0] >= axes[1] && axes[1] > 0.0 && angle >= -1.6 && angle <= 1.6);
  /* A target larger than the picture is not held by it. */
  CHECK_OK(ptzcal_pointing_aim(pointing, uv, of_uv, 0.95, 20.0, &aim, NULL));
  CHECK_NEAR(aim.probability, 0.0, 0.0);

  CHECK_OK(ptzcal_pointing_locate(pointing, aim.pan, aim.tilt, 0.0, aim.uv, NULL, &located, NULL));
  CHECK_NEAR(located.uv[0], uv[0], 1e-6);
  CHECK_NEAR(located.uv[1], uv[1], 1e-6);
  CHECK_NEAR(located.point[1], 1.2, 1e-9);
  CHECK(located.hidden == 0 && located.uv_covariance[0] > 0.0);

  CHECK_OK(ptzcal_pointing_set_distance(pointing, 3.0, 0.1, NULL));
  CHECK_OK(ptzcal_pointing_aim(pointing, uv, NULL, 0.95, 0.0, &aim, NULL));
  CHECK_NEAR(aim.distance, 3.0, 1e-9);
}

static void on_a_cloud(ptzcal_pointing *pointing)
{
  static double xyz[41 * 41 * 3], covariances[41 * 41 * 9];
  const double uv[2] = {400, 300}, high[2] = {400, 180};
  double line[12];
  ptzcal_aim aim;
  size_t i;
  for (i = 0; i < 41 * 41; i++) { /* a wall at z = 3, sampled every 5 cm */
    xyz[3 * i] = -1.0 + 0.05 * (double)(i % 41);
    xyz[3 * i + 1] = -1.0 + 0.05 * (double)(i / 41);
    xyz[3 * i + 2] = 3.0;
    covariances[9 * i] = covariances[9 * i + 4] = covariances[9 * i + 8] = 1e-6;
  }
  CHECK_OK(ptzcal_aim_init(&aim, sizeof aim));
  CHECK_OK(ptzcal_pointing_set_cloud(pointing, xyz, covariances, 41 * 41, PTZCAL_MEASURED_BY_OTHERS, NULL));
  CHECK_OK(ptzcal_pointing_aim(pointing, uv, NULL, 0.95, 0.0, &aim, NULL));
  CHECK_NEAR(aim.point[2], 3.0, 1e-6);
  CHECK(aim.edge == 0);
  CHECK_OK(ptzcal_pointing_set_cloud(pointing, xyz, NULL, 41 * 41, PTZCAL_MEASURED_BY_THIS_RIG, NULL));
  CHECK_OK(ptzcal_pointing_aim(pointing, uv, NULL, 0.95, 0.0, &aim, NULL));
  CHECK_NEAR(aim.point[2], 3.0, 1e-6);
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_pointing_set_cloud(pointing, xyz, NULL, 1, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_pointing_set_cloud(pointing, NULL, NULL, 0, 0, NULL));
  xyz[5] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_pointing_set_cloud(pointing, xyz, NULL, 41 * 41, 0, NULL));
  xyz[5] = 3.0;
  covariances[9] = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_set_cloud(pointing, xyz, covariances, 41 * 41, 0, NULL));
  covariances[9] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_pointing_set_cloud(pointing, xyz, covariances, 41 * 41, 0, NULL));
  covariances[9] = 1e-6;
  /* Every point twice is no harm; all in one place is no surface, and neither are four in a line. */
  for (i = 0; i < 41 * 20; i++) memcpy(xyz + 3 * (41 * 20 + i), xyz + 3 * i, 3 * sizeof *xyz);
  CHECK_OK(ptzcal_pointing_set_cloud(pointing, xyz, NULL, 41 * 40, 0, NULL));
  CHECK_OK(ptzcal_pointing_aim(pointing, high, NULL, 0.95, 0.0, &aim, NULL));
  CHECK_NEAR(aim.point[2], 3.0, 1e-6);
  for (i = 0; i < 12; i++) line[i] = i % 3 == 2 ? 3.0 : 0.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_set_cloud(pointing, line, NULL, 4, 0, NULL));
  for (i = 0; i < 4; i++) line[3 * i] = 0.01 * (double)i;
  CHECK_OK(ptzcal_pointing_set_cloud(pointing, line, NULL, 4, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_pointing_aim(pointing, uv, NULL, 0.95, 0.0, &aim, NULL));
  /* Nothing of the wall is near this ray. */
  for (i = 0; i < 41 * 41; i++) xyz[3 * i] += 50.0;
  CHECK_OK(ptzcal_pointing_set_cloud(pointing, xyz, NULL, 41 * 41, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_pointing_aim(pointing, uv, NULL, 0.95, 0.0, &aim, NULL));
}

static void depth_unknown(ptzcal_pointing *pointing)
{
  const double uv[2] = {420, 310};
  double curve[6 * 300], steps[2 * 300], places[6 * 65];
  ptzcal_sweep *sweep;
  ptzcal_sweep_summary summary;
  size_t n, i;
  CHECK_OK(ptzcal_sweep_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_pointing_sweep(pointing, uv, NULL, 1.5, INFINITY, 0.95, 0.2, &sweep, NULL));
  CHECK_OK(ptzcal_sweep_get_summary(sweep, &summary, NULL));
  CHECK_OK(ptzcal_sweep_copy_curve(sweep, curve, 6 * 300, &n, NULL));
  CHECK(n == 6 * summary.points && summary.points >= 17 && summary.has_zoom == 0);
  CHECK_NEAR(curve[0], 1.5, 1e-9);
  for (i = 0; i < n; i += 6) {
    CHECK(curve[i + 1] >= summary.pan_min && curve[i + 1] <= summary.pan_max);
    CHECK(curve[i + 2] >= summary.tilt_min && curve[i + 2] <= summary.tilt_max);
  }
  CHECK_OK(ptzcal_sweep_copy_steps(sweep, steps, 2 * 300, &n, NULL));
  CHECK(n == 2 * summary.steps && summary.steps >= 1);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_sweep_copy_steps(sweep, steps, 1, &n, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_sweep_copy_curve(sweep, NULL, 0, &n, NULL));
  ptzcal_sweep_free(sweep);
  CHECK_OK(ptzcal_pointing_copy_located_along(pointing, 0.0, 0.0, 0.0, uv, NULL, 2.0, 20.0, places, 6 * 65, &n, NULL));
  CHECK(n >= 6 && n % 6 == 0 && places[0] >= 2.0);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_sweep(pointing, uv, NULL, 0.0, 5.0, 0.95, 0.0, &sweep, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_sweep(pointing, uv, NULL, 5.0, 4.0, 0.95, 0.0, &sweep, NULL));
  CHECK(sweep == NULL);
}

static void what_cannot_be(ptzcal_pointing *pointing)
{
  const double sky[2] = {400, 20}, outside[2] = {400, 700}, good[2] = {300, 520}, bad[3] = {1, 2, 1};
  const double none[3] = {0, 0, 0}, nowhere[2] = {400, NAN};
  double axes[2], angle;
  ptzcal_pointing *fresh;
  ptzcal_error *error = NULL;
  ptzcal_aim aim;
  CHECK_OK(ptzcal_aim_init(&aim, sizeof aim));
  CHECK_OK(ptzcal_pointing_new(fixture_calibration, fixture_rig_model, &fresh, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_pointing_aim(fresh, good, NULL, 0.95, 0.0, &aim, NULL));
  ptzcal_pointing_free(fresh);
  CHECK_OK(ptzcal_pointing_set_plane(pointing, down, 2.4, NULL, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_pointing_aim(pointing, nowhere, NULL, 0.95, 0.0, &aim, NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNREACHABLE, ptzcal_pointing_aim(pointing, sky, NULL, 0.95, 0.0, &aim, &error));
  CHECK(strstr(ptzcal_error_message(error), "horizon") != NULL);
  ptzcal_error_free(error);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_aim(pointing, outside, NULL, 0.95, 0.0, &aim, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_aim(pointing, good, bad, 0.95, 0.0, &aim, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_aim(pointing, good, NULL, 1.0, 0.0, &aim, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_aim(pointing, good, NULL, 0.5, -1.0, &aim, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_set_plane(pointing, none, 1.0, NULL, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_set_plane(pointing, down, 1.0, NULL, 7, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_set_distance(pointing, -1.0, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_set_reach(pointing, 1.0, -1.0, 0.0, 1.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pointing_set_head_deviation(pointing, -1.0, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_ellipse(bad, 0.95, axes, &angle, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_pointing_new_adjusted(fixture_adjusted, 9, 0, &fresh, NULL));
  CHECK(fresh == NULL);
  /* Out of the head's reach. */
  CHECK_OK(ptzcal_pointing_set_reach(pointing, 1.0, 1.2, -0.1, 0.1, NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNREACHABLE, ptzcal_pointing_aim(pointing, good, NULL, 0.95, 0.0, &aim, NULL));
}

int main(void)
{
  ptzcal_pointing *pointing, *adjusted;
  ptzcal_pose pose;
  double rig[225] = {0};
  make_fixtures();
  CHECK_OK(ptzcal_pointing_new(fixture_calibration, fixture_rig_model, &pointing, NULL));
  CHECK_OK(ptzcal_pointing_set_rig_covariance(pointing, rig, NULL));
  CHECK_OK(ptzcal_pointing_set_head_deviation(pointing, 1e-4, 1e-4, NULL));
  CHECK_OK(ptzcal_pose_init(&pose, sizeof pose));
  CHECK_OK(ptzcal_pointing_set_station(pointing, &pose, NULL, NULL));
  there_and_back(pointing);
  on_a_cloud(pointing);
  depth_unknown(pointing);
  what_cannot_be(pointing);
  ptzcal_pointing_free(pointing);
  CHECK_OK(ptzcal_pointing_new_adjusted(fixture_adjusted, 0, 0, &adjusted, NULL));
  ptzcal_pointing_free(adjusted);
  free_fixtures();
  return 0;
}
