/* Probing a device, and heads whose numbers have no angles until a map gives them some. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

static void a_simulated_head_is_probed(void)
{
  ptzcal_head_options *options;
  ptzcal_probe_options how;
  ptzcal_probe_report *report;
  ptzcal_figure figure;
  ptzcal_error *error = NULL;
  ptzcal_cancel *token;
  char *text;
  size_t needed = 0;
  CHECK_OK(ptzcal_head_options_new(&options, NULL));
  CHECK_OK(ptzcal_head_options_set_address(options, "sim:room?real_time=20", NULL));
  CHECK_OK(ptzcal_probe_options_init(&how, sizeof how));
  CHECK(how.repeats == 5 && how.toggle_laser == 0);
  how.repeats = 2;
  how.amplitude = 0.02;
  CHECK_OK(ptzcal_probe(options, NULL, &how, NULL, &report, NULL));
  CHECK_OK(ptzcal_figure_init(&figure, sizeof figure));
  /* Whether readings follow the head is not to be seen where every call is slow, as under valgrind. */
  (void)ptzcal_probe_report_get(report, PTZCAL_PROBE_FIGURE_POSITION_FOLLOWS, &figure, NULL);
  CHECK(figure.value == 0.0 || figure.value == 1.0);
  CHECK_OK(ptzcal_probe_report_get(report, PTZCAL_PROBE_FIGURE_DURATION, &figure, NULL));
  CHECK(figure.value > 0.0 && figure.count == 1);
  /* Nobody asked for the laser: there is no figure, and a reason. */
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_probe_report_get(report, PTZCAL_PROBE_FIGURE_LASER_VISIBLE_AFTER, &figure, &error));
  CHECK(*ptzcal_error_message(error));
  ptzcal_error_free(error);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_probe_report_get(report, 999, &figure, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_probe_report_copy_text(report, NULL, 0, &needed, NULL));
  text = (char *)calloc(needed + 1, 1);
  CHECK(text && needed > 200);
  CHECK_OK(ptzcal_probe_report_copy_text(report, text, needed, &needed, NULL));
  CHECK(strstr(text, "Speed") && strstr(text, "Backlash"));
  free(text);
  ptzcal_probe_report_free(report);

  how.amplitude = 3.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_probe(options, NULL, &how, NULL, &report, NULL));
  how.amplitude = 0.02;
  how.toggle_laser = 7;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_probe(options, NULL, &how, NULL, &report, NULL));
  CHECK_OK(ptzcal_cancel_new(&token, NULL));
  CHECK_OK(ptzcal_cancel_request(token));
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_probe(options, NULL, NULL, token, &report, NULL));
  CHECK(report == NULL);
  ptzcal_cancel_free(token);
  CHECK_OK(ptzcal_head_options_set_address(options, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_probe(options, NULL, NULL, NULL, &report, NULL));
  ptzcal_head_options_free(options);
}

/* A head that counts from -1 to 1 and is there at once. */
static double raw[2];

static int32_t raw_move(void *user, double pan, double tilt)
{
  (void)user;
  raw[0] = pan;
  raw[1] = tilt;
  return PTZCAL_STATUS_OK;
}

static int32_t raw_position(void *user, double *pan, double *tilt, double *zoom)
{
  (void)user;
  *pan = raw[0];
  *tilt = raw[1];
  *zoom = 0.0;
  return PTZCAL_STATUS_OK;
}

/* A wall without anything on it. */
static int32_t blank(void *user, double not_before, double timeout, ptzcal_image *image, double *timestamp)
{
  static uint8_t pixels[64 * 48];
  (void)user, (void)not_before, (void)timeout;
  make_image(image, pixels, 64, 48);
  *timestamp = NAN;
  return PTZCAL_STATUS_OK;
}

static void a_map_gives_angles(void)
{
  ptzcal_angle_map *map, *again;
  ptzcal_angle_summary summary;
  ptzcal_head_options *options;
  ptzcal_head *head;
  ptzcal_head_capabilities can;
  ptzcal_camera camera;
  ptzcal_ptz ptz;
  uint64_t number;
  int32_t end;
  double pan, tilt, pan_sigma;

  make_angle_map(&map);
  CHECK_OK(ptzcal_angle_map_save(map, "angles.json", NULL));
  CHECK_OK(ptzcal_angle_map_read("angles.json", &again, NULL));
  ptzcal_angle_map_free(map);
  CHECK_OK(ptzcal_angle_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_angle_map_get_summary(again, &summary, NULL));
  CHECK(summary.frames == 0 && summary.raw[0] == -1.0 && summary.angles[1] == 1.5 && summary.angles[3] == 0.4);
  CHECK_OK(ptzcal_angle_map_to_angles(again, 0.5, -0.5, &pan, &tilt, &pan_sigma, NULL, NULL));
  CHECK_NEAR(pan, 0.75, 1e-12);
  CHECK_NEAR(tilt, -0.2, 1e-12);
  CHECK(pan_sigma > 0.0 && pan_sigma < 2e-4);
  CHECK_OK(ptzcal_angle_map_to_raw(again, pan, tilt, &pan, &tilt, NULL));
  CHECK_NEAR(pan, 0.5, 1e-12);
  CHECK(ptzcal_angle_map_to_angles(again, 1.5, 0.0, &pan, &tilt, NULL, NULL, NULL) < 0);
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_angle_map_read("nothing.json", &map, NULL));

  make_ptz(&ptz);
  ptz.raw_units = 1;
  ptz.move_absolute = raw_move;
  ptz.position = raw_position;
  CHECK_OK(ptzcal_head_options_new(&options, NULL));
  CHECK_OK(ptzcal_head_options_set_ptz(options, &ptz, NULL));
  CHECK_OK(ptzcal_head_capabilities_init(&can, sizeof can));
  CHECK_OK(ptzcal_head_open(options, &head, NULL));
  CHECK_OK(ptzcal_head_get_capabilities(head, &can, NULL));
  CHECK(can.raw_units == 1 && can.pan_max == 1.0);
  CHECK_OK(ptzcal_head_close(head, NULL));
  CHECK_OK(ptzcal_head_options_set_angle_map(options, again, NULL));
  CHECK_OK(ptzcal_head_open(options, &head, NULL));
  CHECK_OK(ptzcal_head_get_capabilities(head, &can, NULL));
  CHECK(can.raw_units == 0);
  CHECK_NEAR(can.pan_max, 1.5, 1e-12);
  CHECK_OK(ptzcal_head_move(head, 0.3, 0.2, &number, NULL));
  CHECK_OK(ptzcal_head_wait(head, number, 20.0, NULL, &end, NULL, NULL));
  CHECK(end == PTZCAL_MOVE_END_ARRIVED);
  CHECK_NEAR(raw[0], 0.2, 1e-9);
  CHECK_NEAR(raw[1], 0.5, 1e-9);
  CHECK_OK(ptzcal_head_close(head, NULL));
  /* Set for a head that knows its angles. */
  ptz.raw_units = 0;
  CHECK_OK(ptzcal_head_options_set_ptz(options, &ptz, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_head_open(options, &head, NULL));

  /* Nothing is learned without frames, or from a blank wall. */
  ptz.raw_units = 1;
  CHECK_OK(ptzcal_head_options_set_ptz(options, &ptz, NULL));
  CHECK_OK(ptzcal_head_options_set_angle_map(options, NULL, NULL));
  make_camera(&camera);
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 60.0;
  camera.cx = 31.5;
  camera.cy = 23.5;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_learn_angles(options, &camera, NULL, NULL, NULL, NULL, &map, NULL));
  CHECK_OK(ptzcal_head_options_set_frames(options, blank, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_learn_angles(options, &camera, NULL, NULL, NULL, NULL, &map, NULL));
  CHECK(map == NULL);
  ptzcal_head_options_free(options);
  ptzcal_angle_map_free(again);
}

int main(void)
{
  a_simulated_head_is_probed();
  a_map_gives_angles();
  return 0;
}
