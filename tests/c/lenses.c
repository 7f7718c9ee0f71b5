/* Lens models: the fisheye lens, and the two linear methods with the division model. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define N FIXTURE_POINTS

static double xyz[3 * N], uv[2 * N];

static void a_fisheye_lens_sees_beyond_90_degrees(void)
{
  const double k[4] = {-0.01, 0.02, -0.015, 0.003};
  const double beside[3] = {2.0, 0.0, -0.2}, behind[3] = {0.0, 0.0, -1.0};
  double theta = atan2(2.0, -0.2), radius = theta, power = theta, pixel[2], ray[3];
  ptzcal_camera camera;
  int i;

  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  camera.width = 800;
  camera.height = 600;
  camera.fx = camera.fy = 200.0;
  camera.cx = 400.0;
  camera.cy = 300.0;
  camera.distortion_model = PTZCAL_DISTORTION_MODEL_FISHEYE;
  memcpy(camera.distortion, k, sizeof k);
  for (i = 0; i < 4; i++) {
    power *= theta * theta;
    radius += k[i] * power;
  }
  CHECK_OK(ptzcal_camera_project(&camera, beside, 1, pixel, NULL));
  CHECK_NEAR(pixel[0], 400.0 + 200.0 * radius, 1e-9);
  CHECK_NEAR(pixel[1], 300.0, 1e-9);
  CHECK_OK(ptzcal_camera_back_project(&camera, pixel, 1, ray, NULL));
  CHECK_NEAR(ray[0], sin(theta), 1e-12);
  CHECK_NEAR(ray[2], cos(theta), 1e-12);
  CHECK_STATUS(PTZCAL_STATUS_BEHIND_CAMERA, ptzcal_camera_project(&camera, behind, 1, pixel, NULL));
  pixel[0] = 1e6;
  CHECK_STATUS(PTZCAL_STATUS_OUTSIDE_LENS, ptzcal_camera_back_project(&camera, pixel, 1, ray, NULL));
  camera.distortion[4] = 0.1; /* not a coefficient of this model */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_camera_project(&camera, beside, 1, pixel, NULL));
}

static void a_fisheye_lens_is_fitted(void)
{
  ptzcal_correspondences *set;
  ptzcal_calibration_options *options;
  ptzcal_calibration *result;
  ptzcal_calibration_summary summary;
  ptzcal_camera truth, found;

  make_camera(&truth);
  truth.distortion_model = PTZCAL_DISTORTION_MODEL_FISHEYE;
  truth.distortion[0] = -0.02;
  truth.fx = truth.fy = 900.0;
  make_points(&truth, xyz, uv, N, 0.1);
  CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
  CHECK_OK(ptzcal_correspondences_add_points(set, xyz, uv, N, NULL));
  CHECK_OK(ptzcal_calibration_options_new(&options, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibration_options_set_distortion(options, 6, NULL));
  CHECK_OK(ptzcal_calibration_options_set_lens(options, &truth, NULL));
  CHECK_OK(ptzcal_calibrate_camera(set, options, &result, NULL));
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_calibration_get_camera(result, &found, NULL));
  CHECK(found.distortion_model == PTZCAL_DISTORTION_MODEL_FISHEYE && found.distortion[0] == -0.02);
  CHECK_OK(ptzcal_calibration_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_calibration_get_summary(result, &summary, NULL));
  CHECK(summary.parameters == 15 && summary.rms < 0.2);
  ptzcal_calibration_free(result);
  ptzcal_calibration_options_free(options);
  ptzcal_correspondences_free(set);
}

typedef ptzcal_status (*linear_method)(const ptzcal_correspondences *, const double *, ptzcal_camera *,
                                       ptzcal_error **);

static void linear(linear_method method, size_t fewest, double within)
{
  const double nowhere[2] = {410.0, NAN};
  double centre[2], wall[3 * N];
  ptzcal_correspondences *set;
  ptzcal_camera truth, found, before;
  ptzcal_error *error = NULL;
  size_t i;

  make_camera(&truth);
  truth.fy = truth.fx;
  truth.distortion_model = PTZCAL_DISTORTION_MODEL_DIVISION;
  truth.distortion[0] = -0.2;
  make_points(&truth, xyz, uv, N, 0.05);
  centre[0] = truth.cx;
  centre[1] = truth.cy;
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  before = found;
  CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
  CHECK_OK(ptzcal_correspondences_add_points(set, xyz, uv, fewest - 1, NULL));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, method(set, centre, &found, &error));
  CHECK(strlen(ptzcal_error_hint(error)) > 0);
  ptzcal_error_free(error);
  CHECK_OK(ptzcal_correspondences_add_points(set, xyz + 3 * (fewest - 1), uv + 2 * (fewest - 1), N - fewest + 1, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, method(set, nowhere, &found, NULL));
  CHECK(memcmp(&found, &before, sizeof found) == 0);

  CHECK_OK(method(set, centre, &found, NULL));
  CHECK(found.width == 800 && found.distortion_model == PTZCAL_DISTORTION_MODEL_DIVISION);
  CHECK_NEAR(found.distortion[0], -0.2, within);
  CHECK_NEAR(found.fx, truth.fx, 200 * within);
  /* The image's centre is not the centre of distortion here, but near it. */
  CHECK_OK(method(set, NULL, &found, NULL));
  CHECK_NEAR(found.distortion[0], -0.2, 0.1);
  ptzcal_correspondences_free(set);

  /* A wall. */
  CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
  for (i = 0; i < N; i++) {
    memcpy(wall + 3 * i, xyz + 3 * i, 2 * sizeof *wall);
    wall[3 * i + 2] = 3.0;
  }
  CHECK_OK(ptzcal_camera_project(&truth, wall, N, uv, NULL));
  CHECK_OK(ptzcal_correspondences_add_points(set, wall, uv, N, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, method(set, centre, &found, NULL));
  ptzcal_correspondences_free(set);
}

int main(void)
{
  a_fisheye_lens_sees_beyond_90_degrees();
  a_fisheye_lens_is_fitted();
  linear(ptzcal_radial_alignment, 7, 0.01);
  linear(ptzcal_division_eigenproblem, 6, 0.05);
  return 0;
}
