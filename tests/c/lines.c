/* Edges, line segments, lines in space and their matches, from the caller's memory to a calibrated camera;
   and what is refused. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define W 240
#define H 180
#define MOST 256

static uint8_t pixels[H][W];
static double uv[MOST][4], uv_covariance[MOST][6], ends[MOST][4], details[MOST][3], edges[W * H][5];

/* Normal distribution's integral. */
static double step(double z) { return 0.5 * erfc(-z / sqrt(2.0)); }

/* A bright turned rectangle, blurred by 0.9 pixels: its four sides are at known places. */
#define CX 118.3
#define CY 91.7
#define HALF_U 70.0
#define HALF_V 45.0
#define TURN 0.25

static void paint(void)
{
  uint32_t state = 9;
  int x, y;
  for (y = 0; y < H; y++)
    for (x = 0; x < W; x++) {
      const double u = cos(TURN) * (x - CX) + sin(TURN) * (y - CY), v = cos(TURN) * (y - CY) - sin(TURN) * (x - CX);
      const double s = sqrt(0.81 + 1.0 / 12.0);
      const double inside = (step((u + HALF_U) / s) - step((u - HALF_U) / s)) * (step((v + HALF_V) / s) - step((v - HALF_V) / s));
      pixels[y][x] = (uint8_t)(60.0 + 110.0 * inside + 2.0 * fixture_random(&state) + 0.5);
    }
}

static void segments_found(const ptzcal_image *image)
{
  size_t count = 0, i, k;
  int sides[4] = {0, 0, 0, 0};
  CHECK_OK(ptzcal_detect_line_segments(image, NULL, uv[0], uv_covariance[0], ends[0], details[0], MOST, &count, NULL));
  CHECK(count == 4);
  for (i = 0; i < count; i++) {
    const double *p = uv[i], *e = ends[i], *c = uv_covariance[i];
    for (k = 0; k < 2; k++) {
      const double dx = p[2 * k] - CX, dy = p[2 * k + 1] - CY;
      const double u = cos(TURN) * dx + sin(TURN) * dy, v = cos(TURN) * dy - sin(TURN) * dx;
      const double off = fmin(fabs(fabs(u) - HALF_U), fabs(fabs(v) - HALF_V));
      CHECK(off < 0.06 && off < 5.0 * sqrt(c[3 * k]) + 0.02);
      CHECK(c[3 * k] > 0.0 && c[3 * k] < 0.01 && c[3 * k + 1] == 0.0 && c[3 * k + 2] == c[3 * k]);
      sides[fabs(fabs(u) - HALF_U) < 1.0 ? (u > 0.0) : 2 + (v > 0.0)]++;
    }
    /* The bright side is on the right: the middle of the rectangle is. */
    CHECK((e[2] - e[0]) * (CY - e[1]) - (e[3] - e[1]) * (CX - e[0]) > 0.0);
    CHECK(fabs(details[i][0] - 110.0) < 6.0 && fabs(details[i][1] - 0.94) < 0.2 && details[i][2] > 80.0);
    CHECK(i == 0 || details[i][2] <= details[i - 1][2]);
  }
  for (k = 0; k < 4; k++) CHECK(sides[k] == 2);
  /* Only what is asked for. */
  CHECK_OK(ptzcal_detect_line_segments(image, NULL, uv[0], NULL, NULL, NULL, MOST, &count, NULL));
  CHECK(count == 4);
}

static void segments_refused(const ptzcal_image *image)
{
  ptzcal_line_options options;
  ptzcal_image broken = *image;
  size_t count = 0;
  const double before = uv[0][0];
  uv[0][0] = -7.0;
  CHECK_OK(ptzcal_line_options_init(&options, sizeof options));
  CHECK(options.max_segments == 10000 && options.min_length == 20.0 && options.min_contrast == 12.0 && options.max_gap == 40.0);
#define DETECT(image, capacity) ptzcal_detect_line_segments(image, &options, uv[0], NULL, NULL, NULL, capacity, &count, NULL)
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, DETECT(image, 3));
  CHECK(count == 4 && uv[0][0] == -7.0);
  options.min_length = 7.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, DETECT(image, MOST));
  options.min_length = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, DETECT(image, MOST));
  options.min_length = 1e300;
  CHECK_OK(DETECT(image, MOST));
  CHECK(count == 0);
  options.min_length = 20.0;
  options.min_contrast = 0.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, DETECT(image, MOST));
  options.min_contrast = 256.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, DETECT(image, MOST));
  options.min_contrast = 12.0;
  options.max_gap = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, DETECT(image, MOST));
  options.max_gap = INFINITY;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, DETECT(image, MOST));
  options.max_gap = 0.0;
  options.max_segments = 0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, DETECT(image, MOST));
  options.max_segments = 2;
  CHECK_OK(DETECT(image, 2));
  CHECK(count == 2);
  broken.size[0] -= 1;
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, DETECT(&broken, MOST));
  /* One pixel and one row have no lines. */
  broken = *image;
  broken.width = broken.height = 1;
  CHECK_OK(DETECT(&broken, MOST));
  CHECK(count == 0);
  broken.width = W;
  CHECK_OK(DETECT(&broken, MOST));
  CHECK(count == 0);
  uv[0][0] = before;
}

static void canny(const ptzcal_image *image)
{
  size_t count = 0, i;
  CHECK_OK(ptzcal_detect_edges(image, 0.0, 8.0, 16.0, edges[0], W * H, &count, NULL));
  /* The outline's length, in columns and rows. */
  CHECK(count > 350 && count < 600);
  for (i = 0; i < count; i++) {
    const double dx = edges[i][0] - CX, dy = edges[i][1] - CY;
    const double u = cos(TURN) * dx + sin(TURN) * dy, v = cos(TURN) * dy - sin(TURN) * dx;
    /* Corners are round. */
    if (fabs(fabs(u) - HALF_U) > 4.0 || fabs(fabs(v) - HALF_V) > 4.0)
      CHECK(fmin(fabs(fabs(u) - HALF_U), fabs(fabs(v) - HALF_V)) < 0.35);
    CHECK(dx * edges[i][2] + dy * edges[i][3] < 0.0 && edges[i][4] >= 8.0);
    CHECK_NEAR(hypot(edges[i][2], edges[i][3]), 1.0, 1e-12);
  }
  CHECK_OK(ptzcal_detect_edges(image, 1.5, 4.0, 8.0, edges[0], W * H, &i, NULL));
  CHECK(i > 350 && i < 600);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_detect_edges(image, 0.0, 8.0, 16.0, edges[0], count - 1, &i, NULL));
  CHECK(i == count);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_detect_edges(image, -1.0, 8.0, 16.0, edges[0], 0, &count, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_detect_edges(image, 11.0, 8.0, 16.0, edges[0], 0, &count, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_detect_edges(image, 0.0, 16.0, 8.0, edges[0], 0, &count, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_detect_edges(image, 0.0, 0.0, 8.0, edges[0], 0, &count, NULL));
}

#define POINTS 60

static void fitted(void)
{
  double xyz[POINTS][3], covariance[POINTS][9], line[6], line_covariance[36], extent[2], factor = 0.0, miss[3];
  uint8_t inliers[POINTS];
  ptzcal_line_fit_options options;
  uint32_t state = 3;
  size_t i, k;
  CHECK_OK(ptzcal_line_fit_options_init(&options, sizeof options));
  CHECK(options.robust == 1 && options.seed == 1 && options.min_inliers == 0.3 && options.sigma == 0.01);
  /* (1, 2, 3) + s (0.6, 0, 0.8), s from 0 to 2; every fourth point is somewhere else. */
  memset(covariance, 0, sizeof covariance);
  for (i = 0; i < POINTS; i++) {
    const double s = 2.0 * (double)i / (POINTS - 1), wrong = i % 4 == 3 ? 0.4 : 0.0;
    const double at[3] = {1.0 + 0.6 * s, 2.0 + wrong, 3.0 + 0.8 * s};
    for (k = 0; k < 3; k++) {
      xyz[i][k] = at[k] + 0.005 * fixture_random(&state);
      covariance[i][4 * k] = 0.003 * 0.003;
    }
  }
  CHECK_OK(ptzcal_fit_line_3d(xyz[0], covariance[0], POINTS, &options, line, line_covariance, extent, inliers, &factor, NULL));
  for (i = 0; i < POINTS; i++) CHECK(inliers[i] == (i % 4 != 3));
  CHECK_NEAR(fabs(0.6 * line[3] + 0.8 * line[5]), 1.0, 1e-5);
  CHECK(line_covariance[0] > 0.0 && line_covariance[35] > 0.0 && line_covariance[1] == line_covariance[6]);
  CHECK_NEAR(extent[1] - extent[0], 2.0, 0.1);
  CHECK(factor > 0.5 && factor < 1.5);
  /* The point is on the line. */
  miss[0] = line[0] - 1.0, miss[1] = line[1] - 2.0, miss[2] = line[2] - 3.0;
  CHECK_NEAR(0.8 * miss[0] - 0.6 * miss[2], 0.0, 0.003);
  CHECK_NEAR(miss[1], 0.0, 0.003);
  CHECK_OK(ptzcal_fit_line_3d(xyz[0], NULL, POINTS, NULL, line, NULL, NULL, NULL, NULL, NULL));
#define FIT(covariance, n) ptzcal_fit_line_3d(xyz[0], covariance, n, &options, line, NULL, NULL, NULL, NULL, NULL)
  options.robust = 2;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, FIT(NULL, POINTS));
  options.robust = 1;
  options.sigma = 0.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, FIT(NULL, POINTS));
  CHECK_OK(FIT(covariance[0], POINTS));
  options.sigma = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, FIT(NULL, POINTS));
  options.sigma = 0.01;
  options.outlier_threshold = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, FIT(NULL, POINTS));
  options.outlier_threshold = 3.7;
  options.min_inliers = 1.5;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, FIT(NULL, POINTS));
  options.min_inliers = 0.9;
  CHECK_STATUS(PTZCAL_STATUS_NO_CONSENSUS, FIT(covariance[0], POINTS));
  options.min_inliers = 0.3;
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, FIT(NULL, 1));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, FIT(NULL, 0));
  covariance[7][4] = 0.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, FIT(covariance[0], POINTS));
  covariance[7][4] = 1e-5;
  for (i = 0; i < POINTS; i++)
    for (k = 0; k < 3; k++) xyz[i][k] = (double)k + 0.001 * fixture_random(&state);
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, FIT(NULL, POINTS));
}

/* The rectangle as a card 2 m away, before a wall at 3 m. */
static void lifted(const ptzcal_image *image)
{
  static float depths[H][W];
  double lines[MOST][6], covariances[MOST][36], extents[MOST][2];
  uint8_t found[MOST];
  ptzcal_depth_map *map, *small;
  ptzcal_camera camera;
  size_t count = 0, i;
  int x, y;
  for (y = 0; y < H; y++)
    for (x = 0; x < W; x++) {
      const double u = cos(TURN) * (x - CX) + sin(TURN) * (y - CY), v = cos(TURN) * (y - CY) - sin(TURN) * (x - CX);
      depths[y][x] = fabs(u) < HALF_U && fabs(v) < HALF_V ? 2.0f : 3.0f;
    }
  CHECK_OK(ptzcal_depth_map_new_f32(depths[0], W, H, W, 1.0, &map, NULL));
  CHECK_OK(ptzcal_depth_map_new_f32(depths[0], W - 1, H, W, 1.0, &small, NULL));
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  camera.width = W;
  camera.height = H;
  camera.fx = camera.fy = 260.0;
  camera.cx = 119.5;
  camera.cy = 89.5;
  CHECK_OK(ptzcal_detect_line_segments(image, NULL, uv[0], uv_covariance[0], ends[0], NULL, MOST, &count, NULL));
#define LIFT(map, inverse_depth_sigma, depth_sigma) \
  ptzcal_lift_line_segments(uv[0], uv_covariance[0], ends[0], count, &camera, map, inverse_depth_sigma, depth_sigma, lines[0], covariances[0], extents[0], found, NULL)
  CHECK_OK(LIFT(map, 0.0014, 0.001));
  for (i = 0; i < count; i++) {
    const double *l = lines[i];
    CHECK(found[i] == 1);
    CHECK_NEAR(l[2], 2.0, 1e-3);
    CHECK_NEAR(l[3] * l[3] + l[4] * l[4] + l[5] * l[5], 1.0, 1e-9);
    /* In the segment's direction, as long as it is seen. */
    CHECK(l[3] * (ends[i][2] - ends[i][0]) + l[4] * (ends[i][3] - ends[i][1]) > 0.0);
    CHECK_NEAR((extents[i][1] - extents[i][0]) * 130.0, hypot(ends[i][2] - ends[i][0], ends[i][3] - ends[i][1]), 0.5);
    CHECK(covariances[i][14] > 0.0 && covariances[i][14] < 1e-3);
  }
  CHECK_OK(ptzcal_lift_line_segments(uv[0], NULL, ends[0], count, &camera, map, 0.0014, 0.0, lines[0], NULL, NULL, found, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, LIFT(small, 0.0014, 0.001));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, LIFT(map, 0.0, 0.0));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, LIFT(map, -1.0, 0.001));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, LIFT(map, 0.0014, NAN));
  ends[0][2] = ends[0][0];
  ends[0][3] = ends[0][1];
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, LIFT(map, 0.0014, 0.001));
  ptzcal_depth_map_free(map);
  ptzcal_depth_map_free(small);
}

#define LINES 40

static ptzcal_camera truth;

static void make_truth(void)
{
  const double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  CHECK_OK(ptzcal_camera_init(&truth, sizeof truth));
  truth.width = 800;
  truth.height = 600;
  truth.fx = truth.fy = 845.0;
  truth.cx = 410.0;
  truth.cy = 290.0;
  memcpy(truth.rotation, rotation, sizeof rotation);
  truth.translation[0] = 0.1;
}

/* Lines of a room by a first camera that is a few pixels off, and the camera from all matches. */
static void matched_and_calibrated(void)
{
  double lines[LINES][6], exact[LINES][36], extents[LINES][2], seen[LINES][4], noise[LINES][6], tips[LINES][4];
  double residuals[LINES][2], found_lines[LINES][6], found_uv[LINES][4], found_noise[LINES][6];
  uint32_t pairs[LINES][2], state = 21;
  size_t count = 0, i, k;
  ptzcal_camera first;
  ptzcal_line_match_options options;
  ptzcal_correspondences *set;
  ptzcal_calibration *calibration;
  ptzcal_camera camera;
  make_truth();
  memset(exact, 0, sizeof exact);
  for (i = 0; i < LINES; i++) {
    double a[3], b[3], ab[6], pixel[4];
    for (;;) {
      for (k = 0; k < 3; k++) {
        a[k] = (k == 2 ? 3.5 : 0.0) + 1.6 * (fixture_random(&state) - 0.0);
        b[k] = (k == 2 ? 3.5 : 0.0) + 1.6 * (fixture_random(&state) - 0.0);
      }
      memcpy(ab, a, sizeof a);
      memcpy(ab + 3, b, sizeof b);
      if (ptzcal_camera_project(&truth, ab, 2, pixel, NULL) == PTZCAL_STATUS_OK && pixel[0] > 5 && pixel[0] < 795 && pixel[1] > 5 &&
          pixel[1] < 595 && pixel[2] > 5 && pixel[2] < 795 && pixel[3] > 5 && pixel[3] < 595 &&
          hypot(pixel[2] - pixel[0], pixel[3] - pixel[1]) > 80.0)
        break;
    }
    for (k = 0; k < 3; k++) {
      lines[i][k] = a[k];
      lines[i][3 + k] = b[k] - a[k];
    }
    extents[i][0] = 0.0;
    extents[i][1] = 1.0;
    /* Segment i shows line (7 i) mod LINES. */
    for (k = 0; k < 4; k++) {
      const size_t s = (7 * i) % LINES;
      tips[s][k] = pixel[k];
      seen[s][k] = pixel[k] + 0.05 * fixture_random(&state);
    }
  }
  for (i = 0; i < LINES; i++) {
    const double c[6] = {0.0025, 0.0, 0.0025, 0.0025, 0.0, 0.0025};
    memcpy(noise[i], c, sizeof c);
  }
  first = truth;
  first.fx = first.fy = 848.0;
  first.cx += 1.5;
  first.translation[1] -= 0.004;
  CHECK_OK(ptzcal_line_match_options_init(&options, sizeof options));
  CHECK(options.same_polarity == 1 && options.camera_sigma == 2.0 && options.max_distance == 3.0 && options.min_lead == 9.0);
#define MATCH(camera, options, capacity) \
  ptzcal_match_lines(lines[0], exact[0], extents[0], LINES, camera, seen[0], noise[0], tips[0], LINES, options, pairs[0], residuals[0], capacity, &count, NULL)
  CHECK_OK(MATCH(&first, &options, LINES));
  CHECK(count >= LINES / 2);
  for (i = 0; i < count; i++) {
    const uint32_t line = pairs[i][0], segment = pairs[i][1];
    CHECK(segment == (7 * line) % LINES);
    CHECK(fabs(residuals[i][0]) < 8.0 && fabs(residuals[i][1]) < 8.0);
    memcpy(found_lines[i], lines[line], sizeof lines[0]);
    memcpy(found_uv[i], seen[segment], sizeof seen[0]);
    memcpy(found_noise[i], noise[segment], sizeof noise[0]);
  }
  CHECK_OK(ptzcal_correspondences_new(800, 600, &set, NULL));
  CHECK_OK(ptzcal_correspondences_add_directed_lines(set, found_lines[0], NULL, found_uv[0], found_noise[0], count, NULL));
  CHECK_OK(ptzcal_calibrate_camera(set, NULL, &calibration, NULL));
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  CHECK_OK(ptzcal_calibration_get_camera(calibration, &camera, NULL));
  CHECK_NEAR(camera.fx, 845.0, 2.0);
  CHECK_NEAR(camera.translation[0], 0.1, 0.01);
  ptzcal_calibration_free(calibration);
  ptzcal_correspondences_free(set);
  /* The same without covariances, outputs that are not wanted, and no options. */
  CHECK_OK(ptzcal_match_lines(lines[0], NULL, extents[0], LINES, &truth, seen[0], NULL, tips[0], LINES, NULL, pairs[0], NULL, LINES, &count, NULL));
  CHECK(count >= LINES / 2);
  k = count;
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL,
               ptzcal_match_lines(lines[0], NULL, extents[0], LINES, &truth, seen[0], NULL, tips[0], LINES, NULL, pairs[0], NULL, k - 1, &count, NULL));
  CHECK(count == k);
  /* Against the light: the same with all directions turned round is nothing, unless either will do. */
  for (i = 0; i < LINES; i++) {
    for (k = 0; k < 3; k++) lines[i][3 + k] *= -1.0;
    extents[i][0] = -1.0;
    extents[i][1] = 0.0;
  }
  CHECK_OK(MATCH(&truth, &options, LINES));
  CHECK(count == 0);
  options.same_polarity = 0;
  CHECK_OK(MATCH(&truth, &options, LINES));
  CHECK(count >= LINES / 2);
  CHECK_OK(ptzcal_match_lines(NULL, NULL, NULL, 0, &truth, NULL, NULL, NULL, 0, NULL, NULL, NULL, 0, &count, NULL));
  CHECK(count == 0);
  options.same_polarity = 3;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, MATCH(&truth, &options, LINES));
  options.same_polarity = 1;
  options.camera_sigma = 0.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, MATCH(&truth, &options, LINES));
  options.camera_sigma = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, MATCH(&truth, &options, LINES));
  options.camera_sigma = 2.0;
  options.min_overlap = 1.1;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, MATCH(&truth, &options, LINES));
  options.min_overlap = 0.5;
  first.fx = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, MATCH(&first, &options, LINES));
  lines[3][3] = lines[3][4] = lines[3][5] = 0.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, MATCH(&truth, &options, LINES));
  lines[3][3] = 1.0;
  memcpy(seen[2] + 2, seen[2], 2 * sizeof(double));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, MATCH(&truth, &options, LINES));
}

int main(void)
{
  ptzcal_image image;
  paint();
  make_image(&image, pixels, W, H);
  segments_found(&image);
  segments_refused(&image);
  canny(&image);
  fitted();
  lifted(&image);
  matched_and_calibrated();
  return 0;
}
