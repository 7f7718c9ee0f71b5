/* The simulator through the C API: its truth is consistent with what it shows. */
#include "fixtures.h"
#include <string.h>

int main(void)
{
  static const char *bad[] = {"", "sim:", "sim:nowhere", "sim:room?colour=blue", "sim:room?seed=x", "http://camera"};
  ptzcal_simulator *simulator;
  ptzcal_rig_model nominal, truth;
  ptzcal_camera camera, head;
  ptzcal_pose station;
  ptzcal_image image;
  double pan, tilt, now, before, timestamp;
  int32_t motion = -1;
  size_t count = 0, i;

  for (i = 0; i < sizeof bad / sizeof *bad; i++) {
    ptzcal_error *error = NULL;
    CHECK(ptzcal_simulator_new(bad[i], &simulator, &error) != PTZCAL_STATUS_OK);
    CHECK(simulator == NULL && *ptzcal_error_message(error));
    ptzcal_error_free(error);
  }

  CHECK_OK(ptzcal_simulator_new("sim:room?seed=3", &simulator, NULL));
  CHECK_OK(ptzcal_rig_model_init(&nominal, sizeof nominal));
  CHECK_OK(ptzcal_rig_model_init(&truth, sizeof truth));
  CHECK_OK(ptzcal_simulator_nominal_rig(simulator, &nominal, NULL));
  CHECK_OK(ptzcal_simulator_true_rig(simulator, &truth, NULL));
  CHECK(truth.width == nominal.width && truth.fx > 0.0);
  CHECK_OK(ptzcal_pose_init(&station, sizeof station));
  CHECK_OK(ptzcal_simulator_true_station(simulator, &station, NULL));

  CHECK_OK(ptzcal_simulator_fixed_cameras(simulator, &count, NULL));
  CHECK(count >= 1);
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  CHECK_OK(ptzcal_simulator_true_camera(simulator, 0, &camera, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_simulator_true_camera(simulator, (uint32_t)count, &camera, NULL));

  CHECK_OK(ptzcal_image_init(&image, sizeof image));
  CHECK_OK(ptzcal_simulator_next_frame(simulator, 0, 0.0, 1.0, &image, &timestamp, NULL));
  CHECK(image.width == camera.width && image.height == camera.height && image.plane[0] && timestamp >= 0.0);
  CHECK_OK(ptzcal_simulator_next_frame(simulator, PTZCAL_HEAD_CAMERA, 0.0, 1.0, &image, &timestamp, NULL));
  CHECK(image.width == truth.width);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_simulator_next_frame(simulator, (uint32_t)count, 0.0, 1.0, &image, &timestamp, NULL));

  CHECK_OK(ptzcal_simulator_move(simulator, 0.1, 0.05, NULL));
  CHECK_OK(ptzcal_simulator_motion(simulator, &motion, NULL));
  CHECK_OK(ptzcal_simulator_now(simulator, &before, NULL));
  CHECK(motion == PTZCAL_MOTION_MOVING);
  CHECK_OK(ptzcal_simulator_sleep(simulator, 5.0, NULL));
  CHECK_OK(ptzcal_simulator_now(simulator, &now, NULL));
  CHECK_NEAR(now - before, 5.0, 1e-6);
  CHECK_OK(ptzcal_simulator_position(simulator, &pan, &tilt, NULL));
  CHECK_NEAR(pan, 0.1, 0.01);
  CHECK_NEAR(tilt, 0.05, 0.01);
  CHECK_OK(ptzcal_simulator_stop(simulator, NULL));
  CHECK_OK(ptzcal_camera_init(&head, sizeof head));
  CHECK_OK(ptzcal_rig_model_head_camera(&truth, pan, tilt, &head, NULL));

  CHECK_STATUS(PTZCAL_STATUS_UNREACHABLE, ptzcal_simulator_move(simulator, 100.0, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_simulator_set_laser(simulator, 2, NULL));
  CHECK_OK(ptzcal_simulator_set_laser(simulator, 1, NULL));
  CHECK_OK(ptzcal_simulator_set_laser(simulator, 0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_simulator_sleep(simulator, -1.0, NULL));
  ptzcal_simulator_free(simulator);
  return 0;
}
