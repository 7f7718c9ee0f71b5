/* Structs that grow: older, newer and broken callers. */
#include "fixtures.h"
#include <stdlib.h>
#include <string.h>

/* A camera as a later header may have it. */
typedef struct newer_camera {
  ptzcal_camera known;
  double unknown[3];
} newer_camera;

static void defaults(void)
{
  ptzcal_camera camera;
  ptzcal_rig_model model;
  int i;
  taint(&camera, sizeof camera);
  CHECK_OK(ptzcal_camera_init(&camera, sizeof camera));
  CHECK(camera.struct_size == sizeof camera);
  for (i = 0; i < 9; i++) CHECK(camera.rotation[i] == (i % 4 == 0 ? 1.0 : 0.0));
  CHECK(camera.fx == 0.0 && camera.width == 0 && camera.translation[2] == 0.0);
  CHECK_OK(ptzcal_rig_model_init(&model, sizeof model));
  CHECK(model.pan_scale == 1.0 && model.tilt_scale == 1.0 && model.pan_zero == 0.0);
}

static void newer_caller(void)
{
  newer_camera camera;
  double centre[3];
  ptzcal_error *error = NULL;
  taint(&camera, sizeof camera);
  CHECK_OK(ptzcal_camera_init(&camera.known, sizeof camera));
  CHECK(camera.known.struct_size == sizeof camera);
  CHECK(camera.unknown[0] == 0.0 && camera.unknown[2] == 0.0);
  make_camera(fixture_camera);
  memcpy((char *)&camera + 4, (char *)fixture_camera + 4, sizeof *fixture_camera - 4);
  CHECK_OK(ptzcal_camera_centre(&camera.known, centre, NULL));
  CHECK_NEAR(centre[0], 0.5, 1e-12);

  /* As an output it is filled as far as the library goes. */
  make_rig_model(fixture_rig_model);
  CHECK_OK(ptzcal_rig_model_head_camera(fixture_rig_model, 0.1, 0.0, &camera.known, NULL));
  CHECK(camera.known.struct_size == sizeof camera && camera.known.width == 720 && camera.unknown[0] == 0.0);

  /* What the library does not know is not ignored when it is asked for. */
  camera.unknown[1] = 1.0;
  taint(centre, sizeof centre);
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_camera_centre(&camera.known, centre, &error));
  CHECK(strstr(ptzcal_error_message(error), "newer") != NULL);
  CHECK(is_tainted(centre, sizeof centre));
  ptzcal_error_free(error);
}

static void broken_caller(void)
{
  static const size_t sizes[] = {0, 1, 4, sizeof(ptzcal_camera) - 1, 1 << 20, SIZE_MAX};
  ptzcal_camera camera;
  size_t i;
  for (i = 0; i < sizeof sizes / sizeof *sizes; i++) {
    taint(&camera, sizeof camera);
    CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_camera_init(&camera, sizes[i]));
    CHECK(is_tainted(&camera, sizeof camera));
  }
}

/* Exactly as many bytes as struct_size says, at the end of a block and at any address: valgrind
   and the sanitizers see the first byte that is touched beyond. */
static void exact_and_unaligned(void)
{
  size_t offset;
  make_rig_model(fixture_rig_model);
  for (offset = 0; offset < 8; offset += 3) {
    char *block = (char *)malloc(offset + sizeof(ptzcal_camera));
    ptzcal_camera copy;
    CHECK(block != NULL);
    CHECK_OK(ptzcal_camera_init((ptzcal_camera *)(void *)(block + offset), sizeof copy));
    CHECK_OK(ptzcal_rig_model_head_camera(fixture_rig_model, 0.0, 0.0, (ptzcal_camera *)(void *)(block + offset), NULL));
    memcpy(&copy, block + offset, sizeof copy);
    CHECK(copy.fx == 800.0 && copy.struct_size == sizeof copy);
    free(block);
  }
}

int main(void)
{
  defaults();
  newer_caller();
  broken_caller();
  exact_and_unaligned();
  return 0;
}
