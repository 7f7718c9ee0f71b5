/* A process that forks while it uses the library: the child goes on as the parent does. */
#include "fixtures.h"
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

static double focal_length(void)
{
  ptzcal_calibration *result;
  ptzcal_camera camera;
  CHECK_OK(ptzcal_calibrate_camera(fixture_correspondences, NULL, &result, NULL));
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  CHECK_OK(ptzcal_calibration_get_camera(result, &camera, NULL));
  ptzcal_calibration_free(result);
  return camera.fx;
}

int main(void)
{
  double before;
  int i, status;
  make_camera(fixture_camera);
  make_points(fixture_camera, fixture_xyz, fixture_uv, FIXTURE_POINTS, 0.3);
  CHECK_OK(ptzcal_correspondences_new(800, 600, &fixture_correspondences, NULL));
  CHECK_OK(ptzcal_correspondences_add_points(fixture_correspondences, fixture_xyz, fixture_uv, FIXTURE_POINTS, NULL));
  before = focal_length();
  for (i = 0; i < 3; i++) {
    pid_t child = fork();
    CHECK(child >= 0);
    if (child == 0) {
      CHECK(focal_length() == before);
      ptzcal_correspondences_free(fixture_correspondences);
      _exit(0);
    }
    CHECK(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  }
  CHECK(focal_length() == before);
  ptzcal_correspondences_free(fixture_correspondences);
  return 0;
}
