/* Stations along a path: tied by planes that nobody named, solved, and refused where nothing ties them; planes
 * of boxes and of scans. */
#include "fixtures.h"
#include <math.h>

#define STATIONS 3
#define SHOTS 1800

/* x, z, turned to the right by, tipped down by. */
static const double places[4 * STATIONS] = {-0.6, -0.3, 0.2, 0.0, -0.1, 0.1, 0.5, 0.05, 0.4, -0.2, 1.0, -0.05};

struct listener {
  uint64_t calls, total, stop_at;
  ptzcal_adjustment *survey;
};

static int32_t listen(void *user, const ptzcal_progress *progress)
{
  struct listener *heard = user;
  uint32_t index;
  CHECK(progress->done == heard->calls && progress->shot == NULL);
  heard->calls++;
  heard->total = progress->total;
  /* The survey is in use. */
  CHECK_STATUS(PTZCAL_STATUS_BUSY, ptzcal_adjustment_add_station(heard->survey, NULL, NULL, &index, NULL));
  return progress->done == heard->stop_at;
}

static void a_path_is_tied_and_solved(ptzcal_adjustment *survey)
{
  ptzcal_adjusted *adjusted;
  ptzcal_adjusted_summary adjusted_summary;
  ptzcal_cancel *token;
  ptzcal_link link;
  ptzcal_loop closure;
  ptzcal_planes_options planes;
  ptzcal_registration *registration = NULL;
  ptzcal_station_pose between;
  ptzcal_tie_options options;
  ptzcal_ties *ties = NULL;
  ptzcal_ties_summary summary;
  struct listener heard = {0, 0, 2, NULL};
  uint32_t pairs[4] = {0, 1, 1, 2}, around[STATIONS], i;
  size_t needed;
  heard.survey = survey;
  CHECK_OK(ptzcal_adjusted_summary_init(&adjusted_summary, sizeof adjusted_summary));
  CHECK_OK(ptzcal_link_init(&link, sizeof link));
  CHECK_OK(ptzcal_loop_init(&closure, sizeof closure));
  CHECK_OK(ptzcal_planes_options_init(&planes, sizeof planes));
  CHECK_OK(ptzcal_tie_options_init(&options, sizeof options));
  CHECK_OK(ptzcal_ties_summary_init(&summary, sizeof summary));
  planes.flatness = 1e-3;
  options.planes = &planes;

  /* Stopped by the listener, and by the token: the survey is as it was. */
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_adjustment_tie_stations(survey, &options, listen, &heard, NULL, &ties, NULL));
  CHECK(heard.calls == 3 && heard.total == STATIONS + 3 && ties == NULL);
  CHECK_OK(ptzcal_cancel_new(&token, NULL));
  CHECK_OK(ptzcal_cancel_request(token));
  CHECK_STATUS(PTZCAL_STATUS_CANCELLED, ptzcal_adjustment_tie_stations(survey, &options, NULL, NULL, token, &ties, NULL));
  ptzcal_cancel_free(token);
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_adjustment_solve(survey, NULL, NULL, &adjusted, NULL));

  heard.calls = 0, heard.stop_at = UINT64_MAX;
  CHECK_OK(ptzcal_adjustment_tie_stations(survey, &options, listen, &heard, NULL, &ties, NULL));
  CHECK(heard.calls == STATIONS + 4);
  CHECK_OK(ptzcal_ties_get_summary(ties, &summary, NULL));
  CHECK(summary.links == 3 && summary.linked >= 2 && summary.loops == summary.linked - 2);
  CHECK(summary.planes >= 6 && summary.shots > STATIONS * SHOTS / 2);
  for (i = 0; i < summary.links; i++) {
    const char *reason = ptzcal_ties_link_reason(ties, i);
    CHECK_OK(ptzcal_ties_get_link(ties, i, &link, NULL));
    CHECK(link.station_a == i / 2 && link.station_b == (i + 3) / 2);
    if (link.status == PTZCAL_STATUS_OK) {
      CHECK_OK(ptzcal_ties_get_registration(ties, i, &registration, NULL));
      CHECK_OK(ptzcal_station_pose_init(&between, sizeof between));
      CHECK_OK(ptzcal_registration_get(registration, &between, NULL));
      CHECK(between.matches >= 3 && *reason == '\0');
      ptzcal_registration_free(registration);
    } else {
      CHECK_STATUS(link.status, ptzcal_ties_get_registration(ties, i, &registration, NULL));
      CHECK(registration == NULL && *reason);
    }
  }
  for (i = 0; i < summary.loops; i++) {
    CHECK_OK(ptzcal_ties_get_loop(ties, i, &closure, NULL));
    CHECK(closure.stations == 3 && closure.probability > 1e-4 && closure.rotation < 0.02 && closure.position < 0.05);
    CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_ties_copy_loop(ties, i, around, 2, &needed, NULL));
    CHECK(needed == 3);
    CHECK_OK(ptzcal_ties_copy_loop(ties, i, around, STATIONS, NULL, NULL));
    CHECK(around[0] + around[1] + around[2] == 3);
  }
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_ties_get_link(ties, summary.links, &link, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_ties_get_registration(ties, UINT32_MAX, &registration, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_ties_get_loop(ties, summary.loops, &closure, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_ties_copy_loop(ties, summary.loops, NULL, 0, NULL, NULL));
  CHECK(*ptzcal_ties_link_reason(ties, summary.links) == '\0' && *ptzcal_ties_link_reason(NULL, 0) == '\0');
  ptzcal_ties_free(ties);
  ptzcal_ties_free(NULL);

  CHECK_OK(ptzcal_adjustment_solve(survey, NULL, NULL, &adjusted, NULL));
  CHECK_OK(ptzcal_adjusted_get_summary(adjusted, &adjusted_summary, NULL));
  CHECK(adjusted_summary.planes == summary.planes);
  for (i = 0; i < STATIONS; i++) {
    ptzcal_pose pose;
    CHECK_OK(ptzcal_pose_init(&pose, sizeof pose));
    CHECK_OK(ptzcal_adjusted_get_station(adjusted, i, &pose, NULL));
    CHECK_NEAR(pose.translation[0], places[4 * i], 0.01);
    CHECK_NEAR(pose.translation[1], 0.0, 0.01);
    CHECK_NEAR(pose.translation[2], places[4 * i + 1], 0.01);
    CHECK_NEAR(atan2(pose.rotation[2], pose.rotation[8]), places[4 * i + 2], 5e-3);
  }
  ptzcal_adjusted_free(adjusted);

  /* What hits a plane already is looked at no more: nothing is left to tie. */
  options.pairs = pairs, options.pair_count = 2;
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_adjustment_tie_stations(survey, &options, NULL, NULL, NULL, &ties, NULL));
}

static void bad_options(ptzcal_adjustment *survey)
{
  const uint32_t same[2] = {1, 1}, none[2] = {0, STATIONS}, twice[4] = {0, 1, 1, 0};
  ptzcal_planes_options planes;
  ptzcal_station_options stations;
  ptzcal_tie_options options;
  ptzcal_ties *ties = NULL;
  ptzcal_error *error;
#define REFUSED(wanted)                                                                                                \
  CHECK_STATUS(PTZCAL_STATUS_##wanted, ptzcal_adjustment_tie_stations(survey, &options, NULL, NULL, NULL, &ties, NULL)); \
  CHECK(ties == NULL);                                                                                                 \
  CHECK_OK(ptzcal_tie_options_init(&options, sizeof options))
  CHECK_OK(ptzcal_tie_options_init(&options, sizeof options));
  CHECK_OK(ptzcal_planes_options_init(&planes, sizeof planes));
  CHECK_OK(ptzcal_station_options_init(&stations, sizeof stations));
  options.min_closure = NAN;
  REFUSED(NOT_FINITE);
  options.min_closure = -0.5;
  REFUSED(INVALID_ARGUMENT);
  options.min_closure = 2.0;
  REFUSED(INVALID_ARGUMENT);
  options.pair_count = 1;
  REFUSED(NULL_POINTER);
  options.pairs = same, options.pair_count = 1;
  REFUSED(INVALID_ARGUMENT);
  options.pairs = none, options.pair_count = 1;
  REFUSED(INVALID_ARGUMENT);
  options.pairs = twice, options.pair_count = 2;
  REFUSED(INVALID_ARGUMENT);
  options.pairs = twice, options.pair_count = SIZE_MAX;
  REFUSED(INVALID_ARGUMENT);
  planes.threshold = -1.0, options.planes = &planes;
  REFUSED(INVALID_ARGUMENT);
  planes.threshold = NAN, options.planes = &planes;
  REFUSED(NOT_FINITE);
  planes.struct_size = 3, options.planes = &planes;
  REFUSED(INVALID_ARGUMENT);
  /* A prior is of one pair. */
  stations.has_prior = 1, options.stations = &stations;
  REFUSED(INVALID_ARGUMENT);
  stations.has_prior = 0, stations.max_angle = 9.0, options.stations = &stations;
  REFUSED(INVALID_ARGUMENT);
  stations.max_angle = NAN, options.stations = &stations;
  REFUSED(NOT_FINITE);
  options.struct_size = 7;
  REFUSED(INVALID_ARGUMENT);
  /* No pairs at all: the message says who is lost. */
  options.pairs = same, options.pair_count = 0;
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_adjustment_tie_stations(survey, &options, NULL, NULL, NULL, &ties, &error));
  CHECK(strstr(ptzcal_error_message(error), "station 1") != NULL);
  ptzcal_error_free(error);
}

static void planes_in_boxes(void)
{
  static double room[3 * FIXTURE_ROOM];
  /* Floor and ceiling. */
  double boxes[12] = {-3.1, 1.05, -2.1, 3.1, 1.15, 2.5, -3.1, -1.55, -2.1, 3.1, -1.45, 2.5};
  ptzcal_error *error;
  ptzcal_plane plane;
  ptzcal_planes *planes, *none = NULL;
  ptzcal_planes_options options;
  CHECK_OK(ptzcal_plane_init(&plane, sizeof plane));
  CHECK_OK(ptzcal_planes_options_init(&options, sizeof options));
  options.flatness = 0.0;
  make_room(0.0, 0.0, 0.0, 1, FIXTURE_ROOM, room);
  CHECK_OK(ptzcal_planes_fit_points_in_boxes(room, FIXTURE_ROOM, 0.004, boxes, 2, &options, &planes, NULL));
  CHECK_OK(ptzcal_planes_get(planes, 0, &plane, NULL));
  CHECK_NEAR(plane.n[1], 1.0 / 1.1, 2e-3);
  CHECK_OK(ptzcal_planes_get(planes, 1, &plane, NULL));
  CHECK_NEAR(plane.n[1], -1.0 / 1.5, 2e-3);
  ptzcal_planes_free(planes);
  /* Noise along the rays: the same planes, better known than from as noisy points. */
  CHECK_OK(ptzcal_planes_find_ranges(room, FIXTURE_ROOM, 0.003, &options, &planes, NULL));
  CHECK_OK(ptzcal_planes_get(planes, 0, &plane, NULL));
  CHECK(plane.noise_factor > 0.8 && plane.noise_factor < 1.2);
  ptzcal_planes_free(planes);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_find_ranges(room, FIXTURE_ROOM, 0.0, NULL, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_find_ranges(room, FIXTURE_ROOM, -1.0, NULL, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_planes_find_ranges(NULL, 0, 0.01, NULL, &none, NULL));

  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_points_in_boxes(room, FIXTURE_ROOM, 0.004, boxes, 0, NULL, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_points_in_boxes(room, FIXTURE_ROOM, 0.004, boxes, 1001, NULL, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, ptzcal_planes_fit_points_in_boxes(room, FIXTURE_ROOM, 0.004, NULL, 2, NULL, &none, NULL));
  boxes[7] = 8.0; /* It ends before it begins. */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_points_in_boxes(room, FIXTURE_ROOM, 0.004, boxes, 2, NULL, &none, NULL));
  boxes[10] = 9.0; /* Beyond the room. */
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_planes_fit_points_in_boxes(room, FIXTURE_ROOM, 0.004, boxes, 2, NULL, &none, &error));
  CHECK(ptzcal_error_index(error) == 1);
  ptzcal_error_free(error);
  boxes[0] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_planes_fit_points_in_boxes(room, FIXTURE_ROOM, 0.004, boxes, 2, NULL, &none, NULL));
  CHECK(none == NULL);
}

/* The simulated room's scan as it is, whole and in parts, beside the same shots copied by hand. */
static void planes_of_a_scan(void)
{
  static double pan_tilt[2 * 1024], spots[2 * 1024], covariance[3 * 1024];
  static int32_t labels[1024];
  double readings[4] = {0}, box[6] = {0}, centre[3];
  ptzcal_plane plane, by_hand;
  ptzcal_planes *whole, *part, *none = NULL;
  ptzcal_planes_options find;
  ptzcal_region region;
  ptzcal_rig *rig;
  ptzcal_rig_model model;
  ptzcal_rig_options *options;
  ptzcal_scan *scan;
  ptzcal_scan_summary summary;
  uint32_t count, k;
  size_t n = 0, most = 0, i, needed;
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_OK(ptzcal_rig_options_set_address(options, "sim:room", NULL));
  CHECK_OK(ptzcal_rig_open(options, &rig, NULL));
  CHECK_OK(ptzcal_rig_model_init(&model, sizeof model));
  CHECK_OK(ptzcal_rig_get_model(rig, &model, NULL));
  CHECK_OK(ptzcal_region_init(&region, sizeof region));
  region.pan_min = -0.45, region.pan_max = 0.25, region.tilt_min = -0.33, region.tilt_max = 0.28;
  region.pan_steps = 12, region.tilt_steps = 8;
  CHECK_OK(ptzcal_rig_scan_region(rig, &region, NULL, NULL, NULL, &scan, NULL));
  CHECK_OK(ptzcal_scan_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_scan_get_summary(scan, &summary, NULL));
  for (i = 0; i < summary.shots; i++) {
    ptzcal_shot shot;
    ptzcal_spot spot;
    CHECK_OK(ptzcal_shot_init(&shot, sizeof shot));
    CHECK_OK(ptzcal_spot_init(&spot, sizeof spot));
    CHECK_OK(ptzcal_scan_get_shot(scan, i, &shot, NULL));
    if (!shot.has_point) continue;
    CHECK_OK(ptzcal_scan_get_spot(scan, i, PTZCAL_HEAD_CAMERA, &spot, NULL));
    pan_tilt[2 * n] = shot.pan, pan_tilt[2 * n + 1] = shot.tilt;
    spots[2 * n] = spot.x, spots[2 * n + 1] = spot.y;
    memcpy(covariance + 3 * n++, spot.covariance, sizeof spot.covariance);
  }
  CHECK_OK(ptzcal_plane_init(&plane, sizeof plane));
  CHECK_OK(ptzcal_plane_init(&by_hand, sizeof by_hand));
  CHECK_OK(ptzcal_planes_find_scan(scan, NULL, &whole, NULL));
  CHECK_OK(ptzcal_planes_count(whole, &count, NULL));
  CHECK(count >= 1);
  CHECK_OK(ptzcal_planes_copy_labels(whole, labels, 1024, &needed, NULL));
  CHECK(needed == summary.shots);
  CHECK_OK(ptzcal_planes_find_shots(&model, pan_tilt, spots, covariance, n, NULL, &part, NULL));
  for (k = count; k-- > 0;) {
    CHECK_OK(ptzcal_planes_get(whole, k, &plane, NULL));
    CHECK_OK(ptzcal_planes_get(part, k, &by_hand, NULL));
    CHECK(plane.count == by_hand.count);
    CHECK_NEAR(plane.n[0], by_hand.n[0], 1e-9);
    CHECK_NEAR(plane.n[2], by_hand.n[2], 1e-9);
  }
  memcpy(centre, plane.centre, sizeof centre);
  ptzcal_planes_free(part);
  ptzcal_planes_free(whole);

  /* Parts, by readings and by place, about the shot with the most neighbours on the first plane. */
  for (i = 0; i < summary.shots; i++) {
    ptzcal_shot shot, other;
    size_t j, near = 0;
    CHECK_OK(ptzcal_shot_init(&shot, sizeof shot));
    CHECK_OK(ptzcal_shot_init(&other, sizeof other));
    if (labels[i]) continue;
    CHECK_OK(ptzcal_scan_get_shot(scan, i, &shot, NULL));
    for (j = 0; j < summary.shots; j++) {
      CHECK_OK(ptzcal_scan_get_shot(scan, j, &other, NULL));
      near += labels[j] == 0 && fabs(other.pan - shot.pan) <= 0.1 && fabs(other.tilt - shot.tilt) <= 0.1;
    }
    if (near <= most) continue;
    most = near;
    readings[0] = shot.pan - 0.1, readings[1] = shot.pan + 0.1;
    readings[2] = shot.tilt - 0.1, readings[3] = shot.tilt + 0.1;
    for (k = 0; k < 3; k++) box[k] = shot.point[k] - 0.8, box[k + 3] = shot.point[k] + 0.8;
  }
  CHECK(most >= 6);
  CHECK_OK(ptzcal_planes_options_init(&find, sizeof find));
  find.min_points = 4;
  CHECK_OK(ptzcal_planes_fit_scan(scan, readings, 1, &find, &part, NULL));
  CHECK_OK(ptzcal_planes_get(part, 0, &plane, NULL));
  CHECK_NEAR(plane.n[0] * centre[0] + plane.n[1] * centre[1] + plane.n[2] * centre[2], 1.0, 0.03);
  CHECK_OK(ptzcal_planes_copy_labels(part, labels, 1024, &needed, NULL));
  CHECK(needed == summary.shots);
  ptzcal_planes_free(part);
  CHECK_OK(ptzcal_planes_fit_scan_in_boxes(scan, box, 1, &find, &part, NULL));
  CHECK_OK(ptzcal_planes_get(part, 0, &plane, NULL));
  CHECK_NEAR(plane.n[0] * centre[0] + plane.n[1] * centre[1] + plane.n[2] * centre[2], 1.0, 0.03);
  ptzcal_planes_free(part);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_scan(scan, readings, 0, &find, &none, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_scan(scan, readings, UINT32_MAX, &find, &none, NULL));
  readings[0] = 9.0, readings[1] = 10.0; /* Where nothing was measured. */
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_planes_fit_scan(scan, readings, 1, &find, &none, NULL));
  readings[1] = 8.0; /* It ends before it begins. */
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_scan(scan, readings, 1, &find, &none, NULL));
  box[3] = box[0];
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_fit_scan_in_boxes(scan, box, 1, &find, &none, NULL));
  find.min_points = 3;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_planes_find_scan(scan, &find, &none, NULL));
  find.min_points = UINT32_MAX;
  CHECK_STATUS(PTZCAL_STATUS_TOO_FEW_POINTS, ptzcal_planes_find_scan(scan, &find, &none, NULL));
  CHECK(none == NULL);
  ptzcal_scan_free(scan);
  CHECK_OK(ptzcal_rig_close(rig, NULL));
  ptzcal_rig_options_free(options);
}

int main(void)
{
  ptzcal_adjustment *survey;
  ptzcal_rig_model model;
  make_rig_model(&model);
  make_walk(&model, places, STATIONS, SHOTS, &survey);
  bad_options(survey);
  a_path_is_tied_and_solved(survey);
  ptzcal_adjustment_free(survey);
  planes_in_boxes();
  planes_of_a_scan();
  return 0;
}
