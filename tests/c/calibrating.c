/* Calibration: a known camera is found again; sets that cannot tell are refused. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define N FIXTURE_POINTS

static double xyz[3 * N], uv[2 * N];

static ptzcal_status calibrate_set(const double *points, const double *pixels, size_t n,
                                   const ptzcal_calibration_options *options, ptzcal_calibration **result,
                                   ptzcal_error **error)
{
  ptzcal_correspondences *set;
  ptzcal_status status;
  CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
  CHECK_OK(ptzcal_correspondences_add_points(set, points, pixels, n, NULL));
  status = ptzcal_calibrate_camera(set, options, result, error);
  ptzcal_correspondences_free(set);
  CHECK((status == PTZCAL_STATUS_OK) == (*result != NULL));
  return status;
}

static void refused(ptzcal_status wanted, const double *points, const double *pixels, size_t n)
{
  ptzcal_error *error = NULL;
  ptzcal_calibration *result = (ptzcal_calibration *)(void *)xyz;
  CHECK_STATUS(wanted, calibrate_set(points, pixels, n, NULL, &result, &error));
  CHECK(strlen(ptzcal_error_hint(error)) > 0);
  ptzcal_error_free(error);
}

static void a_known_camera_is_found(void)
{
  ptzcal_camera truth, found;
  ptzcal_calibration *result;
  ptzcal_calibration_summary summary;
  double centre[3], covariance[11 * 11], residuals[2 * N];
  uint8_t inliers[N];
  size_t needed = 0, i;

  make_camera(&truth);
  make_points(&truth, xyz, uv, N, 0.3);
  uv[2 * 5] += 60.0; /* one gross outlier */
  CHECK_OK(calibrate_set(xyz, uv, N, NULL, &result, NULL));

  CHECK_OK(ptzcal_calibration_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_calibration_get_summary(result, &summary, NULL));
  CHECK(summary.measurements == N && summary.parameters == 11 && summary.inliers >= N - 6 && summary.inliers < N);
  CHECK(summary.rms > 0.1 && summary.rms < 0.5 && summary.condition >= 1.0 && summary.iterations > 0);

  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_calibration_get_camera(result, &found, NULL));
  CHECK(found.width == 800 && found.height == 600 && found.struct_size == sizeof found);
  CHECK_OK(ptzcal_camera_centre(&found, centre, NULL));

  /* The buffer protocol. */
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_calibration_copy_covariance(result, NULL, 0, &needed, NULL));
  CHECK(needed == 121);
  taint(covariance, sizeof covariance);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL,
               ptzcal_calibration_copy_covariance(result, covariance, 120, &needed, NULL));
  CHECK(is_tainted(covariance, sizeof covariance));
  CHECK_OK(ptzcal_calibration_copy_covariance(result, covariance, 121, NULL, NULL));
  for (i = 0; i < 121; i++) CHECK_NEAR(covariance[i], covariance[i % 11 * 11 + i / 11], 1e-12);

  /* Every parameter within five of its own standard deviations of the truth. */
  CHECK_NEAR(found.fx, truth.fx, 5 * sqrt(covariance[0]));
  CHECK_NEAR(found.cx, truth.cx, 5 * sqrt(covariance[3 * 12]));
  CHECK_NEAR(found.cy, truth.cy, 5 * sqrt(covariance[4 * 12]));
  CHECK_NEAR(centre[0], 0.5, 5 * sqrt(covariance[8 * 12]));
  CHECK_NEAR(centre[1], -0.2, 5 * sqrt(covariance[9 * 12]));
  CHECK_NEAR(centre[2], -1.0, 5 * sqrt(covariance[10 * 12]));
  CHECK(sqrt(covariance[8 * 12]) < 0.05);

  CHECK_OK(ptzcal_calibration_copy_residuals(result, residuals, 2 * N, &needed, NULL));
  CHECK(needed == 2 * N);
  CHECK_NEAR(residuals[2 * 5], 60.0, 2.0);
  CHECK_OK(ptzcal_calibration_copy_inliers(result, inliers, N, &needed, NULL));
  CHECK(needed == N && inliers[5] == 0 && inliers[4] <= 1);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_calibration_copy_inliers(result, inliers, N - 1, &needed, NULL));
  ptzcal_calibration_free(result);
}

static void options(void)
{
  ptzcal_calibration_options *o;
  ptzcal_calibration *result, *again;
  ptzcal_camera truth, found, twin;
  make_camera(&truth);
  truth.distortion_model = PTZCAL_DISTORTION_MODEL_BROWN_CONRADY;
  truth.distortion[0] = -0.2;
  make_points(&truth, xyz, uv, N, 0.1);
  CHECK_OK(ptzcal_calibration_options_new(&o, NULL));
  CHECK_OK(ptzcal_calibration_options_set_distortion(o, PTZCAL_DISTORTION_MODEL_RADIAL1, NULL));
  CHECK_OK(ptzcal_calibration_options_set_pixel_sigma(o, 0.1, NULL));
  CHECK_OK(ptzcal_calibration_options_set_skew_sigma(o, 0.0, NULL));
  CHECK_OK(ptzcal_calibration_options_set_aspect_sigma(o, INFINITY, NULL));
  CHECK_OK(ptzcal_calibration_options_set_max_focal_deviation(o, INFINITY, NULL));
  CHECK_OK(ptzcal_calibration_options_set_seed(o, 99, NULL));
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_camera_init(&twin, sizeof twin));
  CHECK_OK(calibrate_set(xyz, uv, N, o, &result, NULL));
  CHECK_OK(calibrate_set(xyz, uv, N, o, &again, NULL));
  CHECK_OK(ptzcal_calibration_get_camera(result, &found, NULL));
  CHECK_OK(ptzcal_calibration_get_camera(again, &twin, NULL));
  CHECK(memcmp(&found, &twin, sizeof found) == 0); /* the same seed, the same bits */
  CHECK(found.distortion_model == PTZCAL_DISTORTION_MODEL_BROWN_CONRADY);
  CHECK_NEAR(found.skew, 0.0, 0.0);
  CHECK_NEAR(found.distortion[0], -0.2, 0.05);
  CHECK(found.distortion[1] == 0.0);
  ptzcal_calibration_free(result);
  ptzcal_calibration_free(again);

  /* A lens that is known: only the pose is found. */
  CHECK_OK(ptzcal_calibration_options_set_lens(o, &truth, NULL));
  CHECK_OK(ptzcal_calibration_options_set_robust(o, 0, NULL));
  CHECK_OK(ptzcal_calibration_options_set_max_iterations(o, 50, NULL));
  CHECK_OK(calibrate_set(xyz, uv, N, o, &result, NULL));
  CHECK_OK(ptzcal_calibration_get_camera(result, &found, NULL));
  CHECK(found.fx == truth.fx && found.distortion[0] == -0.2);
  CHECK_NEAR(found.translation[2], truth.translation[2], 0.01);
  ptzcal_calibration_free(result);

  /* What no option takes. */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibration_options_set_distortion(o, 6, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibration_options_set_distortion(o, UINT32_MAX, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibration_options_set_skew_sigma(o, -1.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_calibration_options_set_pixel_sigma(o, INFINITY, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibration_options_set_max_focal_deviation(o, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibration_options_set_max_iterations(o, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibration_options_set_max_iterations(o, UINT32_MAX, NULL));
  truth.fx = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_calibration_options_set_lens(o, &truth, NULL));
  ptzcal_calibration_options_free(o);
}

static void sets_that_cannot_tell(void)
{
  ptzcal_camera truth;
  double flat[3 * N], pixels[2 * N];
  size_t i;
  make_camera(&truth);
  make_points(&truth, xyz, uv, N, 0.3);
  refused(PTZCAL_STATUS_TOO_FEW_POINTS, xyz, uv, 0);
  refused(PTZCAL_STATUS_TOO_FEW_POINTS, xyz, uv, 5);

  for (i = 0; i < N; i++) { /* all points equal */
    memcpy(flat + 3 * i, xyz, 3 * sizeof *xyz);
    memcpy(pixels + 2 * i, uv, 2 * sizeof *uv);
  }
  refused(PTZCAL_STATUS_DEGENERATE, flat, pixels, N);

  for (i = 0; i < N; i++) { /* five points, again and again */
    memcpy(flat + 3 * i, xyz + 3 * (i % 5), 3 * sizeof *xyz);
    memcpy(pixels + 2 * i, uv + 2 * (i % 5), 2 * sizeof *uv);
  }
  {
    ptzcal_calibration *result;
    ptzcal_status status = calibrate_set(flat, pixels, N, NULL, &result, NULL);
    CHECK(status == PTZCAL_STATUS_DEGENERATE || status == PTZCAL_STATUS_TOO_FEW_POINTS);
  }

  for (i = 0; i < N; i++) { /* on a line */
    double s = (double)i / N;
    flat[3 * i] = -0.5 + s;
    flat[3 * i + 1] = 0.3 * s;
    flat[3 * i + 2] = 2.0 + s;
  }
  CHECK_OK(ptzcal_camera_project(&truth, flat, N, pixels, NULL));
  refused(PTZCAL_STATUS_DEGENERATE, flat, pixels, N);

  memcpy(flat, xyz, sizeof flat);
  for (i = 0; i < N; i++) flat[3 * i + 2] = 3.0; /* in a plane */
  CHECK_OK(ptzcal_camera_project(&truth, flat, N, pixels, NULL));
  refused(PTZCAL_STATUS_DEGENERATE, flat, pixels, N);

  memcpy(flat, xyz, sizeof flat);
  for (i = 0; i < N; i++) { /* all pixels equal */
    pixels[2 * i] = 400.0;
    pixels[2 * i + 1] = 300.0;
  }
  {
    ptzcal_calibration *result;
    ptzcal_status status = calibrate_set(flat, pixels, N, NULL, &result, NULL);
    CHECK(status <= PTZCAL_STATUS_TOO_FEW_POINTS && status > PTZCAL_STATUS_NOT_FOUND);
  }
}

/* Measured points twice, and some of them behind the camera, are no reason to fail. */
static void untidy_sets(void)
{
  ptzcal_camera truth, found;
  ptzcal_calibration *result;
  uint8_t inliers[2 * N];
  double points[6 * N], pixels[4 * N];
  size_t i;
  make_camera(&truth);
  make_points(&truth, xyz, uv, N, 0.3);
  memcpy(points, xyz, sizeof xyz);
  memcpy(points + 3 * N, xyz, sizeof xyz);
  memcpy(pixels, uv, sizeof uv);
  memcpy(pixels + 2 * N, uv, sizeof uv);
  for (i = 0; i < 5; i++) points[3 * i + 2] = -5.0; /* behind */
  CHECK_OK(calibrate_set(points, pixels, 2 * N, NULL, &result, NULL));
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_calibration_get_camera(result, &found, NULL));
  CHECK_NEAR(found.fx, truth.fx, 10.0);
  CHECK_OK(ptzcal_calibration_copy_inliers(result, inliers, 2 * N, NULL, NULL));
  for (i = 0; i < 5; i++) CHECK(inliers[i] == 0);
  ptzcal_calibration_free(result);
}

static void laser_shots(void)
{
  ptzcal_camera truth, head, found;
  ptzcal_correspondences *set;
  ptzcal_calibration *result;
  ptzcal_error *error = NULL;
  double pan_tilt[2 * N], spots[2 * N], pixels[2 * N], centre[3];
  const double noise[3] = {0.01, 0.0, 0.01};
  double noises[3 * N];
  uint32_t state = 3;
  size_t i;
  make_camera(&truth);
  make_rig_model(fixture_rig_model);
  CHECK_OK(ptzcal_camera_init(&head, sizeof head));
  for (i = 0; i < N; i++) {
    double depth = 3.0 + 1.5 * fixture_random(&state), beam[3], point[3];
    int k;
    pan_tilt[2 * i] = -0.15 + 0.25 * fixture_random(&state);
    pan_tilt[2 * i + 1] = 0.2 * fixture_random(&state);
    /* The laser's point in the head frame, and from there to the world: x_w = R^T (x_h - t). */
    beam[0] = fixture_rig_model->laser_x0;
    beam[1] = fixture_rig_model->laser_y0;
    beam[2] = depth;
    CHECK_OK(ptzcal_rig_model_head_camera(fixture_rig_model, pan_tilt[2 * i], pan_tilt[2 * i + 1], &head, NULL));
    for (k = 0; k < 3; k++)
      point[k] = head.rotation[k] * (beam[0] - head.translation[0]) + head.rotation[3 + k] * (beam[1] - head.translation[1]) +
                 head.rotation[6 + k] * (beam[2] - head.translation[2]);
    CHECK_OK(ptzcal_camera_project(&head, point, 1, spots + 2 * i, NULL));
    CHECK_OK(ptzcal_camera_project(&truth, point, 1, pixels + 2 * i, NULL));
    for (k = 0; k < 2; k++) {
      spots[2 * i + k] += 0.1 * fixture_random(&state);
      pixels[2 * i + k] += 0.1 * fixture_random(&state);
    }
    memcpy(noises + 3 * i, noise, sizeof noise);
  }
  CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
  CHECK_OK(ptzcal_correspondences_add_laser_shots(set, fixture_rig_model, pan_tilt, spots, noises, pixels, noises, N, NULL));
  CHECK_OK(ptzcal_calibrate_camera(set, NULL, &result, &error));
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_calibration_get_camera(result, &found, NULL));
  CHECK_OK(ptzcal_camera_centre(&found, centre, NULL));
  CHECK_NEAR(centre[0], 0.5, 0.03);
  CHECK_NEAR(centre[1], -0.2, 0.03);
  CHECK_NEAR(centre[2], -1.0, 0.03);
  CHECK_NEAR(found.fx, truth.fx, 8.0);
  ptzcal_calibration_free(result);
  ptzcal_correspondences_free(set);
}

/* A lens that was left out is named; what fits is not doubted. */
static void a_model_that_does_not_fit_is_said(void)
{
  ptzcal_calibration_options *settings;
  ptzcal_calibration_summary summary;
  int distorted;
  CHECK_OK(ptzcal_calibration_options_new(&settings, NULL));
  /* The noise of make_points is uniform within 0.3 px. */
  CHECK_OK(ptzcal_calibration_options_set_pixel_sigma(settings, 0.3 / sqrt(3.0), NULL));
  CHECK_OK(ptzcal_calibration_summary_init(&summary, sizeof summary));
  for (distorted = 0; distorted < 2; distorted++) {
    ptzcal_camera truth;
    ptzcal_calibration *result;
    make_camera(&truth);
    truth.distortion_model = PTZCAL_DISTORTION_MODEL_DIVISION;
    truth.distortion[0] = distorted ? -0.05 : 0.0;
    make_points(&truth, xyz, uv, N, 0.3);
    CHECK_OK(calibrate_set(xyz, uv, N, settings, &result, NULL));
    CHECK_OK(ptzcal_calibration_get_summary(result, &summary, NULL));
    CHECK(summary.degrees_of_freedom > N && summary.chi2 > 0);
    if (distorted) {
      CHECK(summary.warnings >= 1 && summary.probability < 0.001);
      CHECK(strstr(ptzcal_calibration_warning(result, (size_t)summary.warnings - 1), "lens distortion") != NULL);
    } else {
      CHECK(summary.warnings == 0 && summary.probability > 0.001);
    }
    CHECK(strcmp(ptzcal_calibration_warning(result, (size_t)summary.warnings), "") == 0);
    CHECK(strcmp(ptzcal_calibration_warning(result, SIZE_MAX), "") == 0);
    CHECK(strncmp(ptzcal_calibration_weakest(result), "weakest: camera ", 16) == 0);
    CHECK(ptzcal_calibration_weakest(result) == ptzcal_calibration_weakest(result));
    ptzcal_calibration_free(result);
  }
  CHECK(strcmp(ptzcal_calibration_warning(NULL, 0), "") == 0 && strcmp(ptzcal_calibration_weakest(NULL), "") == 0);
  ptzcal_calibration_options_free(settings);
}

int main(void)
{
  a_known_camera_is_found();
  a_model_that_does_not_fit_is_said();
  options();
  sets_that_cannot_tell();
  untidy_sets();
  laser_shots();
  return 0;
}
