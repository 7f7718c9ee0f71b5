/* Spot detection from the caller's memory: every format, stride and direction; and images that would
   be read outside their memory are refused. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define W 96
#define H 64
#define X 41.3
#define Y 27.6

/* One frame, red, with noise: background 60, and the spot when the laser is on. */
static uint8_t level(int x, int y, int on, uint32_t *state)
{
  double v = 60.0 + 2.0 * fixture_random(state) + 2.0 * fixture_random(state);
  double r2 = (x - X) * (x - X) + (y - Y) * (y - Y);
  if (on) v += 130.0 * exp(-r2 / (2 * 1.6 * 1.6));
  return (uint8_t)(v + 0.5);
}

static void paint(uint8_t gray[H][W], int on, uint32_t seed)
{
  int x, y;
  for (y = 0; y < H; y++)
    for (x = 0; x < W; x++) gray[y][x] = level(x, y, on, &seed);
}

static uint8_t on_gray[H][W], off_gray[H][W];

/* A frame in another layout, with `pad` bytes behind every row, bottom-up when asked. */
static void convert(uint8_t gray[H][W], uint32_t format, int pad, int bottom_up, uint8_t *memory, ptzcal_image *image)
{
  static const int bytes[] = {0, 1, 3, 3, 4, 4, 2, 1, 1};
  const int row = W * bytes[format] + pad;
  int x, y, c;
  CHECK_OK(ptzcal_image_init(image, sizeof *image));
  image->format = format;
  image->width = W;
  image->height = H;
  for (y = 0; y < H; y++) {
    uint8_t *to = memory + (bottom_up ? H - 1 - y : y) * row;
    for (x = 0; x < W; x++) {
      if (format == PTZCAL_PIXEL_FORMAT_YUYV) {
        to[2 * x] = gray[y][x];
        to[2 * x + 1] = 128;
      } else {
        for (c = 0; c < bytes[format]; c++) to[bytes[format] * x + c] = gray[y][x];
      }
    }
  }
  image->plane[0] = memory + (bottom_up ? (H - 1) * row : 0);
  image->stride[0] = bottom_up ? -row : row;
  image->size[0] = (size_t)(row * (H - 1) + row - pad);
  if (format == PTZCAL_PIXEL_FORMAT_NV12 || format == PTZCAL_PIXEL_FORMAT_I420) {
    const int planes = format == PTZCAL_PIXEL_FORMAT_NV12 ? 1 : 2;
    for (c = 1; c <= planes; c++) {
      uint8_t *chroma = memory + H * row + (c - 1) * (H / 2 * W);
      memset(chroma, 128, H / 2 * W);
      image->plane[c] = chroma;
      image->stride[c] = planes == 1 ? W : W / 2;
      image->size[c] = (size_t)(H / 2 * image->stride[c]);
    }
  }
}

static void is_found(const ptzcal_image *on, const ptzcal_image *off, const ptzcal_spot_options *options)
{
  ptzcal_spot spot;
  ptzcal_error *error = NULL;
  ptzcal_status status;
  CHECK_OK(ptzcal_spot_init(&spot, sizeof spot));
  status = ptzcal_detect_spot(on, off, options, &spot, &error);
  if (status) fprintf(stderr, "format %u: %s\n", (unsigned)on->format, ptzcal_error_message(error));
  CHECK_OK(status);
  CHECK_NEAR(spot.x, X, 0.15);
  CHECK_NEAR(spot.y, Y, 0.15);
  CHECK(spot.covariance[0] > 0.0 && spot.covariance[0] < 0.1 && spot.covariance[2] > 0.0);
  CHECK(spot.signal_to_noise > 20.0 && spot.peak > 80.0 && spot.area > 8 && !spot.saturated);
}

static void every_layout(void)
{
  static uint8_t memory[2][(4 * W + 16) * H + H * W];
  ptzcal_image on, off;
  uint32_t format;
  int bottom_up;
  for (format = PTZCAL_PIXEL_FORMAT_GRAY8; format <= PTZCAL_PIXEL_FORMAT_I420; format++) {
    for (bottom_up = 0; bottom_up < 2; bottom_up++) {
      convert(on_gray, format, 13 * bottom_up, bottom_up, memory[0], &on);
      convert(off_gray, format, 5, 0, memory[1], &off);
      is_found(&on, &off, NULL);
    }
  }
}

/* Frame after frame, one and ten at a time: the same answers as without memory. */
static void detector(void)
{
  static uint8_t memory[2][(4 * W + 16) * H + H * W];
  ptzcal_image on, off;
  const ptzcal_image *many_on[10], *many_off[10];
  ptzcal_spot_detector *d;
  ptzcal_spot spot, expected;
  ptzcal_error *error = NULL;
  uint32_t format;
  size_t i, n;
  CHECK_OK(ptzcal_spot_detector_new(NULL, &d, NULL));
  CHECK_OK(ptzcal_spot_init(&spot, sizeof spot));
  CHECK_OK(ptzcal_spot_init(&expected, sizeof expected));
  for (format = PTZCAL_PIXEL_FORMAT_GRAY8; format <= PTZCAL_PIXEL_FORMAT_I420; format++) {
    convert(on_gray, format, 13, 0, memory[0], &on);
    convert(off_gray, format, 5, 0, memory[1], &off);
    for (i = 0; i < 10; i++) many_on[i] = &on, many_off[i] = &off;
    for (n = 1; n <= 10; n += 3) {
      CHECK_OK(ptzcal_spot_detector_detect(d, many_on, n, many_off, n, &spot, NULL));
      CHECK_OK(ptzcal_detect_spot_averaged(many_on, n, many_off, n, NULL, &expected, NULL));
      CHECK(memcmp(&spot, &expected, sizeof spot) == 0);
    }
  }
  /* Nothing, and then a spot again. */
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_spot_detector_detect(d, many_off, 1, many_off, 1, &spot, NULL));
  CHECK_OK(ptzcal_spot_detector_detect(d, many_on, 1, many_off, 1, &spot, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_detector_detect(d, many_on, 0, NULL, 0, &spot, &error));
  CHECK(strstr(ptzcal_error_message(error), "n_on") != NULL);
  ptzcal_error_free(error);
  many_on[1] = NULL;
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_spot_detector_detect(d, many_on, 2, many_off, 1, &spot, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_spot_detector_detect(d, many_on, 10, many_off, 1, &spot, NULL));
  ptzcal_spot_detector_free(d);
}

static void options(void)
{
  ptzcal_image on, off;
  ptzcal_spot_options *o;
  ptzcal_spot spot;
  const double band[4] = {0, Y, W, Y}, elsewhere[4] = {0, 44, W, 44};
  make_image(&on, on_gray, W, H);
  make_image(&off, off_gray, W, H);
  CHECK_OK(ptzcal_spot_init(&spot, sizeof spot));
  CHECK_OK(ptzcal_spot_options_new(&o, NULL));
  CHECK_OK(ptzcal_spot_options_set_colour(o, PTZCAL_LASER_COLOUR_WHITE, NULL));
  CHECK_OK(ptzcal_spot_options_set_max_area(o, 500, NULL));
  CHECK_OK(ptzcal_spot_options_set_ambiguity_ratio(o, 0.6, NULL));
  CHECK_OK(ptzcal_spot_options_set_region(o, 20, 10, 40, 40, NULL));
  CHECK_OK(ptzcal_spot_options_set_band(o, band, 2, 6.0, NULL));
  is_found(&on, &off, o);
  /* Where the spot is not. */
  CHECK_OK(ptzcal_spot_options_set_band(o, elsewhere, 2, 4.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_detect_spot(&on, &off, o, &spot, NULL));
  CHECK(spot.x == 0.0 && spot.area == 0);
  CHECK_OK(ptzcal_spot_options_set_band(o, band, 2, 6.0, NULL));
  CHECK_OK(ptzcal_spot_options_set_min_signal_to_noise(o, 1e6, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_detect_spot(&on, &off, o, &spot, NULL));

  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_options_set_region(o, 0, 0, 0, 5, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_options_set_region(o, UINT32_MAX, 0, 2, 5, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_options_set_band(o, band, 1, 6.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_options_set_band(o, NULL, 0, 6.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_options_set_band(o, band, 2, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_options_set_colour(o, 5, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_options_set_colour(o, UINT32_MAX, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_options_set_max_area(o, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_options_set_min_signal_to_noise(o, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_spot_options_set_ambiguity_ratio(o, 1.5, NULL));
  ptzcal_spot_options_free(o);
}

static void averaged(void)
{
  static uint8_t frames[6][H][W];
  ptzcal_image images[6];
  const ptzcal_image *on[4], *off[4];
  ptzcal_spot one, four;
  int i;
  for (i = 0; i < 6; i++) {
    paint(frames[i], i < 3, 100u + (uint32_t)i);
    make_image(&images[i], frames[i], W, H);
    if (i < 3)
      on[i] = &images[i];
    else
      off[i - 3] = &images[i];
  }
  CHECK_OK(ptzcal_spot_init(&one, sizeof one));
  CHECK_OK(ptzcal_spot_init(&four, sizeof four));
  CHECK_OK(ptzcal_detect_spot(on[0], off[0], NULL, &one, NULL));
  CHECK_OK(ptzcal_detect_spot_averaged(on, 3, off, 3, NULL, &four, NULL));
  CHECK_NEAR(four.x, X, 0.1);
  CHECK(four.signal_to_noise > one.signal_to_noise * 1.2);
  /* One bad frame spoils the call, whichever it is. */
  on[3] = NULL;
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_detect_spot_averaged(on, 4, off, 3, NULL, &four, NULL));
  images[5].width = W / 2;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_detect_spot_averaged(on, 3, off, 3, NULL, &four, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_detect_spot_averaged(on, 0, off, 3, NULL, &four, NULL));
}

static void never_a_guess(void)
{
  ptzcal_image on, off;
  ptzcal_spot spot;
  uint8_t twin[H][W];
  int x, y;
  CHECK_OK(ptzcal_spot_init(&spot, sizeof spot));
  make_image(&off, off_gray, W, H);
  paint(twin, 0, 55); /* the laser did not light */
  make_image(&on, twin, W, H);
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_detect_spot(&on, &off, NULL, &spot, NULL));
  for (y = 0; y < H; y++) /* a second spot, as bright */
    for (x = 0; x < W; x++) twin[y][x] = on_gray[y][x] > on_gray[H - 1 - y][W - 1 - x] ? on_gray[y][x] : on_gray[H - 1 - y][W - 1 - x];
  CHECK_STATUS(PTZCAL_STATUS_AMBIGUOUS, ptzcal_detect_spot(&on, &off, NULL, &spot, NULL));
  CHECK(spot.x == 0.0 && spot.signal_to_noise == 0.0);
}

static void bad(const ptzcal_image *image, ptzcal_status wanted)
{
  ptzcal_image good;
  ptzcal_spot spot;
  ptzcal_error *error = NULL;
  make_image(&good, off_gray, W, H);
  CHECK_OK(ptzcal_spot_init(&spot, sizeof spot));
  CHECK_STATUS(wanted, ptzcal_detect_spot(image, &good, NULL, &spot, &error));
  CHECK(ptzcal_error_status(error) == wanted);
  ptzcal_error_free(error);
  CHECK_STATUS(wanted, ptzcal_detect_spot(&good, image, NULL, &spot, NULL));
  CHECK(spot.x == 0.0);
}

static void bad_images(void)
{
  ptzcal_image good, i;
  make_image(&good, on_gray, W, H);
#define BAD(change, status) (i = good, change, bad(&i, status))
  BAD(i.format = 0, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.format = 9, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.format = UINT32_MAX, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.width = 0, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.height = 0, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.width = i.height = UINT32_MAX, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD((i.width = 65537, i.stride[0] = 65537, i.size[0] = SIZE_MAX), PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.plane[0] = NULL, PTZCAL_STATUS_NULL_POINTER);
  BAD(i.stride[0] = W - 1, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.stride[0] = 1 - W, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.stride[0] = 0, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.stride[0] = PTRDIFF_MAX, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.stride[0] = PTRDIFF_MIN, PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.stride[0] = W + 1, PTZCAL_STATUS_BUFFER_TOO_SMALL);
  BAD(i.size[0] = W * H - 1, PTZCAL_STATUS_BUFFER_TOO_SMALL);
  BAD(i.size[0] = 0, PTZCAL_STATUS_BUFFER_TOO_SMALL);
  BAD(i.height = H + 1, PTZCAL_STATUS_BUFFER_TOO_SMALL);
  BAD((i.format = PTZCAL_PIXEL_FORMAT_YUYV, i.width = W / 2 - 1), PTZCAL_STATUS_INVALID_ARGUMENT);
  BAD(i.format = PTZCAL_PIXEL_FORMAT_NV12, PTZCAL_STATUS_NULL_POINTER);
  BAD((i.format = PTZCAL_PIXEL_FORMAT_I420, i.plane[1] = i.plane[2] = i.plane[0]), PTZCAL_STATUS_BUFFER_TOO_SMALL);
  BAD((i.format = PTZCAL_PIXEL_FORMAT_NV12, i.plane[1] = i.plane[0], i.stride[1] = W), PTZCAL_STATUS_BUFFER_TOO_SMALL);
}

int main(void)
{
  paint(on_gray, 1, 1);
  paint(off_gray, 0, 2);
  every_layout();
  detector();
  options();
  averaged();
  never_a_guess();
  bad_images();
  return 0;
}
