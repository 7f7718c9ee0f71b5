/* Calibration from lines, alone and with points: a known camera is found again. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define N FIXTURE_POINTS
#define LINES (N / 2)

static double xyz[3 * N], uv[2 * N];

/* Points 2 i and 2 i + 1 span line i; its segment is seen from another pair of points of it. */
static void add_lines(ptzcal_correspondences *set, const ptzcal_camera *truth, int directed)
{
  double shown[6 * LINES], ends[4 * LINES], lines[6 * LINES];
  size_t i, k;
  for (i = 0; i < LINES; i++)
    for (k = 0; k < 3; k++) {
      const double a = xyz[6 * i + k], b = xyz[6 * i + 3 + k];
      shown[6 * i + k] = a + 0.1 * (b - a);
      shown[6 * i + 3 + k] = a + 0.8 * (b - a);
      lines[6 * i + k] = a;
      lines[6 * i + 3 + k] = directed ? 7.0 * (a - b) : b;
    }
  CHECK_OK(ptzcal_camera_project(truth, shown, 2 * LINES, ends, NULL));
  if (directed)
    CHECK_OK(ptzcal_correspondences_add_directed_lines(set, lines, NULL, ends, NULL, LINES, NULL));
  else
    CHECK_OK(ptzcal_correspondences_add_lines(set, lines, NULL, ends, NULL, LINES, NULL));
}

static void found_again(const ptzcal_camera *truth, const ptzcal_correspondences *set, size_t n)
{
  ptzcal_calibration *result;
  ptzcal_calibration_summary summary;
  ptzcal_camera found;
  double centre[3], residuals[2 * (N + LINES)];
  size_t needed, i;
  CHECK_OK(ptzcal_calibrate_camera(set, NULL, &result, NULL));
  CHECK_OK(ptzcal_calibration_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_calibration_get_summary(result, &summary, NULL));
  CHECK(summary.measurements == n && summary.inliers == n && summary.rms < 1e-3);
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_calibration_get_camera(result, &found, NULL));
  CHECK_OK(ptzcal_camera_centre(&found, centre, NULL));
  /* fx / fy is 845 / 845.5: the prior pulls a little at data without noise. */
  CHECK_NEAR(found.fx, truth->fx, 0.1);
  CHECK_NEAR(centre[0], 0.5, 1e-3);
  CHECK_NEAR(centre[2], -1.0, 1e-3);
  CHECK_OK(ptzcal_calibration_copy_residuals(result, residuals, 2 * n, &needed, NULL));
  CHECK(needed == 2 * n);
  for (i = 0; i < 2 * n; i++) CHECK_NEAR(residuals[i], 0.0, 0.01);
  ptzcal_calibration_free(result);
}

int main(void)
{
  ptzcal_camera truth;
  ptzcal_correspondences *set;
  ptzcal_calibration *none = NULL;
  ptzcal_error *error = NULL;
  double parallel[6 * 20], ends[4 * 20];
  size_t i;
  int directed;
  make_camera(&truth);
  make_points(&truth, xyz, uv, N, 0.0);
  for (directed = 0; directed < 2; directed++) {
    CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
    add_lines(set, &truth, directed);
    found_again(&truth, set, LINES);
    CHECK_OK(ptzcal_correspondences_add_points(set, xyz, uv, N, NULL));
    found_again(&truth, set, N + LINES);
    ptzcal_correspondences_free(set);
  }

  /* Parallel lines cannot tell. */
  for (i = 0; i < 20; i++) {
    memcpy(parallel + 6 * i, xyz + 3 * i, 3 * sizeof *xyz);
    parallel[6 * i + 3] = xyz[3 * i] + 0.2;
    parallel[6 * i + 4] = xyz[3 * i + 1] + 0.1;
    parallel[6 * i + 5] = xyz[3 * i + 2] + 0.3;
  }
  CHECK_OK(ptzcal_camera_project(&truth, parallel, 40, ends, NULL));
  CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
  CHECK_OK(ptzcal_correspondences_add_lines(set, parallel, NULL, ends, NULL, 20, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_calibrate_camera(set, NULL, &none, &error));
  CHECK(none == NULL && strstr(ptzcal_error_hint(error), "parallel") != NULL);
  ptzcal_error_free(error);
  ptzcal_correspondences_free(set);
  return 0;
}
