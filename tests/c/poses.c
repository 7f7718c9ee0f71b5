/* Rig poses by roof edges: a step to the right is found; what cannot tell is refused. */
#include "fixtures.h"
#include <math.h>

static void a_step_to_the_right(void)
{
  ptzcal_roof_edges *here, *there;
  ptzcal_pose_options *options;
  ptzcal_pose_estimate *result;
  ptzcal_pose pose;
  double covariance[36];
  size_t needed;
  uint32_t method;
  make_corner(&here, 0.0);
  make_corner(&there, 0.4);
  CHECK_OK(ptzcal_pose_options_new(&options, NULL));
  for (method = PTZCAL_POSE_METHOD_ROOF_EDGE_PROCRUSTES; method <= PTZCAL_POSE_METHOD_PLANE_TO_PLANE; method++) {
    CHECK_OK(ptzcal_pose_options_set_method(options, method, NULL));
    CHECK_OK(ptzcal_estimate_pose_roof_edges(here, there, options, &result, NULL));
    CHECK_OK(ptzcal_pose_init(&pose, sizeof pose));
    CHECK_OK(ptzcal_pose_estimate_get(result, &pose, NULL));
    CHECK_NEAR(pose.translation[0], 0.4, 1e-9);
    CHECK_NEAR(pose.translation[1], 0.0, 1e-9);
    CHECK_NEAR(pose.translation[2], 0.0, 1e-9);
    CHECK_NEAR(pose.rotation_angle, 0.0, 1e-6);
    CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_pose_estimate_copy_covariance(result, NULL, 0, &needed, NULL));
    CHECK(needed == 36);
    CHECK_OK(ptzcal_pose_estimate_copy_covariance(result, covariance, 36, NULL, NULL));
    ptzcal_pose_estimate_free(result);
  }
  ptzcal_pose_options_free(options);
  ptzcal_roof_edges_free(here);
  ptzcal_roof_edges_free(there);
}

static void what_cannot_tell(void)
{
  ptzcal_roof_edges *full, *empty;
  ptzcal_pose_options *options;
  ptzcal_pose_estimate *result;
  const double normal[3] = {0, 0, 0}, up[3] = {0, 1, 0};
  uint32_t plane = 77;
  make_corner(&full, 0.0);
  CHECK_OK(ptzcal_roof_edges_new(&empty, NULL));
  CHECK_OK(ptzcal_pose_options_new(&options, NULL));
  CHECK(ptzcal_estimate_pose_roof_edges(full, empty, NULL, &result, NULL) != PTZCAL_STATUS_OK && result == NULL);
  CHECK(ptzcal_estimate_pose_roof_edges(empty, empty, NULL, &result, NULL) != PTZCAL_STATUS_OK && result == NULL);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_roof_edges_add_plane(empty, normal, 1.0, NULL, &plane, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_roof_edges_add_plane(empty, up, 0.0, NULL, &plane, NULL));
  CHECK(plane == 77);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_roof_edges_add_edge(full, 0, 3, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_roof_edges_add_edge(full, 0, UINT32_MAX, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_roof_edges_add_edge(full, 1, 1, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pose_options_set_method(options, 3, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_pose_options_set_method(options, UINT32_MAX, NULL));
  ptzcal_pose_options_free(options);
  ptzcal_roof_edges_free(empty);
  ptzcal_roof_edges_free(full);
}

int main(void)
{
  a_step_to_the_right();
  what_cannot_tell();
  return 0;
}
