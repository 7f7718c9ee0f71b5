/* Sets of 2D-3D measurements: all of a call are added, or none. */
#include "fixtures.h"
#include <math.h>

static ptzcal_correspondences *set;

static void holds(size_t wanted)
{
  size_t count = 12345;
  CHECK_OK(ptzcal_correspondences_count(set, &count, NULL));
  CHECK(count == wanted);
}

static void adding(void)
{
  ptzcal_error *error = NULL;
  double xyz[9] = {0, 0, 1, 1, 0, 2, 0, 1, 3}, uv[6] = {1, 2, 3, 4, 5, 6};
  double xyz_covariance[27] = {0}, uv_covariance[9] = {1, 0, 1, 2, 0.5, 1, 1, 0, 3};
  holds(0);
  CHECK_OK(ptzcal_correspondences_add_points(set, xyz, uv, 3, NULL));
  holds(3);
  CHECK_OK(ptzcal_correspondences_add_points(set, NULL, NULL, 0, NULL));
  /* A zero covariance is a point that is exact. */
  CHECK_OK(ptzcal_correspondences_add_points_weighted(set, xyz, xyz_covariance, uv, uv_covariance, 3, NULL));
  CHECK_OK(ptzcal_correspondences_add_points_weighted(set, xyz, NULL, uv, uv_covariance, 3, NULL));
  CHECK_OK(ptzcal_correspondences_add_points_weighted(set, xyz, xyz_covariance, uv, NULL, 3, NULL));
  holds(12);

  /* The last one is bad: none is added. */
  uv[5] = INFINITY;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_correspondences_add_points(set, xyz, uv, 3, &error));
  CHECK(ptzcal_error_index(error) == 2);
  ptzcal_error_free(error);
  uv[5] = 6;
  uv_covariance[6] = -1;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_correspondences_add_points_weighted(set, xyz, NULL, uv, uv_covariance, 3, NULL));
  uv_covariance[6] = 0; /* zero noise would weigh infinitely */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_correspondences_add_points_weighted(set, xyz, NULL, uv, uv_covariance, 3, NULL));
  xyz_covariance[18] = -1;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_correspondences_add_points_weighted(set, xyz, xyz_covariance, uv, NULL, 3, NULL));
  holds(12);
}

static void shots(void)
{
  double pan_tilt[4] = {0, 0, 0.1, 0.2}, spots[4] = {400, 290, 410, 291}, uv[4] = {1, 2, 3, 4};
  double noise[6] = {1, 0, 1, 1, 0, 1};
  make_rig_model(fixture_rig_model);
  CHECK_OK(ptzcal_correspondences_add_laser_shots(set, fixture_rig_model, pan_tilt, spots, NULL, uv, NULL, 2, NULL));
  CHECK_OK(ptzcal_correspondences_add_laser_shots(set, fixture_rig_model, pan_tilt, spots, noise, uv, noise, 2, NULL));
  holds(16);
  noise[3] = 0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_laser_shots(
                                                   set, fixture_rig_model, pan_tilt, spots, NULL, uv, noise, 2, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_laser_shots(
                                                   set, fixture_rig_model, pan_tilt, spots, noise, uv, NULL, 2, NULL));
  fixture_rig_model->laser_x0 = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_correspondences_add_laser_shots(
                                             set, fixture_rig_model, pan_tilt, spots, NULL, uv, NULL, 2, NULL));
  holds(16);
}

static void lines(void)
{
  ptzcal_error *error = NULL;
  double xyz[12] = {0, 0, 1, 1, 0, 2, 0, 1, 3, 0, 1, 2}, uv[8] = {1, 2, 30, 4, 5, 6, 70, 8};
  double directed[12] = {0, 0, 1, 1, 0, 1, 0, 1, 3, 0, 0, -1};
  double of_xyz[36] = {0}, of_line[72] = {0}, of_uv[12] = {1, 0, 1, 2, 0.5, 1, 1, 0, 3, 1, 0, 1};
  holds(16);
  CHECK_OK(ptzcal_correspondences_add_lines(set, xyz, NULL, uv, NULL, 2, NULL));
  CHECK_OK(ptzcal_correspondences_add_lines(set, xyz, of_xyz, uv, of_uv, 2, NULL));
  CHECK_OK(ptzcal_correspondences_add_directed_lines(set, directed, NULL, uv, NULL, 2, NULL));
  CHECK_OK(ptzcal_correspondences_add_directed_lines(set, directed, of_line, uv, of_uv, 2, NULL));
  CHECK_OK(ptzcal_correspondences_add_lines(set, NULL, NULL, NULL, NULL, 0, NULL));
  CHECK_OK(ptzcal_correspondences_add_directed_lines(set, NULL, NULL, NULL, NULL, 0, NULL));
  holds(24);

  /* The second one is bad: none is added. */
  xyz[10] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_correspondences_add_lines(set, xyz, NULL, uv, NULL, 2, &error));
  CHECK(ptzcal_error_index(error) == 1);
  ptzcal_error_free(error);
  xyz[10] = 1;
  xyz[11] = 3; /* two points that are one */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_lines(set, xyz, NULL, uv, NULL, 2, NULL));
  xyz[11] = 2;
  directed[11] = 0; /* no direction */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_correspondences_add_directed_lines(set, directed, NULL, uv, NULL, 2, NULL));
  directed[11] = INFINITY;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE,
               ptzcal_correspondences_add_directed_lines(set, directed, NULL, uv, NULL, 2, NULL));
  directed[11] = 1e13; /* beyond measure */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_correspondences_add_directed_lines(set, directed, NULL, uv, NULL, 2, NULL));
  directed[11] = -1;
  of_xyz[18] = -1;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_lines(set, xyz, of_xyz, uv, NULL, 2, NULL));
  of_line[36] = -1;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_correspondences_add_directed_lines(set, directed, of_line, uv, NULL, 2, NULL));
  of_uv[11] = 0; /* zero noise would weigh infinitely */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_lines(set, xyz, NULL, uv, of_uv, 2, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_correspondences_add_directed_lines(set, directed, NULL, uv, of_uv, 2, NULL));
  uv[6] = 5, uv[7] = 6; /* a segment without length */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_lines(set, xyz, NULL, uv, NULL, 2, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_correspondences_add_directed_lines(set, directed, NULL, uv, NULL, 2, NULL));
  holds(24);
}

static void sizes(void)
{
  static const uint32_t bad[] = {0, 65537, UINT32_MAX};
  size_t i;
  for (i = 0; i < 3; i++) {
    ptzcal_correspondences *none = set;
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_new(bad[i], 600, &none, NULL));
    CHECK(none == NULL);
    none = set;
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_new(800, bad[i], &none, NULL));
    CHECK(none == NULL);
  }
}

/* One more than a set takes, where it holds 24: refused before memory is taken for them. Pages that nobody
   reads cost nothing. */
static void too_many(void)
{
  ptzcal_error *error = NULL;
  size_t n = 10000000 - 24 + 1;
  double *xyz = calloc(n, 3 * sizeof *xyz), *uv = calloc(n, 2 * sizeof *uv);
  CHECK(xyz != NULL && uv != NULL);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_points(set, xyz, uv, n, &error));
  CHECK(strstr(ptzcal_error_message(error), "10000001"));
  ptzcal_error_free(error);
  make_rig_model(fixture_rig_model);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_laser_shots(
                                                   set, fixture_rig_model, uv, uv, NULL, uv, NULL, n, NULL));
  holds(24);
  free(xyz);
  free(uv);
}

int main(void)
{
  CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
  adding();
  shots();
  lines();
  sizes();
  too_many();
  ptzcal_correspondences_free(set);
  return 0;
}
