/* Cameras in every format, lists of them, tables of points, calibrations that are solved again. */
#include "fixtures.h"
#include <string.h>

static int same(const ptzcal_camera *a, const ptzcal_camera *b) { return memcmp(a, b, sizeof *a) == 0; }

static void one_camera(void)
{
  static const char *names[] = {"auto.json", "c.json", "c.yaml", "c.xml", "c.cv.json", "c.ros", "c.colmap", "c.cameramodel", "c.kalibr"};
  ptzcal_camera camera, found;
  uint32_t format;
  make_camera(&camera);
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  for (format = PTZCAL_CAMERA_FORMAT_AUTO; format <= PTZCAL_CAMERA_FORMAT_KALIBR; format++) {
    CHECK_OK(ptzcal_camera_write(&camera, names[format], format, NULL));
    CHECK_OK(ptzcal_camera_read(names[format], PTZCAL_CAMERA_FORMAT_AUTO, &found, NULL));
    CHECK(found.width == camera.width && found.height == camera.height);
    CHECK_NEAR(found.fx, camera.fx, 0.0);
    CHECK_NEAR(found.cx, camera.cx, 1e-12);
    CHECK_NEAR(found.cy, camera.cy, 1e-12);
    if (format <= PTZCAL_CAMERA_FORMAT_OPENCV_JSON) CHECK(same(&found, &camera));
    if (format == PTZCAL_CAMERA_FORMAT_COLMAP || format == PTZCAL_CAMERA_FORMAT_MRCAL) {
      int i;
      for (i = 0; i < 9; i++) CHECK_NEAR(found.rotation[i], camera.rotation[i], 1e-14);
      for (i = 0; i < 3; i++) CHECK_NEAR(found.translation[i], camera.translation[i], 0.0);
    }
    CHECK_OK(ptzcal_camera_read(names[format], format, &found, NULL));
  }
  /* Another format than it is. */
  taint(&found, sizeof found);
  found.struct_size = sizeof found;
  CHECK_STATUS(PTZCAL_STATUS_FILE_FORMAT, ptzcal_camera_read("c.xml", PTZCAL_CAMERA_FORMAT_ROS, &found, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_camera_read("none.yaml", PTZCAL_CAMERA_FORMAT_AUTO, &found, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_camera_read("c.xml", 99, &found, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_camera_write(&camera, "c.xml", 9, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_camera_write(&camera, "c.unknown", 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_camera_write(&camera, "no/such/folder/c.xml", 0, NULL));
  camera.skew = 0.5;
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_camera_write(&camera, "c.xml", PTZCAL_CAMERA_FORMAT_AUTO, NULL));
  camera.skew = 0.0;
  camera.distortion_model = PTZCAL_DISTORTION_MODEL_DIVISION;
  memset(camera.distortion, 0, sizeof camera.distortion);
  camera.distortion[0] = -0.1;
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_camera_write(&camera, "c.ros", PTZCAL_CAMERA_FORMAT_ROS, NULL));
  CHECK_OK(ptzcal_camera_write(&camera, "c.colmap", PTZCAL_CAMERA_FORMAT_COLMAP, NULL));
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_camera_read("c.colmap", PTZCAL_CAMERA_FORMAT_AUTO, &found, NULL));
  CHECK(found.distortion_model == PTZCAL_DISTORTION_MODEL_DIVISION);
  CHECK_NEAR(found.distortion[0], -0.1, 0.0);
}

static void faults_are_named(void)
{
  ptzcal_camera found;
  ptzcal_error *error = NULL;
  FILE *file = fopen("bad.yaml", "w");
  CHECK(file && fputs("image_width: 640\nimage_height: tall\ncamera_matrix: 1\n", file) >= 0 && fclose(file) == 0);
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_STATUS(PTZCAL_STATUS_FILE_FORMAT, ptzcal_camera_read("bad.yaml", PTZCAL_CAMERA_FORMAT_AUTO, &found, &error));
  CHECK(strstr(ptzcal_error_message(error), "line 2: image_height: 'tall'") != NULL);
  CHECK(found.width == 0);
  ptzcal_error_free(error);
}

static void lists(void)
{
  ptzcal_camera_list *list = NULL, *back = NULL;
  ptzcal_camera camera, found;
  ptzcal_error *error = NULL;
  size_t count = 7;
  uint32_t format = 99, has_pose = 99;
  make_camera(&camera);
  CHECK_OK(ptzcal_camera_init(&found, sizeof found));
  CHECK_OK(ptzcal_camera_list_new(&list, NULL));
  CHECK_OK(ptzcal_camera_list_count(list, &count, &format, NULL));
  CHECK(count == 0 && format == PTZCAL_CAMERA_FORMAT_AUTO);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_camera_list_write(list, "l", PTZCAL_CAMERA_FORMAT_JSON, NULL));
  CHECK_OK(ptzcal_camera_list_add(list, &camera, "gate", NULL));
  camera.translation[0] += 1.0;
  CHECK_OK(ptzcal_camera_list_add(list, &camera, NULL, NULL));
  CHECK(strcmp(ptzcal_camera_list_name(list, 0), "gate") == 0);
  CHECK(strcmp(ptzcal_camera_list_name(list, 1), "") == 0 && strcmp(ptzcal_camera_list_name(list, 2), "") == 0);
  CHECK(strcmp(ptzcal_camera_list_name(NULL, 0), "") == 0);

  CHECK_OK(ptzcal_camera_list_write(list, "l.colmap", PTZCAL_CAMERA_FORMAT_COLMAP, NULL));
  CHECK_OK(ptzcal_camera_list_read("l.colmap", PTZCAL_CAMERA_FORMAT_AUTO, &back, NULL));
  CHECK_OK(ptzcal_camera_list_count(back, &count, &format, NULL));
  CHECK(count == 2 && format == PTZCAL_CAMERA_FORMAT_COLMAP);
  CHECK(strcmp(ptzcal_camera_list_name(back, 0), "gate") == 0);
  CHECK(strcmp(ptzcal_camera_list_name(back, 1), "camera1") == 0);
  CHECK_OK(ptzcal_camera_list_get(back, 1, &found, &has_pose, NULL));
  CHECK(has_pose == 1);
  CHECK_NEAR(found.translation[0], camera.translation[0], 0.0);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_camera_list_get(back, 2, &found, &has_pose, NULL));
  ptzcal_camera_list_free(back);
  CHECK_STATUS(PTZCAL_STATUS_AMBIGUOUS, ptzcal_camera_read("l.colmap", PTZCAL_CAMERA_FORMAT_AUTO, &found, NULL));

  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_camera_list_write(list, "l.ros", PTZCAL_CAMERA_FORMAT_ROS, NULL));
  CHECK_OK(ptzcal_camera_write(&camera, "one.ros", PTZCAL_CAMERA_FORMAT_ROS, NULL));
  CHECK_OK(ptzcal_camera_list_read("one.ros", PTZCAL_CAMERA_FORMAT_AUTO, &back, NULL));
  CHECK_OK(ptzcal_camera_list_get(back, 0, &found, &has_pose, NULL));
  CHECK(has_pose == 0);
  CHECK_NEAR(found.translation[0], 0.0, 0.0);
  ptzcal_camera_list_free(back);

  /* Which camera of several cannot be written. */
  camera.skew = 2.0;
  CHECK_OK(ptzcal_camera_list_add(list, &camera, "skewed", NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_camera_list_write(list, "l.colmap", PTZCAL_CAMERA_FORMAT_COLMAP, &error));
  CHECK(ptzcal_error_index(error) == 2);
  ptzcal_error_free(error);
  ptzcal_camera_list_free(list);
  ptzcal_camera_list_free(NULL);
  back = (ptzcal_camera_list *)&camera;
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_camera_list_read("none", PTZCAL_CAMERA_FORMAT_AUTO, &back, NULL));
  CHECK(back == NULL);
}

static void tables(void)
{
  ptzcal_correspondences *set = NULL;
  ptzcal_camera camera;
  ptzcal_error *error = NULL;
  double xyz[3 * FIXTURE_POINTS], uv[2 * FIXTURE_POINTS];
  size_t count = 0, added = 0;
  FILE *file;
  make_camera(&camera);
  make_points(&camera, xyz, uv, FIXTURE_POINTS, 0.1);
  CHECK_OK(ptzcal_correspondences_new(camera.width, camera.height, &set, NULL));
  CHECK_OK(ptzcal_correspondences_add_points(set, xyz, uv, FIXTURE_POINTS, NULL));
  CHECK_OK(ptzcal_correspondences_save_csv(set, "points.csv", NULL));
  CHECK_OK(ptzcal_correspondences_add_csv(set, "points.csv", &added, NULL));
  CHECK_OK(ptzcal_correspondences_count(set, &count, NULL));
  CHECK(added == FIXTURE_POINTS && count == 2 * FIXTURE_POINTS);
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_correspondences_add_csv(set, "none.csv", NULL, NULL));
  file = fopen("bad.csv", "w");
  CHECK(file && fputs("x,y,z,u,v\n1,2,3,4,5\n1,2,3,4,wide\n", file) >= 0 && fclose(file) == 0);
  CHECK_STATUS(PTZCAL_STATUS_FILE_FORMAT, ptzcal_correspondences_add_csv(set, "bad.csv", &added, &error));
  CHECK(strstr(ptzcal_error_message(error), "line 3: v: 'wide'") != NULL);
  ptzcal_error_free(error);
  file = fopen("bad.csv", "w");
  CHECK(file && fputs("x,y,z,u,v,cov_uu,cov_uv,cov_vv\n1,2,3,4,5,1,0,1\n1,2,3,4,5,-1,0,1\n", file) >= 0 && fclose(file) == 0);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_correspondences_add_csv(set, "bad.csv", &added, NULL));
  CHECK_OK(ptzcal_correspondences_count(set, &count, NULL));
  CHECK(count == 2 * FIXTURE_POINTS);
  {
    double line[6] = {0, 0, 3, 1, 0, 3}, ends[4] = {100, 100, 300, 100};
    CHECK_OK(ptzcal_correspondences_add_lines(set, line, NULL, ends, NULL, 1, NULL));
    CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_correspondences_save_csv(set, "lines.csv", NULL));
  }
  ptzcal_correspondences_free(set);
}

static void solved_again(void)
{
  ptzcal_correspondences *set = NULL, *set_again = NULL;
  ptzcal_calibration_options *options = NULL, *options_again = NULL;
  ptzcal_calibration *first = NULL, *second = NULL;
  ptzcal_camera camera, a, b;
  double xyz[3 * FIXTURE_POINTS], uv[2 * FIXTURE_POINTS], of_a[256], of_b[256];
  size_t needed = 0;
  make_camera(&camera);
  make_points(&camera, xyz, uv, FIXTURE_POINTS, 0.3);
  CHECK_OK(ptzcal_correspondences_new(camera.width, camera.height, &set, NULL));
  CHECK_OK(ptzcal_correspondences_add_points(set, xyz, uv, FIXTURE_POINTS, NULL));
  CHECK_OK(ptzcal_calibration_options_new(&options, NULL));
  CHECK_OK(ptzcal_calibration_options_set_distortion(options, camera.distortion_model, NULL));
  CHECK_OK(ptzcal_calibration_options_set_seed(options, 77, NULL));
  CHECK_OK(ptzcal_calibrate_camera(set, options, &first, NULL));
  CHECK_OK(ptzcal_calibration_save(first, "again.json", NULL));
  CHECK_OK(ptzcal_calibration_load_inputs("again.json", &set_again, &options_again, NULL));
  CHECK_OK(ptzcal_calibrate_camera(set_again, options_again, &second, NULL));
  CHECK_OK(ptzcal_camera_init(&a, sizeof a));
  CHECK_OK(ptzcal_camera_init(&b, sizeof b));
  CHECK_OK(ptzcal_calibration_get_camera(first, &a, NULL));
  CHECK_OK(ptzcal_calibration_get_camera(second, &b, NULL));
  CHECK(same(&a, &b));
  CHECK_OK(ptzcal_calibration_copy_covariance(first, of_a, 256, &needed, NULL));
  CHECK_OK(ptzcal_calibration_copy_covariance(second, of_b, 256, &needed, NULL));
  CHECK(memcmp(of_a, of_b, needed * sizeof *of_a) == 0);
  ptzcal_calibration_free(first);
  ptzcal_calibration_free(second);
  ptzcal_correspondences_free(set_again);
  ptzcal_calibration_options_free(options_again);
  ptzcal_correspondences_free(set);
  ptzcal_calibration_options_free(options);
  CHECK_OK(ptzcal_camera_save(&camera, "alone.json", NULL));
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_calibration_load_inputs("alone.json", &set_again, &options_again, NULL));
  CHECK(set_again == NULL && options_again == NULL);
}

int main(void)
{
  one_camera();
  faults_are_named();
  lists();
  tables();
  solved_again();
  return 0;
}
