/* Calibrates a fixed camera from one view of a depth camera that sees the same things:
 *
 *     cc calibrate_from_depth_camera.c $(pkg-config --cflags --libs ptzcal) -o calibrate
 *     ./calibrate colour.png depth.png fixed.png 518 519 325.5 253.5 [matches.png]
 *
 * The first two are the depth camera's, registered, the depth in millimetres, 16 bits; the numbers are
 * its fx, fy, cx, cy in pixels. The world is its frame. With a last argument what was matched is drawn. */
#include <math.h>
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

static ptzcal_picture *read_picture(const char *path, ptzcal_image *image)
{
  ptzcal_error *error = NULL;
  ptzcal_picture *picture = NULL;
  check(ptzcal_picture_read(path, &picture, &error), &error);
  ptzcal_image_init(image, sizeof *image);
  check(ptzcal_picture_image(picture, image, &error), &error);
  return picture;
}

/* Both images side by side, the pairs of points joined. */
static void draw_matches(const ptzcal_rgbd *rgbd, const ptzcal_image *colour, const ptzcal_image *fixed, const char *path)
{
  ptzcal_error *error = NULL;
  ptzcal_picture *picture = NULL;
  size_t i, needed = 0, n;
  double *pairs, *left, *right;
  ptzcal_rgbd_copy_pairs(rgbd, NULL, 0, &needed, NULL);
  n = needed / PTZCAL_RGBD_PAIR_SIZE;
  pairs = malloc(needed * sizeof *pairs);
  left = malloc(2 * n * sizeof *left);
  right = malloc(2 * n * sizeof *right);
  if (!pairs || !left || !right)
    exit(1);
  check(ptzcal_rgbd_copy_pairs(rgbd, pairs, needed, NULL, &error), &error);
  for (i = 0; i < n; i++) {
    const double *pair = pairs + i * PTZCAL_RGBD_PAIR_SIZE;
    left[2 * i] = pair[1], left[2 * i + 1] = pair[2];
    right[2 * i] = pair[3], right[2 * i + 1] = pair[4];
  }
  check(ptzcal_picture_beside(colour, fixed, &picture, &error), &error);
  check(ptzcal_picture_draw_matches(picture, left, right, NULL, n, colour->width, &error), &error);
  check(ptzcal_picture_save(picture, path, &error), &error);
  ptzcal_picture_free(picture);
  free(pairs);
  free(left);
  free(right);
}

int main(int argc, char **argv)
{
  ptzcal_error *error = NULL;
  ptzcal_image colour, fixed;
  ptzcal_picture *colour_picture, *fixed_picture;
  ptzcal_depth_map *depth = NULL;
  ptzcal_rgbd *rgbd = NULL;
  ptzcal_rgbd_view view;
  ptzcal_calibration *calibration = NULL;
  ptzcal_calibration_summary summary;
  ptzcal_camera camera;
  double covariance[11 * 11], centre[3];
  int i;
  if (argc < 8) {
    fprintf(stderr, "%s COLOUR DEPTH FIXED FX FY CX CY [MATCHES.png]\n", argv[0]);
    return 2;
  }
  colour_picture = read_picture(argv[1], &colour);
  fixed_picture = read_picture(argv[3], &fixed);
  check(ptzcal_depth_map_read(argv[2], 0.001, &depth, &error), &error);
  ptzcal_camera_init(&camera, sizeof camera);
  camera.width = colour.width;
  camera.height = colour.height;
  camera.fx = atof(argv[4]);
  camera.fy = atof(argv[5]);
  camera.cx = atof(argv[6]);
  camera.cy = atof(argv[7]);
  for (i = 0; i < 3; i++)
    camera.rotation[4 * i] = 1;

  check(ptzcal_rgbd_new(&fixed, NULL, &rgbd, &error), &error);
  ptzcal_rgbd_view_init(&view, sizeof view);
  check(ptzcal_rgbd_add_view(rgbd, &colour, depth, &camera, &view, &error), &error);
  printf("%u features, %u matches, %u of them with depth; %u lines\n", view.features, view.matches, view.pairs, view.lines);
  check(ptzcal_rgbd_calibrate(rgbd, NULL, &calibration, &error), &error);

  check(ptzcal_calibration_get_camera(calibration, &camera, &error), &error);
  check(ptzcal_calibration_copy_covariance(calibration, covariance, 11 * 11, NULL, &error), &error);
  check(ptzcal_camera_centre(&camera, centre, &error), &error);
  ptzcal_calibration_summary_init(&summary, sizeof summary);
  check(ptzcal_calibration_get_summary(calibration, &summary, &error), &error);
  printf("fx %.2f +- %.2f, fy %.2f +- %.2f px\n", camera.fx, sqrt(covariance[0]), camera.fy, sqrt(covariance[12]));
  printf("cx %.2f +- %.2f, cy %.2f +- %.2f px\n", camera.cx, sqrt(covariance[36]), camera.cy, sqrt(covariance[48]));
  printf("centre %.4f %.4f %.4f m\n", centre[0], centre[1], centre[2]);
  printf("%llu of %llu pairs of points and lines used, rms %.2f px\n", (unsigned long long)summary.inliers,
         (unsigned long long)summary.measurements, summary.rms);
  if (argc > 8)
    draw_matches(rgbd, &colour, &fixed, argv[8]);

  ptzcal_calibration_free(calibration);
  ptzcal_rgbd_free(rgbd);
  ptzcal_depth_map_free(depth);
  ptzcal_picture_free(fixed_picture);
  ptzcal_picture_free(colour_picture);
  return 0;
}
