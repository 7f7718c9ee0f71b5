/* Projection and back-projection, against numbers worked out by hand. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

static void simple(ptzcal_camera *camera)
{
  CHECK_OK(ptzcal_camera_init(camera, sizeof *camera));
  camera->width = 640;
  camera->height = 480;
  camera->fx = 500.0;
  camera->fy = 510.0;
  camera->cx = 320.0;
  camera->cy = 240.0;
}

static void by_hand(void)
{
  ptzcal_camera camera;
  double xyz[6] = {0.2, -0.1, 2.0, 0.0, 0.0, 1.0}, uv[4];
  simple(&camera);
  camera.skew = 2.0;
  CHECK_OK(ptzcal_camera_project(&camera, xyz, 2, uv, NULL));
  CHECK_NEAR(uv[0], 500.0 * 0.1 + 2.0 * -0.05 + 320.0, 1e-12);
  CHECK_NEAR(uv[1], 510.0 * -0.05 + 240.0, 1e-12);
  CHECK_NEAR(uv[2], 320.0, 0.0);

  /* Brown-Conrady, all five coefficients, at (x, y) = (0.1, -0.05), r^2 = 0.0125. */
  camera.distortion_model = PTZCAL_DISTORTION_MODEL_BROWN_CONRADY;
  camera.distortion[0] = -0.3;
  camera.distortion[1] = 0.1;
  camera.distortion[2] = 0.001;
  camera.distortion[3] = -0.002;
  camera.distortion[4] = 0.05;
  {
    const double x = 0.1, y = -0.05, r2 = 0.0125;
    const double g = 1 + r2 * (-0.3 + r2 * (0.1 + r2 * 0.05));
    const double a = x * g + 2 * 0.001 * x * y - 0.002 * (r2 + 2 * x * x);
    const double b = y * g + 0.001 * (r2 + 2 * y * y) + 2 * -0.002 * x * y;
    CHECK_OK(ptzcal_camera_project(&camera, xyz, 1, uv, NULL));
    CHECK_NEAR(uv[0], 500.0 * a + 2.0 * b + 320.0, 1e-10);
    CHECK_NEAR(uv[1], 510.0 * b + 240.0, 1e-10);
  }

  /* Division model: (x, y) = (a, b) / (1 + lambda r_d^2). */
  memset(camera.distortion, 0, sizeof camera.distortion);
  camera.distortion_model = PTZCAL_DISTORTION_MODEL_DIVISION;
  camera.distortion[0] = -0.2;
  camera.skew = 0.0;
  {
    const double a = 0.3, b = 0.4, scale = 1 - 0.2 * 0.25;
    double point[3], pixel[2];
    point[0] = a / scale;
    point[1] = b / scale;
    point[2] = 1.0;
    CHECK_OK(ptzcal_camera_project(&camera, point, 1, pixel, NULL));
    CHECK_NEAR(pixel[0], 500.0 * a + 320.0, 1e-10);
    CHECK_NEAR(pixel[1], 510.0 * b + 240.0, 1e-10);
  }
}

static void there_and_back(void)
{
  ptzcal_camera camera;
  double xyz[3 * FIXTURE_POINTS], uv[2 * FIXTURE_POINTS], rays[3 * FIXTURE_POINTS], centre[3];
  int model, i;
  make_camera(&camera);
  CHECK_OK(ptzcal_camera_centre(&camera, centre, NULL));
  CHECK_NEAR(centre[0], 0.5, 1e-12);
  CHECK_NEAR(centre[1], -0.2, 1e-12);
  CHECK_NEAR(centre[2], -1.0, 1e-12);
  for (model = PTZCAL_DISTORTION_MODEL_NONE; model <= PTZCAL_DISTORTION_MODEL_DIVISION; model++) {
    camera.distortion_model = (uint32_t)model;
    camera.distortion[0] = model == PTZCAL_DISTORTION_MODEL_NONE ? 0.0 : -0.15;
    camera.distortion[3] = model == PTZCAL_DISTORTION_MODEL_BROWN_CONRADY ? 0.001 : 0.0;
    make_points(&camera, xyz, uv, FIXTURE_POINTS, 0.0);
    CHECK_OK(ptzcal_camera_back_project(&camera, uv, FIXTURE_POINTS, rays, NULL));
    for (i = 0; i < FIXTURE_POINTS; i++) {
      double d[3], length;
      int k;
      for (k = 0; k < 3; k++) d[k] = xyz[3 * i + k] - centre[k];
      length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      for (k = 0; k < 3; k++) CHECK_NEAR(rays[3 * i + k], d[k] / length, 1e-9);
    }
  }
}

static void no_image(void)
{
  ptzcal_camera camera;
  ptzcal_error *error = NULL;
  double xyz[9] = {0, 0, 1, 0, 0, -1, 0, 0, 0}, uv[6], rays[9];
  simple(&camera);
  taint(uv, sizeof uv);
  CHECK_STATUS(PTZCAL_STATUS_BEHIND_CAMERA, ptzcal_camera_project(&camera, xyz, 3, uv, &error));
  CHECK(ptzcal_error_index(error) == 1);
  CHECK(is_tainted(uv, sizeof uv));
  ptzcal_error_free(error);
  /* The centre itself. */
  CHECK_STATUS(PTZCAL_STATUS_BEHIND_CAMERA, ptzcal_camera_project(&camera, xyz + 6, 1, uv, NULL));

  /* A pincushion division lens has no image beyond a radius. */
  camera.distortion_model = PTZCAL_DISTORTION_MODEL_DIVISION;
  camera.distortion[0] = 0.5;
  xyz[6] = 50.0;
  xyz[8] = 1.0;
  xyz[5] = 1.0;
  CHECK_STATUS(PTZCAL_STATUS_OUTSIDE_LENS, ptzcal_camera_project(&camera, xyz, 3, uv, &error));
  CHECK(ptzcal_error_index(error) == 2);
  ptzcal_error_free(error);

  /* A barrel lens that folds back: no ray comes from beyond its largest radius. */
  camera.distortion_model = PTZCAL_DISTORTION_MODEL_RADIAL1;
  camera.distortion[0] = -0.6;
  uv[0] = 320.0;
  uv[1] = 240.0;
  uv[2] = 640.0;
  uv[3] = 480.0;
  taint(rays, sizeof rays);
  CHECK_STATUS(PTZCAL_STATUS_OUTSIDE_LENS, ptzcal_camera_back_project(&camera, uv, 2, rays, &error));
  CHECK(ptzcal_error_index(error) == 1);
  CHECK(is_tainted(rays, sizeof rays));
  ptzcal_error_free(error);
}

static void edges(void)
{
  ptzcal_camera camera;
  double memory[6] = {0.1, 0.2, 1.0, 0.3, 0.1, 2.0}, uv[4];
  simple(&camera);
  /* Nothing to do. */
  CHECK_OK(ptzcal_camera_project(&camera, NULL, 0, NULL, NULL));
  CHECK_OK(ptzcal_camera_back_project(&camera, NULL, 0, NULL, NULL));
  /* In place. */
  CHECK_OK(ptzcal_camera_project(&camera, memory, 2, uv, NULL));
  CHECK_OK(ptzcal_camera_project(&camera, memory, 2, memory, NULL));
  CHECK(memcmp(memory, uv, sizeof uv) == 0);
}

static void bad(const ptzcal_camera *camera, ptzcal_status wanted, const char *what)
{
  ptzcal_error *error = NULL;
  double centre[3];
  taint(centre, sizeof centre);
  CHECK_STATUS(wanted, ptzcal_camera_centre(camera, centre, &error));
  CHECK(strstr(ptzcal_error_message(error), what) != NULL);
  CHECK(is_tainted(centre, sizeof centre));
  ptzcal_error_free(error);
}

static void bad_cameras(void)
{
  ptzcal_camera good, c;
  make_camera(&good);
#define BAD(change, status, what) (c = good, change, bad(&c, status, what))
  BAD(c.width = 0, PTZCAL_STATUS_INVALID_ARGUMENT, "camera");
  BAD(c.height = 65537, PTZCAL_STATUS_INVALID_ARGUMENT, "camera");
  BAD(c.width = UINT32_MAX, PTZCAL_STATUS_INVALID_ARGUMENT, "camera");
  BAD(c.fx = 0.0, PTZCAL_STATUS_INVALID_ARGUMENT, "intrinsics");
  BAD(c.fy = -845.0, PTZCAL_STATUS_INVALID_ARGUMENT, "intrinsics");
  BAD(c.cx = NAN, PTZCAL_STATUS_NOT_FINITE, "intrinsics[3]");
  BAD(c.fx = INFINITY, PTZCAL_STATUS_NOT_FINITE, "intrinsics[0]");
  BAD(c.distortion_model = 6, PTZCAL_STATUS_INVALID_ARGUMENT, "distortion_model");
  BAD(c.distortion_model = UINT32_MAX, PTZCAL_STATUS_INVALID_ARGUMENT, "distortion_model");
  BAD((c.distortion_model = PTZCAL_DISTORTION_MODEL_BROWN_CONRADY, c.distortion[4] = NAN), PTZCAL_STATUS_NOT_FINITE,
      "distortion[4]");
  /* Coefficients of another model are not ignored. */
  BAD(c.distortion[0] = 0.1, PTZCAL_STATUS_INVALID_ARGUMENT, "distortion: coefficient 0");
  BAD((c.distortion_model = PTZCAL_DISTORTION_MODEL_BROWN_CONRADY, c.distortion[5] = 0.1),
      PTZCAL_STATUS_INVALID_ARGUMENT, "distortion: coefficient 5");
  BAD((c.distortion_model = PTZCAL_DISTORTION_MODEL_DIVISION, c.distortion[1] = NAN), PTZCAL_STATUS_INVALID_ARGUMENT,
      "distortion: coefficient 1");
  BAD(c.rotation[4] = 1.01, PTZCAL_STATUS_INVALID_ARGUMENT, "not a rotation");
  BAD(c.rotation[4] = -1.0, PTZCAL_STATUS_INVALID_ARGUMENT, "not a rotation");
  BAD(memset(c.rotation, 0, sizeof c.rotation), PTZCAL_STATUS_INVALID_ARGUMENT, "not a rotation");
  BAD(c.rotation[0] = NAN, PTZCAL_STATUS_NOT_FINITE, "pose");
  BAD(c.translation[2] = INFINITY, PTZCAL_STATUS_NOT_FINITE, "pose");
  /* Set up, but not filled in. */
  BAD(CHECK_OK(ptzcal_camera_init(&c, sizeof c)), PTZCAL_STATUS_INVALID_ARGUMENT, "camera");
}

int main(void)
{
  by_hand();
  there_and_back();
  no_image();
  edges();
  bad_cameras();
  return 0;
}
