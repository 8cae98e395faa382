/* The C ABI from C: every function, every kind of failure. */
#include <npt_c.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

static int failures = 0;

#define CHECK(condition)                                              \
  do {                                                                \
    if (!(condition)) {                                               \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      ++failures;                                                     \
    }                                                                 \
  } while (0)

enum { V = 100, P = 60 };
static float identity[3 * V], pose[3 * V], result[3 * V], again[3 * V];
static uint32_t fan[3 * (P - 2)];

static void make_meshes(void) {
  for (int i = 0; i < 3 * V; ++i) {
    identity[i] = sinf((float)i);
    pose[i] = cosf((float)i);
  }
  for (uint32_t t = 0; t < P - 2; ++t) {
    fan[3 * t] = 0;
    fan[3 * t + 1] = t + 1;
    fan[3 * t + 2] = t + 2;
  }
}

static int finite_numbers(const float* values) {
  for (int i = 0; i < 3 * V; ++i)
    if (!isfinite(values[i])) return 0;
  return 1;
}

static void transfers(void) {
  npt_network* network = NULL;
  CHECK(npt_open_random(64, 0, 1, 2, &network) == NPT_OK);
  CHECK(strcmp(npt_describe(network), "bottleneck 64, conv_relu, per-vertex") == 0);
  CHECK(npt_transfer(network, identity, V, pose, V, NULL, 0, result) == NPT_OK);
  CHECK(finite_numbers(result));
  CHECK(npt_transfer(network, identity, V, pose, V, NULL, 0, again) == NPT_OK);
  CHECK(memcmp(result, again, sizeof result) == 0);

  /* Fewer vertices in the pose mesh: points on its surface, or without triangles some of its vertices. */
  CHECK(npt_transfer(network, identity, V, pose, P, fan, P - 2, again) == NPT_OK);
  CHECK(finite_numbers(again));
  CHECK(memcmp(result, again, sizeof result) != 0);
  CHECK(npt_transfer(network, identity, V, pose, P, NULL, 0, again) == NPT_OK);
  CHECK(finite_numbers(again));
  memcpy(again, result, sizeof result);
  fan[5] = P;
  CHECK(npt_transfer(network, identity, V, pose, P, fan, P - 2, again) == NPT_BAD_INPUT);
  CHECK(strcmp(npt_last_error(), "pose_triangles: triangle 1: found vertex 60, expected a number below 60") == 0);
  CHECK(npt_transfer(network, identity, 0, pose, V, NULL, 0, again) == NPT_BAD_INPUT);
  CHECK(memcmp(result, again, sizeof result) == 0);
  pose[7] = NAN;
  CHECK(npt_transfer(network, identity, V, pose, V, NULL, 0, again) == NPT_OK);
  CHECK(!finite_numbers(again));
  make_meshes();
  CHECK(npt_transfer(NULL, identity, V, pose, V, NULL, 0, again) == NPT_BAD_ARGUMENT);
  CHECK(npt_transfer(network, NULL, V, pose, V, NULL, 0, again) == NPT_BAD_ARGUMENT);
  CHECK(npt_transfer(network, identity, V, pose, V, NULL, 1, again) == NPT_BAD_ARGUMENT);
  CHECK(npt_transfer(network, identity, SIZE_MAX, pose, V, NULL, 0, again) == NPT_BAD_ARGUMENT);
  npt_close(network);

  CHECK(npt_open_random(64, 1, 1, 1, &network) == NPT_OK);
  CHECK(npt_transfer(network, identity, V, pose, P, NULL, 0, again) == NPT_OK);
  CHECK(finite_numbers(again));
  npt_close(network);
  npt_close(NULL);
}

static void openings(const char* weights_of_16) {
  npt_network* network = NULL;
  CHECK(npt_open_random(65, 0, 1, 1, &network) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "expected bottleneck 64 or 1024") != NULL);
  CHECK(npt_open_random(64, 0, 1, -1, &network) == NPT_BAD_ARGUMENT);
  CHECK(npt_open_random(64, 0, 1, 1, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_open_weights("does/not/exist.safetensors", 1, &network) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "does/not/exist.safetensors") != NULL);
  CHECK(npt_open_weights(weights_of_16, 1, &network) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "found '16', expected 64 or 1024") != NULL);
  CHECK(npt_open_weights(NULL, 1, &network) == NPT_BAD_ARGUMENT);
  CHECK(network == NULL);
  CHECK(npt_describe(NULL) == NULL);
}

int main(int argc, char** argv) {
  CHECK(argc == 2);
  CHECK(strcmp(npt_last_error(), "") == 0);
  CHECK(strlen(npt_version()) >= 5);
  make_meshes();
  if (argc == 2) openings(argv[1]);
  transfers();
  return failures != 0;
}
