/* The rig's measurement model. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

/* A laser beside the camera and parallel to its axis: depth = f b / (u - cx). */
static void depth_by_hand(void)
{
  ptzcal_rig_model model;
  double pan_tilt[4] = {0.0, 0.0, 0.5, 0.0}, spots[4], xyz[6], covariance[18];
  const double noise[6] = {0.04, 0.0, 0.04, 0.04, 0.0, 0.04};
  make_rig_model(&model);
  model.laser_y0 = 0.0;
  spots[0] = spots[2] = 360.0 + 800.0 * 0.1 / 2.0;
  spots[1] = spots[3] = 288.0;
  CHECK_OK(ptzcal_rig_model_locate(&model, pan_tilt, spots, noise, 2, xyz, covariance, NULL));
  CHECK_NEAR(xyz[0], 0.1, 1e-12);
  CHECK_NEAR(xyz[1], 0.0, 1e-12);
  CHECK_NEAR(xyz[2], 2.0, 1e-12);
  /* sigma_Z = Z^2 sigma / (f b); along the beam only. */
  CHECK_NEAR(sqrt(covariance[8]), 4.0 * 0.2 / 80.0, 1e-12);
  CHECK_NEAR(covariance[0], 0.0, 1e-15);
  /* Pan turns to the right. */
  CHECK_NEAR(xyz[3], 0.1 * cos(0.5) + 2.0 * sin(0.5), 1e-12);
  CHECK_NEAR(xyz[5], -0.1 * sin(0.5) + 2.0 * cos(0.5), 1e-12);
  /* Without covariances in or out. */
  CHECK_OK(ptzcal_rig_model_locate(&model, pan_tilt, spots, NULL, 2, xyz, NULL, NULL));
  CHECK_NEAR(xyz[2], 2.0, 1e-12);
}

static void head_camera_sees_the_spot(void)
{
  ptzcal_camera head;
  double pan_tilt[2] = {-0.3, 0.2}, spot[2] = {395.0, 290.0}, xyz[3], uv[2];
  make_rig_model(fixture_rig_model);
  fixture_rig_model->axis_tilt_z = 0.02;
  fixture_rig_model->axis_pan_x = 0.01;
  fixture_rig_model->pan_zero = 0.01;
  spot[1] = 288.0 + (spot[0] - 360.0) * 0.05;
  CHECK_OK(ptzcal_camera_init(&head, sizeof head));
  CHECK_OK(ptzcal_rig_model_head_camera(fixture_rig_model, pan_tilt[0], pan_tilt[1], &head, NULL));
  CHECK_OK(ptzcal_rig_model_locate(fixture_rig_model, pan_tilt, spot, NULL, 1, xyz, NULL, NULL));
  CHECK_OK(ptzcal_camera_project(&head, xyz, 1, uv, NULL));
  CHECK_NEAR(uv[0], spot[0], 1e-9);
  CHECK_NEAR(uv[1], spot[1], 1e-9);
  CHECK(xyz[1] < 0.0); /* tilted up */
}

static void bad_shots(void)
{
  ptzcal_error *error = NULL;
  double pan_tilt[4] = {0, 0, 0, 0}, spots[4] = {400.0, 288.0, 300.0, 288.0}, xyz[6];
  double noise[6] = {1, 0, 1, 1, 2, 1};
  make_rig_model(fixture_rig_model);
  taint(xyz, sizeof xyz);
  CHECK_STATUS(PTZCAL_STATUS_BEHIND_CAMERA,
               ptzcal_rig_model_locate(fixture_rig_model, pan_tilt, spots, NULL, 2, xyz, NULL, &error));
  CHECK(ptzcal_error_index(error) == 1);
  ptzcal_error_free(error);
  spots[2] = 410.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT,
               ptzcal_rig_model_locate(fixture_rig_model, pan_tilt, spots, noise, 2, xyz, NULL, NULL));
  noise[4] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE,
               ptzcal_rig_model_locate(fixture_rig_model, pan_tilt, spots, noise, 2, xyz, NULL, &error));
  CHECK(ptzcal_error_index(error) == 1);
  ptzcal_error_free(error);
  CHECK(is_tainted(xyz, sizeof xyz));
  CHECK_OK(ptzcal_rig_model_locate(fixture_rig_model, NULL, NULL, NULL, 0, NULL, NULL, NULL));
}

static void bad(const ptzcal_rig_model *model, ptzcal_status wanted, const char *what)
{
  ptzcal_error *error = NULL;
  ptzcal_camera camera;
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  CHECK_STATUS(wanted, ptzcal_rig_model_head_camera(model, 0.0, 0.0, &camera, &error));
  CHECK(strstr(ptzcal_error_message(error), what) != NULL);
  CHECK(camera.fx == 0.0);
  ptzcal_error_free(error);
}

static void bad_models(void)
{
  ptzcal_rig_model good, m;
  make_rig_model(&good);
#define BAD(change, status, what) (m = good, change, bad(&m, status, what))
  BAD(m.laser_x0 = m.laser_y0 = 0.0, PTZCAL_STATUS_INVALID_ARGUMENT, "laser");
  BAD(m.laser_vx = NAN, PTZCAL_STATUS_NOT_FINITE, "laser[2]");
  BAD(m.axis_pan_z = INFINITY, PTZCAL_STATUS_NOT_FINITE, "offsets[3]");
  BAD(m.pan_scale = 0.0, PTZCAL_STATUS_INVALID_ARGUMENT, "encoders");
  BAD(m.tilt_zero = NAN, PTZCAL_STATUS_NOT_FINITE, "encoders[2]");
  BAD(m.distortion_model = 77, PTZCAL_STATUS_INVALID_ARGUMENT, "distortion_model");
  BAD(m.fx = 0.0, PTZCAL_STATUS_INVALID_ARGUMENT, "intrinsics");
  BAD(m.width = 0, PTZCAL_STATUS_INVALID_ARGUMENT, "image size");
}

int main(void)
{
  depth_by_hand();
  head_camera_sees_the_spot();
  bad_shots();
  bad_models();
  return 0;
}
