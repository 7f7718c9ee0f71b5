/* The rig stands at one place, then at another: both scan, the planes that both saw say where the second
 * place is, and the two clouds become one model. Build and run, with the library installed:
 *
 *     cc survey_two_stations.c $(pkg-config --cflags --libs ptzcal) -lm -o survey && ./survey
 *
 * Without arguments the two places are in the simulator's room; with two, they are rig addresses (and the
 * rough pose below is to be yours). */
#include <math.h>
#include <ptzcal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREES (3.14159265358979323846 / 180)

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

/* Scans from where the rig stands, with the head camera alone. */
static ptzcal_scan *scan_from(const char *address)
{
  ptzcal_error *error = NULL;
  ptzcal_rig_options *options = NULL;
  ptzcal_rig *rig = NULL;
  ptzcal_scan *scan = NULL;
  ptzcal_region region;
  check(ptzcal_rig_options_new(&options, &error), &error);
  check(ptzcal_rig_options_set_address(options, address, &error), &error);
  check(ptzcal_rig_open(options, &rig, &error), &error);
  ptzcal_region_init(&region, sizeof region);
  region.pan_min = -50 * DEGREES, region.pan_max = 50 * DEGREES, region.pan_steps = 36;
  region.tilt_min = -24 * DEGREES, region.tilt_max = 24 * DEGREES, region.tilt_steps = 18;
  check(ptzcal_rig_scan_region(rig, &region, NULL, NULL, NULL, &scan, &error), &error);
  check(ptzcal_scan_end(scan, &error), &error); /* complete? */
  check(ptzcal_rig_close(rig, &error), &error);
  ptzcal_rig_options_free(options);
  return scan;
}

static ptzcal_planes *planes_of(const ptzcal_scan *scan, const char *name)
{
  ptzcal_error *error = NULL;
  ptzcal_planes *planes = NULL;
  uint32_t count = 0;
  check(ptzcal_planes_find_scan(scan, NULL, &planes, &error), &error);
  check(ptzcal_planes_count(planes, &count, &error), &error);
  printf("station %s: %u planes\n", name, count);
  for (uint32_t i = 0; i < count; i++) {
    ptzcal_plane plane;
    ptzcal_plane_init(&plane, sizeof plane);
    check(ptzcal_planes_get(planes, i, &plane, &error), &error);
    const double length = sqrt(plane.n[0] * plane.n[0] + plane.n[1] * plane.n[1] + plane.n[2] * plane.n[2]);
    printf("  %2u: %5.2f m away, %5.1f m2, rms %.1f mm, %u shots\n", i, 1 / length, plane.area, 1e3 * plane.rms,
           plane.count);
  }
  return planes;
}

int main(int argc, char **argv)
{
  ptzcal_error *error = NULL;
  const char *places[2] = {argc > 2 ? argv[1] : "sim:room?station=1", argc > 2 ? argv[2] : "sim:room?station=2"};
  ptzcal_scan *scans[2] = {scan_from(places[0]), scan_from(places[1])};
  ptzcal_planes *planes[2] = {planes_of(scans[0], "A"), planes_of(scans[1], "B")};

  /* Where B is, roughly, as one sees it: a metre to the left of A, turned to the right by a third of a right
   * angle. With scans all around nothing needs to be known (options NULL); with few shots of a part of a room
   * more than one pose would explain them. */
  ptzcal_station_options rough;
  ptzcal_station_options_init(&rough, sizeof rough);
  const double turn = 30 * DEGREES;
  const double rotation[9] = {cos(turn), 0, sin(turn), 0, 1, 0, -sin(turn), 0, cos(turn)};
  rough.has_prior = 1;
  memcpy(rough.prior_rotation, rotation, sizeof rotation);
  rough.prior_translation[0] = -1;
  rough.prior_rotation_sigma = 10 * DEGREES;
  rough.prior_position_sigma = 0.3;
  ptzcal_registration *registration = NULL;
  check(ptzcal_register_stations(planes[0], planes[1], &rough, &registration, &error), &error);
  ptzcal_station_pose pose;
  ptzcal_station_pose_init(&pose, sizeof pose);
  check(ptzcal_registration_get(registration, &pose, &error), &error);
  const double *t = pose.translation, *c = pose.covariance;
  printf("%u planes are the same; B is at (%.4f, %.4f, %.4f) m in A's frame, to %.1f mm\n", pose.matches, t[0], t[1],
         t[2], 1e3 * sqrt(c[21] + c[28] + c[35]));

  /* One cloud in A's frame: B's points, moved there with the pose's uncertainty. */
  ptzcal_cloud *clouds[2] = {NULL, NULL};
  for (int i = 0; i < 2; i++)
    check(ptzcal_cloud_from_scan(scans[i], &clouds[i], &error), &error);
  ptzcal_pose to_a;
  ptzcal_pose_init(&to_a, sizeof to_a);
  memcpy(to_a.rotation, pose.rotation, sizeof to_a.rotation);
  memcpy(to_a.translation, pose.translation, sizeof to_a.translation);
  check(ptzcal_cloud_transform(clouds[1], &to_a, pose.covariance, &error), &error);
  check(ptzcal_cloud_merge(clouds[0], clouds[1], &error), &error);
  check(ptzcal_cloud_save(clouds[0], "room.ply", &error), &error);

  /* And a surface for viewers, of what A saw. */
  ptzcal_mesh *mesh = NULL;
  size_t triangles = 0;
  check(ptzcal_mesh_from_scan(scans[0], NULL, &mesh, &error), &error);
  check(ptzcal_mesh_size(mesh, NULL, &triangles, NULL, &error), &error);
  check(ptzcal_mesh_save(mesh, "room.glb", &error), &error);
  printf("room.ply: both clouds in one frame; room.glb: %zu triangles\n", triangles);

  ptzcal_mesh_free(mesh);
  for (int i = 0; i < 2; i++) {
    ptzcal_cloud_free(clouds[i]);
    ptzcal_planes_free(planes[i]);
    ptzcal_scan_free(scans[i]);
  }
  ptzcal_registration_free(registration);
  return 0;
}
