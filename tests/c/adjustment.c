/* Joint adjustment: a survey whose truth is known, and everything that is refused. */
#include "fixtures.h"
#include <math.h>
#include <pthread.h>
#include <string.h>
#include <time.h>

#define N 400
#define NOISE 0.4
#define RIG PTZCAL_RIG_PARAMETERS
/* The rig, two stations, two cameras without lens coefficients. */
#define P (RIG + 2 * 6 + 2 * 11)

static ptzcal_rig_model believed, truth;
static ptzcal_camera cameras[2];
static ptzcal_pose world, second;
static double covariance[P * P];

static double sigma(int parameter) { return sqrt(covariance[parameter * (P + 1)]); }

/* Adds shots from a station, seen by both cameras; n may be 0. */
static void shoot(ptzcal_adjustment *survey, const ptzcal_pose *pose, uint32_t station, size_t n, uint32_t seed)
{
  const double variance = NOISE * NOISE / 3.0;
  double *pan_tilt = (double *)malloc(2 * n * sizeof(double)), *spots = (double *)malloc(2 * n * sizeof(double));
  double *uv = (double *)malloc(4 * n * sizeof(double)), *noise = (double *)malloc(3 * n * sizeof(double));
  size_t *shots = (size_t *)malloc(n * sizeof(size_t)), i, first = 0;
  uint32_t camera;
  int k;
  CHECK(pan_tilt && spots && uv && noise && shots);
  for (i = 0; i < n; i++) {
    double point[3], depth = 3.0 + 1.5 * fixture_random(&seed);
    pan_tilt[2 * i] = -0.1 + 0.3 * fixture_random(&seed);
    pan_tilt[2 * i + 1] = 0.25 * fixture_random(&seed);
    make_shot(&truth, pose, pan_tilt + 2 * i, depth, point, spots + 2 * i);
    for (camera = 0; camera < 2; camera++)
      CHECK_OK(ptzcal_camera_project(&cameras[camera], point, 1, uv + 2 * (camera * n + i), NULL));
    for (k = 0; k < 2; k++) spots[2 * i + (size_t)k] += NOISE * fixture_random(&seed);
    noise[3 * i] = noise[3 * i + 2] = variance;
    noise[3 * i + 1] = 0.0;
  }
  for (i = 0; i < 4 * n; i++) uv[i] += NOISE * fixture_random(&seed);
  CHECK_OK(ptzcal_adjustment_add_shots(survey, station, pan_tilt, spots, noise, NULL, n, &first, NULL));
  for (i = 0; i < n; i++) shots[i] = first + i;
  for (camera = 0; camera < 2; camera++)
    CHECK_OK(ptzcal_adjustment_add_sightings(survey, camera, shots, uv + 2 * n * camera, noise, n, NULL));
  free(pan_tilt), free(spots), free(uv), free(noise), free(shots);
}

/* Two stations, the second unknown, and two cameras. */
static ptzcal_adjustment *make(size_t n)
{
  ptzcal_adjustment *survey;
  uint32_t index = 9, i;
  CHECK_OK(ptzcal_adjustment_new(&believed, &survey, NULL));
  CHECK_OK(ptzcal_adjustment_add_station(survey, &world, NULL, &index, NULL));
  CHECK(index == 0);
  CHECK_OK(ptzcal_adjustment_add_station(survey, NULL, NULL, &index, NULL));
  CHECK(index == 1);
  for (i = 0; i < 2; i++) {
    CHECK_OK(ptzcal_adjustment_add_camera(survey, 800, 600, NULL, &index, NULL));
    CHECK(index == i);
  }
  if (n) {
    shoot(survey, &world, 0, n, 5);
    shoot(survey, &second, 1, n, 6);
  }
  return survey;
}

static void set_up(void)
{
  const double s = 0.28, c = 0.96;
  make_rig_model(&truth);
  believed = truth;
  truth.axis_tilt_z = truth.axis_pan_z = 0.04;
  make_camera(&cameras[0]);
  make_camera(&cameras[1]);
  /* The other one at (-0.9, 0.3, -0.5), turned the other way. */
  cameras[1].rotation[2] = -s;
  cameras[1].rotation[6] = s;
  cameras[1].translation[0] = -(c * -0.9 - s * -0.5);
  cameras[1].translation[1] = -0.3;
  cameras[1].translation[2] = -(s * -0.9 + c * -0.5);
  CHECK_OK(ptzcal_pose_init(&world, sizeof world));
  second = world;
  second.rotation[0] = second.rotation[8] = c;
  second.rotation[2] = s;
  second.rotation[6] = -s;
  second.translation[0] = -0.6;
  second.translation[1] = 0.1;
  second.translation[2] = 0.2;
}

static ptzcal_adjusted_summary summary_of(const ptzcal_adjusted *adjusted)
{
  ptzcal_adjusted_summary summary;
  CHECK_OK(ptzcal_adjusted_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_adjusted_get_summary(adjusted, &summary, NULL));
  return summary;
}

static void a_camera_is_found(const ptzcal_adjusted *adjusted, uint32_t camera)
{
  ptzcal_calibration *calibration;
  ptzcal_calibration_summary summary;
  ptzcal_camera found;
  double own[121], at[3], wanted[3];
  int first = RIG + 12 + 11 * (int)camera, i, k;
  CHECK_OK(ptzcal_adjusted_get_calibration(adjusted, camera, &calibration, NULL));
  CHECK_OK(ptzcal_calibration_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_calibration_get_summary(calibration, &summary, NULL));
  CHECK(summary.measurements == 2 * N && summary.parameters == 11 && summary.inliers > 2 * N - 20);
  CHECK_OK(ptzcal_calibration_copy_covariance(calibration, own, 121, NULL, NULL));
  for (i = 0; i < 11; i++)
    for (k = 0; k < 11; k++) CHECK_NEAR(own[11 * i + k], covariance[(first + i) * P + first + k], 0.0);
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_calibration_get_camera(calibration, &found, NULL));
  CHECK_OK(ptzcal_camera_centre(&found, at, NULL));
  CHECK_OK(ptzcal_camera_centre(&cameras[camera], wanted, NULL));
  CHECK_NEAR(found.fx, cameras[camera].fx, 4.5 * sigma(first));
  CHECK_NEAR(found.cx, cameras[camera].cx, 4.5 * sigma(first + 3));
  for (i = 0; i < 3; i++) {
    CHECK_NEAR(at[i], wanted[i], 4.5 * sigma(first + 8 + i));
    CHECK(sigma(first + 8 + i) < 0.03);
  }
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjusted_get_calibration(adjusted, 2, &calibration, NULL));
  CHECK(calibration == NULL);
}

static void points_are_found(const ptzcal_adjusted *adjusted)
{
  double pan_tilt[4] = {0.1, -0.05, -0.2, 0.1}, spots[4], point[2][3], xyz[6], c[18], shot[3], of_shot[9];
  const double noise[6] = {1e-6, 0.0, 1e-6, 1e-6, 0.0, 1e-6};
  uint8_t inliers[2 * N];
  size_t needed;
  int i, k;
  for (i = 0; i < 2; i++) make_shot(&truth, &second, pan_tilt + 2 * i, 3.0 + i, point[i], spots + 2 * i);
  CHECK_OK(ptzcal_adjusted_measure(adjusted, 1, pan_tilt, spots, noise, 2, xyz, c, NULL));
  for (i = 0; i < 2; i++)
    for (k = 0; k < 3; k++) CHECK_NEAR(xyz[3 * i + k], point[i][k], 4.5 * sqrt(c[9 * i + 4 * k]));
  CHECK(sqrt(c[8]) < 0.05);
  CHECK_NEAR(c[1], c[3], 1e-12 * c[8]);
  CHECK_OK(ptzcal_adjusted_measure(adjusted, 1, pan_tilt, spots, NULL, 2, xyz, NULL, NULL));
  taint(xyz, sizeof xyz);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_adjusted_measure(adjusted, 2, pan_tilt, spots, NULL, 2, xyz, NULL, NULL));
  spots[2] = 100.0; /* on the other side of the vanishing point: beyond infinity */
  CHECK_STATUS(PTZCAL_STATUS_UNREACHABLE,
               ptzcal_adjusted_measure(adjusted, 1, pan_tilt, spots, NULL, 2, xyz, NULL, NULL));
  CHECK(is_tainted(xyz, sizeof xyz));

  CHECK_OK(ptzcal_adjusted_shot_point(adjusted, 2 * N - 1, shot, of_shot, NULL));
  CHECK(of_shot[0] > 0.0 && of_shot[4] > 0.0 && of_shot[8] > 0.0 && sqrt(of_shot[8]) < 0.02);
  CHECK_OK(ptzcal_adjusted_shot_point(adjusted, 0, shot, NULL, NULL));
  CHECK(shot[2] > 1.0 && shot[2] < 5.0);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjusted_shot_point(adjusted, 2 * N, shot, NULL, NULL));

  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL,
               ptzcal_adjusted_copy_head_inliers(adjusted, inliers, 2 * N - 1, &needed, NULL));
  CHECK(needed == 2 * N);
  CHECK_OK(ptzcal_adjusted_copy_head_inliers(adjusted, inliers, 2 * N, NULL, NULL));
  CHECK(inliers[0] <= 1);
}

/* The axis offsets are 40 mm and believed to be 0: fixed, the check finds them; free, they come out. */
static void a_survey(void)
{
  ptzcal_adjustment *survey = make(N);
  ptzcal_adjusted *adjusted, *again;
  ptzcal_adjusted_summary summary;
  ptzcal_suspect suspect;
  ptzcal_rig_model rig;
  ptzcal_pose pose;
  double sigmas[RIG] = {0}, other[P * P];
  size_t needed;
  int i;

  CHECK_OK(ptzcal_adjustment_solve(survey, NULL, NULL, &adjusted, NULL));
  summary = summary_of(adjusted);
  CHECK(summary.suspects > 0 && summary.warnings > summary.suspects && summary.probability < 1e-6);
  CHECK_OK(ptzcal_suspect_init(&suspect, sizeof suspect));
  CHECK_OK(ptzcal_adjusted_get_suspect(adjusted, 0, &suspect, NULL));
  CHECK(strcmp(ptzcal_adjusted_suspect_name(adjusted, 0), "the axis offsets") == 0);
  CHECK(suspect.parameters > 0 && suspect.parameters <= 4 && suspect.gain > 100.0 && suspect.probability < 1e-5);
  CHECK(strlen(ptzcal_adjusted_warning(adjusted, summary.warnings - 1)) > 0);
  CHECK(strlen(ptzcal_adjusted_warning(adjusted, summary.warnings)) == 0);
  CHECK(strlen(ptzcal_adjusted_suspect_name(adjusted, SIZE_MAX)) == 0);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjusted_get_suspect(adjusted, summary.suspects, &suspect, NULL));
  ptzcal_adjusted_free(adjusted);

  for (i = PTZCAL_RIG_PARAMETER_AXIS_TILT_Y; i <= PTZCAL_RIG_PARAMETER_AXIS_PAN_Z; i++) sigmas[i] = 0.1;
  CHECK_OK(ptzcal_adjustment_set_rig_sigmas(survey, sigmas, NULL));
  CHECK_OK(ptzcal_adjustment_solve(survey, NULL, NULL, &adjusted, NULL));
  ptzcal_adjustment_free(survey); /* the answer does not need it */
  summary = summary_of(adjusted);
  CHECK(summary.suspects == 0 && summary.warnings == 0 && summary.probability > 1e-3);
  CHECK(summary.parameters == P && summary.stations == 2 && summary.cameras == 2 && summary.shots == 2 * N);
  CHECK(summary.spots == 6 * N && summary.used > 6 * N - 60 && summary.used <= summary.spots);
  CHECK(summary.freedom > 3 * N && summary.iterations > 0 && summary.condition > 1.0 && summary.noise_factor >= 1.0);
  CHECK(strncmp(ptzcal_adjusted_weakest(adjusted), "weakest: ", 9) == 0);
  CHECK((summary.prior_only == 0) == (strlen(ptzcal_adjusted_prior_only(adjusted, 0)) == 0));

  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_adjusted_copy_covariance(adjusted, NULL, 0, &needed, NULL));
  CHECK(needed == P * P);
  CHECK_OK(ptzcal_adjusted_copy_covariance(adjusted, covariance, P * P, NULL, NULL));
  for (i = 0; i < P * P; i++) CHECK_NEAR(covariance[i], covariance[i % P * P + i / P], 0.0);
  CHECK(strcmp(ptzcal_adjusted_parameter_name(adjusted, PTZCAL_RIG_PARAMETER_AXIS_PAN_Z), "pan axis z") == 0);
  CHECK(strcmp(ptzcal_adjusted_parameter_name(adjusted, P - 1), "camera 1 position z") == 0);
  CHECK(strlen(ptzcal_adjusted_parameter_name(adjusted, P)) == 0);
  CHECK(strlen(ptzcal_adjusted_parameter_name(NULL, 0)) == 0);

  CHECK_OK(ptzcal_rig_model_init(&rig, sizeof rig));
  CHECK_OK(ptzcal_adjusted_get_rig_model(adjusted, &rig, NULL));
  CHECK_NEAR(rig.axis_tilt_z, 0.04, 4.5 * sigma(PTZCAL_RIG_PARAMETER_AXIS_TILT_Z));
  CHECK_NEAR(rig.axis_pan_z, 0.04, 4.5 * sigma(PTZCAL_RIG_PARAMETER_AXIS_PAN_Z));
  CHECK(sigma(PTZCAL_RIG_PARAMETER_AXIS_PAN_Z) < 0.02 && sigma(PTZCAL_RIG_PARAMETER_LASER_X0) == 0.0);
  CHECK(rig.laser_x0 == truth.laser_x0 && rig.fx == truth.fx && rig.pan_scale == 1.0);

  CHECK_OK(ptzcal_pose_init(&pose, sizeof pose));
  CHECK_OK(ptzcal_adjusted_get_station(adjusted, 1, &pose, NULL));
  for (i = 0; i < 3; i++) {
    CHECK_NEAR(pose.translation[i], second.translation[i], 4.5 * sigma(RIG + 9 + i));
    CHECK(sigma(RIG + 9 + i) < 0.03 && sigma(RIG + i) == 0.0);
  }
  CHECK_NEAR(pose.rotation[2], second.rotation[2], 4.5 * sigma(RIG + 7));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjusted_get_station(adjusted, 2, &pose, NULL));
  a_camera_is_found(adjusted, 0);
  a_camera_is_found(adjusted, 1);
  points_are_found(adjusted);

  CHECK_OK(ptzcal_adjusted_resolve(adjusted, NULL, &again, NULL));
  CHECK_OK(ptzcal_adjusted_copy_covariance(again, other, P * P, NULL, NULL));
  CHECK(memcmp(other, covariance, sizeof other) == 0);
  ptzcal_adjusted_free(again);
  ptzcal_adjusted_free(adjusted);
}

/* Everything but the mean of the rig's prior and the sightings of camera 0 is known beforehand. */
static void priors(void)
{
  ptzcal_adjustment *survey;
  ptzcal_adjusted *first, *second_answer;
  ptzcal_calibration *calibration;
  ptzcal_adjust_options options;
  ptzcal_rig_model model = truth;
  double pose_covariance[36] = {0}, rig_covariance[RIG * RIG] = {0}, before[121], after[121], sigmas[11] = {0};
  uint32_t index;
  int i;
  make_survey(&survey, &truth, &truth, cameras, 1, 100, NOISE);
  CHECK_OK(ptzcal_adjustment_solve(survey, NULL, NULL, &first, NULL));
  CHECK_OK(ptzcal_adjusted_get_calibration(first, 0, &calibration, NULL));
  CHECK_OK(ptzcal_calibration_copy_covariance(calibration, before, 121, NULL, NULL));
  ptzcal_adjustment_free(survey);

  /* An earlier calibration, a station within a millimetre, a rig with correlated slopes. */
  model.laser_vx += 1e-4;
  CHECK_OK(ptzcal_adjustment_new(&model, &survey, NULL));
  for (i = 0; i < 2; i++) rig_covariance[(PTZCAL_RIG_PARAMETER_LASER_VX + i) * (RIG + 1)] = 4e-8;
  rig_covariance[PTZCAL_RIG_PARAMETER_LASER_VX * RIG + PTZCAL_RIG_PARAMETER_LASER_VY] = 1e-8;
  rig_covariance[PTZCAL_RIG_PARAMETER_LASER_VY * RIG + PTZCAL_RIG_PARAMETER_LASER_VX] = 1e-8;
  CHECK_OK(ptzcal_adjustment_set_rig_covariance(survey, rig_covariance, NULL));
  for (i = 0; i < 6; i++) pose_covariance[7 * i] = 1e-6;
  CHECK_OK(ptzcal_adjustment_add_station(survey, &world, NULL, &index, NULL));
  CHECK_OK(ptzcal_adjustment_add_station(survey, &second, pose_covariance, &index, NULL));
  CHECK_OK(ptzcal_adjustment_add_calibrated_camera(survey, calibration, &index, NULL));
  for (i = 5; i < 11; i++) sigmas[i] = INFINITY; /* its pose is to be found, its lens is known */
  CHECK_OK(ptzcal_adjustment_add_known_camera(survey, &cameras[1], sigmas, 11, &index, NULL));
  CHECK(index == 1);
  ptzcal_calibration_free(calibration);
  shoot(survey, &world, 0, 60, 21);
  shoot(survey, &second, 1, 60, 22);
  CHECK_OK(ptzcal_adjust_options_init(&options, sizeof options));
  options.pointing_sigma_pan = options.pointing_sigma_tilt = 1e-6;
  CHECK_OK(ptzcal_adjustment_solve(survey, &options, NULL, &second_answer, NULL));
  CHECK_OK(ptzcal_adjusted_get_calibration(second_answer, 0, &calibration, NULL));
  CHECK_OK(ptzcal_calibration_copy_covariance(calibration, after, 121, NULL, NULL));
  for (i = 8; i < 11; i++) CHECK(after[12 * i] < before[12 * i]);
  ptzcal_calibration_free(calibration);
  CHECK_OK(ptzcal_adjusted_get_calibration(second_answer, 1, &calibration, NULL));
  CHECK_OK(ptzcal_calibration_copy_covariance(calibration, after, 121, NULL, NULL));
  CHECK(after[0] == 0.0 && after[12 * 10] > 0.0 && summary_of(second_answer).warnings == 0);
  ptzcal_calibration_free(calibration);
  ptzcal_adjusted_free(first);
  ptzcal_adjusted_free(second_answer);
  ptzcal_adjustment_free(survey);
}

/* Fixed cameras alone measure a shot that the head did not see. */
static void shots_without_the_head(void)
{
  ptzcal_adjustment *survey;
  ptzcal_adjusted *adjusted;
  const double pan_tilt[6] = {0.05, 0.02, 0.0, 0.1, 0.1, 0.0};
  double spots[6] = {0}, point[3], spot[2], uv[2], xyz[3], c[9];
  const uint8_t unseen[3] = {0, 0, 0};
  size_t shots[1];
  uint32_t camera;
  int k;
  make_survey(&survey, &truth, &truth, cameras, 2, 200, NOISE);
  CHECK_OK(ptzcal_adjustment_add_shots(survey, 0, pan_tilt, NULL, NULL, NULL, 1, shots, NULL));
  CHECK(shots[0] == 200);
  make_shot(&truth, &world, pan_tilt, 3.5, point, spot);
  for (camera = 0; camera < 2; camera++) {
    CHECK_OK(ptzcal_camera_project(&cameras[camera], point, 1, uv, NULL));
    CHECK_OK(ptzcal_adjustment_add_sightings(survey, camera, shots, uv, NULL, 1, NULL));
  }
  /* And shots that nobody saw. */
  CHECK_OK(ptzcal_adjustment_add_shots(survey, 0, pan_tilt, spots, NULL, unseen, 3, NULL, NULL));
  CHECK_OK(ptzcal_adjustment_add_shots(survey, 0, NULL, NULL, NULL, NULL, 0, NULL, NULL));
  CHECK_OK(ptzcal_adjustment_solve(survey, NULL, NULL, &adjusted, NULL));
  CHECK(summary_of(adjusted).shots == 204 && summary_of(adjusted).spots == 602);
  CHECK_OK(ptzcal_adjusted_shot_point(adjusted, 200, xyz, c, NULL));
  for (k = 0; k < 3; k++) CHECK_NEAR(xyz[k], point[k], 4.5 * sqrt(c[4 * k]) + 1e-3);
  CHECK_STATUS(PTZCAL_STATUS_UNREACHABLE, ptzcal_adjusted_shot_point(adjusted, 201, xyz, c, NULL));
  ptzcal_adjusted_free(adjusted);
  ptzcal_adjustment_free(survey);
}

/* The call fails with a status, and the message names what is wrong. */
#define REFUSED(status, word, call) refused(__FILE__, __LINE__, #call, status, word, call)
static ptzcal_error *why;

static void refused(const char *file, int line, const char *call, ptzcal_status wanted, const char *word, ptzcal_status got)
{
  check_status(file, line, call, wanted, got);
  if (!strstr(ptzcal_error_message(why), word)) {
    fprintf(stderr, "%s:%d: '%s' does not name '%s'\n", file, line, ptzcal_error_message(why), word);
    exit(1);
  }
  ptzcal_error_free(why);
}

static void bad_priors(void)
{
  ptzcal_adjustment *survey = make(0);
  double sigmas[RIG] = {0}, c[RIG * RIG] = {0}, of_camera[11] = {0}, of_pose[36] = {0};
  ptzcal_pose mirrored = world;
  ptzcal_camera lens = cameras[0];
  uint32_t index;

  sigmas[PTZCAL_RIG_PARAMETER_AXIS_TILT_Z] = -0.1;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "tilt axis z", ptzcal_adjustment_set_rig_sigmas(survey, sigmas, &why));
  sigmas[PTZCAL_RIG_PARAMETER_AXIS_TILT_Z] = NAN;
  REFUSED(PTZCAL_STATUS_NOT_FINITE, "sigmas[8]", ptzcal_adjustment_set_rig_sigmas(survey, sigmas, &why));
  REFUSED(PTZCAL_STATUS_NULL_POINTER, "sigmas", ptzcal_adjustment_set_rig_sigmas(survey, NULL, &why));
  REFUSED(PTZCAL_STATUS_NULL_POINTER, "adjustment", ptzcal_adjustment_set_rig_sigmas(NULL, sigmas, &why));
  c[0] = c[RIG + 1] = 1.0;
  c[1] = c[RIG] = 2.0; /* correlated by more than 1 */
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "laser y0", ptzcal_adjustment_set_rig_covariance(survey, c, &why));
  c[1] = 0.5;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "symmetric", ptzcal_adjustment_set_rig_covariance(survey, c, &why));
  c[1] = INFINITY;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "laser", ptzcal_adjustment_set_rig_covariance(survey, c, &why));

  mirrored.rotation[0] = -1.0;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "rotation",
          ptzcal_adjustment_add_station(survey, &mirrored, NULL, &index, &why));
  mirrored.rotation[0] = NAN;
  REFUSED(PTZCAL_STATUS_NOT_FINITE, "station", ptzcal_adjustment_add_station(survey, &mirrored, NULL, &index, &why));
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "pose", ptzcal_adjustment_add_station(survey, NULL, of_pose, &index, &why));
  of_pose[7] = -1.0;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "rotation y",
          ptzcal_adjustment_add_station(survey, &world, of_pose, &index, &why));

  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "0 x 600", ptzcal_adjustment_add_camera(survey, 0, 600, NULL, &index, &why));
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "10", ptzcal_adjustment_add_known_camera(survey, &lens, of_camera, 10, &index, &why));
  of_camera[3] = -2.0;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "cx",
          ptzcal_adjustment_add_known_camera(survey, &lens, of_camera, 11, &index, &why));
  lens.distortion_model = 77;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "77",
          ptzcal_adjustment_add_known_camera(survey, &lens, of_camera, 11, &index, &why));
  lens = cameras[0];
  lens.fx = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_adjustment_add_known_camera(survey, &lens, of_camera, 11, &index, NULL));
  REFUSED(PTZCAL_STATUS_NULL_POINTER, "calibration",
          ptzcal_adjustment_add_calibrated_camera(survey, NULL, &index, &why));
  /* Nothing of this was added: the next indices tell. */
  CHECK_OK(ptzcal_adjustment_add_station(survey, NULL, NULL, &index, NULL));
  CHECK(index == 2);
  CHECK_OK(ptzcal_adjustment_add_camera(survey, 8, 8, NULL, &index, NULL));
  CHECK(index == 2);
  ptzcal_adjustment_free(survey);
}

static void bad_shots(void)
{
  ptzcal_adjustment *survey = make(0);
  ptzcal_scan *scan = NULL;
  double pan_tilt[4] = {0.0, 0.0, 0.1, 0.0}, spots[4] = {400.0, 290.0, 410.0, 290.0};
  double noise[6] = {1.0, 0.0, 1.0, 1.0, 0.0, 1.0};
  size_t shots[2] = {0, 1}, first = 77;
#define SHOTS(station) ptzcal_adjustment_add_shots(survey, station, pan_tilt, spots, noise, NULL, 2, &first, &why)
#define SIGHTINGS(camera) ptzcal_adjustment_add_sightings(survey, camera, shots, spots, noise, 2, &why)
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "station", SHOTS(2));
  noise[5] = -1.0;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "covariance", SHOTS(0));
  noise[5] = 1.0;
  noise[4] = 1.0; /* singular */
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "positive definite", SHOTS(0));
  noise[4] = 0.0;
  pan_tilt[2] = 1e6;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "pan", SHOTS(0));
  pan_tilt[2] = NAN;
  REFUSED(PTZCAL_STATUS_NOT_FINITE, "pan_tilt[1]", SHOTS(0));
  pan_tilt[2] = 0.1;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "shot", SIGHTINGS(0)); /* there are none yet */
  CHECK(first == 77);
  CHECK_OK(SHOTS(0));
  CHECK(first == 0); /* what was refused left nothing behind */
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "camera", SIGHTINGS(2));
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "camera", SIGHTINGS(UINT32_MAX));
  shots[1] = 2;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "shot", SIGHTINGS(0));
  shots[1] = 0;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "twice", SIGHTINGS(0));
  shots[1] = 1;
  spots[3] = INFINITY;
  REFUSED(PTZCAL_STATUS_NOT_FINITE, "uv[1]", SIGHTINGS(0));
  spots[3] = 290.0;
  CHECK_OK(SIGHTINGS(0)); /* here too */
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "twice", SIGHTINGS(0));
  REFUSED(PTZCAL_STATUS_NULL_POINTER, "scan", ptzcal_adjustment_add_scan(survey, 0, scan, NULL, 0, NULL, &why));
  ptzcal_adjustment_free(survey);
}

static void surveys_that_cannot_tell(void)
{
  ptzcal_adjustment *survey = make(0);
  ptzcal_adjusted *result;
  ptzcal_adjust_options options;
  ptzcal_cancel *cancel;
  double sigmas[RIG] = {0};
  uint32_t index;
  REFUSED(PTZCAL_STATUS_TOO_FEW_POINTS, "0 usable", ptzcal_adjustment_solve(survey, NULL, NULL, &result, &why));
  CHECK(result == NULL);
  ptzcal_adjustment_free(survey);

  make_survey(&survey, &truth, &truth, cameras, 1, 60, NOISE);
  CHECK_OK(ptzcal_adjust_options_init(&options, sizeof options));
  options.robust = 2;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "robust", ptzcal_adjustment_solve(survey, &options, NULL, &result, &why));
  options.robust = 1;
  options.max_iterations = 0;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "max_iter", ptzcal_adjustment_solve(survey, &options, NULL, &result, &why));
  options.max_iterations = 100;
  options.huber = -3.0;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "huber", ptzcal_adjustment_solve(survey, &options, NULL, &result, &why));
  options.huber = INFINITY;
  options.max_focal_deviation = NAN;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "focal", ptzcal_adjustment_solve(survey, &options, NULL, &result, &why));
  options.max_focal_deviation = 1e-9;
  REFUSED(PTZCAL_STATUS_DEGENERATE, "camera 0", ptzcal_adjustment_solve(survey, &options, NULL, &result, &why));
  options.max_focal_deviation = 0.1;
  options.pointing_sigma_tilt = -1.0;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "pointing", ptzcal_adjustment_solve(survey, &options, NULL, &result, &why));
  options.pointing_sigma_tilt = 0.0;
  options.robust = 0;
  CHECK_OK(ptzcal_adjustment_solve(survey, &options, NULL, &result, NULL));

  CHECK_OK(ptzcal_cancel_new(&cancel, NULL));
  CHECK_OK(ptzcal_cancel_request(cancel));
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_adjusted_resolve(result, cancel, &result, NULL));
  CHECK(result == NULL);
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_adjustment_solve(survey, &options, cancel, &result, NULL));
  ptzcal_cancel_free(cancel);

  /* The pan zero turns a single station's world. */
  sigmas[PTZCAL_RIG_PARAMETER_PAN_ZERO] = INFINITY;
  CHECK_OK(ptzcal_adjustment_set_rig_sigmas(survey, sigmas, NULL));
  REFUSED(PTZCAL_STATUS_DEGENERATE, "pan encoder", ptzcal_adjustment_solve(survey, NULL, NULL, &result, &why));
  /* A station that shares nothing, then a camera that saw nothing. */
  memset(sigmas, 0, sizeof sigmas);
  CHECK_OK(ptzcal_adjustment_set_rig_sigmas(survey, sigmas, NULL));
  CHECK_OK(ptzcal_adjustment_add_station(survey, NULL, NULL, &index, NULL));
  REFUSED(PTZCAL_STATUS_BAD_STATE, "station 1", ptzcal_adjustment_solve(survey, NULL, NULL, &result, &why));
  CHECK_OK(ptzcal_adjustment_add_camera(survey, 640, 480, NULL, &index, NULL));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_adjustment_solve(survey, NULL, NULL, &result, &why));
  CHECK(ptzcal_error_index(why) == 1 && strlen(ptzcal_error_hint(why)) > 0);
  ptzcal_error_free(why);
  ptzcal_adjustment_free(survey);
}

typedef struct work {
  const ptzcal_adjustment *survey;
  const ptzcal_cancel *cancel;
  ptzcal_status end;
} work;

static void *solve_until_cancelled(void *user)
{
  work *w = (work *)user;
  ptzcal_adjusted *result;
  do {
    w->end = ptzcal_adjustment_solve(w->survey, NULL, w->cancel, &result, NULL);
    ptzcal_adjusted_free(result);
  } while (w->end == PTZCAL_STATUS_OK || w->end == PTZCAL_STATUS_BUSY);
  return NULL;
}

/* Two threads solve one survey; a third cannot add to it meanwhile. */
static void threads(void)
{
  ptzcal_adjustment *survey = make(N);
  ptzcal_cancel *cancel;
  pthread_t solvers[2];
  work works[2];
  double sigmas[RIG] = {0};
  const struct timespec pause = {0, 1000000};
  int i, tries, busy = 0;
  CHECK_OK(ptzcal_cancel_new(&cancel, NULL));
  for (i = 0; i < 2; i++) {
    works[i].survey = survey;
    works[i].cancel = cancel;
    CHECK(pthread_create(&solvers[i], NULL, solve_until_cancelled, &works[i]) == 0);
  }
  for (tries = 0; tries < 10000 && !busy; tries++) {
    ptzcal_status status = ptzcal_adjustment_set_rig_sigmas(survey, sigmas, NULL);
    nanosleep(&pause, NULL);
    CHECK(status == PTZCAL_STATUS_OK || status == PTZCAL_STATUS_BUSY);
    busy = status == PTZCAL_STATUS_BUSY;
  }
  CHECK(busy);
  CHECK_OK(ptzcal_cancel_request(cancel));
  for (i = 0; i < 2; i++) {
    CHECK(pthread_join(solvers[i], NULL) == 0);
    CHECK(works[i].end == PTZCAL_STATUS_CANCELLED);
  }
  ptzcal_cancel_free(cancel);
  ptzcal_adjustment_free(survey);
}

/* The simulator's own surveys: add_scan, and what does not fit together. */
static void a_scan(void)
{
  ptzcal_rig_options *rig_options;
  ptzcal_scan_options *scan_options;
  ptzcal_rig *rig;
  ptzcal_region region;
  ptzcal_scan *scan;
  ptzcal_scan_summary scan_summary;
  ptzcal_adjustment *survey, *other;
  ptzcal_adjusted *adjusted;
  ptzcal_simulator *simulator;
  ptzcal_rig_model model;
  ptzcal_calibration *calibration;
  ptzcal_calibration_options *options;
  ptzcal_camera found, wanted;
  double sigmas[RIG] = {0}, at[3], there[3];
  uint32_t index, chosen[2] = {PTZCAL_NO_CAMERA, 0};
  size_t first = 7;
  int i;
  CHECK_OK(ptzcal_rig_options_new(&rig_options, NULL));
  CHECK_OK(ptzcal_rig_options_set_address(rig_options, "sim:room?seed=4", NULL));
  CHECK_OK(ptzcal_rig_options_set_settle(rig_options, 2, 0.1, 0.0, 30.0, 0.0, NULL));
  CHECK_OK(ptzcal_rig_open(rig_options, &rig, NULL));
  ptzcal_rig_options_free(rig_options);
  CHECK_OK(ptzcal_scan_options_new(&scan_options, NULL));
  CHECK_OK(ptzcal_scan_options_add_camera_address(scan_options, "sim:fixed/1", NULL, NULL));
  CHECK_OK(ptzcal_scan_options_add_camera_address(scan_options, "sim:fixed/0", NULL, NULL));
  CHECK_OK(ptzcal_region_init(&region, sizeof region));
  region.pan_min = -0.4, region.pan_max = 0.25, region.tilt_min = -0.3, region.tilt_max = 0.28;
  region.pan_steps = 9, region.tilt_steps = 6;
  CHECK_OK(ptzcal_rig_scan_region(rig, &region, scan_options, NULL, NULL, &scan, NULL));
  ptzcal_scan_options_free(scan_options);
  CHECK_OK(ptzcal_scan_summary_init(&scan_summary, sizeof scan_summary));
  CHECK_OK(ptzcal_scan_get_summary(scan, &scan_summary, NULL));
  CHECK_OK(ptzcal_rig_model_init(&model, sizeof model));
  CHECK_OK(ptzcal_rig_get_model(rig, &model, NULL));

  CHECK_OK(ptzcal_adjustment_new(&model, &survey, NULL));
  for (i = PTZCAL_RIG_PARAMETER_AXIS_TILT_Y; i <= PTZCAL_RIG_PARAMETER_AXIS_PAN_Z; i++) sigmas[i] = 5e-4;
  sigmas[PTZCAL_RIG_PARAMETER_TILT_ZERO] = 3e-4;
  CHECK_OK(ptzcal_adjustment_set_rig_sigmas(survey, sigmas, NULL));
  CHECK_OK(ptzcal_adjustment_add_station(survey, &world, NULL, &index, NULL));
  CHECK_OK(ptzcal_calibration_options_new(&options, NULL));
  CHECK_OK(ptzcal_calibration_options_set_distortion(options, PTZCAL_DISTORTION_MODEL_RADIAL1, NULL));
  CHECK_OK(ptzcal_adjustment_add_camera(survey, 800, 600, options, &index, NULL));
  CHECK_OK(ptzcal_adjustment_add_camera(survey, 640, 480, options, &index, NULL));
  ptzcal_calibration_options_free(options);

#define SCAN(station, n) ptzcal_adjustment_add_scan(survey, station, scan, chosen, n, &first, &why)
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "the scan watched 2", SCAN(0, 1));
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "station", SCAN(1, 2));
  chosen[1] = 2;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "camera 2 of 2", SCAN(0, 2));
  chosen[1] = 1;
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "640 x 480", SCAN(0, 2));
  chosen[0] = chosen[1] = 0; /* one camera twice */
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "twice", SCAN(0, 2));
  chosen[0] = PTZCAL_NO_CAMERA;
  make_rig_model(&model);
  model.width = 360;
  CHECK_OK(ptzcal_adjustment_new(&model, &other, NULL));
  REFUSED(PTZCAL_STATUS_INVALID_ARGUMENT, "rig",
          ptzcal_adjustment_add_scan(other, 0, scan, chosen, 2, NULL, &why));
  ptzcal_adjustment_free(other);
  CHECK(first == 7);
  CHECK_OK(SCAN(0, 2));
  CHECK(first == 0);
  /* Camera 1 saw nothing. */
  REFUSED(PTZCAL_STATUS_TOO_FEW_POINTS, "camera 1", ptzcal_adjustment_solve(survey, NULL, NULL, &adjusted, &why));
  ptzcal_adjustment_free(survey);

  CHECK_OK(ptzcal_rig_get_model(rig, &model, NULL));
  CHECK_OK(ptzcal_adjustment_new(&model, &survey, NULL));
  CHECK_OK(ptzcal_adjustment_set_rig_sigmas(survey, sigmas, NULL));
  CHECK_OK(ptzcal_adjustment_add_station(survey, &world, NULL, &index, NULL));
  CHECK_OK(ptzcal_calibration_options_new(&options, NULL));
  CHECK_OK(ptzcal_calibration_options_set_distortion(options, PTZCAL_DISTORTION_MODEL_RADIAL1, NULL));
  CHECK_OK(ptzcal_adjustment_add_camera(survey, 800, 600, options, &index, NULL));
  ptzcal_calibration_options_free(options);
  CHECK_OK(SCAN(0, 2));
  CHECK_OK(ptzcal_adjustment_solve(survey, NULL, NULL, &adjusted, NULL));
  CHECK(summary_of(adjusted).shots == scan_summary.shots);
  CHECK_OK(ptzcal_adjusted_get_calibration(adjusted, 0, &calibration, NULL));
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_camera_init(&wanted, sizeof wanted));
  CHECK_OK(ptzcal_calibration_get_camera(calibration, &found, NULL));
  CHECK_OK(ptzcal_rig_simulator(rig, &simulator, NULL));
  CHECK_OK(ptzcal_simulator_true_camera(simulator, 0, &wanted, NULL));
  CHECK_OK(ptzcal_camera_centre(&found, at, NULL));
  CHECK_OK(ptzcal_camera_centre(&wanted, there, NULL));
  for (i = 0; i < 3; i++) CHECK_NEAR(at[i], there[i], 0.005);
  ptzcal_simulator_free(simulator);
  ptzcal_calibration_free(calibration);
  ptzcal_adjusted_free(adjusted);
  ptzcal_adjustment_free(survey);
  ptzcal_scan_free(scan);
  CHECK_OK(ptzcal_rig_close(rig, NULL));
}

int main(void)
{
  set_up();
  a_survey();
  priors();
  shots_without_the_head();
  bad_priors();
  bad_shots();
  surveys_that_cannot_tell();
  threads();
  a_scan();
  return 0;
}
