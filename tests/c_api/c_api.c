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
  identity = (npt_mesh){sizeof(npt_mesh), identity_xyz, V, fan, V - 2, NULL};
  pose = (npt_mesh){sizeof(npt_mesh), pose_xyz, V, fan, V - 2, NULL};
  small_pose = (npt_mesh){sizeof(npt_mesh), pose_xyz, P, fan, P - 2, "small.obj"};
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
  npt_options options = {sizeof options};
  CHECK(npt_default_options(&options) == NPT_OK);
  options.threads = 2;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_OK);
  CHECK(strcmp(npt_describe(transfer), "bottleneck 64, conv_relu, per-vertex") == 0);
  CHECK(npt_run(transfer, &identity, &pose, result, NULL) == NPT_OK);
  CHECK(finite_numbers(result));
  CHECK(npt_run(transfer, &identity, &pose, again, NULL) == NPT_OK);
  CHECK(same(result, again));

  /* Fewer vertices in the pose mesh: points on its surface, or without triangles some of its vertices. */
  CHECK(npt_run(transfer, &identity, &small_pose, again, NULL) == NPT_OK);
  CHECK(finite_numbers(again) && !same(result, again));
  small_pose.triangles = NULL;
  CHECK(npt_run(transfer, &identity, &small_pose, again, NULL) == NPT_BAD_ARGUMENT);
  small_pose.triangle_count = 0;
  CHECK(npt_run(transfer, &identity, &small_pose, again, NULL) == NPT_OK);
  CHECK(finite_numbers(again));
  make_meshes();

  /* Failures leave the result as it was. */
  memcpy(again, result, sizeof result);
  fan[5] = P;
  CHECK(npt_run(transfer, &identity, &small_pose, again, NULL) == NPT_BAD_INPUT);
  CHECK(strcmp(npt_last_error(), "small.obj: triangle 1: found vertex 60, expected a number below 60") == 0);
  make_meshes();
  identity.vertices = 0;
  CHECK(npt_run(transfer, &identity, &pose, again, NULL) == NPT_BAD_INPUT);
  identity.vertices = SIZE_MAX;
  CHECK(npt_run(transfer, &identity, &pose, again, NULL) == NPT_BAD_ARGUMENT);
  make_meshes();
  CHECK(npt_run(NULL, &identity, &pose, again, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_run(transfer, NULL, &pose, again, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_run(transfer, &identity, &pose, NULL, NULL) == NPT_BAD_ARGUMENT);
  identity.xyz = NULL;
  CHECK(npt_run(transfer, &identity, &pose, again, NULL) == NPT_BAD_ARGUMENT);
  CHECK(same(result, again));
  make_meshes();
  pose_xyz[7] = NAN;
  CHECK(npt_run(transfer, &identity, &pose, again, NULL) == NPT_OK);
  CHECK(!finite_numbers(again));
  make_meshes();
  npt_close(transfer);
  npt_close(NULL);
}

/* Random weights estimate no body: the network makes results, and there is no skeleton and no joint. */
static void by_network(const npt_transfer* transfer, const npt_character* own, const npt_pose* posed) {
  const npt_skeleton* skeleton = NULL;
  npt_result report = {sizeof report};
  npt_measures measures = {sizeof measures};
  npt_estimate estimate = {sizeof estimate};
  npt_joint_pose joints = {sizeof joints};
  npt_mesh mesh = {sizeof mesh};
  double motions[NPT_JOINTS * 12];
  CHECK(npt_report(transfer, own, posed, &report) == NPT_OK);
  CHECK(report.method == NPT_NETWORK && report.warning_count == 0);
  CHECK(report.confidence == -1 && report.character_confidence == -1 && report.pose_confidence == -1);
  CHECK(npt_report(transfer, own, posed, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_measure(transfer, own, posed, identity_xyz, &measures) == NPT_OK);
  CHECK(measures.common_stretch == 1 && measures.largest_stretch <= 1 && measures.stretched_vertex < V);
  CHECK(measures.penetration == 0 && measures.character_coverage == -1 && measures.pose_coverage == -1);
  CHECK(npt_measure(transfer, own, posed, NULL, &measures) == NPT_BAD_ARGUMENT);
  measures.size = 8;
  CHECK(npt_measure(transfer, own, posed, identity_xyz, &measures) == NPT_BAD_ARGUMENT);
  report.size = 8;
  CHECK(npt_report(transfer, own, posed, &report) == NPT_BAD_ARGUMENT);
  CHECK(npt_apply(transfer, own, posed, again, &report) == NPT_BAD_ARGUMENT);
  CHECK(npt_character_estimate(own, &estimate) == NPT_OK);
  CHECK(!estimate.recognised && estimate.confidence == -1 && strcmp(estimate.domain, "") == 0);
  CHECK(npt_pose_estimate(posed, &estimate) == NPT_OK);
  CHECK(!estimate.recognised && estimate.confidence == -1 && estimate.warning_count == 0);
  estimate.size = 0;
  CHECK(npt_pose_estimate(posed, &estimate) == NPT_BAD_ARGUMENT);
  CHECK(npt_character_mesh(own, &mesh) == NPT_OK);
  CHECK(mesh.vertices == V && mesh.triangle_count == V - 2 && same(mesh.xyz, identity_xyz));
  CHECK(memcmp(mesh.triangles, fan, sizeof fan) == 0 && strcmp(mesh.name, "identity") == 0);
  CHECK(npt_character_joints(own, &joints) == NPT_BAD_INPUT);
  CHECK(npt_last_error_code() == NPT_ERROR_NEEDS_RECOGNITION);
  CHECK(npt_pose_joints(posed, &joints) == NPT_BAD_INPUT);
  CHECK(npt_open_skeleton(own, &skeleton) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "found a character that is not recognised") != NULL);
  CHECK(npt_open_skeleton(own, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_last_error_code() == NPT_ERROR_ARGUMENT);
  npt_close_skeleton(NULL);
  CHECK(npt_move_joints(transfer, own, posed, motions) == NPT_BAD_INPUT);
  CHECK(npt_move_joints(transfer, own, posed, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_character_save(own, "character.npt") == NPT_BAD_INPUT);
  CHECK(npt_last_error_code() == NPT_ERROR_NEEDS_RECOGNITION);
  CHECK(npt_character_save(own, NULL) == NPT_BAD_ARGUMENT);
}

static void tracked(const npt_transfer* transfer, const npt_character* own) {
  npt_tracker* tracker = NULL;
  const npt_pose* frame = NULL;
  size_t tries[NPT_MOST_TRIES];
  CHECK(npt_open_tracker(transfer, &tracker) == NPT_OK);
  CHECK(npt_next_pose(tracker, &pose, V, &frame) == NPT_OK);
  CHECK(npt_apply(transfer, own, frame, again, NULL) == NPT_OK);
  CHECK(same(result, again));
  npt_restart_tracker(tracker);
  CHECK(npt_start_tracker(tracker, &pose, &identity, 1, V, &frame) == NPT_OK);
  CHECK(npt_apply(transfer, own, frame, again, NULL) == NPT_OK);
  CHECK(same(result, again));
  CHECK(npt_start_tracker(tracker, &pose, NULL, 1, V, &frame) == NPT_BAD_ARGUMENT);
  CHECK(npt_next_pose(tracker, NULL, V, &frame) == NPT_BAD_ARGUMENT);
  CHECK(npt_next_pose(NULL, &pose, V, &frame) == NPT_BAD_ARGUMENT);
  CHECK(npt_open_tracker(transfer, NULL) == NPT_BAD_ARGUMENT);
  npt_close_tracker(tracker);
  npt_close_tracker(NULL);
  npt_restart_tracker(NULL);
  CHECK(npt_frames_to_try(0, tries) == 0 && npt_frames_to_try(1, tries) == 0);
  CHECK(npt_frames_to_try(20, tries) == 3 && tries[0] == 5 && tries[1] == 10 && tries[2] == 15);
  CHECK(npt_frames_to_try(20, NULL) == 3);
}

/* Characters, poses and trackers give npt_run's numbers, with every option. */
static void prepared(void) {
  npt_transfer *transfer = NULL, *other = NULL;
  npt_character* own = NULL;
  npt_pose* posed = NULL;
  npt_options options = {sizeof options};
  CHECK(npt_default_options(&options) == NPT_OK);
  options.threads = 1;
  options.network.pairings = 2;
  options.network.mirror = 1;
  options.network.invariant = 1;
  options.seed = 5;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_OK);
  CHECK(strcmp(npt_describe(transfer), "bottleneck 64, conv_relu, per-vertex, 2 pairings, mirrored") == 0);
  CHECK(npt_run(transfer, &identity, &pose, result, NULL) == NPT_OK);
  CHECK(npt_prepare_character(transfer, &identity, NULL, &own) == NPT_OK);
  CHECK(npt_prepare_pose(transfer, &pose, V, NULL, &posed) == NPT_OK);
  CHECK(npt_apply(transfer, own, posed, again, NULL) == NPT_OK);
  CHECK(same(result, again));
  CHECK(npt_apply(transfer, own, NULL, again, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_prepare_character(transfer, NULL, NULL, &own) == NPT_BAD_ARGUMENT);
  CHECK(npt_prepare_pose(transfer, &pose, V, NULL, NULL) == NPT_BAD_ARGUMENT);
  tracked(transfer, own);
  CHECK(npt_open_random(64, 0, 1, &options, &other) == NPT_OK);
  CHECK(npt_apply(other, own, posed, again, NULL) == NPT_BAD_INPUT);
  CHECK(npt_last_error_code() == NPT_ERROR_FOREIGN);
  npt_close(other);
  npt_release_pose(posed);
  npt_release_character(own);
  CHECK(npt_prepare(transfer, &identity, &pose, &own, &posed) == NPT_OK);
  CHECK(npt_apply(transfer, own, posed, again, NULL) == NPT_OK);
  CHECK(same(result, again));
  CHECK(npt_prepare(transfer, &identity, NULL, &own, &posed) == NPT_BAD_ARGUMENT);
  by_network(transfer, own, posed);
  npt_release_pose(posed);
  CHECK(npt_prepare_pose(transfer, &pose, V - 1, NULL, &posed) == NPT_OK);
  CHECK(npt_apply(transfer, own, posed, again, NULL) == NPT_BAD_INPUT); /* for other characters */
  npt_release_pose(posed);
  npt_release_character(own);
  npt_close(transfer);
  npt_release_character(NULL);
  npt_release_pose(NULL);
}

static void vertex_counts(void) {
  npt_transfer* transfer = NULL;
  npt_options options = {sizeof options};
  CHECK(npt_default_options(&options) == NPT_OK);
  /* The pooled feature takes pose meshes of any vertex count; the order of its vertices hardly matters. */
  options.network.resample = 0;
  CHECK(npt_open_random(64, 1, 1, &options, &transfer) == NPT_OK);
  CHECK(npt_run(transfer, &identity, &small_pose, again, NULL) == NPT_OK);
  CHECK(finite_numbers(again));
  npt_close(transfer);
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_OK);
  CHECK(npt_run(transfer, &identity, &small_pose, again, NULL) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "small.obj: found 60 vertices, expected 100") != NULL);
  npt_close(transfer);
}

static void texts(void) {
  const npt_warning warning = {NPT_WARNING_LOW_CONFIDENCE, NPT_POSE, 0.66, NPT_REMEDY_LOOK_AT_RESULT, NULL};
  const char* text = npt_warning_text(&warning, "hero.glb", "walk.glb");
  CHECK(strcmp(text, "walk.glb is recognised as a body with a low confidence of 66 %") == 0);
  CHECK(strstr(npt_warning_text(&warning, NULL, NULL), "pose is recognised") != NULL);
  CHECK(strcmp(npt_warning_text(NULL, NULL, NULL), "") == 0);
  CHECK(strcmp(npt_remedy_text(NPT_REMEDY_LOOK_AT_RESULT), "look at the result before using it") == 0);
  CHECK(strcmp(npt_remedy_text(NPT_REMEDY_NONE), "") == 0);
}

static void openings(const char* weights_of_16) {
  npt_transfer* transfer = NULL;
  npt_options options = {sizeof options};
  CHECK(npt_default_options(&options) == NPT_OK);
  CHECK(npt_open_random(65, 0, 1, NULL, &transfer) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "expected bottleneck 64, 128, 256, 512 or 1024") != NULL);
  options.threads = -1;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_BAD_ARGUMENT);
  npt_default_options(&options);
  options.method = (npt_method)3;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_BAD_ARGUMENT);
  npt_default_options(&options);
  options.body.least_confidence = NAN;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_BAD_ARGUMENT);
  npt_default_options(&options);
  options.network.pairings = 0;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_BAD_INPUT);
  CHECK(npt_last_error_code() == NPT_ERROR_BAD_INPUT);
  npt_default_options(&options);
  options.method = NPT_BODY; /* which random weights don't have */
  options.version = NPT_OPTIONS_VERSION + 1;
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_BAD_ARGUMENT);
  options = (npt_options){0};
  CHECK(npt_open_random(64, 0, 1, &options, &transfer) == NPT_BAD_ARGUMENT);
  CHECK(npt_open_random(64, 0, 1, NULL, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_open("does/not/exist.safetensors", NULL, &transfer) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "does/not/exist.safetensors") != NULL);
  CHECK(npt_open(weights_of_16, NULL, &transfer) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "found bottleneck 16, conv_relu, per-vertex, expected one of the networks") != NULL);
  CHECK(npt_open(NULL, NULL, &transfer) == NPT_BAD_ARGUMENT);
  CHECK(npt_open_files(NULL, 0, NULL, &transfer) == NPT_BAD_ARGUMENT);
  CHECK(transfer == NULL);
  CHECK(npt_describe(NULL) == NULL);
  options.size = 8;
  CHECK(npt_default_options(&options) == NPT_BAD_ARGUMENT);
  CHECK(npt_default_options(NULL) == NPT_BAD_ARGUMENT);
}

static int asked = 0;
static int stop(void* user) { return ++asked > *(const int*)user; }
static void progress(double done, void* user) { CHECK(done >= 0 && done <= 1 && user != NULL); }

/* What needs body estimation: stopped work, a mesh without a surface, and clips. */
static void estimating(const char* weights) {
  npt_transfer* transfer = NULL;
  npt_character* own = NULL;
  npt_pose* posed = NULL;
  npt_estimate estimate = {sizeof estimate};
  int most = 0;
  npt_control control = {sizeof control, progress, stop, &most};
  CHECK(npt_open(weights, NULL, &transfer) == NPT_OK);
  CHECK(strstr(npt_describe(transfer), "people by body estimation") != NULL);
  CHECK(npt_prepare_character(transfer, &identity, &control, &own) == NPT_STOPPED);
  CHECK(npt_last_error_code() == NPT_ERROR_STOPPED && own == NULL);
  CHECK(npt_prepare_pose(transfer, &pose, V, &control, &posed) == NPT_STOPPED && posed == NULL);
  control.size = 1;
  CHECK(npt_prepare_pose(transfer, &pose, V, &control, &posed) == NPT_BAD_ARGUMENT);
  control.size = sizeof control;
  most = 1000;
  CHECK(npt_prepare_pose(transfer, &pose, V, &control, &posed) == NPT_OK);
  CHECK(asked > 3);
  npt_release_pose(posed);
  identity.triangles = NULL, identity.triangle_count = 0;
  CHECK(npt_prepare_character(transfer, &identity, &control, &own) == NPT_OK);
  CHECK(npt_character_estimate(own, &estimate) == NPT_OK);
  CHECK(!estimate.recognised && estimate.confidence == -1 && estimate.warning_count == 1);
  CHECK(estimate.warnings[0].code == NPT_WARNING_NO_SURFACE && estimate.warnings[0].mesh == NPT_IDENTITY);
  make_meshes();
  CHECK(npt_animate_file(transfer, "none.obj", "none.obj", "out.glb", NULL, NULL, NULL) == NPT_BAD_INPUT);
  CHECK(strstr(npt_last_error(), "none.obj: found no moving scene, expected a .glb or .gltf with a clip") != NULL);
  CHECK(npt_animate_file(transfer, "none.obj", "none.glb", "out.obj", NULL, NULL, NULL) == NPT_BAD_INPUT);
  CHECK(npt_animate_file(transfer, "none.obj", "none.glb", "none/out.glb", NULL, NULL, NULL) == NPT_BAD_INPUT);
  CHECK(npt_animate_file(transfer, NULL, "none.glb", "out.glb", NULL, NULL, NULL) == NPT_BAD_ARGUMENT);
  npt_release_character(own);
  npt_close(transfer);
}

/* Every file of weights that npt ships opens, alone and together. */
static void shipped(int count, char** files) {
  npt_transfer* transfer = NULL;
  for (int i = 0; i < count; ++i) {
    CHECK(npt_open(files[i], NULL, &transfer) == NPT_OK);
    if (strstr(npt_describe(transfer), "people by body estimation") != NULL) estimating(files[i]);
    npt_close(transfer);
  }
  CHECK(npt_open_files((const char* const*)files, (size_t)count, NULL, &transfer) == NPT_OK);
  npt_close(transfer);
}

int main(int argc, char** argv) {
  CHECK(argc > 1);
  CHECK(strcmp(npt_last_error(), "") == 0 && npt_last_error_code() == NPT_ERROR_NONE);
  CHECK(strlen(npt_version()) >= 5);
  make_meshes();
  if (argc > 1) openings(argv[1]);
  transfers();
  prepared();
  vertex_counts();
  texts();
  if (argc > 2) shipped(argc - 2, argv + 2);
  return failures != 0;
}
