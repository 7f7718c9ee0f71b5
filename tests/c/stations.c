/* Planes of two scans of a room, and the pose between them: found, refused where nothing tells. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

static double room[3 * FIXTURE_ROOM];

/* X_a = R X_b + t for stations at (xa, 0, za) and (xb, 0, zb), turned to the right by ta and tb. */
static void check_pose(const ptzcal_registration *registration, const double *a, const double *b, double tolerance)
{
  ptzcal_station_pose pose;
  const double turn = b[2] - a[2], dx = b[0] - a[0], dz = b[1] - a[1];
  int i;
  CHECK_OK(ptzcal_station_pose_init(&pose, sizeof pose));
  CHECK_OK(ptzcal_registration_get(registration, &pose, NULL));
  CHECK_NEAR(pose.translation[0], cos(a[2]) * dx - sin(a[2]) * dz, tolerance);
  CHECK_NEAR(pose.translation[1], 0.0, tolerance);
  CHECK_NEAR(pose.translation[2], sin(a[2]) * dx + cos(a[2]) * dz, tolerance);
  CHECK_NEAR(pose.rotation[0], cos(turn), tolerance);
  CHECK_NEAR(pose.rotation[2], sin(turn), tolerance);
  CHECK_NEAR(pose.rotation[4], 1.0, tolerance);
  CHECK(pose.matches >= 5 && pose.agreement > 0.95 && pose.runner_up < 0.93 && pose.condition >= 1.0);
  CHECK(pose.degrees_of_freedom == 3.0 * pose.matches - 6.0 && pose.chi2 > 0.0);
  for (i = 0; i < 36; i += 7) CHECK(pose.covariance[i] > 0.0 && sqrt(pose.covariance[i]) < tolerance);
}

static void a_room_from_two_places(void)
{
  const double here[3] = {-0.6, -0.3, 0.2}, there[3] = {0.5, 0.6, -0.9};
  ptzcal_planes *a, *b;
  ptzcal_registration *registration, *again;
  ptzcal_roof_edges *edges_a, *edges_b;
  ptzcal_pose_estimate *estimate;
  ptzcal_pose pose;
  uint32_t pairs[2 * 64], count;
  size_t needed = 0;
  make_planes(here[0], here[1], here[2], 1, &a);
  make_planes(there[0], there[1], there[2], 1, &b);
  CHECK_OK(ptzcal_planes_count(a, &count, NULL));
  CHECK(count >= 6);
  CHECK_OK(ptzcal_register_stations(a, b, NULL, &registration, NULL));
  check_pose(registration, here, there, 3e-3);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_registration_copy_matches(registration, pairs, 3, &needed, NULL));
  CHECK(needed >= 10 && needed <= 128 && needed % 2 == 0);
  CHECK_OK(ptzcal_registration_copy_matches(registration, pairs, 128, NULL, NULL));
  /* The same pairs, named. */
  CHECK_OK(ptzcal_register_matched_planes(a, b, pairs, needed / 2, &again, NULL));
  check_pose(again, here, there, 3e-3);
  /* The thesis's way: edges where these planes meet. */
  CHECK_OK(ptzcal_registration_roof_edges(registration, a, b, 0.3, &edges_a, &edges_b, NULL));
  CHECK_OK(ptzcal_estimate_pose_roof_edges(edges_a, edges_b, NULL, &estimate, NULL));
  CHECK_OK(ptzcal_pose_init(&pose, sizeof pose));
  CHECK_OK(ptzcal_pose_estimate_get(estimate, &pose, NULL));
  CHECK_NEAR(pose.rotation_angle, 1.1, 5e-3);
  ptzcal_pose_estimate_free(estimate);
  ptzcal_roof_edges_free(edges_a);
  ptzcal_roof_edges_free(edges_b);
  ptzcal_registration_free(again);
  ptzcal_registration_free(registration);
  ptzcal_planes_free(a);
  ptzcal_planes_free(b);
}

static void planes_and_labels(void)
{
  static int32_t labels[FIXTURE_ROOM], region[FIXTURE_ROOM];
  ptzcal_planes_options options;
  ptzcal_planes *found, *named, *none = NULL;
  ptzcal_plane plane;
  size_t needed, i, floor = 0;
  uint32_t count, k;
  double sigma, norm;
  make_room(0.0, 0.0, 0.0, 1, FIXTURE_ROOM, room);
  room[4] = NAN; /* passed over */
  CHECK_OK(ptzcal_planes_options_init(&options, sizeof options));
  options.flatness = 0.0;
  CHECK_OK(ptzcal_planes_find_points(room, FIXTURE_ROOM, 0.0, &options, &found, NULL));
  CHECK_OK(ptzcal_planes_sigma(found, &sigma, NULL));
  CHECK(sigma > 0.0005 && sigma < 0.005);
  CHECK_OK(ptzcal_planes_count(found, &count, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_planes_copy_labels(found, labels, 10, &needed, NULL));
  CHECK(needed == FIXTURE_ROOM);
  CHECK_OK(ptzcal_planes_copy_labels(found, labels, FIXTURE_ROOM, NULL, NULL));
  CHECK(labels[1] == -1);
  CHECK_OK(ptzcal_plane_init(&plane, sizeof plane));
  for (k = 0; k < count; k++) {
    uint32_t members = 0;
    CHECK_OK(ptzcal_planes_get(found, k, &plane, NULL));
    for (i = 0; i < FIXTURE_ROOM; i++) members += labels[i] == (int32_t)k;
    CHECK(members == plane.count && plane.area > 0.0 && plane.rms < 0.01 && plane.covariance[0] > 0.0);
    CHECK_NEAR(plane.n[0] * plane.centre[0] + plane.n[1] * plane.centre[1] + plane.n[2] * plane.centre[2], 1.0, 1e-9);
    CHECK(plane.extent[0] < plane.extent[1] && plane.extent[2] < plane.extent[3]);
    if (plane.n[1] > 0.9 && plane.n[1] < 0.92) floor = plane.count;
  }
  CHECK(floor > 500);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_get(found, count, &plane, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_get(found, UINT32_MAX, &plane, NULL));

  /* Floor and ceiling, named by where they are. */
  for (i = 0; i < FIXTURE_ROOM; i++) region[i] = room[3 * i + 1] > 1.08 ? 0 : room[3 * i + 1] < -1.48 ? 1 : -1;
  CHECK_OK(ptzcal_planes_fit_points(room, FIXTURE_ROOM, 0.004, region, 2, &options, &named, NULL));
  CHECK_OK(ptzcal_planes_count(named, &count, NULL));
  CHECK(count == 2);
  for (k = 0; k < 2; k++) {
    CHECK_OK(ptzcal_planes_get(named, k, &plane, NULL));
    norm = sqrt(plane.n[0] * plane.n[0] + plane.n[1] * plane.n[1] + plane.n[2] * plane.n[2]);
    CHECK_NEAR(1.0 / norm, k ? 1.5 : 1.1, 2e-3);
    CHECK_NEAR(plane.n[1] / norm, k ? -1.0 : 1.0, 1e-4);
  }
  region[7] = 2;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_points(room, FIXTURE_ROOM, 0.0, region, 2, NULL, &none, NULL));
  region[7] = -2;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_points(room, FIXTURE_ROOM, 0.0, region, 2, NULL, &none, NULL));
  region[7] = -1;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_points(room, FIXTURE_ROOM, 0.0, region, 0, NULL, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_points(room, FIXTURE_ROOM, 0.0, region, UINT32_MAX, NULL, &none, NULL));
  {
    ptzcal_error *error;
    CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_planes_fit_points(room, FIXTURE_ROOM, 0.0, region, 3, NULL, &none, &error));
    CHECK(ptzcal_error_index(error) == 2 && none == NULL);
    ptzcal_error_free(error);
  }
  ptzcal_planes_free(named);
  ptzcal_planes_free(found);
}

static void shots_and_depths(void)
{
  static double pan_tilt[2 * 900], spots[2 * 900];
  static float metres[80 * 60];
  static int32_t region[900];
  ptzcal_rig_model model;
  ptzcal_camera camera;
  ptzcal_depth_map *map;
  ptzcal_planes *planes, *none = NULL;
  ptzcal_plane plane;
  uint32_t count, i, state = 3;
  make_rig_model(&model);
  /* A wall 4 m ahead of the rig, and the floor 1.2 m below it: the shots by the depths along the axis. */
  for (i = 0; i < 900; i++) {
    ptzcal_pose here;
    double point[3], depth = 4.0;
    int k;
    CHECK_OK(ptzcal_pose_init(&here, sizeof here));
    pan_tilt[2 * i] = 0.5 * fixture_random(&state);
    pan_tilt[2 * i + 1] = -0.25 + 0.25 * fixture_random(&state);
    for (k = 0; k < 50; k++) {
      make_shot(&model, &here, pan_tilt + 2 * i, depth, point, spots + 2 * i);
      depth *= fmin(4.0 / point[2], 1.2 / fmax(point[1], 1e-3));
    }
    spots[2 * i] += 0.3 * fixture_random(&state);
    region[i] = point[1] > 1.19 ? 0 : 1;
  }
  CHECK_OK(ptzcal_planes_find_shots(&model, pan_tilt, spots, NULL, 900, NULL, &planes, NULL));
  CHECK_OK(ptzcal_planes_count(planes, &count, NULL));
  CHECK(count == 2);
  ptzcal_planes_free(planes);
  CHECK_OK(ptzcal_planes_fit_shots(&model, pan_tilt, spots, NULL, 900, region, 2, NULL, &planes, NULL));
  CHECK_OK(ptzcal_plane_init(&plane, sizeof plane));
  CHECK_OK(ptzcal_planes_get(planes, 0, &plane, NULL));
  CHECK_NEAR(plane.n[1], 1.0 / 1.2, 0.02);
  CHECK_OK(ptzcal_planes_get(planes, 1, &plane, NULL));
  CHECK_NEAR(plane.n[2], 1.0 / 4.0, 0.005);
  CHECK_NEAR(plane.noise_factor, 0.17, 0.05); /* +-0.3 px, believed to be 1 px */
  ptzcal_planes_free(planes);

  /* A wall 2 m ahead in the upper half of a depth image, the floor in the lower. */
  make_camera(&camera);
  camera.width = 80, camera.height = 60;
  camera.fx = camera.fy = 70.0, camera.skew = 0.0, camera.cx = 39.5, camera.cy = 29.5;
  camera.distortion_model = PTZCAL_DISTORTION_MODEL_NONE;
  memset(camera.distortion, 0, sizeof camera.distortion);
  for (i = 0; i < 80 * 60; i++) {
    double y = ((double)(i / 80) - 29.5) / 70.0;
    metres[i] = (float)fmin(2.0, y > 0 ? 0.5 / y : 9.0);
  }
  CHECK_OK(ptzcal_depth_map_new_f32(metres, 80, 60, 80, 1.0, &map, NULL));
  CHECK_OK(ptzcal_planes_find_depths(map, &camera, 0.001425, 0.001, NULL, &planes, NULL));
  CHECK_OK(ptzcal_planes_count(planes, &count, NULL));
  CHECK(count == 2);
  ptzcal_planes_free(planes);
  camera.width = 81;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_find_depths(map, &camera, 0.001, 0.001, NULL, &none, NULL));
  camera.width = 80;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_find_depths(map, &camera, 0.0, 0.0, NULL, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_find_depths(map, &camera, -1.0, 0.0, NULL, &none, NULL));
  CHECK(none == NULL);
  ptzcal_depth_map_free(map);
}

static void what_cannot_tell(void)
{
  const double here[3] = {-0.6, -0.3, 0.2}, there[3] = {0.5, 0.6, -0.9};
  const uint32_t pairs[6] = {0, 0, 1, 1, 2, 99};
  ptzcal_planes *a, *b, *walls;
  ptzcal_registration *registration = NULL;
  ptzcal_station_options options;
  ptzcal_error *error;
  size_t i, n = 0;
  /* An empty room looks the same after half a turn; a rough pose tells. */
  make_planes(here[0], here[1], here[2], 0, &a);
  make_planes(there[0], there[1], there[2], 0, &b);
  CHECK_STATUS(PTZCAL_STATUS_AMBIGUOUS, ptzcal_register_stations(a, b, NULL, &registration, &error));
  CHECK(registration == NULL && *ptzcal_error_message(error) && *ptzcal_error_hint(error));
  ptzcal_error_free(error);
  CHECK_OK(ptzcal_station_options_init(&options, sizeof options));
  options.has_prior = 1;
  options.prior_rotation[0] = options.prior_rotation[8] = cos(-1.0);
  options.prior_rotation[2] = sin(-1.0), options.prior_rotation[6] = -sin(-1.0);
  options.prior_translation[0] = 1.0, options.prior_translation[2] = 1.0;
  CHECK_OK(ptzcal_register_stations(a, b, &options, &registration, NULL));
  check_pose(registration, here, there, 5e-3);
  ptzcal_registration_free(registration);
  options.prior_translation[0] = 9.0;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_register_stations(a, b, &options, &registration, NULL));
  options.prior_rotation[0] = 2.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_register_stations(a, b, &options, &registration, NULL));
  options.prior_rotation[0] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_register_stations(a, b, &options, &registration, NULL));
  CHECK_OK(ptzcal_station_options_init(&options, sizeof options));
  options.has_prior = 2;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_register_stations(a, b, &options, &registration, NULL));
  options.has_prior = 0, options.max_angle = 1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_register_stations(a, b, &options, &registration, NULL));
  options.max_angle = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_register_stations(a, b, &options, &registration, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_register_matched_planes(a, b, pairs, 3, &registration, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_register_matched_planes(a, b, pairs, 2, &registration, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_register_matched_planes(a, b, NULL, 0, &registration, NULL));
  ptzcal_planes_free(a);
  ptzcal_planes_free(b);
  /* Floor and ceiling alone: the message says which ways are open. */
  make_room(0.0, 0.0, 0.0, 0, FIXTURE_ROOM, room);
  for (i = 0; i < FIXTURE_ROOM; i++)
    if (room[3 * i + 1] > 1.09 || room[3 * i + 1] < -1.49) memcpy(room + 3 * n++, room + 3 * i, 3 * sizeof *room);
  CHECK_OK(ptzcal_planes_find_points(room, n, 0.004, NULL, &walls, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_register_stations(walls, walls, NULL, &registration, &error));
  CHECK(strstr(ptzcal_error_message(error), "rotation about (0.000, 1.000, 0.000)") != NULL);
  CHECK(registration == NULL);
  ptzcal_error_free(error);
  ptzcal_planes_free(walls);
}

static void bad_clouds_and_options(void)
{
  ptzcal_planes_options options;
  ptzcal_planes *none = NULL;
  const double one[3] = {1, 2, 3};
  uint32_t state = 9;
  size_t i;
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_planes_find_points(NULL, 0, 0.0, NULL, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_planes_find_points(one, 1, 0.0, NULL, &none, NULL));
  for (i = 0; i < 3 * FIXTURE_ROOM; i++) room[i] = 1.0;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_planes_find_points(room, FIXTURE_ROOM, 0.01, NULL, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_DEGENERATE, ptzcal_planes_find_points(room, FIXTURE_ROOM, 0.0, NULL, &none, NULL));
  for (i = 0; i < 3 * FIXTURE_ROOM; i++) room[i] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_planes_find_points(room, FIXTURE_ROOM, 0.01, NULL, &none, NULL));
  for (i = 0; i < 3 * FIXTURE_ROOM; i++) room[i] = 2.0 * fixture_random(&state);
  CHECK_STATUS(PTZCAL_STATUS_NOT_FOUND, ptzcal_planes_find_points(room, FIXTURE_ROOM, 0.01, NULL, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_find_points(room, FIXTURE_ROOM, -1.0, NULL, &none, NULL));
#define BAD(member, value)                                                                                             \
  CHECK_OK(ptzcal_planes_options_init(&options, sizeof options));                                                      \
  options.member = value;                                                                                              \
  CHECK(ptzcal_planes_find_points(room, FIXTURE_ROOM, 0.01, &options, &none, NULL) <= PTZCAL_STATUS_INVALID_ARGUMENT)
  BAD(threshold, 0.0);
  BAD(threshold, NAN);
  BAD(flatness, -0.1);
  BAD(flatness, INFINITY);
  BAD(min_share, 2.0);
  BAD(min_share, NAN);
  BAD(min_points, 3);
  BAD(max_planes, 0);
  BAD(max_planes, 1001);
  BAD(min_range, -1.0);
  BAD(min_range, NAN);
  BAD(max_range, 0.0);
  BAD(max_range, NAN);
  CHECK(none == NULL);
}

int main(void)
{
  a_room_from_two_places();
  planes_and_labels();
  shots_and_depths();
  what_cannot_tell();
  bad_clouds_and_options();
  return 0;
}
