/* Clouds and meshes: made, changed, written, read, seen by cameras; and what is refused. */
#include "fixtures.h"
#include <math.h>
#include <string.h>

#define N 5

static const double xyz[3 * N] = {-1, -1, 3, 1, -1, 3, 1, 1, 3, -1, 1, 3, 0.5, 0.25, 5};
static const uint8_t rgb[3 * N] = {255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 9, 9, 1, 2, 3};
static double covariances[6 * N];
static const uint32_t square[6] = {0, 2, 1, 0, 3, 2};

static size_t count(const ptzcal_cloud *cloud)
{
  size_t points = 0;
  CHECK_OK(ptzcal_cloud_size(cloud, &points, NULL, NULL, NULL));
  return points;
}

static ptzcal_cloud *sample(const double *noise)
{
  ptzcal_cloud *cloud;
  CHECK_OK(ptzcal_cloud_new(&cloud, NULL));
  CHECK_OK(ptzcal_cloud_add_points(cloud, xyz, rgb, noise, N, NULL));
  return cloud;
}

static void straight_camera(ptzcal_camera *camera)
{
  CHECK_OK(ptzcal_camera_init(camera, sizeof *camera));
  camera->width = 64;
  camera->height = 48;
  camera->fx = camera->fy = 40.0;
  camera->cx = 32.0;
  camera->cy = 24.0;
}

static void points(void)
{
  ptzcal_cloud *cloud = sample(covariances), *other, *plain = sample(NULL);
  ptzcal_pose pose;
  double back[3 * N], noise[6 * N], deviations[N], covariance[36] = {0};
  const double least[3] = {-2, -2, 2}, greatest[3] = {2, 2, 4};
  uint8_t colours[3 * N];
  uint32_t kind = 9, normals = 9, i;
  size_t needed = 0;
  CHECK_OK(ptzcal_cloud_size(cloud, &needed, &kind, &normals, NULL));
  CHECK(needed == N && kind == PTZCAL_CLOUD_NOISE_COVARIANCES && normals == 0);
  CHECK_STATUS(PTZCAL_STATUS_BUFFER_TOO_SMALL, ptzcal_cloud_copy_points(cloud, back, 3 * N - 1, &needed, NULL));
  CHECK(needed == 3 * N);
  CHECK_OK(ptzcal_cloud_copy_points(cloud, back, 3 * N, NULL, NULL));
  CHECK_OK(ptzcal_cloud_copy_colours(cloud, colours, sizeof colours, &needed, NULL));
  CHECK_OK(ptzcal_cloud_copy_covariances(cloud, noise, 6 * N, NULL, NULL));
  CHECK_OK(ptzcal_cloud_copy_deviations(cloud, deviations, N, NULL, NULL));
  CHECK(memcmp(back, xyz, sizeof xyz) == 0 && memcmp(colours, rgb, sizeof rgb) == 0);
  CHECK(memcmp(noise, covariances, sizeof covariances) == 0);
  CHECK_NEAR(deviations[0], sqrt(1e-4 + 2e-4 + 3e-4), 1e-12);
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_cloud_copy_normals(cloud, back, 3 * N, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_cloud_copy_covariances(plain, noise, 6 * N, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_cloud_copy_deviations(plain, noise, 6 * N, NULL, NULL));

  /* A quarter turn about z, and 1 m along x; the pose is 2 cm uncertain along z. */
  CHECK_OK(ptzcal_pose_init(&pose, sizeof pose));
  memset(pose.rotation, 0, sizeof pose.rotation);
  pose.rotation[1] = -1.0;
  pose.rotation[3] = pose.rotation[8] = 1.0;
  pose.translation[0] = 1.0;
  covariance[35] = 4e-4;
  CHECK_OK(ptzcal_cloud_transform(cloud, &pose, covariance, NULL));
  CHECK_OK(ptzcal_cloud_copy_points(cloud, back, 3 * N, NULL, NULL));
  CHECK_OK(ptzcal_cloud_copy_covariances(cloud, noise, 6 * N, NULL, NULL));
  CHECK_NEAR(back[0], 2.0, 1e-12);
  CHECK_NEAR(back[1], -1.0, 1e-12);
  CHECK_NEAR(noise[0], 2e-4, 1e-15);
  CHECK_NEAR(noise[3], 1e-4, 1e-15);
  CHECK_NEAR(noise[5], 3e-4 + 4e-4, 1e-15);

  /* Twice the same points: half as many voxels, half the variance. */
  ptzcal_cloud_free(cloud);
  cloud = sample(covariances);
  other = sample(covariances);
  CHECK_OK(ptzcal_cloud_merge(cloud, other, NULL));
  CHECK(count(cloud) == 2 * N && count(other) == N);
  CHECK_STATUS(PTZCAL_STATUS_BUSY, ptzcal_cloud_merge(cloud, cloud, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_merge(cloud, plain, NULL));
  CHECK_OK(ptzcal_cloud_thin(cloud, 0.01, NULL));
  CHECK(count(cloud) == N);
  CHECK_OK(ptzcal_cloud_copy_covariances(cloud, noise, 6 * N, NULL, NULL));
  for (i = 0; i < N; i++) CHECK_NEAR(noise[6 * i], 0.5e-4, 1e-12);
  CHECK_OK(ptzcal_cloud_crop(cloud, least, greatest, NULL));
  CHECK(count(cloud) == N - 1);
  CHECK_OK(ptzcal_cloud_strip(cloud, NULL));
  CHECK_OK(ptzcal_cloud_merge(cloud, plain, NULL));
  CHECK(count(cloud) == 2 * N - 1);
  ptzcal_cloud_free(cloud);
  ptzcal_cloud_free(other);
  ptzcal_cloud_free(plain);
}

static void files(void)
{
  static const char *const clouds[4] = {"cloud.ply", "cloud.pcd", "cloud.glb", "cloud.wrl"};
  static const char *const meshes[3] = {"mesh.ply", "mesh.GLB", "mesh.wrl"};
  ptzcal_cloud *cloud = sample(covariances), *found;
  ptzcal_mesh *mesh, *back;
  double a[3 * N], b[3 * N];
  uint32_t triangles[6], kind, i, k;
  size_t n, needed;
  FILE *file;
  CHECK_OK(ptzcal_mesh_new(cloud, square, 2, &mesh, NULL));
  CHECK_OK(ptzcal_cloud_copy_points(cloud, a, 3 * N, NULL, NULL));
  for (i = 0; i < 4; i++) {
    size_t skipped = 7;
    CHECK_OK(ptzcal_cloud_save(cloud, clouds[i], NULL));
    CHECK_OK(ptzcal_cloud_load(clouds[i], &found, &skipped, NULL));
    CHECK_OK(ptzcal_cloud_copy_points(found, b, 3 * N, &n, NULL));
    CHECK_OK(ptzcal_cloud_size(found, NULL, &kind, NULL, NULL));
    CHECK(n == 3 * N && skipped == 0 && kind == (i < 3 ? PTZCAL_CLOUD_NOISE_COVARIANCES : PTZCAL_CLOUD_NOISE_UNKNOWN));
    for (k = 0; k < 3 * N; k++) CHECK_NEAR(a[k], b[k], 1e-6);
    ptzcal_cloud_free(found);
  }
  for (i = 0; i < 3; i++) {
    CHECK_OK(ptzcal_mesh_save(mesh, meshes[i], NULL));
    CHECK_OK(ptzcal_mesh_load(meshes[i], &back, NULL));
    CHECK_OK(ptzcal_mesh_copy_triangles(back, triangles, 6, &needed, NULL));
    CHECK(needed == 6 && memcmp(triangles, square, sizeof square) == 0);
    ptzcal_mesh_free(back);
    CHECK_OK(ptzcal_cloud_load(meshes[i], &found, NULL, NULL));
    CHECK(count(found) == N);
    ptzcal_cloud_free(found);
  }
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_cloud_save(cloud, "cloud.xyz", NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_cloud_save(cloud, "cloud", NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_cloud_save(cloud, "no/such/folder/cloud.ply", NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_mesh_save(mesh, "mesh.pcd", NULL));
  CHECK_STATUS(PTZCAL_STATUS_UNSUPPORTED, ptzcal_mesh_load("cloud.pcd", &back, NULL));
  CHECK_STATUS(PTZCAL_STATUS_FILE_IO, ptzcal_mesh_load("none.glb", &back, NULL));
  CHECK(back == NULL);
  /* A few bytes that promise a hundred million points. */
  file = fopen("lie.ply", "wb");
  CHECK(file);
  fputs("ply\nformat binary_little_endian 1.0\nelement vertex 100000000\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n", file);
  fclose(file);
  CHECK_STATUS(PTZCAL_STATUS_FILE_FORMAT, ptzcal_cloud_load("lie.ply", &found, NULL, NULL));
  CHECK(found == NULL);
  /* Two points, of which one is nowhere; then a byte too few, and a byte too many. */
  for (i = 0; i < 3; i++) {
    const float nowhere[3] = {1.0f, NAN, 2.0f}, somewhere[3] = {1.0f, 2.0f, 3.0f};
    file = fopen("cut.ply", "wb");
    CHECK(file);
    fputs("ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
          "property float z\nend_header\n", file);
    CHECK(fwrite(nowhere, sizeof nowhere, 1, file) == 1);
    CHECK(fwrite(somewhere, sizeof somewhere - (i == 1), 1, file) == 1);
    if (i == 2) fputc(0, file);
    fclose(file);
    if (i == 0) {
      CHECK_OK(ptzcal_cloud_load("cut.ply", &found, &needed, NULL));
      CHECK(count(found) == 1 && needed == 1);
      ptzcal_cloud_free(found);
    } else {
      CHECK_STATUS(PTZCAL_STATUS_FILE_FORMAT, ptzcal_cloud_load("cut.ply", &found, NULL, NULL));
      CHECK(found == NULL);
    }
  }
  remove("cut.ply");
  /* A depth camera's pixel without depth. */
  file = fopen("holes.pcd", "wb");
  CHECK(file);
  fputs("VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\nnan nan nan\n1 2 3\n", file);
  fclose(file);
  CHECK_OK(ptzcal_cloud_load("holes.pcd", &found, &needed, NULL));
  CHECK(count(found) == 1 && needed == 1);
  ptzcal_cloud_free(found);
  for (i = 0; i < 4; i++) remove(clouds[i]);
  for (i = 0; i < 3; i++) remove(meshes[i]);
  remove("lie.ply");
  remove("holes.pcd");
  ptzcal_mesh_free(mesh);
  ptzcal_cloud_free(cloud);
}

static void seen(void)
{
  static uint8_t picture[48 * 64];
  static float metres[48 * 64], variances[48 * 64], again[48 * 64];
  ptzcal_cloud *cloud = sample(covariances), *plain = sample(NULL), *vertices;
  ptzcal_mesh *mesh, *surface;
  ptzcal_depth_map *map, *read;
  ptzcal_camera camera, wide;
  ptzcal_image image, small;
  size_t known, covered = 9, n_vertices, n_triangles, n_textures;
  uint32_t normals;
  straight_camera(&camera);
  make_image(&image, picture, 64, 48);
  make_image(&small, picture, 63, 48);
  CHECK_OK(ptzcal_mesh_new(cloud, square, 2, &mesh, NULL));
  CHECK_OK(ptzcal_mesh_depth_map(mesh, &camera, &map, NULL));
  CHECK_OK(ptzcal_depth_map_size(map, NULL, NULL, &known, NULL));
  /* 2 m at 3 m: 26.7 pixels a side. */
  CHECK(known >= 26 * 26 && known <= 28 * 28);
  CHECK_OK(ptzcal_depth_map_copy_metres(map, metres, 48 * 64, NULL, NULL));
  CHECK_OK(ptzcal_depth_map_copy_variances(map, variances, 48 * 64, NULL, NULL));
  CHECK_NEAR(metres[24 * 64 + 32], 3.0, 1e-6);
  /* In the middle of an edge between two points, each with half the weight. */
  CHECK_NEAR(variances[24 * 64 + 32], 3e-4 / 2, 1e-9);
  CHECK(metres[0] == 0.0f && variances[0] == 0.0f);
  CHECK_OK(ptzcal_depth_map_save(map, "depth.png", 0.001, NULL));
  CHECK_OK(ptzcal_depth_map_read("depth.png", 0.001, &read, NULL));
  CHECK_OK(ptzcal_depth_map_copy_metres(read, again, 48 * 64, NULL, NULL));
  CHECK(memcmp(metres, again, sizeof metres) == 0);
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_depth_map_copy_variances(read, variances, 48 * 64, NULL, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_depth_map_save(map, "depth.png", 1e-6, NULL));
  ptzcal_depth_map_free(read);

  /* The map is a surface again, and its points a cloud. */
  CHECK_OK(ptzcal_mesh_from_depth_map(map, &camera, &image, 0.0, 0.01, NULL, &surface, NULL));
  CHECK_OK(ptzcal_mesh_size(surface, &n_vertices, &n_triangles, NULL, NULL));
  CHECK(n_vertices == known && n_triangles > known);
  CHECK_OK(ptzcal_mesh_vertices(surface, &vertices, NULL));
  CHECK_OK(ptzcal_cloud_size(vertices, &n_vertices, NULL, &normals, NULL));
  CHECK(n_vertices == known && normals == 1);
  ptzcal_cloud_free(vertices);
  CHECK_OK(ptzcal_cloud_from_depth_map(map, &camera, NULL, 0.001, 0.0, &vertices, NULL));
  CHECK(count(vertices) == known);
  ptzcal_cloud_free(vertices);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_from_depth_map(map, &camera, &small, 0.001, 0.0, &vertices, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_from_depth_map(map, &camera, &image, 0.0, 0.0, &vertices, NULL));
  ptzcal_mesh_free(surface);
  ptzcal_depth_map_free(map);

  CHECK_OK(ptzcal_mesh_texture(mesh, &covered, NULL));
  CHECK(covered == 0);
  CHECK_OK(ptzcal_mesh_add_picture(mesh, &image, &camera, NULL));
  CHECK_OK(ptzcal_mesh_texture(mesh, &covered, NULL));
  CHECK_OK(ptzcal_mesh_size(mesh, NULL, &n_triangles, &n_textures, NULL));
  CHECK(covered == 2 && n_triangles == 2 && n_textures == 1);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_mesh_add_picture(mesh, &small, &camera, NULL));

  CHECK_OK(ptzcal_cloud_depth_map(plain, &camera, &map, NULL));
  CHECK_OK(ptzcal_depth_map_size(map, NULL, NULL, &known, NULL));
  CHECK(known == N);
  CHECK_STATUS(PTZCAL_STATUS_BAD_STATE, ptzcal_depth_map_copy_variances(map, NULL, 0, NULL, NULL));
  ptzcal_depth_map_free(map);
  wide = camera;
  wide.width = wide.height = 65536;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_depth_map(plain, &wide, &map, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_mesh_depth_map(mesh, &wide, &map, NULL));
  CHECK(map == NULL);
  remove("depth.png");
  ptzcal_mesh_free(mesh);
  ptzcal_cloud_free(cloud);
  ptzcal_cloud_free(plain);
}

static void scanned(void)
{
  ptzcal_rig_options *options;
  ptzcal_rig *rig;
  ptzcal_scan *scan;
  ptzcal_region region;
  ptzcal_scan_summary summary;
  ptzcal_surface_options surface;
  ptzcal_cloud *cloud;
  ptzcal_mesh *mesh;
  uint32_t kind;
  size_t vertices, triangles;
  CHECK_OK(ptzcal_rig_options_new(&options, NULL));
  CHECK_OK(ptzcal_rig_options_set_address(options, "sim:room", NULL));
  CHECK_OK(ptzcal_rig_open(options, &rig, NULL));
  CHECK_OK(ptzcal_region_init(&region, sizeof region));
  region.pan_min = -0.1;
  region.pan_max = 0.1;
  region.tilt_min = -0.05;
  region.tilt_max = 0.05;
  region.pan_steps = 5;
  region.tilt_steps = 4;
  CHECK_OK(ptzcal_rig_scan_region(rig, &region, NULL, NULL, NULL, &scan, NULL));
  CHECK_OK(ptzcal_scan_summary_init(&summary, sizeof summary));
  CHECK_OK(ptzcal_scan_get_summary(scan, &summary, NULL));
  CHECK_OK(ptzcal_cloud_from_scan(scan, &cloud, NULL));
  CHECK_OK(ptzcal_cloud_size(cloud, &vertices, &kind, NULL, NULL));
  CHECK(vertices == summary.found && kind == PTZCAL_CLOUD_NOISE_COVARIANCES);
  CHECK_OK(ptzcal_surface_options_init(&surface, sizeof surface));
  CHECK_OK(ptzcal_mesh_from_scan(scan, &surface, &mesh, NULL));
  CHECK_OK(ptzcal_mesh_size(mesh, &vertices, &triangles, NULL, NULL));
  CHECK(vertices == summary.found && triangles >= 12);
  ptzcal_mesh_free(mesh);
  surface.max_incidence = 2.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_mesh_from_scan(scan, &surface, &mesh, NULL));
  surface.max_incidence = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_mesh_from_scan(scan, &surface, &mesh, NULL));
  CHECK(mesh == NULL);
  ptzcal_cloud_free(cloud);
  ptzcal_scan_free(scan);
  CHECK_OK(ptzcal_rig_close(rig, NULL));
  ptzcal_rig_options_free(options);
}

static void refused(void)
{
  static const uint32_t outside[3] = {0, 1, N};
  ptzcal_cloud *cloud = sample(covariances);
  ptzcal_mesh *mesh;
  ptzcal_pose pose;
  ptzcal_error *error = NULL;
  double bad[6 * N], covariance[36] = {0};
  memcpy(bad, covariances, sizeof bad);
  bad[6 * 3] = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_add_points(cloud, xyz, rgb, bad, N, NULL));
  bad[6 * 3] = NAN;
  CHECK_STATUS(PTZCAL_STATUS_NOT_FINITE, ptzcal_cloud_add_points(cloud, xyz, rgb, bad, N, &error));
  CHECK(ptzcal_error_index(error) == 3);
  ptzcal_error_free(error);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_add_points(cloud, xyz, rgb, NULL, N, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_add_points(cloud, xyz, rgb, covariances, SIZE_MAX / 24, NULL));
  CHECK_OK(ptzcal_cloud_add_points(cloud, NULL, NULL, NULL, 0, NULL));
  CHECK(count(cloud) == N);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_thin(cloud, 0.0, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_thin(cloud, 1e-9, NULL));
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_crop(cloud, xyz + 3, xyz, NULL));
  CHECK_OK(ptzcal_pose_init(&pose, sizeof pose));
  covariance[0] = -1.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_transform(cloud, &pose, covariance, NULL));
  pose.rotation[0] = 2.0;
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_cloud_transform(cloud, &pose, NULL, NULL));
  CHECK(count(cloud) == N);
  CHECK_STATUS(PTZCAL_STATUS_INVALID_ARGUMENT, ptzcal_mesh_new(cloud, outside, 1, &mesh, NULL));
  CHECK(mesh == NULL);
  /* Nothing at all is a cloud and a mesh. */
  CHECK_OK(ptzcal_mesh_new(cloud, NULL, 0, &mesh, NULL));
  ptzcal_mesh_free(mesh);
  ptzcal_cloud_free(cloud);
  ptzcal_cloud_free(NULL);
  ptzcal_mesh_free(NULL);
}

int main(void)
{
  size_t i;
  for (i = 0; i < N; i++) {
    covariances[6 * i] = 1e-4;
    covariances[6 * i + 3] = 2e-4;
    covariances[6 * i + 5] = 3e-4;
  }
  points();
  files();
  seen();
  scanned();
  refused();
  return 0;
}
