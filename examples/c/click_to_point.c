/* From nothing to click-to-point: opens a rig, scans, calibrates the fixed camera, writes a report, and
 * turns the head to what was clicked on. The integrator's guide (docs/guide.md) goes through it. Build and
 * run, with the library installed:
 *
 *     cc click_to_point.c $(pkg-config --cflags --libs ptzcal) -o click && ./click
 *
 * Without arguments it uses the simulator's room. With them, real devices:
 *
 *     ./click visca:///dev/ttyUSB0?model=evi-d30 gpio:///dev/gpiochip0/laser v4l2:///dev/video0 onvif://hall.lan */
#include <math.h>
#include <ptzcal.h>
#include <stdio.h>
#include <stdlib.h>

#define DEGREES (3.14159265358979323846 / 180)

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

static int32_t show_progress(void *user, const ptzcal_progress *progress)
{
  (void)user;
  printf("\r%llu of %llu shots", (unsigned long long)progress->done, (unsigned long long)progress->total);
  fflush(stdout);
  return 0; /* anything else stops the scan; what was measured is kept */
}

static ptzcal_rig *open_rig(int devices, char **addresses)
{
  ptzcal_error *error = NULL;
  ptzcal_rig_options *options = NULL;
  ptzcal_rig *rig = NULL;
  check(ptzcal_rig_options_new(&options, &error), &error);
  if (devices < 3) {
    check(ptzcal_rig_options_set_address(options, "sim:room", &error), &error);
  } else {
    ptzcal_rig_model model;
    ptzcal_rig_model_init(&model, sizeof model);
    /* From ptzcal_rig_calibration_solve: fill in your rig's own. */
    check(ptzcal_rig_options_set_model(options, &model, &error), &error);
    check(ptzcal_rig_options_set_ptz_address(options, addresses[0], &error), &error);
    check(ptzcal_rig_options_set_laser_address(options, addresses[1], &error), &error);
    check(ptzcal_rig_options_set_frames_address(options, addresses[2], &error), &error);
  }
  check(ptzcal_rig_open(options, &rig, &error), &error);
  ptzcal_rig_options_free(options);
  return rig;
}

int main(int argc, char **argv)
{
  ptzcal_error *error = NULL;
  ptzcal_rig *rig = open_rig(argc - 1, argv + 1);
  const char *camera = argc > 4 ? argv[4] : "sim:fixed/0";

  /* Scan: 24 x 20 directions, watched by the fixed camera. */
  ptzcal_scan_options *scan_options = NULL;
  check(ptzcal_scan_options_new(&scan_options, &error), &error);
  check(ptzcal_scan_options_add_camera_address(scan_options, camera, NULL, &error), &error);
  ptzcal_region region;
  ptzcal_region_init(&region, sizeof region);
  region.pan_min = -26 * DEGREES, region.pan_max = 14 * DEGREES, region.pan_steps = 24;
  region.tilt_min = -19 * DEGREES, region.tilt_max = 16 * DEGREES, region.tilt_steps = 20;
  ptzcal_scan *scan = NULL;
  check(ptzcal_rig_scan_region(rig, &region, scan_options, show_progress, NULL, &scan, &error), &error);
  check(ptzcal_scan_end(scan, &error), &error); /* complete? */
  ptzcal_scan_options_free(scan_options);

  /* Calibrate: from the shots that both cameras saw. */
  ptzcal_correspondences *set = NULL;
  uint32_t width = 0, height = 0;
  check(ptzcal_scan_camera_size(scan, 0, &width, &height, &error), &error);
  check(ptzcal_correspondences_new(width, height, &set, &error), &error);
  check(ptzcal_correspondences_add_scan(set, scan, 0, &error), &error);
  ptzcal_calibration_options *options = NULL;
  check(ptzcal_calibration_options_new(&options, &error), &error);
  check(ptzcal_calibration_options_set_distortion(options, PTZCAL_DISTORTION_MODEL_RADIAL2, &error), &error);
  ptzcal_calibration *calibration = NULL;
  check(ptzcal_calibrate_camera(set, options, &calibration, &error), &error);
  ptzcal_calibration_options_free(options);
  printf("\n%s\n", ptzcal_calibration_weakest(calibration));

  /* Look at it before you trust it, and keep it. */
  ptzcal_report *report = NULL;
  check(ptzcal_report_new("Hall", &report, &error), &error);
  check(ptzcal_report_add_calibration(report, camera, calibration, set, NULL, &error), &error);
  check(ptzcal_report_add_scan(report, "Scan", scan, &error), &error);
  check(ptzcal_report_save(report, "hall.html", &error), &error);
  check(ptzcal_calibration_save(calibration, "hall.json", &error), &error);

  /* Use it: a click on the floor, 1.2 m below the rig, known to 2 px. */
  ptzcal_rig_model model;
  ptzcal_rig_model_init(&model, sizeof model);
  check(ptzcal_rig_get_model(rig, &model, &error), &error);
  ptzcal_pointing *pointing = NULL;
  check(ptzcal_pointing_new(calibration, &model, &pointing, &error), &error);
  const double floor_normal[3] = {0, 1, 0};
  check(ptzcal_pointing_set_plane(pointing, floor_normal, 1.2, NULL, PTZCAL_MEASURED_BY_OTHERS, &error), &error);
  const double click[2] = {150, 560}, click_covariance[3] = {4, 0, 4};
  ptzcal_aim aim;
  ptzcal_aim_init(&aim, sizeof aim);
  check(ptzcal_pointing_aim(pointing, click, click_covariance, 0.95, 0.5, &aim, &error), &error);
  check(ptzcal_rig_move(rig, aim.pan, aim.tilt, NULL, &error), &error);
  printf("pixel (%.0f, %.0f) is %.2f m away; the head turned to pan %.2f, tilt %.2f degrees\n", click[0], click[1],
         aim.distance, aim.pan / DEGREES, aim.tilt / DEGREES);

  ptzcal_pointing_free(pointing);
  ptzcal_report_free(report);
  ptzcal_calibration_free(calibration);
  ptzcal_correspondences_free(set);
  ptzcal_scan_free(scan);
  check(ptzcal_rig_close(rig, &error), &error); /* the laser is off for good */
  return 0;
}
