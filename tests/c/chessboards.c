/* Chessboard detection from the caller's memory: the whole board, a part of it, and what is refused. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define W 200
#define H 150
#define LEFT 24.0
#define TOP 18.0
#define SQUARE 16.0
#define COLUMNS 8
#define ROWS 5
#define CORNERS (COLUMNS * ROWS)

static uint8_t pixels[H][W];

/* The square's shade at a place: dark where column and row are alike, white around the board. */
static double shade(double x, double y)
{
  const double a = floor((x - LEFT) / SQUARE), b = floor((y - TOP) / SQUARE);
  if (a < 0 || b < 0 || a > COLUMNS || b > ROWS) return 200.0;
  return fmod(a + b, 2.0) == 0.0 ? 40.0 : 200.0;
}

/* Means of 8 x 8 places over 2 x 2 pixels: a blurred board. */
static void paint(void)
{
  uint32_t state = 3;
  int x, y, i, j;
  for (y = 0; y < H; y++) {
    for (x = 0; x < W; x++) {
      double sum = 0.0;
      for (i = 0; i < 8; i++)
        for (j = 0; j < 8; j++) sum += shade(x + (j - 3.5) / 4.0, y + (i - 3.5) / 4.0);
      pixels[y][x] = (uint8_t)(sum / 64.0 + 1.5 * fixture_random(&state) + 0.5);
    }
  }
}

static double corners[CORNERS][2], covariance[CORNERS][3];
static uint8_t found[CORNERS];

static ptzcal_status detect(const ptzcal_image *image, uint32_t columns, uint32_t rows, size_t capacity, ptzcal_chessboard *board)
{
  ptzcal_chessboard_options options;
  size_t needed = 0;
  ptzcal_status status;
  CHECK_OK(ptzcal_chessboard_options_init(&options, sizeof options));
  CHECK_OK(ptzcal_chessboard_init(board, sizeof *board));
  options.columns = columns;
  options.rows = rows;
  status = ptzcal_detect_chessboard(image, &options, board, corners[0], covariance[0], found, capacity, &needed, NULL);
  if (status == PTZCAL_STATUS_OK || (status == PTZCAL_STATUS_BUFFER_TOO_SMALL && capacity < CORNERS)) CHECK(needed == CORNERS);
  return status;
}

static void whole(const ptzcal_image *image)
{
  ptzcal_chessboard board;
  int i;
  CHECK_OK(detect(image, COLUMNS, ROWS, CORNERS, &board));
  CHECK(board.columns == COLUMNS && board.rows == ROWS && board.found == CORNERS);
  CHECK(board.blur > 0.3 && board.blur < 1.5);
  /* Pixel (0, 0) is the centre of the top-left pixel; the square outside the first corner is dark. */
  for (i = 0; i < CORNERS; i++) {
    CHECK(found[i] == 1);
    CHECK_NEAR(corners[i][0], LEFT + SQUARE * (1 + i % COLUMNS), 0.05);
    CHECK_NEAR(corners[i][1], TOP + SQUARE * (1 + i / COLUMNS), 0.05);
    CHECK(covariance[i][0] > 0.0 && covariance[i][0] < 0.01 && covariance[i][2] > 0.0);
  }
  /* Of unknown size; without options and covariances. */
  CHECK_OK(detect(image, 0, 0, CORNERS, &board));
  CHECK(board.columns == COLUMNS && board.rows == ROWS);
  CHECK_OK(ptzcal_detect_chessboard(image, NULL, &board, corners[0], NULL, found, CORNERS, NULL, NULL));
  CHECK(board.found == CORNERS);
}

static void part(const ptzcal_image *image)
{
  ptzcal_chessboard board;
  int x, y, i = 2 * COLUMNS + 3;
  for (y = 60; y < 74; y++)
    for (x = 80; x < 96; x++) pixels[y][x] = 120;
  CHECK_OK(detect(image, COLUMNS, ROWS, CORNERS, &board));
  CHECK(board.found < CORNERS && found[i] == 0 && corners[i][0] == 0.0 && covariance[i][2] == 0.0);
  CHECK(found[0] == 1 && found[CORNERS - 1] == 1);
  paint();
}

static void refused(const ptzcal_image *image)
{
  ptzcal_chessboard board;
  ptzcal_chessboard_options options;
  ptzcal_image small = *image;
  const double before = corners[0][0];
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, detect(image, COLUMNS - 1, ROWS, CORNERS, &board));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, detect(image, COLUMNS + 1, ROWS, CORNERS, &board));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, detect(image, 2, 5, CORNERS, &board));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, detect(image, 5, 0, CORNERS, &board));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, detect(image, UINT32_MAX, 5, CORNERS, &board));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, detect(image, 100, 100, CORNERS, &board));
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, detect(image, COLUMNS, ROWS, CORNERS - 1, &board));
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, detect(image, COLUMNS, ROWS, 0, &board));
  small.width = 12;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, detect(&small, 0, 0, CORNERS, &board));
  small = *image;
  small.size[0] -= 1;
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, detect(&small, COLUMNS, ROWS, CORNERS, &board));
  CHECK(board.found == 0 && corners[0][0] == before);
  CHECK_OK(ptzcal_chessboard_options_init(&options, sizeof options));
  options.min_found = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE,
               ptzcal_detect_chessboard(image, &options, &board, corners[0], NULL, found, CORNERS, NULL, NULL));
  options.min_found = 1.5;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_detect_chessboard(image, &options, &board, corners[0], NULL, found, CORNERS, NULL, NULL));
}

int main(void)
{
  ptzcal_image image;
  paint();
  make_image(&image, pixels, W, H);
  whole(&image);
  part(&image);
  refused(&image);
  return 0;
}
