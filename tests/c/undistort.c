/* Images without lens distortion, on one thread and on many, and what is refused. */
#include "fixtures.h"
#include <math.h>
#include <pthread.h>
#include <string.h>

#define W 160
#define H 120

static uint8_t source[H][W + 3], picture[3 * W * H], again[4 * W * H];

static void make_lens(ptzcal_camera *camera)
{
  make_camera(camera);
  camera->width = W;
  camera->height = H;
  camera->fx = camera->fy = 130.0;
  camera->cx = 80.5;
  camera->cy = 58.0;
  camera->distortion_model = PTZCAL_DISTORTION_MODEL_BROWN_CONRADY;
  camera->distortion[0] = -0.25;
  camera->distortion[1] = 0.06;
}

/* A ramp, x + y, in rows with padding. */
static void make_ramp(ptzcal_image *image)
{
  int x, y;
  CHECK_OK(ptzcal_image_init(image, sizeof *image));
  for (y = 0; y < H; y++)
    for (x = 0; x < W; x++) source[y][x] = (uint8_t)((x + y) / 2 + 50);
  image->format = PTZCAL_PIXEL_FORMAT_GRAY8;
  image->width = W;
  image->height = H;
  image->plane[0] = source;
  image->stride[0] = W + 3;
  image->size[0] = sizeof source;
}

static void ideal_cameras(void)
{
  ptzcal_camera camera, filled, all;
  make_lens(&camera);
  CHECK_OK(ptzcal_camera_init(&filled, sizeof filled));
  CHECK_OK(ptzcal_camera_init(&all, sizeof all));
  CHECK_OK(ptzcal_camera_undistorted(&camera, 0.0, &filled, NULL));
  CHECK_OK(ptzcal_camera_undistorted(&camera, 1.0, &all, NULL));
  CHECK(filled.width == W && filled.height == H && filled.distortion_model == PTZCAL_DISTORTION_MODEL_NONE);
  CHECK(filled.fx > all.fx && memcmp(filled.rotation, camera.rotation, sizeof camera.rotation) == 0);
  CHECK_NEAR(filled.fx, filled.fy, 1e-9);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_camera_undistorted(&camera, 1.5, &all, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_camera_undistorted(&camera, NAN, &all, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_camera_undistorted(NULL, 0.0, &all, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_camera_undistorted(&camera, 0.0, NULL, NULL));
  /* A lens that folds back inside the image, and one that sees more than 180 degrees. */
  camera.distortion[0] = -1.5;
  camera.distortion[1] = 0.0;
  CHECK_STATUS(PTZCAL_STATUS_LENS_NOT_MONOTONE, ptzcal_camera_undistorted(&camera, 1.0, &all, NULL));
  camera.distortion[0] = 0.0;
  camera.distortion_model = PTZCAL_DISTORTION_MODEL_FISHEYE;
  camera.fx = camera.fy = 40.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_camera_undistorted(&camera, 1.0, &all, NULL));
}

static void pictures(void)
{
  ptzcal_camera camera, ideal, drawn;
  ptzcal_undistorter *undistorter;
  ptzcal_image image;
  uint8_t border[4] = {9, 9, 9, 9};
  int x, y;
  make_lens(&camera);
  make_ramp(&image);
  CHECK_OK(ptzcal_camera_init(&ideal, sizeof ideal));
  CHECK_OK(ptzcal_camera_init(&drawn, sizeof drawn));
  CHECK_OK(ptzcal_camera_undistorted(&camera, 1.0, &ideal, NULL));
  ideal.translation[0] = 77.0; /* not looked at */
  CHECK_OK(ptzcal_undistorter_new(&camera, &ideal, &undistorter, NULL));
  CHECK_OK(ptzcal_undistorter_get_camera(undistorter, &drawn, NULL));
  CHECK(drawn.fx == ideal.fx && drawn.struct_size == sizeof drawn);
  for (x = 0; x < 3; x++) CHECK_NEAR(drawn.translation[x], camera.translation[x], 1e-12);

  CHECK_OK(ptzcal_undistorter_apply(undistorter, &image, picture, W * H, W, NULL));
  for (y = 0; y < H; y += 7) {
    for (x = 0; x < W; x += 7) {
      double pixel[2], ray[3], centre[3], uv[2];
      int i;
      pixel[0] = x, pixel[1] = y;
      CHECK_OK(ptzcal_camera_back_project(&drawn, pixel, 1, ray, NULL));
      CHECK_OK(ptzcal_camera_centre(&drawn, centre, NULL));
      for (i = 0; i < 3; i++) ray[i] += centre[i];
      CHECK_OK(ptzcal_camera_project(&camera, ray, 1, uv, NULL));
      if (uv[0] >= 0 && uv[1] >= 0 && uv[0] <= W - 1 && uv[1] <= H - 1) {
        CHECK_NEAR(picture[y * W + x], (uv[0] + uv[1]) / 2 + 49.75, 1.1);
      } else if (uv[0] < -1.1 || uv[1] < -1.1 || uv[0] > W + 0.1 || uv[1] > H + 0.1) {
        CHECK(picture[y * W + x] == 0);
      }
    }
  }
  CHECK(picture[W / 2] == 0);

  /* A region, bottom-up, with another border. */
  taint(again, sizeof again);
  CHECK_OK(ptzcal_undistorter_apply_region(undistorter, &image, 20, 10, 50, 30, NULL, again, 64 * 30, -64, NULL));
  for (y = 0; y < 30; y++) {
    CHECK(memcmp(again + 64 * (29 - y), picture + (10 + y) * W + 20, 50) == 0);
    CHECK(is_tainted(again + 64 * (29 - y) + 50, 14));
  }
  CHECK_OK(ptzcal_undistorter_apply_region(undistorter, &image, W / 2, 0, 1, 1, border, again, 1, 1, NULL));
  CHECK(again[0] == 9);

  /* Top-down from a bottom-up image is upside down twice. */
  image.plane[0] = source[H - 1];
  image.stride[0] = -(W + 3);
  CHECK_OK(ptzcal_undistorter_apply(undistorter, &image, again, W * H, W, NULL));
  CHECK(memcmp(again, picture, W * H) != 0);
  ptzcal_undistorter_free(undistorter);
  ptzcal_undistorter_free(NULL);
}

static void refused(void)
{
  ptzcal_camera camera, ideal;
  ptzcal_undistorter *undistorter = NULL, *none;
  ptzcal_image image, other;
  make_lens(&camera);
  make_ramp(&image);
  CHECK_OK(ptzcal_camera_init(&ideal, sizeof ideal));
  CHECK_OK(ptzcal_camera_undistorted(&camera, 0.0, &ideal, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_undistorter_new(&camera, &camera, &none, NULL));
  CHECK(none == NULL);
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_undistorter_new(NULL, &ideal, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_undistorter_new(&camera, NULL, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_undistorter_new(&camera, &ideal, NULL, NULL));
  ideal.width = ideal.height = 65536;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_undistorter_new(&camera, &ideal, &none, NULL));
  ideal.width = W;
  ideal.height = H;
  ideal.fx = INFINITY;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_undistorter_new(&camera, &ideal, &none, NULL));
  ideal.fx = ideal.fy;
  CHECK_OK(ptzcal_undistorter_new(&camera, &ideal, &undistorter, NULL));

  taint(again, sizeof again);
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_undistorter_apply(NULL, &image, again, W * H, W, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_undistorter_apply(undistorter, NULL, again, W * H, W, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_undistorter_apply(undistorter, &image, NULL, W * H, W, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_undistorter_apply(undistorter, &image, again, W * H - 1, W, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_undistorter_apply(undistorter, &image, again, 0, W, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_undistorter_apply(undistorter, &image, again, W * H, W - 1, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_undistorter_apply(undistorter, &image, again, W * H, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_undistorter_apply(undistorter, &image, again, SIZE_MAX, W, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_undistorter_apply(undistorter, &image, again, W * H, PTRDIFF_MIN, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_undistorter_apply(undistorter, &image, again, W * H, PTRDIFF_MAX, NULL));
  /* Into the image itself. */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_undistorter_apply(undistorter, &image, &source[H - 1][5], W * H, W, NULL));
  /* Another size, another format. */
  other = image;
  other.width--;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_undistorter_apply(undistorter, &other, again, W * H, W, NULL));
  other = image;
  other.format = 99;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_undistorter_apply(undistorter, &other, again, W * H, W, NULL));
  other.format = PTZCAL_PIXEL_FORMAT_NV12;
  other.plane[1] = source;
  other.stride[1] = W;
  other.size[1] = sizeof source;
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_undistorter_apply(undistorter, &other, again, W * H, W, NULL));
  /* Regions. */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_undistorter_apply_region(undistorter, &image, 1, 0, W, H, NULL, again, W * H, W, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_undistorter_apply_region(undistorter, &image, 0, 0, 0, H, NULL, again, W * H, W, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_undistorter_apply_region(undistorter, &image, 0, 0, W, 0, NULL, again, W * H, W, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_undistorter_apply_region(undistorter, &image, UINT32_MAX, 1, 2, 2, NULL, again, W * H, W, NULL));
  CHECK(is_tainted(again, sizeof again));
  ptzcal_undistorter_free(undistorter);
}

/* One undistorter, many threads: each draws its rows. */
static ptzcal_undistorter *shared;
static ptzcal_image shared_image;

static void *draw(void *at)
{
  uint32_t y = (uint32_t)((uint8_t *)at - picture) / W;
  CHECK_OK(ptzcal_undistorter_apply_region(shared, &shared_image, 0, y, W, H / 4, NULL, (uint8_t *)at, W * (H / 4), W, NULL));
  return NULL;
}

static void threads(void)
{
  pthread_t thread[4];
  ptzcal_camera camera, ideal;
  int i;
  make_lens(&camera);
  make_ramp(&shared_image);
  CHECK_OK(ptzcal_camera_init(&ideal, sizeof ideal));
  CHECK_OK(ptzcal_camera_undistorted(&camera, 0.5, &ideal, NULL));
  CHECK_OK(ptzcal_undistorter_new(&camera, &ideal, &shared, NULL));
  for (i = 0; i < 4; i++) CHECK(pthread_create(&thread[i], NULL, draw, picture + i * (H / 4) * W) == 0);
  for (i = 0; i < 4; i++) CHECK(pthread_join(thread[i], NULL) == 0);
  CHECK_OK(ptzcal_undistorter_apply(shared, &shared_image, again, W * H, W, NULL));
  CHECK(memcmp(picture, again, W * H) == 0);
  ptzcal_undistorter_free(shared);
}

int main(void)
{
  ideal_cameras();
  pictures();
  refused();
  threads();
  return 0;
}
