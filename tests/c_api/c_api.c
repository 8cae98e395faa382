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
static float identity_xyz[3 * V], pose_xyz[3 * V], result[3 * V], again[3 * V];
static uint32_t fan[3 * (V - 2)];
static npt_mesh identity, pose, small_pose;

static void make_meshes(void) {
  for (int i = 0; i < 3 * V; ++i) {
    identity_xyz[i] = sinf((float)i);
    pose_xyz[i] = cosf((float)i);
  }
  for (uint32_t t = 0; t < V - 2; ++t) {
    fan[3 * t] = 0;
    fan[3 * t + 1] = t + 1;
    fan[3 * t + 2] = t + 2;
  }
  identity = (npt_mesh){identity_xyz, V, fan, V - 2, NULL};
  pose = (npt_mesh){pose_xyz, V, fan, V - 2, NULL};
  small_pose = (npt_mesh){pose_xyz, P, fan, P - 2, "small.obj"};
}

static int finite_numbers(const float* values) {
  for (int i = 0; i < 3 * V; ++i)
    if (!isfinite(values[i])) return 0;
  return 1;
}

/* NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): it is the bits that are compared */
static int same(const float* a, const float* b) { return memcmp(a, b, sizeof result) == 0; }

static void transfers(void) {
  npt_transfer* transfer = NULL;
  npt_options options;
  npt_default_options(&options);
  options.threads = 2;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_OK);
  CHECK(strcmp(npt_describe(transfer), "bottleneck 64, conv_relu, per-vertex") == 0);
  CHECK(npt_run(transfer, &identity, &pose, result) == NPT_OK);
  CHECK(finite_numbers(result));
  CHECK(npt_run(transfer, &identity, &pose, again) == NPT_OK);
  CHECK(same(result, again));

  /* Fewer vertices in the pose mesh: points on its surface, or without triangles some of its vertices. */
  CHECK(npt_run(transfer, &identity, &small_pose, again) == NPT_OK);
  CHECK(finite_numbers(again) && !same(result, again));
  small_pose.triangles = NULL;
  CHECK(npt_run(transfer, &identity, &small_pose, again) == NPT_BAD_ARGUMENT);
  small_pose.triangle_count = 0;
  CHECK(npt_run(transfer, &identity, &small_pose, again) == NPT_OK);
  CHECK(finite_numbers(again));
  make_meshes();

  /* Failures leave the result as it was. */
  memcpy(again, result, sizeof result);
  fan[5] = P;
  CHECK(npt_run(transfer, &identity, &small_pose, again) == NPT_BAD_INPUT);
  CHECK(strcmp(npt_last_error(), "small.obj: triangle 1: found vertex 60, expected a number below 60") == 0);
  make_meshes();
  identity.vertices = 0;
  CHECK(npt_run(transfer, &identity, &pose, again) == NPT_BAD_INPUT);
  identity.vertices = SIZE_MAX;
  CHECK(npt_run(transfer, &identity, &pose, again) == NPT_BAD_ARGUMENT);
  make_meshes();
  CHECK(npt_run(NULL, &identity, &pose, again) == NPT_BAD_ARGUMENT);
  CHECK(npt_run(transfer, NULL, &pose, again) == NPT_BAD_ARGUMENT);
  CHECK(npt_run(transfer, &identity, &pose, NULL) == NPT_BAD_ARGUMENT);
  identity.xyz = NULL;
  CHECK(npt_run(transfer, &identity, &pose, again) == NPT_BAD_ARGUMENT);
  CHECK(same(result, again));
  make_meshes();
  pose_xyz[7] = NAN;
  CHECK(npt_run(transfer, &identity, &pose, again) == NPT_OK);
  CHECK(!finite_numbers(again));
  make_meshes();
  npt_close(transfer);
  npt_close(NULL);
}

/* Random weights estimate no bodies: the network does it, and there is nothing to say and no skeleton. */
static void explained(const npt_transfer* transfer, const npt_identity* own, const npt_pose* posed) {
  const npt_skeleton* skeleton = NULL;
  npt_sequence* sequence = NULL;
  npt_report report;
  double motions[NPT_JOINTS * 12];
  CHECK(npt_explain(transfer, own, posed, &report) == NPT_OK);
  CHECK(report.method == NPT_NETWORK && report.identity_confidence < 0 && report.pose_confidence < 0);
  CHECK(strcmp(npt_last_notes(), "") == 0);
  CHECK(npt_explain(transfer, own, posed, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_open_skeleton(transfer, own, &skeleton) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "identity is not recognised as a person") != NULL);
  CHECK(npt_open_skeleton(transfer, own, NULL) == NPT_BAD_ARGUMENT);
  npt_close_skeleton(NULL);
  CHECK(npt_move_joints(transfer, own, posed, motions) == NPT_BAD_INPUT);
  CHECK(npt_move_joints(transfer, own, posed, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_open_sequence(transfer, own, &sequence) == NPT_OK);
  CHECK(npt_explain_frame(sequence, &report) == NPT_BAD_ARGUMENT); /* no frame yet */
  CHECK(npt_move_frame_joints(sequence, motions) == NPT_BAD_ARGUMENT);
  CHECK(npt_run_frame(sequence, &pose, again) == NPT_OK);
  CHECK(npt_explain_frame(sequence, &report) == NPT_OK);
  CHECK(report.method == NPT_NETWORK);
  CHECK(npt_move_frame_joints(sequence, motions) == NPT_BAD_INPUT);
  npt_close_sequence(sequence);
}

/* Prepared meshes and sequences give npt_run's numbers, with every option. */
static void prepared(void) {
  npt_transfer* transfer = NULL;
  npt_identity* own = NULL;
  npt_pose* posed = NULL;
  npt_sequence* sequence = NULL;
  npt_options options;
  npt_default_options(&options);
  options.threads = 1;
  options.pairings = 2;
  options.mirror = 1;
  options.invariant = 1;
  options.seed = 5;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_OK);
  CHECK(strcmp(npt_describe(transfer), "bottleneck 64, conv_relu, per-vertex, 2 pairings, mirrored") == 0);
  CHECK(npt_run(transfer, &identity, &pose, result) == NPT_OK);
  CHECK(npt_prepare_identity(transfer, &identity, &own) == NPT_OK);
  CHECK(npt_prepare_pose(transfer, &pose, V, &posed) == NPT_OK);
  CHECK(npt_run_prepared(transfer, own, posed, again) == NPT_OK);
  CHECK(same(result, again));
  CHECK(npt_open_sequence(transfer, own, &sequence) == NPT_OK);
  CHECK(npt_run_frame(sequence, &pose, again) == NPT_OK);
  CHECK(same(result, again));
  CHECK(npt_run_frame(sequence, NULL, again) == NPT_BAD_ARGUMENT);
  CHECK(npt_run_frame(NULL, &pose, again) == NPT_BAD_ARGUMENT);
  CHECK(npt_run_prepared(transfer, own, NULL, again) == NPT_BAD_ARGUMENT);
  CHECK(npt_prepare_identity(transfer, NULL, &own) == NPT_BAD_ARGUMENT);
  CHECK(npt_prepare_pose(transfer, &pose, V, NULL) == NPT_BAD_ARGUMENT);
  npt_close_sequence(sequence);
  npt_release_pose(posed);
  npt_release_identity(own);
  CHECK(npt_prepare(transfer, &identity, &pose, &own, &posed) == NPT_OK);
  CHECK(npt_run_prepared(transfer, own, posed, again) == NPT_OK);
  CHECK(same(result, again));
  CHECK(npt_prepare(transfer, &identity, NULL, &own, &posed) == NPT_BAD_ARGUMENT);
  explained(transfer, own, posed);
  npt_release_pose(posed);
  CHECK(npt_prepare_pose(transfer, &pose, V - 1, &posed) == NPT_OK);
  CHECK(npt_run_prepared(transfer, own, posed, again) == NPT_BAD_INPUT); /* for other identities */
  npt_release_pose(posed);
  npt_release_identity(own);
  npt_close(transfer);
  npt_release_identity(NULL);
  npt_release_pose(NULL);
  npt_close_sequence(NULL);

  /* The pooled feature takes pose meshes of any vertex count as they are; the order of its vertices hardly matters. */
  npt_default_options(&options);
  options.resample = 0;
  CHECK(npt_open_random(64, 1, 1, &options, &transfer) == NPT_OK);
  CHECK(npt_run(transfer, &identity, &small_pose, again) == NPT_OK);
  CHECK(finite_numbers(again));
  npt_close(transfer);
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_OK);
  CHECK(npt_run(transfer, &identity, &small_pose, again) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "small.obj: found 60 vertices, expected 100") != NULL);
  npt_close(transfer);
}

static void openings(const char* weights_of_16) {
  npt_transfer* transfer = NULL;
  npt_options options;
  npt_default_options(&options);
  CHECK(npt_open_random(65, 0, 1, NULL, &transfer) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "expected bottleneck 64, 128, 256, 512 or 1024") != NULL);
  options.threads = -1;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_BAD_ARGUMENT);
  npt_default_options(&options);
  options.pairings = 0;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_BAD_INPUT);
  options = (npt_options){0};
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_BAD_ARGUMENT);
  CHECK(npt_open_random(64, 0, 1, NULL, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_open("does/not/exist.safetensors", NULL, &transfer) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "does/not/exist.safetensors") != NULL);
  CHECK(npt_open(weights_of_16, NULL, &transfer) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "found bottleneck 16, conv_relu, per-vertex, expected one of the networks") != NULL);
  CHECK(npt_open(NULL, NULL, &transfer) == NPT_BAD_ARGUMENT);
  CHECK(transfer == NULL);
  CHECK(npt_describe(NULL) == NULL);
  npt_default_options(NULL);
}

/* Every file of weights that npt ships opens. */
static void shipped(int count, char** files) {
  for (int i = 0; i < count; ++i) {
    npt_transfer* transfer = NULL;
    CHECK(npt_open(files[i], NULL, &transfer) == NPT_OK);
    npt_close(transfer);
  }
}

int main(int argc, char** argv) {
  CHECK(argc > 1);
  CHECK(strcmp(npt_last_error(), "") == 0);
  CHECK(strlen(npt_version()) >= 5);
  make_meshes();
  if (argc > 1) openings(argv[1]);
  transfers();
  prepared();
  shipped(argc - 2, argv + 2);
  return failures != 0;
}
