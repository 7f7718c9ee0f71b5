/* Error objects: what they say, and that they are cleared on entry. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

int main(void)
{
  ptzcal_error *error = NULL;
  double uv[4] = {0, 0, NAN, 0}, rays[6];

  /* NULL is no error. */
  CHECK(ptzcal_error_status(NULL) == PTZCAL_STATUS_OK);
  CHECK(strcmp(ptzcal_error_message(NULL), "") == 0);
  CHECK(strcmp(ptzcal_error_hint(NULL), "") == 0);
  CHECK(ptzcal_error_index(NULL) == -1);
  ptzcal_error_free(NULL);

  make_camera(fixture_camera);
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_camera_back_project(fixture_camera, uv, 2, rays, &error));
  CHECK(ptzcal_error_status(error) == PTZCAL_STATUS_NOT_FINITE);
  CHECK(strcmp(ptzcal_error_message(error), "uv[1] is NaN or infinite") == 0);
  CHECK(ptzcal_error_index(error) == 1);
  CHECK(strcmp(ptzcal_error_hint(error), "") == 0);
  ptzcal_error_free(error);

  /* A failure that no single point is to blame for, with something to do about it. */
  CHECK_OK(ptzcal_correspondences_new(800, 600, &fixture_correspondences, &error));
  CHECK(error == NULL);
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS,
               ptzcal_calibrate_camera(fixture_correspondences, NULL, &fixture_calibration, &error));
  CHECK(fixture_calibration == NULL);
  CHECK(ptzcal_error_index(error) == -1);
  CHECK(strlen(ptzcal_error_hint(error)) > 0);
  CHECK(strstr(ptzcal_error_message(error), "0 usable points") != NULL);
  ptzcal_error_free(error);

  /* Success clears the pointer, and so does every entry: garbage in it is never followed. */
  error = (ptzcal_error *)(void *)&uv;
  CHECK_OK(ptzcal_correspondences_add_points(fixture_correspondences, NULL, NULL, 0, &error));
  CHECK(error == NULL);
  ptzcal_correspondences_free(fixture_correspondences);
  return 0;
}
