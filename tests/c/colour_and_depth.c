/* A fixed camera from a view with depth, drawn here: a wall and boxes before it, with a texture. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define W 320
#define H 240
#define AUXILIARY_F 300.0
#define FIXED_F 340.0

/* Left, right, top, bottom, depth, metres; the nearest first. */
static const double layers[6][5] = {{-0.7, -0.2, -0.6, 0.1, 1.4}, {0.1, 0.6, 0.0, 0.6, 1.6}, {-0.1, 0.7, -0.8, -0.25, 2.0},
  {-1.0, -0.35, 0.2, 0.8, 2.3}, {0.7, 1.4, -0.5, 0.7, 2.6}, {-9, 9, -9, 9, 3.2}};

static double corner(int layer, int x, int y)
{
  uint32_t h = (uint32_t)x * 73856093u ^ (uint32_t)y * 19349663u ^ (uint32_t)layer * 83492791u;
  h = (h ^ (h >> 13)) * 1274126177u;
  return (double)((h ^ (h >> 16)) & 0xff);
}

/* Smooth between the corners of cells of 4 cm. */
static double texture(int layer, double x, double y)
{
  const double u = x / 0.04, v = y / 0.04;
  const int i = (int)floor(u), j = (int)floor(v);
  double s = u - i, t = v - j;
  s = s * s * (3 - 2 * s), t = t * t * (3 - 2 * t);
  return (corner(layer, i, j) * (1 - s) + corner(layer, i + 1, j) * s) * (1 - t)
    + (corner(layer, i, j + 1) * (1 - s) + corner(layer, i + 1, j + 1) * s) * t;
}

static uint8_t auxiliary[H][W], fixed[H][W], flat[H][W];
static uint16_t depth[H][W];

/* What a camera at (cx, cy, cz) sees, that looks along z. */
static void paint(uint8_t image[H][W], double f, double cx, double cy, double cz, int with_depth)
{
  uint32_t state = with_depth ? 5 : 6;
  int x, y, i;
  for (y = 0; y < H; y++) {
    for (x = 0; x < W; x++) {
      for (i = 0; i < 6; i++) {
        const double *l = layers[i], z = l[4] - cz, X = cx + (x - 159.5) / f * z, Y = cy + (y - 119.5) / f * z;
        if (X < l[0] || X > l[1] || Y < l[2] || Y > l[3]) continue;
        image[y][x] = (uint8_t)(0.9 * texture(i, X, Y) + 12.0 + 1.5 * fixture_random(&state));
        if (with_depth) depth[y][x] = (uint16_t)(1000.0 * l[4] + 0.5);
        break;
      }
    }
  }
}

static ptzcal_camera camera;
static ptzcal_depth_map *map;

static ptzcal_status add(ptzcal_rgbd *rgbd, uint8_t image[H][W], ptzcal_rgbd_view *counts)
{
  ptzcal_image view;
  make_image(&view, image, W, H);
  return ptzcal_rgbd_add_view(rgbd, &view, map, &camera, counts, NULL);
}

static void calibrated(void)
{
  static double pairs[4000 * PTZCAL_RGBD_PAIR_SIZE];
  ptzcal_image view;
  ptzcal_rgbd *rgbd;
  ptzcal_rgbd_view counts;
  ptzcal_rgbd_options options;
  ptzcal_calibration *calibration;
  ptzcal_calibration_summary summary;
  ptzcal_camera found;
  static double lines[1000 * PTZCAL_RGBD_LINE_SIZE];
  size_t needed, n_lines;
  double centre[3];
  CHECK_OK(ptzcal_rgbd_view_init(&counts, sizeof counts));
  CHECK_OK(ptzcal_rgbd_options_init(&options, sizeof options));
  CHECK(options.min_pairs == 20 && options.guided == 1 && options.lines == 1);
  make_image(&view, fixed, W, H);
  CHECK_OK(ptzcal_rgbd_new(&view, &options, &rgbd, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_rgbd_copy_pairs(rgbd, NULL, 0, &needed, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_rgbd_copy_lines(rgbd, NULL, 0, &needed, NULL));
  /* Nothing yet, and a view that has nothing. */
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_rgbd_calibrate(rgbd, NULL, &calibration, NULL));
  CHECK_OK(add(rgbd, flat, &counts));
  CHECK(counts.features == 0 && counts.pairs == 0);
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_rgbd_calibrate(rgbd, NULL, &calibration, NULL));
  CHECK_OK(add(rgbd, auxiliary, &counts));
  CHECK(counts.pairs > 60 && counts.pairs <= counts.matches && counts.with_depth <= counts.features);
  CHECK_OK(ptzcal_rgbd_calibrate(rgbd, NULL, &calibration, NULL));
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_calibration_get_camera(calibration, &found, NULL));
  CHECK_OK(ptzcal_calibration_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_calibration_get_summary(calibration, &summary, NULL));
  CHECK_OK(ptzcal_camera_centre(&found, centre, NULL));
  CHECK_NEAR(found.fx, FIXED_F, 0.01 * FIXED_F);
  CHECK_NEAR(found.fy, FIXED_F, 0.01 * FIXED_F);
  CHECK_NEAR(centre[0], 0.15, 0.02);
  CHECK_NEAR(centre[1], -0.05, 0.02);
  CHECK_NEAR(centre[2], 0.1, 0.02);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_rgbd_copy_pairs(rgbd, pairs, 3, &needed, NULL));
  CHECK_OK(ptzcal_rgbd_copy_lines(rgbd, lines, sizeof lines / sizeof *lines, &n_lines, NULL));
  n_lines /= PTZCAL_RGBD_LINE_SIZE;
  CHECK(needed == PTZCAL_RGBD_PAIR_SIZE * (summary.measurements - n_lines));
  CHECK_OK(ptzcal_rgbd_copy_pairs(rgbd, pairs, sizeof pairs / sizeof *pairs, &needed, NULL));
  /* Of the second view, before the wall. */
  CHECK(pairs[0] == 1.0 && pairs[7] > 1.3 && pairs[7] < 3.3);
  ptzcal_calibration_free(calibration);
  /* Without the guide, and with a known noise. */
  ptzcal_rgbd_free(rgbd);
  options.guided = options.lines = 0;
  options.keypoint_sigma = 0.3;
  CHECK_OK(ptzcal_rgbd_new(&view, &options, &rgbd, NULL));
  CHECK_OK(add(rgbd, auxiliary, NULL));
  CHECK_OK(ptzcal_rgbd_calibrate(rgbd, NULL, &calibration, NULL));
  ptzcal_calibration_free(calibration);
  ptzcal_rgbd_free(rgbd);
}

static void refused(void)
{
  ptzcal_image view;
  ptzcal_rgbd *rgbd;
  ptzcal_rgbd_options options;
  ptzcal_depth_map *small;
  ptzcal_camera other = camera;
  make_image(&view, fixed, W, H);
  CHECK_OK(ptzcal_rgbd_options_init(&options, sizeof options));
  options.guided = 2;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rgbd_new(&view, &options, &rgbd, NULL));
  options.guided = 1, options.min_pairs = 3;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rgbd_new(&view, &options, &rgbd, NULL));
  options.min_pairs = 20, options.keypoint_sigma = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rgbd_new(&view, &options, &rgbd, NULL));
  options.keypoint_sigma = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_rgbd_new(&view, &options, &rgbd, NULL));
  options.keypoint_sigma = 0.0, options.inverse_depth_sigma = options.depth_sigma = 0.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rgbd_new(&view, &options, &rgbd, NULL));
  view.width = view.height = 1;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rgbd_new(&view, NULL, &rgbd, NULL));
  CHECK(rgbd == NULL);
  make_image(&view, fixed, W, H);
  CHECK_OK(ptzcal_rgbd_new(&view, NULL, &rgbd, NULL));
  CHECK_OK(ptzcal_depth_map_new_u16(depth[0], W, H - 1, W, 0.001, &small, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rgbd_add_view(rgbd, &view, small, &camera, NULL, NULL));
  other.width = W + 1;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_rgbd_add_view(rgbd, &view, map, &other, NULL, NULL));
  ptzcal_depth_map_free(small);
  ptzcal_rgbd_free(rgbd);
}

int main(void)
{
  int i;
  memset(flat, 90, sizeof flat);
  paint(auxiliary, AUXILIARY_F, 0.0, 0.0, 0.0, 1);
  paint(fixed, FIXED_F, 0.15, -0.05, 0.1, 0);
  CHECK_OK(ptzcal_depth_map_new_u16(depth[0], W, H, W, 0.001, &map, NULL));
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  camera.width = W, camera.height = H;
  camera.fx = camera.fy = AUXILIARY_F;
  camera.cx = 159.5, camera.cy = 119.5;
  for (i = 0; i < 3; i++) camera.rotation[4 * i] = 1.0;
  calibrated();
  refused();
  ptzcal_depth_map_free(map);
  return 0;
}
