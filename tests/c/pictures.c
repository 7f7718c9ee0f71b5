/* Pictures: read, drawn on, written; and what is refused. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define W 40
#define H 30

static uint8_t pixels[H][W];

static const uint8_t *at(const ptzcal_image *image, int x, int y)
{
  return (const uint8_t *)image->plane[0] + y * image->stride[0] + 3 * x;
}

static void drawn(void)
{
  static const double line[4] = {2, 10, 30, 10}, circle[2] = {20, 20}, corners[8] = {5, 5, 15, 5, 5, 15, 15, 15};
  static const double seen[4] = {10, 10, 30, 20}, residuals[4] = {0.2, 0, INFINITY, NAN};
  static const uint8_t flags[4] = {1, 0, 1, 1};
  ptzcal_picture *picture, *both, *again;
  ptzcal_image image, view;
  make_image(&image, pixels, W, H);
  CHECK_OK(ptzcal_image_init(&view, sizeof view));
  CHECK_OK(ptzcal_picture_new(&image, &picture, NULL));
  CHECK_OK(ptzcal_picture_image(picture, &view, NULL));
  CHECK(view.format == PTZCAL_PIXEL_FORMAT_RGB24 && view.width == W && view.height == H);
  CHECK(at(&view, 3, 3)[0] == 100 && at(&view, 3, 3)[2] == 100);
  CHECK_OK(ptzcal_picture_dim(picture, 0.5, NULL));
  CHECK(at(&view, 3, 3)[1] == 50);
  CHECK_OK(ptzcal_picture_draw_lines(picture, line, 1, 3.0, 0xff8000u, NULL));
  CHECK(at(&view, 20, 10)[0] == 255 && at(&view, 20, 10)[1] == 128 && at(&view, 20, 10)[2] == 0 && at(&view, 20, 14)[0] == 50);
  CHECK_OK(ptzcal_picture_draw_circles(picture, circle, 1, 5.0, 2.0, 0x0000ffu, NULL));
  CHECK(at(&view, 25, 20)[2] == 255 && at(&view, 20, 20)[2] == 50);
  CHECK_OK(ptzcal_picture_draw_board(picture, corners, flags, 2, 2, NULL));
  CHECK_OK(ptzcal_picture_draw_board(picture, corners, NULL, 2, 2, NULL));
  CHECK_OK(ptzcal_picture_draw_board(picture, NULL, NULL, 0, 2, NULL));
  CHECK_OK(ptzcal_picture_draw_residuals(picture, seen, residuals, flags, 2, 50.0, NULL));
  CHECK_OK(ptzcal_picture_draw_residuals(picture, seen, residuals, NULL, 2, 50.0, NULL));
  CHECK_OK(ptzcal_picture_save(picture, "picture.png", NULL));
  CHECK_OK(ptzcal_picture_read("picture.png", &again, NULL));
  CHECK_OK(ptzcal_picture_beside(&view, &image, &both, NULL));
  CHECK_OK(ptzcal_picture_draw_matches(both, seen, seen, flags, 2, W, NULL));
  CHECK_OK(ptzcal_picture_draw_matches(both, seen, seen, NULL, 2, W, NULL));
  {
    ptzcal_image read;
    CHECK_OK(ptzcal_image_init(&read, sizeof read));
    CHECK_OK(ptzcal_picture_image(again, &read, NULL));
    CHECK(read.width == W && read.height == H);
    CHECK(memcmp(read.plane[0], view.plane[0], 3 * W * H) == 0);
    CHECK_OK(ptzcal_picture_image(both, &read, NULL));
    CHECK(read.width == 2 * W && at(&read, W + 2, 28)[0] == 100 && at(&read, 2, 28)[0] == 50);
  }
  ptzcal_picture_free(again);
  ptzcal_picture_free(both);
  ptzcal_picture_free(picture);
}

static void refused(void)
{
  static const double ends[4] = {0, 0, 1, 1};
  ptzcal_picture *picture, *other = NULL;
  ptzcal_image image;
  FILE *file = fopen("no-picture.png", "wb");
  CHECK(file && fputs("\x89PNG but no more", file) >= 0 && fclose(file) == 0);
  make_image(&image, pixels, W, H);
  CHECK_OK(ptzcal_picture_new(&image, &picture, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_picture_read("nowhere.png", &other, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_FORMAT, ptzcal_picture_read("no-picture.png", &other, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_picture_save(picture, "nowhere/picture.png", NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_picture_dim(picture, 1.5, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_picture_draw_lines(picture, ends, 1, 0.0, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_picture_draw_lines(picture, ends, 1, 1.0, 0x1000000u, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_picture_draw_board(picture, ends, NULL, SIZE_MAX / 2, 4, NULL));
  CHECK(other == NULL);
  ptzcal_picture_free(picture);
}

static void depths(void)
{
  static const uint16_t millimetres[2][4] = {{1000, 0, 3000, 9}, {1, 65535, 2, 9}};
  static const float metres[2][4] = {{1.0f, NAN, -3.0f, 9.0f}, {0.5f, INFINITY, 2.0f, 9.0f}};
  ptzcal_depth_map *map;
  uint32_t width, height;
  size_t known;
  FILE *file = fopen("depth.pgm", "wb");
  CHECK(file && fwrite("P5\n2 1\n65535\n\x03\xe8\0\0", 1, 17, file) == 17 && fclose(file) == 0);
  CHECK_OK(ptzcal_depth_map_new_u16(millimetres[0], 3, 2, 4, 0.001, &map, NULL));
  CHECK_OK(ptzcal_depth_map_size(map, &width, &height, &known, NULL));
  CHECK(width == 3 && height == 2 && known == 5);
  ptzcal_depth_map_free(map);
  CHECK_OK(ptzcal_depth_map_new_f32(metres[0], 3, 2, 4, 1.0, &map, NULL));
  CHECK_OK(ptzcal_depth_map_size(map, NULL, NULL, &known, NULL));
  CHECK(known == 3);
  ptzcal_depth_map_free(map);
  CHECK_OK(ptzcal_depth_map_read("depth.pgm", 0.001, &map, NULL));
  CHECK_OK(ptzcal_depth_map_size(map, &width, &height, &known, NULL));
  CHECK(width == 2 && height == 1 && known == 1);
  ptzcal_depth_map_free(map);
  CHECK_STATUS(PTZCAL_STATUS_FILE_FORMAT, ptzcal_depth_map_read("picture.png", 0.001, &map, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_depth_map_read("depth.pgm", -1.0, &map, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_depth_map_new_u16(millimetres[0], 3, 2, 2, 0.001, &map, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_depth_map_new_u16(millimetres[0], 0, 2, 4, 0.001, &map, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_depth_map_new_f32(metres[0], 3, UINT32_MAX, 4, 1.0, &map, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_depth_map_new_f32(metres[0], 3, 2, 4, 0.0, &map, NULL));
  CHECK(map == NULL);
}

int main(void)
{
  memset(pixels, 100, sizeof pixels);
  drawn();
  refused();
  depths();
  return 0;
}
