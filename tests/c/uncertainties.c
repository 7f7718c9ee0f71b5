/* Projection and back-projection of a calibration, with covariances. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

static void there_and_back(void)
{
  ptzcal_camera camera;
  double xyz[6] = {0.1, 0.2, 3, -0.4, -0.1, 2}, uv[4], plain[4], noise[6], wider[6], of_xyz[18] = {0};
  double directions[6], of_ray[72], centre[3], of_uv[6] = {1, 0.2, 2, 1, 0, 1}, parameters[121];
  size_t i, k;
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  CHECK_OK(ptzcal_calibration_get_camera(fixture_calibration, &camera, NULL));
  CHECK_OK(ptzcal_camera_project(&camera, xyz, 2, plain, NULL));
  CHECK_OK(ptzcal_calibration_project(fixture_calibration, xyz, NULL, 2, uv, noise, NULL));
  for (i = 0; i < 4; i++) CHECK_NEAR(uv[i], plain[i], 1e-9);
  for (i = 0; i < 2; i++) CHECK(noise[3 * i] > 0 && noise[3 * i + 2] > 0 && noise[3 * i] < 1 && noise[3 * i + 2] < 1);
  of_xyz[0] = of_xyz[4] = of_xyz[8] = 1e-4; /* 1 cm in each axis of the first point */
  CHECK_OK(ptzcal_calibration_project(fixture_calibration, xyz, of_xyz, 2, uv, wider, NULL));
  /* 1 cm at 3.6 m and 845 px. */
  CHECK_NEAR(sqrt(wider[0] - noise[0]), 2.2, 0.4);
  for (i = 3; i < 6; i++) CHECK_NEAR(wider[i], noise[i], 0.0);

  CHECK_OK(ptzcal_calibration_back_project(fixture_calibration, uv, of_uv, 2, directions, of_ray, NULL));
  CHECK_OK(ptzcal_camera_centre(&camera, centre, NULL));
  CHECK_OK(ptzcal_calibration_copy_covariance(fixture_calibration, parameters, 121, NULL, NULL));
  for (i = 0; i < 2; i++) {
    double along = 0, length = 0;
    for (k = 0; k < 3; k++) {
      along += directions[3 * i + k] * (xyz[3 * i + k] - centre[k]);
      length += pow(xyz[3 * i + k] - centre[k], 2);
    }
    CHECK_NEAR(along, sqrt(length), 1e-9);
    for (k = 0; k < 3; k++) CHECK_NEAR(of_ray[36 * i + 7 * k], parameters[12 * (8 + k)], 1e-12);
    for (k = 0; k < 36; k++) CHECK_NEAR(of_ray[36 * i + k], of_ray[36 * i + k % 6 * 6 + k / 6], 0.0);
  }
  /* What is not asked for. */
  CHECK_OK(ptzcal_calibration_project(fixture_calibration, xyz, NULL, 2, uv, NULL, NULL));
  CHECK_OK(ptzcal_calibration_back_project(fixture_calibration, uv, NULL, 2, directions, NULL, NULL));
  CHECK_OK(ptzcal_calibration_project(fixture_calibration, NULL, NULL, 0, NULL, NULL, NULL));
  CHECK_OK(ptzcal_calibration_back_project(fixture_calibration, NULL, NULL, 0, NULL, NULL, NULL));
}

static void clicks(void)
{
  const double floor_normal[3] = {0, 2, 0}; /* y = 1.2, below the camera */
  double uv[4] = {300, 500, 500, 550}, of_uv[6] = {1, 0, 1, 1, 0, 1}, xyz[6], exact[18], noisy[18], back[4];
  size_t i;
  CHECK_OK(ptzcal_calibration_back_project_to_plane(fixture_calibration, uv, NULL, 2, floor_normal, 2.4, xyz, exact, NULL));
  CHECK_OK(ptzcal_calibration_back_project_to_plane(fixture_calibration, uv, of_uv, 2, floor_normal, 2.4, xyz, noisy, NULL));
  CHECK_OK(ptzcal_calibration_project(fixture_calibration, xyz, NULL, 2, back, NULL, NULL));
  for (i = 0; i < 4; i++) CHECK_NEAR(back[i], uv[i], 1e-8);
  for (i = 0; i < 2; i++) {
    CHECK_NEAR(xyz[3 * i + 1], 1.2, 1e-12);
    CHECK(exact[9 * i] > 0 && noisy[9 * i] > exact[9 * i] && noisy[9 * i + 8] > exact[9 * i + 8]);
    CHECK_NEAR(noisy[9 * i + 4], 0.0, 1e-15); /* nothing varies across the plane */
  }
  CHECK_OK(ptzcal_calibration_back_project_to_plane(fixture_calibration, uv, NULL, 2, floor_normal, 2.4, xyz, NULL, NULL));
}

static void what_cannot_be(void)
{
  ptzcal_error *error = NULL;
  const double normal[3] = {0, 1, 0}, none[3] = {0, 0, 0};
  double xyz[6] = {0, 0, 3, 0, 0, -5}, uv[4] = {300, 500, 300, -1e5}, out[6], covariance[72], bad[36] = {0};
  taint(out, sizeof out);
  taint(covariance, sizeof covariance);
  CHECK_STATUS(PTZCAL_STATUS_BEHIND_CAMERA,
               ptzcal_calibration_project(fixture_calibration, xyz, NULL, 2, out, covariance, &error));
  CHECK(ptzcal_error_index(error) == 1);
  ptzcal_error_free(error);
  /* Upwards the floor is never met. */
  CHECK_STATUS(PTZCAL_STATUS_BEHIND_CAMERA,
               ptzcal_calibration_back_project_to_plane(fixture_calibration, uv, NULL, 2, normal, 1.2, out, covariance, &error));
  CHECK(ptzcal_error_index(error) == 1);
  ptzcal_error_free(error);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_calibration_back_project_to_plane(fixture_calibration, uv, NULL, 1, none, 1.2, out, covariance, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE,
               ptzcal_calibration_back_project_to_plane(fixture_calibration, uv, NULL, 1, normal, NAN, out, covariance, NULL));
  xyz[5] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE,
               ptzcal_calibration_project(fixture_calibration, xyz, NULL, 2, out, covariance, NULL));
  xyz[5] = 3;
  bad[9] = -1;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_calibration_project(fixture_calibration, xyz, bad, 2, out, covariance, NULL));
  bad[9] = 1, bad[10] = 0.5; /* not symmetric */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_calibration_project(fixture_calibration, xyz, bad, 2, out, covariance, NULL));
  bad[0] = 1, bad[1] = 2, bad[2] = 1; /* indefinite */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_calibration_back_project(fixture_calibration, uv, bad, 1, out, covariance, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibration_back_project_to_plane(
                                                   fixture_calibration, uv, bad, 1, normal, 1.2, out, covariance, NULL));
  uv[0] = INFINITY;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE,
               ptzcal_calibration_back_project(fixture_calibration, uv, NULL, 1, out, covariance, NULL));
  CHECK(is_tainted(out, sizeof out) && is_tainted(covariance, sizeof covariance));
}

int main(void)
{
  make_fixtures();
  there_and_back();
  clicks();
  what_cannot_be();
  free_fixtures();
  return 0;
}
