/* SIFT features from the caller's memory: found, copied, made again, matched; and what is refused. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define W 160
#define H 120
#define SHIFT 7
#define MOST 512
#define NUMBERS PTZCAL_SIFT_KEYPOINT_SIZE
#define BYTES PTZCAL_SIFT_DESCRIPTOR_SIZE

static uint8_t first[H][W], second[H][W];
static double keypoints[MOST * NUMBERS], others[MOST * NUMBERS], distances[MOST * 2];
static uint8_t descriptors[MOST * BYTES], again[MOST * BYTES];
static uint32_t pairs[MOST * 2];

/* Soft blobs in the same places of both images, but for a shift of SHIFT columns. */
static void paint(void)
{
  uint32_t state = 5;
  static double level[H][W + SHIFT];
  int i, x, y;
  for (y = 0; y < H; y++)
    for (x = 0; x < W + SHIFT; x++) level[y][x] = 120.0;
  for (i = 0; i < 150; i++) {
    const double cx = W * fixture_random(&state), cy = H * fixture_random(&state);
    const double sigma = 2.5 + 1.5 * fixture_random(&state), peak = 90.0 * fixture_random(&state);
    for (y = 0; y < H; y++)
      for (x = 0; x < W + SHIFT; x++) {
        const double r2 = (x - cx) * (x - cx) + (y - cy) * (y - cy);
        if (r2 < 25.0 * sigma * sigma) level[y][x] += peak * exp(-r2 / (2.0 * sigma * sigma));
      }
  }
  for (y = 0; y < H; y++)
    for (x = 0; x < W + SHIFT; x++) {
      const double v = fmin(fmax(level[y][x] + 0.5, 0.0), 255.0);
      if (x < W) first[y][x] = (uint8_t)v;
      if (x >= SHIFT) second[y][x - SHIFT] = (uint8_t)v;
    }
}

static size_t count(const ptzcal_sift_features *features)
{
  size_t n = 0;
  CHECK_OK(ptzcal_sift_features_count(features, &n, NULL));
  return n;
}

static void found_and_made_again(const ptzcal_image *image)
{
  ptzcal_sift_options options;
  ptzcal_sift_features *features, *few, *made;
  size_t n, needed = 0, i;
  CHECK_OK(ptzcal_sift_options_init(&options, sizeof options));
  CHECK(options.max_features == 0 && options.upsample == 1 && options.contrast_threshold == 0.04 && options.edge_ratio == 10.0);
  CHECK_OK(ptzcal_detect_sift(image, &options, &features, NULL));
  n = count(features);
  CHECK(n > 30 && n < MOST);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_sift_features_copy_keypoints(features, keypoints, NUMBERS * n - 1, &needed, NULL));
  CHECK(needed == NUMBERS * n);
  CHECK_OK(ptzcal_sift_features_copy_keypoints(features, keypoints, needed, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_sift_features_copy_descriptors(features, NULL, 0, &needed, NULL));
  CHECK(needed == BYTES * n);
  CHECK_OK(ptzcal_sift_features_copy_descriptors(features, descriptors, needed, NULL, NULL));
  for (i = 0; i < n; i++) {
    const double *k = keypoints + NUMBERS * i;
    CHECK(k[0] > 0.0 && k[0] < W && k[1] > 0.0 && k[1] < H && k[2] > 0.8 && k[3] >= 0.0 && k[3] < 6.2832 && k[5] >= -1.0 && k[6] > 0.0);
    /* The strongest first. */
    CHECK(i == 0 || k[4] <= k[4 - NUMBERS]);
  }
  options.max_features = 5;
  CHECK_OK(ptzcal_detect_sift(image, &options, &few, NULL));
  CHECK(count(few) == 5);
  CHECK_OK(ptzcal_sift_features_copy_keypoints(few, others, 5 * NUMBERS, NULL, NULL));
  CHECK(memcmp(others, keypoints, 5 * NUMBERS * sizeof *others) == 0);
  CHECK_OK(ptzcal_sift_features_new(keypoints, descriptors, n, &made, NULL));
  CHECK_OK(ptzcal_sift_features_copy_keypoints(made, others, NUMBERS * n, NULL, NULL));
  CHECK_OK(ptzcal_sift_features_copy_descriptors(made, again, BYTES * n, NULL, NULL));
  CHECK(memcmp(others, keypoints, NUMBERS * n * sizeof *others) == 0 && memcmp(again, descriptors, BYTES * n) == 0);
  ptzcal_sift_features_free(made);
  ptzcal_sift_features_free(few);
  ptzcal_sift_features_free(features);
  ptzcal_sift_features_free(NULL);
}

static void matched(const ptzcal_image *a, const ptzcal_image *b)
{
  ptzcal_sift_match_options options;
  ptzcal_sift_features *fa, *fb, *none;
  size_t n, i, right = 0;
  CHECK_OK(ptzcal_detect_sift(a, NULL, &fa, NULL));
  CHECK_OK(ptzcal_detect_sift(b, NULL, &fb, NULL));
  CHECK_OK(ptzcal_sift_features_copy_keypoints(fa, keypoints, MOST * NUMBERS, NULL, NULL));
  CHECK_OK(ptzcal_sift_features_copy_keypoints(fb, others, MOST * NUMBERS, NULL, NULL));
  CHECK_OK(ptzcal_match_sift(fa, fb, NULL, pairs, distances, MOST, &n, NULL));
  CHECK(n > 20);
  for (i = 0; i < n; i++) {
    const double *p = keypoints + NUMBERS * pairs[2 * i], *q = others + NUMBERS * pairs[2 * i + 1];
    right += fabs(p[0] - q[0] - SHIFT) < 0.3 && fabs(p[1] - q[1]) < 0.3;
    CHECK(distances[2 * i] >= 0.0 && distances[2 * i + 1] <= 0.8);
  }
  CHECK(right >= n - n / 20);
  /* Whatever the ratio, and not mutual: every feature has a nearest. */
  CHECK_OK(ptzcal_sift_match_options_init(&options, sizeof options));
  CHECK(options.mutual == 1 && options.max_ratio == 0.8);
  options.mutual = 0;
  options.max_ratio = 1.0;
  CHECK_OK(ptzcal_match_sift(fa, fb, &options, pairs, NULL, MOST, &n, NULL));
  CHECK(n == count(fa));
  n = 0;
  taint(pairs, sizeof pairs);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_match_sift(fa, fb, &options, pairs, NULL, 3, &n, NULL));
  CHECK(n == count(fa) && is_tainted(pairs, sizeof pairs));
  /* Against nothing. */
  CHECK_OK(ptzcal_sift_features_new(NULL, NULL, 0, &none, NULL));
  CHECK_OK(ptzcal_match_sift(fa, none, &options, pairs, NULL, MOST, &n, NULL));
  CHECK(n == 0);
  CHECK_OK(ptzcal_match_sift(none, fb, &options, NULL, NULL, 0, &n, NULL));
  CHECK(n == 0);
  options.max_ratio = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_match_sift(fa, fb, &options, pairs, NULL, MOST, &n, NULL));
  options.max_ratio = 0.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_match_sift(fa, fb, &options, pairs, NULL, MOST, &n, NULL));
  options.max_ratio = 1.01;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_match_sift(fa, fb, &options, pairs, NULL, MOST, &n, NULL));
  options.max_ratio = 0.8;
  options.mutual = 2;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_match_sift(fa, fb, &options, pairs, NULL, MOST, &n, NULL));
  ptzcal_sift_features_free(none);
  ptzcal_sift_features_free(fb);
  ptzcal_sift_features_free(fa);
}

static ptzcal_status detect(const ptzcal_image *image, double contrast, double edge_ratio, uint32_t upsample)
{
  ptzcal_sift_options options;
  ptzcal_sift_features *features;
  ptzcal_status status;
  CHECK_OK(ptzcal_sift_options_init(&options, sizeof options));
  options.contrast_threshold = contrast;
  options.edge_ratio = edge_ratio;
  options.upsample = upsample;
  status = ptzcal_detect_sift(image, &options, &features, NULL);
  CHECK((status == PTZCAL_STATUS_OK) == (features != NULL));
  ptzcal_sift_features_free(features);
  return status;
}

static void refused(const ptzcal_image *image)
{
  const double bad_contrasts[] = {0.0, -1.0, 1.5}, bad_ratios[] = {1.0, 0.0, -3.0, 1e9};
  ptzcal_sift_features *features;
  ptzcal_image other = *image;
  size_t i;
  CHECK_OK(detect(image, 0.04, 10.0, 0));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, detect(image, NAN, 10.0, 1));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, detect(image, 0.04, INFINITY, 1));
  for (i = 0; i < 3; i++) CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, detect(image, bad_contrasts[i], 10.0, 1));
  for (i = 0; i < 4; i++) CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, detect(image, 0.04, bad_ratios[i], 1));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, detect(image, 0.04, 10.0, 2));
  other.width = other.height = 1;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, detect(&other, 0.04, 10.0, 1));
  other.width = W, other.height = 11;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, detect(&other, 0.04, 10.0, 1));
  other = *image;
  other.size[0] -= 1;
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, detect(&other, 0.04, 10.0, 1));
  /* One colour is no error. */
  memset(second, 77, sizeof second);
  make_image(&other, second, W, H);
  CHECK_OK(ptzcal_detect_sift(&other, NULL, &features, NULL));
  CHECK(count(features) == 0);
  ptzcal_sift_features_free(features);
  /* Features from elsewhere. */
  keypoints[2] = 0.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_sift_features_new(keypoints, descriptors, 4, &features, NULL));
  keypoints[2] = 1.0;
  keypoints[NUMBERS] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_sift_features_new(keypoints, descriptors, 4, &features, NULL));
  CHECK(features == NULL);
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_sift_features_new(keypoints, NULL, 1, &features, NULL));
}

int main(void)
{
  ptzcal_image a, b;
  paint();
  make_image(&a, first, W, H);
  make_image(&b, second, W, H);
  found_and_made_again(&a);
  matched(&a, &b);
  refused(&a);
  return 0;
}
