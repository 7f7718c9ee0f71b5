/* Calibrates a fixed surveillance camera from a host's point of view: the host owns the cameras and
 * the PTZ control, and hands both in as callbacks. Build and run, with the library installed:
 *
 *     cc calibrate_fixed_camera.c $(pkg-config --cflags --libs ptzcal) -o calibrate && ./calibrate
 *
 * The bodies of the callbacks ask a simulated room, so that the program runs anywhere. In your
 * program they ask your decoder, your PTZ protocol and your laser: nothing else changes. */
#include <math.h>
#include <ptzcal.h>
#include <stdio.h>
#include <stdlib.h>

#define DEGREES (3.14159265358979323846 / 180)

/* What your application knows of a camera. */
typedef struct Camera {
  ptzcal_simulator *room;
  uint32_t number;
} Camera;

/* Ends the program with everything that the library says about an error. It takes the error's address:
 * the error itself, as an argument beside the call, might be read before the call. */
static void check(ptzcal_status status, ptzcal_error **error)
{
  if (status == PTZCAL_STATUS_OK)
    return;
  fprintf(stderr, "%s: %s\n", ptzcal_status_name(status), ptzcal_error_message(*error));
  if (*ptzcal_error_hint(*error))
    fprintf(stderr, "  %s\n", ptzcal_error_hint(*error));
  ptzcal_error_free(*error);
  exit(1);
}

/* ---- your PTZ ---- */

static int32_t head_move(void *user, double pan, double tilt)
{
  return ptzcal_simulator_move(user, pan, tilt, NULL);
}

static int32_t head_position(void *user, double *pan, double *tilt, double *zoom)
{
  *zoom = 0;
  return ptzcal_simulator_position(user, pan, tilt, NULL);
}

static int32_t head_motion(void *user, int32_t *motion)
{
  return ptzcal_simulator_motion(user, motion, NULL);
}

static int32_t head_stop(void *user)
{
  return ptzcal_simulator_stop(user, NULL);
}

/* ---- your laser ---- */

static int32_t laser_set(void *user, int32_t on)
{
  return ptzcal_simulator_set_laser(user, on, NULL);
}

/* ---- your frames: fill in the image, say when its exposure began ---- */

static int32_t next_frame(void *user, double not_before, double timeout, ptzcal_image *image, double *timestamp)
{
  const Camera *camera = user;
  return ptzcal_simulator_next_frame(camera->room, camera->number, not_before, timeout, image, timestamp, NULL);
}

/* ---- the clock that stamps your frames ---- */

static double clock_now(void *user)
{
  double now = 0;
  ptzcal_simulator_now(user, &now, NULL);
  return now;
}

static void clock_sleep(void *user, double seconds)
{
  ptzcal_simulator_sleep(user, seconds, NULL);
}

/* Called after every shot; anything but 0 stops the scan. */
static int32_t show_progress(void *user, const ptzcal_progress *progress)
{
  (void)user;
  if (progress->done % 20 == 0 || progress->done == progress->total)
    printf("\r%llu of %llu shots", (unsigned long long)progress->done, (unsigned long long)progress->total);
  fflush(stdout);
  return 0;
}

int main(void)
{
  ptzcal_error *error = NULL;
  ptzcal_simulator *room = NULL;
  check(ptzcal_simulator_new("sim:room?seed=5", &room, &error), &error);
  Camera head_camera = {room, PTZCAL_HEAD_CAMERA}, fixed_camera = {room, 0};

  /* The rig: its model (from its own calibration) and its devices. */
  ptzcal_rig_model model;
  ptzcal_rig_model_init(&model, sizeof model);
  check(ptzcal_simulator_nominal_rig(room, &model, &error), &error);
  ptzcal_ptz ptz;
  ptzcal_ptz_init(&ptz, sizeof ptz);
  ptz.pan_min = -100 * DEGREES, ptz.pan_max = 100 * DEGREES;
  ptz.tilt_min = -25 * DEGREES, ptz.tilt_max = 25 * DEGREES;
  ptz.pan_step = ptz.tilt_step = 0.07 * DEGREES;
  ptz.user = room;
  ptz.move_absolute = head_move, ptz.position = head_position, ptz.motion = head_motion, ptz.stop = head_stop;

  ptzcal_rig_options *rig_options = NULL;
  check(ptzcal_rig_options_new(&rig_options, &error), &error);
  check(ptzcal_rig_options_set_model(rig_options, &model, &error), &error);
  check(ptzcal_rig_options_set_ptz(rig_options, &ptz, &error), &error);
  check(ptzcal_rig_options_set_laser(rig_options, laser_set, room, &error), &error);
  check(ptzcal_rig_options_set_frames(rig_options, next_frame, &head_camera, &error), &error);
  check(ptzcal_rig_options_set_clock(rig_options, clock_now, clock_sleep, room, &error), &error);
  ptzcal_rig *rig = NULL;
  check(ptzcal_rig_open(rig_options, &rig, &error), &error);
  ptzcal_rig_options_free(rig_options);

  /* The scan: 20 x 18 positions, watched by the fixed camera. */
  ptzcal_scan_options *scan_options = NULL;
  check(ptzcal_scan_options_new(&scan_options, &error), &error);
  check(ptzcal_scan_options_add_camera(scan_options, next_frame, &fixed_camera, 800, 600, NULL, &error), &error);
  ptzcal_region region;
  ptzcal_region_init(&region, sizeof region);
  region.pan_min = -26 * DEGREES, region.pan_max = 14 * DEGREES, region.pan_steps = 20;
  region.tilt_min = -19 * DEGREES, region.tilt_max = 16 * DEGREES, region.tilt_steps = 18;
  ptzcal_scan *scan = NULL;
  check(ptzcal_rig_scan_region(rig, &region, scan_options, show_progress, NULL, &scan, &error), &error);
  ptzcal_scan_options_free(scan_options);
  printf("\n");
  check(ptzcal_scan_end(scan, &error), &error); /* complete? */

  /* The calibration: the shots that both cameras saw. */
  ptzcal_correspondences *set = NULL;
  check(ptzcal_correspondences_new(800, 600, &set, &error), &error);
  check(ptzcal_correspondences_add_scan(set, scan, 0, &error), &error);
  ptzcal_calibration_options *options = NULL;
  check(ptzcal_calibration_options_new(&options, &error), &error);
  check(ptzcal_calibration_options_set_distortion(options, PTZCAL_DISTORTION_MODEL_RADIAL2, &error), &error);
  ptzcal_calibration *calibration = NULL;
  check(ptzcal_calibrate_camera(set, options, &calibration, &error), &error);
  ptzcal_calibration_options_free(options);

  ptzcal_calibration_summary summary;
  ptzcal_calibration_summary_init(&summary, sizeof summary);
  check(ptzcal_calibration_get_summary(calibration, &summary, &error), &error);
  ptzcal_camera camera, truth;
  ptzcal_camera_init(&camera, sizeof camera);
  ptzcal_camera_init(&truth, sizeof truth);
  check(ptzcal_calibration_get_camera(calibration, &camera, &error), &error);
  check(ptzcal_simulator_true_camera(room, 0, &truth, &error), &error);
  double centre[3], true_centre[3], off = 0;
  check(ptzcal_camera_centre(&camera, centre, &error), &error);
  check(ptzcal_camera_centre(&truth, true_centre, &error), &error);
  for (int i = 0; i < 3; i++)
    off += (centre[i] - true_centre[i]) * (centre[i] - true_centre[i]);
  printf("fixed camera: f %.1f px (truth %.1f), centre within %.1f mm, %llu of %llu shots used, rms %.2f px\n", camera.fx,
         truth.fx, sqrt(off) * 1e3, (unsigned long long)summary.inliers, (unsigned long long)summary.measurements, summary.rms);

  /* Use it: where on the floor (y = 1.2 m) is what the fixed camera sees at a pixel? Turn there. */
  double pixel[2] = {150, 560}, direction[3], point[3], pan, tilt;
  check(ptzcal_camera_back_project(&camera, pixel, 1, direction, &error), &error);
  double distance = (1.2 - centre[1]) / direction[1];
  for (int i = 0; i < 3; i++)
    point[i] = centre[i] + distance * direction[i];
  check(ptzcal_rig_aim_at_point(rig, point, NULL, &pan, &tilt, &error), &error);
  printf("pixel (%.0f, %.0f) is at (%.2f, %.2f, %.2f) m on the floor; the head turned to pan %.2f, tilt %.2f degrees\n",
         pixel[0], pixel[1], point[0], point[1], point[2], pan / DEGREES, tilt / DEGREES);

  ptzcal_calibration_free(calibration);
  ptzcal_correspondences_free(set);
  ptzcal_scan_free(scan);
  check(ptzcal_rig_close(rig, &error), &error); /* the laser is off for good */
  ptzcal_simulator_free(room);
  return 0;
}
