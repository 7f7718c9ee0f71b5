/* Joint adjustment: two stations that walls tie, and what is refused. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define PLANES 5
#define HITS 60
#define NOISE 0.2
#define RIG PTZCAL_RIG_PARAMETERS

/* Walls, floor and a slanted board: normal . X = distance in the world, in front of both stations. */
static const double planes[PLANES][4] = {
    {0.0, 0.0, 1.0, 4.0}, {0.6, 0.0, 0.8, 2.6}, {-0.6, 0.0, 0.8, 2.4}, {0.0, 0.6, 0.8, 2.2}, {0.0, -0.8, 0.6, 2.5}};
static ptzcal_rig_model rig;
static ptzcal_pose stations[2];

/* Depth, in the head's frame, at which a shot meets a plane. */
static double depth_of(const ptzcal_pose *pose, const double *pan_tilt, const double *plane)
{
  double a[3], b[3], spot[2], at_a = -plane[3], at_b = -plane[3];
  int k;
  make_shot(&rig, pose, pan_tilt, 1.0, a, spot);
  make_shot(&rig, pose, pan_tilt, 2.0, b, spot);
  for (k = 0; k < 3; k++) {
    at_a += plane[k] * a[k];
    at_b += plane[k] * b[k];
  }
  return 1.0 - at_a / (at_b - at_a);
}

/* Shots of some planes from both stations, the second unknown; wrong: every tenth names another plane. */
static ptzcal_adjustment *survey_of(int first_plane, int last_plane, int wrong)
{
  ptzcal_adjustment *survey;
  uint32_t seed = 11, station, index, hits[HITS];
  const double variance = NOISE * NOISE / 3.0;
  int plane, i, k;
  CHECK_OK(ptzcal_adjustment_new(&rig, &survey, NULL));
  CHECK_OK(ptzcal_adjustment_add_station(survey, &stations[0], NULL, &index, NULL));
  CHECK_OK(ptzcal_adjustment_add_station(survey, NULL, NULL, &index, NULL));
  for (plane = first_plane; plane <= last_plane; plane++) {
    CHECK_OK(ptzcal_adjustment_add_plane(survey, 0.001, &index, NULL));
    CHECK(index == (uint32_t)(plane - first_plane));
  }
  for (station = 0; station < 2; station++)
    for (plane = first_plane; plane <= last_plane; plane++) {
      double pan_tilt[2 * HITS], spots[2 * HITS], noise[3 * HITS], point[3];
      size_t first = 0;
      for (i = 0; i < HITS; i++) {
        double depth;
        do {
          pan_tilt[2 * i] = 0.35 * fixture_random(&seed);
          pan_tilt[2 * i + 1] = 0.3 * fixture_random(&seed);
          depth = depth_of(&stations[station], pan_tilt + 2 * i, planes[plane]);
        } while (!(depth > 1.0 && depth < 8.0));
        make_shot(&rig, &stations[station], pan_tilt + 2 * i, depth, point, spots + 2 * i);
        for (k = 0; k < 2; k++) spots[2 * i + k] += NOISE * fixture_random(&seed);
        noise[3 * i] = noise[3 * i + 2] = variance;
        noise[3 * i + 1] = 0.0;
        hits[i] = (uint32_t)(plane - first_plane);
        if (wrong && i % 10 == 0) hits[i] = (hits[i] + 1) % PLANES;
        if (i % 10 == 5) hits[i] = PTZCAL_NO_PLANE;
      }
      CHECK_OK(ptzcal_adjustment_add_shots(survey, station, pan_tilt, spots, noise, NULL, HITS, &first, NULL));
      CHECK_OK(ptzcal_adjustment_set_planes(survey, first, hits, HITS, NULL));
    }
  return survey;
}

static void stations_are_tied(int wrong)
{
  enum { SHOTS = 2 * PLANES * HITS, P = RIG + 12 + 3 * PLANES };
  static double covariance[P * P];
  ptzcal_adjustment *survey = survey_of(0, PLANES - 1, wrong);
  ptzcal_adjusted *adjusted;
  ptzcal_adjusted_summary summary;
  ptzcal_pose pose;
  uint8_t inliers[SHOTS];
  size_t needed, used = 0;
  int i, k;
  CHECK_OK(ptzcal_adjustment_solve(survey, NULL, NULL, &adjusted, NULL));
  ptzcal_adjustment_free(survey);
  CHECK_OK(ptzcal_adjusted_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_adjusted_get_summary(adjusted, &summary, NULL));
  CHECK(summary.planes == PLANES && summary.cameras == 0 && summary.parameters == P && summary.spots == SHOTS);
  CHECK_OK(ptzcal_adjusted_copy_covariance(adjusted, covariance, P * P, NULL, NULL));
  CHECK(strcmp(ptzcal_adjusted_parameter_name(adjusted, P - 1), "plane 4 distance") == 0);
  CHECK_OK(ptzcal_pose_init(&pose, sizeof pose));
  CHECK_OK(ptzcal_adjusted_get_station(adjusted, 1, &pose, NULL));
  for (i = 0; i < 3; i++) {
    const double sigma = sqrt(covariance[(RIG + 9 + i) * (P + 1)]);
    CHECK(sigma > 0.0 && sigma < 0.05);
    CHECK_NEAR(pose.translation[i], stations[1].translation[i], 4.5 * sigma);
  }
  for (i = 0; i < PLANES; i++) {
    double found[4], c[16], side;
    CHECK_OK(ptzcal_adjusted_get_plane(adjusted, (uint32_t)i, found, c, NULL));
    side = found[3] > 0.0 ? 1.0 : -1.0;
    for (k = 0; k < 4; k++) CHECK_NEAR(side * found[k], planes[i][k], 4.5 * sqrt(c[5 * k]) + 1e-9);
    CHECK(c[15] > 0.0 && sqrt(c[15]) < 0.05);
    CHECK_OK(ptzcal_adjusted_get_plane(adjusted, (uint32_t)i, found, NULL, NULL));
  }
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL,
               ptzcal_adjusted_copy_plane_inliers(adjusted, inliers, SHOTS - 1, &needed, NULL));
  CHECK(needed == SHOTS);
  CHECK_OK(ptzcal_adjusted_copy_plane_inliers(adjusted, inliers, SHOTS, NULL, NULL));
  for (i = 0; i < SHOTS; i++) {
    used += inliers[i];
    if (i % 10 == 5) CHECK(inliers[i] == 0);
  }
  CHECK(wrong ? used > SHOTS * 7 / 10 && used < SHOTS * 85 / 100 : used > SHOTS * 88 / 100);
  {
    double values[4];
    taint(values, sizeof values);
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjusted_get_plane(adjusted, PLANES, values, NULL, NULL));
    CHECK(is_tainted(values, sizeof values));
    CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_adjusted_get_plane(adjusted, 0, NULL, NULL, NULL));
  }
  ptzcal_adjusted_free(adjusted);
}

static void what_is_refused(void)
{
  ptzcal_adjustment *survey = survey_of(0, 1, 0);
  ptzcal_adjusted *adjusted;
  ptzcal_error *error = NULL;
  const double bad[] = {0.0, -1.0, 1e-7, 1.5, INFINITY};
  uint32_t plane = 77;
  size_t i;
  /* Two planes leave the station free along their line. */
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_adjustment_solve(survey, NULL, NULL, &adjusted, &error));
  CHECK(strstr(ptzcal_error_message(error), "three planes") != NULL);
  ptzcal_error_free(error);
  for (i = 0; i < sizeof bad / sizeof *bad; i++) {
    const ptzcal_status status = ptzcal_adjustment_add_plane(survey, bad[i], &plane, NULL);
    CHECK(status == PTZCAL_STATUS_INVALID_ARGUMENT || status == PTZCAL_STATUS_NOT_FINITE);
  }
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_adjustment_add_plane(survey, NAN, &plane, NULL));
  CHECK(plane == 77);
  {
    uint32_t hits[2] = {PTZCAL_NO_PLANE, 0};
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjustment_set_planes(survey, 4 * HITS - 1, hits, 2, NULL));
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjustment_set_planes(survey, SIZE_MAX, hits, 2, NULL));
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjustment_set_planes(survey, 0, hits, SIZE_MAX, NULL));
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjustment_set_planes(survey, 0, hits, 2, NULL)); /* twice */
    hits[1] = 2;
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjustment_set_planes(survey, 4, hits, 2, NULL));
    CHECK_OK(ptzcal_adjustment_set_planes(survey, 0, NULL, 0, NULL));
  }
  ptzcal_adjustment_free(survey);
}

/* With a pose to start from, two planes still leave a direction open, which is named. */
static void a_sliding_station(void)
{
  ptzcal_adjustment *tied = survey_of(0, 1, 0), *survey;
  ptzcal_adjust_options options;
  ptzcal_adjusted *adjusted;
  ptzcal_error *error = NULL;
  double infinite[36] = {0};
  uint32_t index, hits[HITS];
  uint32_t seed = 5, station;
  int plane, i;
  ptzcal_adjustment_free(tied);
  CHECK_OK(ptzcal_adjustment_new(&rig, &survey, NULL));
  CHECK_OK(ptzcal_adjustment_add_station(survey, &stations[0], NULL, &index, NULL));
  for (i = 0; i < 6; i++) infinite[7 * i] = INFINITY;
  CHECK_OK(ptzcal_adjustment_add_station(survey, &stations[1], infinite, &index, NULL));
  for (plane = 0; plane < 2; plane++) CHECK_OK(ptzcal_adjustment_add_plane(survey, 0.001, NULL, NULL));
  for (station = 0; station < 2; station++)
    for (plane = 0; plane < 2; plane++) {
      double pan_tilt[2 * HITS], spots[2 * HITS], point[3];
      size_t first = 0;
      for (i = 0; i < HITS; i++) {
        pan_tilt[2 * i] = 0.3 * fixture_random(&seed);
        pan_tilt[2 * i + 1] = 0.3 * fixture_random(&seed);
        make_shot(&rig, &stations[station], pan_tilt + 2 * i,
                  depth_of(&stations[station], pan_tilt + 2 * i, planes[plane]), point, spots + 2 * i);
        hits[i] = (uint32_t)plane;
      }
      CHECK_OK(ptzcal_adjustment_add_shots(survey, station, pan_tilt, spots, NULL, NULL, HITS, &first, NULL));
      CHECK_OK(ptzcal_adjustment_set_planes(survey, first, hits, HITS, NULL));
    }
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_adjustment_solve(survey, NULL, NULL, &adjusted, &error));
  CHECK(strstr(ptzcal_error_message(error), "station 1") != NULL);
  ptzcal_error_free(error);
  CHECK_OK(ptzcal_adjust_options_init(&options, sizeof options));
  CHECK(options.max_station_deviation == 0.1);
  options.max_station_deviation = NAN;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_adjustment_solve(survey, &options, NULL, &adjusted, NULL));
  ptzcal_adjustment_free(survey);
}

int main(void)
{
  make_rig_model(&rig);
  CHECK_OK(ptzcal_pose_init(&stations[0], sizeof stations[0]));
  stations[1] = stations[0];
  stations[1].rotation[0] = stations[1].rotation[8] = 0.96;
  stations[1].rotation[2] = 0.28;
  stations[1].rotation[6] = -0.28;
  stations[1].translation[0] = -0.6;
  stations[1].translation[1] = 0.1;
  stations[1].translation[2] = 0.2;
  stations_are_tied(0);
  stations_are_tied(1);
  what_is_refused();
  a_sliding_station();
  return 0;
}
