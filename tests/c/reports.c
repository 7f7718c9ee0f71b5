/* Reports: one page of HTML about cameras, scans and surveys; and what is refused. */
#include "fixtures.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static char *html(const ptzcal_report *report)
{
  size_t needed = 0, again = 0;
  char *text;
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_report_copy_html(report, NULL, 0, &needed, NULL));
  text = malloc(needed + 1);
  CHECK_OK(ptzcal_report_copy_html(report, text, needed, &again, NULL));
  CHECK(again == needed);
  text[needed] = 0;
  return text;
}

static int pieces(const char *text, const char *piece)
{
  int n = 0;
  while ((text = strstr(text, piece)) != NULL) {
    n++;
    text += strlen(piece);
  }
  return n;
}

static void made(void)
{
  static const double up[3] = {0, 0, 2};
  ptzcal_report *report;
  ptzcal_image image;
  ptzcal_camera camera;
  uint8_t *pixels;
  char *text, *again;
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  CHECK_OK(ptzcal_calibration_get_camera(fixture_calibration, &camera, NULL));
  pixels = calloc((size_t)camera.width * camera.height, 1);
  make_image(&image, pixels, camera.width, camera.height);
  CHECK_OK(ptzcal_report_new("Hall <1> & \"2\"", &report, NULL));
  CHECK_OK(ptzcal_report_set_up(report, up, NULL));
  CHECK_OK(ptzcal_report_add_note(report, "Measured by <nobody>.", NULL));
  CHECK_OK(ptzcal_report_add_calibration(report, "gate", fixture_calibration, fixture_correspondences, &image, NULL));
  CHECK_OK(ptzcal_report_add_calibration(report, "bare", fixture_calibration, NULL, NULL, NULL));
  CHECK_OK(ptzcal_report_add_board_calibration(report, "head", fixture_board_calibration, fixture_boards, NULL));
  CHECK_OK(ptzcal_report_add_scan(report, "first scan", fixture_scan, NULL));
  CHECK_OK(ptzcal_report_add_adjusted(report, "survey", fixture_adjusted, NULL));
  CHECK_OK(ptzcal_report_add_input(report, "nothing", NULL, 0, NULL));
  CHECK_OK(ptzcal_report_add_input(report, "abc", (const uint8_t *)"abc", 3, NULL));
  text = html(report);
  again = html(report);
  CHECK(strcmp(text, again) == 0);
  CHECK(strncmp(text, "<!DOCTYPE html>", 15) == 0);
  CHECK(strstr(text, "Hall &lt;1&gt; &amp; &quot;2&quot;") != NULL && strstr(text, "<nobody>") == NULL);
  CHECK(pieces(text, "data:image/jpeg;base64,") == 1);
  CHECK(pieces(text, "<h2>head</h2>") == 1 && pieces(text, "<h2>head: views</h2>") == 1);
  CHECK(pieces(text, "<h2>gate</h2>") == 1 && pieces(text, "<h2>survey, camera 1</h2>") == 1);
  /* FIPS 180-4's own examples. */
  CHECK(strstr(text, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855") != NULL);
  CHECK(strstr(text, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad") != NULL);
  CHECK(pieces(text, "http://") == pieces(text, "xmlns=\"http://www.w3.org/2000/svg\""));
  CHECK_OK(ptzcal_report_save(report, "report.html", NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_report_save(report, "no/such/folder/report.html", NULL));
  free(text);
  free(again);
  free(pixels);
  ptzcal_report_free(report);
}

static void refused(void)
{
  static const double none[3] = {0, 0, 0}, bad[3] = {0, NAN, 1};
  static uint8_t pixels[8];
  ptzcal_report *report = fixture_report, *never;
  ptzcal_correspondences *other;
  ptzcal_boards *others;
  ptzcal_image image;
  ptzcal_error *error = NULL;
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_report_new(NULL, &never, NULL));
  CHECK(never == NULL);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_report_new("\xff", &never, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_report_set_up(report, none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_report_set_up(report, bad, NULL));
  CHECK_OK(ptzcal_correspondences_new(640, 480, &other, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_report_add_calibration(report, "x", fixture_calibration, other, NULL, &error));
  CHECK(strstr(ptzcal_error_message(error), "0 measurements") != NULL);
  ptzcal_error_free(error);
  ptzcal_correspondences_free(other);
  CHECK_OK(ptzcal_boards_new(640, 480, &others, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_report_add_board_calibration(report, "x", fixture_board_calibration, others, &error));
  CHECK(strstr(ptzcal_error_message(error), "0 corners in 0 views") != NULL);
  ptzcal_error_free(error);
  ptzcal_boards_free(others);
  make_image(&image, pixels, 4, 2);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_report_add_calibration(report, "x", fixture_calibration, fixture_correspondences, &image, &error));
  CHECK(strstr(ptzcal_error_message(error), "4 x 2") != NULL);
  ptzcal_error_free(error);
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_report_add_input(report, "x", NULL, 1, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_report_add_input(report, "x", pixels, SIZE_MAX, NULL));
  /* What was refused left nothing behind. */
  {
    char *text = html(report);
    CHECK(pieces(text, "<section>") == 0);
    free(text);
  }
  ptzcal_report_free(NULL);
}

int main(void)
{
  make_fixtures();
  made();
  refused();
  free_fixtures();
  return 0;
}
