/* What a call costs a program in C, and what loading the library costs it:
 *     calls libptzcal.so
 * Least of many, so that other programs' load drops out. `make bench` builds and runs it; the same calls
 * from Python are the last tasks of peers/bench.py. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <ptzcal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { LOADS = 30, BLOCKS = 200, CALLS = 1000 };

static double now_ns(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void *open_library(const char *path) {
  void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    fprintf(stderr, "%s\n", dlerror());
    exit(1);
  }
  return library;
}

/* In a process of its own: the library stays loaded once it is. All symbols bound, as strict programs do. */
static double load_ns(const char *path) {
  int ends[2];
  double took = 0.0;
  if (pipe(ends) != 0) exit(1);
  pid_t child = fork();
  if (child == 0) {
    double began = now_ns();
    open_library(path);
    took = now_ns() - began;
    _exit(write(ends[1], &took, sizeof took) == (ssize_t)sizeof took ? 0 : 1);
  }
  int status = 1;
  if (child < 0 || read(ends[0], &took, sizeof took) != (ssize_t)sizeof took) exit(1);
  waitpid(child, &status, 0);
  close(ends[0]);
  close(ends[1]);
  return took;
}

/* Nanoseconds of a call of the statement, least of many blocks. */
#define LEAST_NS(result, call)                          \
  do {                                                  \
    result = 1e30;                                      \
    for (int block = 0; block < BLOCKS; block++) {      \
      double began = now_ns();                          \
      for (int i = 0; i < CALLS; i++) call;             \
      double took = (now_ns() - began) / CALLS;         \
      if (took < result) result = took;                 \
    }                                                   \
  } while (0)

int main(int argc, char **argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: calls libptzcal.so\n");
    return 2;
  }
  double loading = 1e30;
  for (int i = 0; i < LOADS; i++) {
    double took = load_ns(argv[1]);
    if (took < loading) loading = took;
  }
  void *library = open_library(argv[1]);
  uint32_t (*abi_version)(void);
  ptzcal_status (*init)(ptzcal_camera *, size_t);
  ptzcal_status (*project)(const ptzcal_camera *, const double *, size_t, double *, ptzcal_error **);
  *(void **)&abi_version = dlsym(library, "ptzcal_abi_version");
  *(void **)&init = dlsym(library, "ptzcal_camera_init");
  *(void **)&project = dlsym(library, "ptzcal_camera_project");
  if (!abi_version || !init || !project || abi_version() != PTZCAL_ABI_VERSION) return 1;

  ptzcal_camera camera;
  init(&camera, sizeof camera);
  camera.width = 1920;
  camera.height = 1080;
  camera.fx = camera.fy = 1400.0;
  camera.cx = 960.0;
  camera.cy = 540.0;
  camera.distortion_model = PTZCAL_DISTORTION_MODEL_BROWN_CONRADY;
  camera.distortion[0] = -0.2;
  camera.distortion[1] = 0.06;
  const double xyz[3] = {0.4, -0.2, 3.0};
  double uv[2], nothing, one;
  if (project(&camera, xyz, 1, uv, NULL) != PTZCAL_STATUS_OK) return 1;
  LEAST_NS(nothing, abi_version());
  LEAST_NS(one, project(&camera, xyz, 1, uv, NULL));
  printf("loading the library          %9.2f ms\n", 1e-6 * loading);
  printf("a call from C, no arguments  %9.1f ns\n", nothing);
  printf("project 1 point from C       %9.1f ns\n", one);
  return 0;
}
