/* What will a rig in this room make of a fixed camera here, and how many shots does it take? Before anyone
 * scans. Build and run, with the library installed:
 *
 *     cc precision_label.c $(pkg-config --cflags --libs ptzcal) -o label && ./label
 *
 * Writes label.csv and label.svg. */
#include <ptzcal.h>
#include <stdio.h>
#include <stdlib.h>

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

int main(void)
{
  ptzcal_error *error = NULL;

  /* The rig: a head camera of 800 px focal length, the laser ten centimetres beside it. */
  ptzcal_rig_model model;
  ptzcal_rig_model_init(&model, sizeof model);
  model.width = 720, model.height = 576;
  model.fx = model.fy = 800, model.cx = 360, model.cy = 288;
  model.laser_x0 = 0.1, model.laser_y0 = 0.005, model.laser_vx = -0.005, model.laser_vy = 0.003;

  /* The fixed camera is meant to hang here, in the rig's frame (x right, y down, z forward). */
  ptzcal_camera camera;
  ptzcal_camera_init(&camera, sizeof camera);
  camera.width = 800, camera.height = 600;
  camera.fx = camera.fy = 845, camera.cx = 400, camera.cy = 300;
  camera.translation[0] = 0.6, camera.translation[1] = -0.3, camera.translation[2] = -0.1;

  /* The room and two boxes in it: what the laser will meet. */
  const double room[6] = {-1.9, -1.3, -1.0, 2.0, 1.2, 4.6};
  const double boxes[12] = {-0.7, 0.15, 1.7, 0.2, 1.2, 2.5, 0.1, -0.9, 2.9, 0.9, -0.1, 3.5};
  ptzcal_site *site = NULL;
  check(ptzcal_site_new(&model, &camera, &site, &error), &error);
  check(ptzcal_site_set_room(site, room, boxes, 2, &error), &error);

  /* How many shots for a position good to 5 mm? */
  ptzcal_plan_options wanted;
  ptzcal_plan_options_init(&wanted, sizeof wanted);
  wanted.pan_min = -0.5, wanted.pan_max = 0.44, wanted.tilt_min = -0.36, wanted.tilt_max = 0.33;
  wanted.target = 0.005;
  ptzcal_plan *plan = NULL;
  ptzcal_plan_summary summary;
  ptzcal_plan_summary_init(&summary, sizeof summary);
  check(ptzcal_plan_make(site, &wanted, NULL, &plan, &error), &error);
  check(ptzcal_plan_get_summary(plan, &summary, &error), &error);
  printf("5 mm at 0.2 px: a grid of %u x %u (%u in view), or %u chosen shots\n", summary.pan_steps, summary.tilt_steps,
         summary.grid_seen, summary.shots);

  /* What a grid three times as fine is good for. */
  ptzcal_region region;
  ptzcal_region_init(&region, sizeof region);
  region.pan_min = wanted.pan_min, region.pan_max = wanted.pan_max, region.pan_steps = 3 * summary.pan_steps;
  region.tilt_min = wanted.tilt_min, region.tilt_max = wanted.tilt_max, region.tilt_steps = 3 * summary.tilt_steps;
  ptzcal_set_up *set_up = NULL;
  check(ptzcal_set_up_from_region(site, &region, &set_up, &error), &error);
  const double distances[3] = {3, 4, 5}, levels[4] = {0.2, 0.2, 1.0, 1.0};
  ptzcal_label *label = NULL;
  check(ptzcal_label_make(set_up, distances, 3, levels, 2, NULL, NULL, NULL, NULL, &label, &error), &error);
  size_t rows = 0;
  check(ptzcal_label_get_count(label, &rows, &error), &error);
  printf("shots up to   noise  shots   position to (covariance says)\n");
  for (size_t i = 0; i < rows; i++) {
    ptzcal_label_row row;
    ptzcal_label_row_init(&row, sizeof row);
    check(ptzcal_label_get_row(label, i, &row, &error), &error);
    printf("%7.1f m   %4.1f px  %5u   %7.2f (%.2f) mm\n", row.distance, row.fixed_sigma, row.shots,
           1e3 * row.simulated[PTZCAL_STUDY_QUANTITY_POSITION], 1e3 * row.expected[PTZCAL_STUDY_QUANTITY_POSITION]);
  }
  check(ptzcal_label_save_csv(label, "label.csv", &error), &error);
  check(ptzcal_label_save_plot(label, PTZCAL_STUDY_QUANTITY_POSITION, "label.svg", &error), &error);

  ptzcal_label_free(label);
  ptzcal_set_up_free(set_up);
  ptzcal_plan_free(plan);
  ptzcal_site_free(site);
  return 0;
}
