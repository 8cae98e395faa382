/* The C ABI's motions from C: of arrays, of files and of bytes, onto characters; every function, every kind of failure. */
#include <npt_c.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define CHECK(condition)                                              \
  do {                                                                \
    if (!(condition)) {                                               \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      ++failures;                                                     \
    }                                                                 \
  } while (0)

/* A person in a T pose, 1.7 m tall; parents before children, and not depth first. */
enum { J = 22, FRAMES = 16 };
static const char* const names[J] = {
    "Hips",     "Spine",     "LeftUpLeg",   "RightUpLeg",   "Spine1",        "LeftLeg",     "RightLeg",     "Spine2",
    "LeftFoot", "RightFoot", "Neck",        "LeftShoulder", "RightShoulder", "LeftToeBase", "RightToeBase", "Head",
    "LeftArm",  "RightArm",  "LeftForeArm", "RightForeArm", "LeftHand",      "RightHand"};
static const int32_t parents[J] = {-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 7, 7, 8, 9, 10, 11, 12, 16, 17, 18, 19};
static const float places[J][3] = {
    {0, 0.95F, 0},      {0, 0.1F, 0},       {0.1F, -0.05F, 0},  {-0.1F, -0.05F, 0}, {0, 0.12F, 0}, {0, -0.42F, 0},
    {0, -0.42F, 0},     {0, 0.12F, 0},      {0, -0.4F, 0},      {0, -0.4F, 0},      {0, 0.18F, 0}, {0.06F, 0.12F, 0},
    {-0.06F, 0.12F, 0}, {0, -0.06F, 0.12F}, {0, -0.06F, 0.12F}, {0, 0.1F, 0},       {0.12F, 0, 0}, {-0.12F, 0, 0},
    {0.28F, 0, 0},      {-0.28F, 0, 0},     {0.25F, 0, 0},      {-0.25F, 0, 0}};
static float rotations[FRAMES][J][4], translations[FRAMES][J][3];
enum { LEFT_ARM = 16, LEFT_HAND = 20 };

/* The left arm sinks by 90 degrees, and the body goes 0.5 m forward. */
static void make_frames(void) {
  for (int f = 0; f < FRAMES; ++f) {
    memcpy(translations[f], places, sizeof places);
    translations[f][0][2] = 0.5F * (float)f / (FRAMES - 1);
    for (int j = 0; j < J; ++j) rotations[f][j][3] = 1;
    const double half = -0.25 * 3.14159265358979 * f / (FRAMES - 1);
    rotations[f][LEFT_ARM][2] = (float)sin(half), rotations[f][LEFT_ARM][3] = (float)cos(half);
  }
}

static npt_motion_data skeleton_data(void) {
  npt_motion_data data = {sizeof data, "figure", NULL, J, names, parents, &places[0][0]};
  return data;
}
static npt_motion_data clip_data(void) {
  npt_motion_data data = skeleton_data();
  data.clip = "sink";
  data.frames = FRAMES;
  data.translations = &translations[0][0][0];
  data.rotations = &rotations[0][0][0];
  return data;
}

static int near(double a, double b) { return fabs(a - b) < 2e-4; }
static int is_at(const float* place, double x, double y, double z) {
  return near((double)place[0], x) && near((double)place[1], y) && near((double)place[2], z);
}
static int failed_with(npt_status status, npt_status expected, const char* text) {
  const int good = status == expected && strstr(npt_last_error(), text) != NULL;
  if (!good) fprintf(stderr, "status %d: %s\n", (int)status, npt_last_error());
  return good;
}

static void described(const npt_motion* motion) {
  npt_motion_info info = {sizeof info};
  int32_t joints[NPT_ROLES];
  double confidences[NPT_ROLES];
  CHECK(npt_describe_motion(motion, &info) == NPT_OK);
  CHECK(info.joints == J && info.confidence > 0.8 && info.rest_pose == NPT_REST_T);
  for (int j = 0; j < J; ++j)
    CHECK(strcmp(info.names[j], names[j]) == 0 && info.parents[j] == parents[j] && info.nodes[j] == -1);
  CHECK(strcmp(info.clip, "sink") == 0 && near(info.length, 0.5) && info.rate == 30);
  CHECK(info.clip_count == 1 && strcmp(info.clips[0], "sink") == 0);
  CHECK(info.unit == 1 && strcmp(info.up, "y") == 0 && info.base[1][1] == 1 && info.base[1][3] == 0);
  CHECK(info.root_joint == 0 && near(info.root_shift[2], 0.5));
  CHECK(npt_motion_roles(motion, joints, confidences) == NPT_OK);
  int found = 0;
  for (int r = 0; r < NPT_ROLES; ++r) {
    CHECK((joints[r] < 0) == (confidences[r] == 0));
    if (strcmp(npt_role_name(r), "hips") == 0 && joints[r] == 0) ++found;
    if (strcmp(npt_role_name(r), "leftHand") == 0 && joints[r] == LEFT_HAND) ++found;
  }
  CHECK(found == 2);
  CHECK(npt_role_name(-1) == NULL && npt_role_name(NPT_ROLES) == NULL);
  CHECK(npt_motion_roles(motion, NULL, NULL) == NPT_OK);
  CHECK(npt_motion_roles(NULL, joints, confidences) == NPT_BAD_ARGUMENT);
  CHECK(npt_describe_motion(motion, NULL) == NPT_BAD_ARGUMENT);
  info.size = 8;
  CHECK(npt_describe_motion(motion, &info) == NPT_BAD_ARGUMENT);
}

static void sampled(const npt_motion* motion) {
  static float moved[FRAMES][J][3], turned[FRAMES][J][4], positions[FRAMES][J][3];
  npt_motion_frames frames = {sizeof frames, &moved[0][0][0], &turned[0][0][0], NULL, &positions[0][0][0]};
  double times[FRAMES];
  size_t count = 0;
  CHECK(npt_frame_times(motion, 0, &count, NULL) == NPT_OK);
  CHECK(count == FRAMES);
  CHECK(npt_frame_times(motion, 0, &count, times) == NPT_OK);
  CHECK(times[0] == 0 && near(times[FRAMES - 1], 0.5));
  CHECK(npt_sample_motion(motion, times, count, &frames) == NPT_OK);
  CHECK(is_at(positions[0][LEFT_HAND], 0.71, 1.41, 0));
  CHECK(is_at(positions[FRAMES - 1][LEFT_HAND], 0.18, 0.88, 0.5));
  CHECK(is_at(moved[FRAMES - 1][0], 0, 0.95, 0.5) && is_at(moved[3][5], 0, -0.42, 0));
  CHECK(near((double)turned[FRAMES - 1][LEFT_ARM][2], -sqrt(0.5)));
  CHECK(npt_sample_motion(motion, NULL, 1, &frames) == NPT_OK);
  CHECK(is_at(positions[0][LEFT_HAND], 0.71, 1.41, 0));
  CHECK(npt_frame_times(motion, 8, &count, NULL) == NPT_OK);
  CHECK(count == 5);
  CHECK(npt_sample_motion(motion, NULL, 2, &frames) == NPT_BAD_ARGUMENT);
  times[1] = NAN;
  CHECK(npt_sample_motion(motion, times, 2, &frames) == NPT_BAD_ARGUMENT);
  CHECK(npt_sample_motion(motion, times, 1, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_frame_times(motion, -1, &count, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_frame_times(motion, 0, NULL, NULL) == NPT_BAD_ARGUMENT);
}

static void refused_arrays(void) {
  npt_motion* motion = NULL;
  npt_motion_data data = clip_data();
  data.size = 1;
  CHECK(npt_make_motion(&data, NULL, &motion) == NPT_BAD_ARGUMENT);
  data = clip_data();
  data.joints = 0;
  CHECK(npt_make_motion(&data, NULL, &motion) == NPT_BAD_ARGUMENT);
  data = clip_data();
  data.frames = SIZE_MAX;
  CHECK(npt_make_motion(&data, NULL, &motion) == NPT_BAD_ARGUMENT);
  data = clip_data();
  int32_t ring[J];
  memcpy(ring, parents, sizeof ring);
  ring[1] = 4;
  data.parents = ring;
  CHECK(failed_with(npt_make_motion(&data, NULL, &motion), NPT_BAD_INPUT,
                    "figure: joint 'Spine': found parent 4, expected -1 or a joint before it"));
  data = clip_data();
  rotations[3][2][3] = 0;
  CHECK(failed_with(npt_make_motion(&data, NULL, &motion), NPT_BAD_INPUT,
                    "figure: joint 'LeftUpLeg', frame 3: found a rotation that is none"));
  rotations[3][2][3] = 1;
  translations[3][0][1] = NAN;
  CHECK(failed_with(npt_make_motion(&data, NULL, &motion), NPT_BAD_INPUT, "figure: joint 'Hips'"));
  make_frames();
  const double back[FRAMES] = {0.2, 0.1};
  data.times = back;
  CHECK(failed_with(npt_make_motion(&data, NULL, &motion), NPT_BAD_INPUT, "times from 0 on that ascend"));
  data = clip_data();
  CHECK(failed_with(npt_make_motion(&data, "hips Tail\n", &motion), NPT_BAD_INPUT, "no joint 'Tail'"));
  CHECK(npt_make_motion(NULL, NULL, &motion) == NPT_BAD_ARGUMENT &&
        npt_make_motion(&data, NULL, NULL) == NPT_BAD_ARGUMENT);
  CHECK(motion == NULL);
  npt_release_motion(NULL);
}

/* A skeleton that is no person's can be looked at, and put on nobody. */
static void no_person(const npt_motion* figure) {
  npt_motion *chain = NULL, *result = NULL;
  npt_motion_info info = {sizeof info};
  npt_motion_data data = clip_data();
  int32_t above[J];
  const char* links[J];
  for (int j = 0; j < J; ++j) above[j] = j - 1, links[j] = "link";
  data.parents = above, data.names = links;
  CHECK(npt_make_motion(&data, NULL, &chain) == NPT_OK);
  CHECK(npt_describe_motion(chain, &info) == NPT_OK);
  CHECK(info.joints == J && info.confidence < 0.3 && info.rest_pose == NPT_REST_OTHER);
  CHECK(failed_with(npt_transfer_motion(figure, chain, NULL, &result, NULL), NPT_BAD_INPUT,
                    "figure: found a skeleton that is not recognised as a person's"));
  CHECK(npt_last_error_code() == NPT_ERROR_NOT_RECOGNISED);
  CHECK(npt_transfer_motion(chain, figure, NULL, &result, NULL) == NPT_BAD_INPUT && result == NULL);
  npt_release_motion(chain);
}

static void transferred(const npt_motion* clip) {
  npt_motion *hero = NULL, *result = NULL;
  npt_motion_report report = {sizeof report};
  npt_motion_options options = {sizeof options};
  npt_motion_frames frames = {sizeof frames};
  float positions[J][3];
  const double end = 0.5;
  npt_motion_data data = skeleton_data();
  const double twice[3][4] = {{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 2, 0}};
  data.base = &twice[0][0];
  CHECK(npt_make_motion(&data, NULL, &hero) == NPT_OK);
  CHECK(npt_default_motion_options(&options) == NPT_OK);
  options.foot_lock = 0, options.clearance = 0, options.touch = 0, options.key_tolerance = 0;
  options.clip_name = "mine";
  CHECK(npt_transfer_motion(hero, clip, &options, &result, &report) == NPT_OK);
  CHECK(report.clips == 1 && report.confidence > 0.8 && report.warning_count == 0);
  frames.positions = &positions[0][0];
  CHECK(npt_sample_motion(result, &end, 1, &frames) == NPT_OK);
  CHECK(is_at(positions[LEFT_HAND], 0.36, 1.76, 1)); /* twice as large, and as far */
  npt_motion_info info = {sizeof info};
  CHECK(npt_describe_motion(result, &info) == NPT_OK);
  CHECK(strcmp(info.clip, "mine") == 0 && near(info.unit, 2) && strcmp(info.names[LEFT_HAND], "LeftHand") == 0);

  npt_motion* pose = NULL;
  options.time = 0.5;
  CHECK(npt_transfer_motion(hero, clip, &options, &pose, NULL) == NPT_OK);
  CHECK(npt_describe_motion(pose, &info) == NPT_OK);
  CHECK(info.length == 0);
  npt_release_motion(pose);
  options.time = 9;
  CHECK(failed_with(npt_transfer_motion(hero, clip, &options, &pose, NULL), NPT_BAD_INPUT, "the clip's length"));

  options.time = -1, options.clearance = 2;
  CHECK(npt_transfer_motion(hero, clip, &options, &pose, NULL) == NPT_BAD_ARGUMENT);
  options.clearance = 1, options.apply = 1;
  CHECK(npt_transfer_motion(hero, clip, &options, &pose, NULL) == NPT_BAD_ARGUMENT);
  options.apply = 0, options.version = 0;
  CHECK(npt_transfer_motion(hero, clip, &options, &pose, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_default_motion_options(NULL) == NPT_BAD_ARGUMENT);
  CHECK(failed_with(npt_transfer_motion(clip, hero, NULL, &pose, NULL), NPT_BAD_INPUT, "a skeleton without a clip"));
  report.size = 0;
  CHECK(npt_transfer_motion(hero, clip, NULL, &pose, &report) == NPT_BAD_ARGUMENT);
  CHECK(npt_transfer_motion(NULL, clip, NULL, &pose, NULL) == NPT_BAD_ARGUMENT);
  /* No file to write it into. */
  const npt_bytes* bytes = NULL;
  CHECK(failed_with(npt_write_motion(result, "none.glb"), NPT_BAD_INPUT, "a character that is no file of a rig"));
  CHECK(npt_write_motion(clip, "none.glb") == NPT_BAD_ARGUMENT);
  CHECK(failed_with(npt_write_motion(result, "none.fbx"), NPT_BAD_INPUT, ".glb, .gltf, .vrm or .bvh"));
  CHECK(npt_motion_bytes(result, (npt_motion_format)7, &bytes) == NPT_BAD_ARGUMENT);
  CHECK(npt_motion_bytes(NULL, NPT_FORMAT_BVH, &bytes) == NPT_BAD_ARGUMENT && bytes == NULL);
  npt_release_motion(result);
  npt_release_motion(hero);
}

static void warned(const npt_motion* clip) {
  npt_motion *hero = NULL, *result = NULL;
  npt_motion_report report = {sizeof report};
  npt_motion_data data = skeleton_data();
  CHECK(npt_make_motion(&data, "leftLowerArm -\n", &hero) == NPT_OK);
  CHECK(npt_transfer_motion(hero, clip, NULL, &result, &report) == NPT_OK);
  CHECK(report.warning_count == 1);
  CHECK(report.warnings[0].code == NPT_MOTION_JOINTS_MISSING && report.warnings[0].skeleton == NPT_IDENTITY);
  for (int r = 0; r < NPT_ROLES; ++r)
    CHECK((report.warnings[0].roles >> r & 1) == (strcmp(npt_role_name(r), "leftLowerArm") == 0));
  CHECK(strstr(npt_motion_warning_text(&report.warnings[0], "hero.glb", NULL),
               "hero.glb has no joint for leftLowerArm") != NULL);
  CHECK(strcmp(npt_motion_warning_text(NULL, NULL, NULL), "") == 0);
  npt_release_motion(result);
  npt_release_motion(hero);
}

/* The figure as a glTF document: nodes alone. */
static char document[8192];
static void make_document(void) {
  int at = sprintf(document, "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[");
  for (int j = 0; j < J; ++j) {
    at += sprintf(document + at, "%s{\"name\":\"%s\",\"translation\":[%g,%g,%g]", j == 0 ? "" : ",", names[j],
                  (double)places[j][0], (double)places[j][1], (double)places[j][2]);
    int children = 0;
    for (int c = 0; c < J; ++c)
      if (parents[c] == j) at += sprintf(document + at, "%s%d", children++ == 0 ? ",\"children\":[" : ",", c);
    at += sprintf(document + at, "%s}", children == 0 ? "" : "]");
  }
  sprintf(document + at, "],\"skins\":[{\"joints\":[0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21]}]}");
}

static int stop_at_once(void* user) { return user == NULL; }
static void count_steps(double done, void* user) {
  CHECK(done >= 0 && done <= 1);
  ++*(int*)user;
}

static void files(const npt_motion* clip) {
  npt_motion *hero = NULL, *result = NULL, *again = NULL;
  const npt_bytes *bvh = NULL, *bytes = NULL, *map = NULL;
  npt_file character = {sizeof character, NULL, document, strlen(document)};
  npt_motion_info info = {sizeof info};
  CHECK(npt_read_skeleton(&character, NULL, &hero) == NPT_OK);
  CHECK(strcmp(npt_last_notes(), "") == 0);
  CHECK(npt_describe_motion(hero, &info) == NPT_OK);
  CHECK(info.joints == J && info.clip_count == 0 && info.length == 0 && strcmp(info.clip, "") == 0);
  for (int j = 0; j < J; ++j) CHECK(strcmp(info.names[j], names[info.nodes[j]]) == 0);
  CHECK(failed_with(npt_read_motion(&character, NULL, NULL, &again), NPT_BAD_INPUT, "motion: found no clip"));

  /* The clip as BVH, and back from its bytes. */
  CHECK(npt_motion_bytes(clip, NPT_FORMAT_BVH, &bvh) == NPT_OK);
  CHECK(strncmp(bvh->data, "HIERARCHY\nROOT Hips", 19) == 0 && ((const char*)bvh->data)[bvh->count] == '\0');
  npt_file walk = {sizeof walk, "sink.bvh", bvh->data, bvh->count};
  npt_motion* read = NULL;
  CHECK(npt_read_motion(&walk, NULL, NULL, &read) == NPT_OK);
  CHECK(npt_describe_motion(read, &info) == NPT_OK);
  CHECK(info.joints == J && near(info.unit, 0.01) && info.rate == 30 && near(info.length, 0.5));

  CHECK(npt_transfer_motion(hero, read, NULL, &result, NULL) == NPT_OK);
  CHECK(npt_motion_bytes(result, NPT_FORMAT_RIG, &bytes) == NPT_OK);
  npt_file patched = {sizeof patched, NULL, bytes->data, bytes->count};
  CHECK(npt_read_motion(&patched, "motion", NULL, &again) == NPT_OK);
  CHECK(npt_describe_motion(again, &info) == NPT_OK);
  CHECK(info.joints == J && near(info.length, 0.5) && info.clip_count == 1);
  npt_release_motion(again), again = NULL;
  CHECK(npt_motion_bytes(result, NPT_FORMAT_BONE_MAP, &map) == NPT_OK);
  CHECK(strstr(map->data, "leftHand \"LeftHand\" 1\n") != NULL);
  npt_release_motion(hero), hero = NULL;
  CHECK(npt_read_skeleton(&character, map->data, &hero) == NPT_OK);

  /* Two clips into one file, of which the second has the first one's name. */
  const npt_motion* both[2] = {result, result};
  CHECK(npt_write_motions(both, 2, "two.gltf") == NPT_OK);
  CHECK(strstr(npt_last_notes(), "'motion_2'") != NULL);
  npt_file two = {sizeof two, "two.gltf", NULL, 0};
  CHECK(failed_with(npt_read_motion(&two, NULL, NULL, &again), NPT_BAD_INPUT,
                    "found 2 clips, expected the name of one of them: 'motion', 'motion_2'"));
  CHECK(npt_read_motion(&two, "motion_2", NULL, &again) == NPT_OK);
  npt_release_motion(again), again = NULL;
  CHECK(failed_with(npt_read_motion(&two, "run", NULL, &again), NPT_BAD_INPUT, "no clip 'run'"));
  CHECK(npt_write_motions(both, 2, "two.bvh") == NPT_BAD_INPUT);
  CHECK(npt_write_motion(result, "one.bvh") == NPT_OK);
  CHECK(failed_with(npt_write_motion(result, "one.glb"), NPT_BAD_INPUT, ".gltf, as the character is"));
  CHECK(npt_write_motions(NULL, 1, "two.gltf") == NPT_BAD_ARGUMENT &&
        npt_write_motions(both, 0, "a.gltf") == NPT_BAD_ARGUMENT);

  /* From files to a file. */
  npt_file one = {sizeof one, "one.bvh", NULL, 0};
  npt_motion_report report = {sizeof report};
  int steps = 0;
  npt_control control = {sizeof control, count_steps, NULL, &steps};
  CHECK(npt_transfer_motion_file(&two, &one, "three.gltf", NULL, &control, &report) == NPT_OK);
  CHECK(report.clips == 1 && report.confidence > 0.8 && steps >= 4);
  npt_file three = {sizeof three, "three.gltf", NULL, 0};
  CHECK(npt_read_motion(&three, "one", NULL, &again) == NPT_OK);
  npt_release_motion(again), again = NULL;
  CHECK(npt_transfer_motion_file(&character, &two, "four.gltf", NULL, NULL, &report) == NPT_OK);
  CHECK(report.clips == 2);
  npt_motion_options options = {sizeof options};
  npt_default_motion_options(&options);
  options.clip = "motion", options.time = 0.25, options.apply = 1;
  CHECK(npt_transfer_motion_file(&character, &two, "posed.gltf", &options, NULL, NULL) == NPT_OK);
  npt_file posed = {sizeof posed, "posed.gltf", NULL, 0};
  CHECK(failed_with(npt_read_motion(&posed, NULL, NULL, &again), NPT_BAD_INPUT, "found no clip"));
  control.stop = stop_at_once, control.user = NULL, control.progress = NULL;
  CHECK(npt_transfer_motion_file(&two, &one, "stopped.gltf", NULL, &control, NULL) == NPT_STOPPED);
  CHECK(npt_last_error_code() == NPT_ERROR_STOPPED);
  CHECK(
      failed_with(npt_transfer_motion_file(&two, &one, "one.bvh", NULL, NULL, NULL), NPT_BAD_INPUT, "the clip's file"));
  CHECK(npt_transfer_motion_file(&two, NULL, "x.gltf", NULL, NULL, NULL) == NPT_BAD_ARGUMENT);
  CHECK(npt_transfer_motion_file(&two, &one, NULL, NULL, NULL, NULL) == NPT_BAD_ARGUMENT);

  const char* const made[] = {"two.gltf", "one.bvh", "three.gltf", "four.gltf", "posed.gltf"};
  for (size_t i = 0; i < sizeof made / sizeof *made; ++i) CHECK(remove(made[i]) == 0);
  npt_close_bytes(map), npt_close_bytes(bytes), npt_close_bytes(bvh), npt_close_bytes(NULL);
  npt_release_motion(read), npt_release_motion(result), npt_release_motion(hero);
}

static void refused_files(void) {
  npt_motion* motion = NULL;
  npt_file file = {sizeof file, "none.bvh", NULL, 0};
  CHECK(failed_with(npt_read_motion(&file, NULL, NULL, &motion), NPT_BAD_INPUT, "none.bvh"));
  file.path = "walk.mp4";
  CHECK(failed_with(npt_read_motion(&file, NULL, NULL, &motion), NPT_BAD_INPUT, "walk.mp4: found extension '.mp4'"));
  file.path = "walk.fbx";
  CHECK(npt_read_skeleton(&file, NULL, &motion) == NPT_BAD_INPUT);
  CHECK(npt_reads_fbx() || strstr(npt_last_error(), "built with assimp") != NULL);
  file.bytes = "Kaydara FBX Binary", file.byte_count = 18;
  CHECK(failed_with(npt_read_skeleton(&file, NULL, &motion), NPT_BAD_INPUT,
                    "the bytes of an FBX file, expected its path"));
  file.bytes = "\xFF", file.byte_count = 1;
  CHECK(failed_with(npt_read_skeleton(&file, NULL, &motion), NPT_BAD_INPUT, "bytes of no known format"));
  file.byte_count = 0;
  CHECK(npt_read_skeleton(&file, NULL, &motion) == NPT_BAD_INPUT);
  file.path = NULL, file.bytes = NULL;
  CHECK(npt_read_motion(&file, NULL, NULL, &motion) == NPT_BAD_ARGUMENT);
  file.size = 0;
  CHECK(npt_read_motion(&file, NULL, NULL, &motion) == NPT_BAD_ARGUMENT);
  CHECK(npt_read_motion(NULL, NULL, NULL, &motion) == NPT_BAD_ARGUMENT && motion == NULL);
}

/* Random weights recognise nobody. */
static void no_body(void) {
  npt_transfer* transfer = NULL;
  npt_character* character = NULL;
  npt_motion* motion = NULL;
  float xyz[3 * J];
  memcpy(xyz, places, sizeof xyz);
  npt_mesh mesh = {sizeof mesh, xyz, J, NULL, 0, NULL};
  CHECK(npt_open_random(64, 0, 1, NULL, &transfer) == NPT_OK);
  CHECK(npt_prepare_character(transfer, &mesh, NULL, &character) == NPT_OK);
  CHECK(npt_motion_of_character(transfer, character, NPT_VRM, &motion) == NPT_BAD_INPUT && motion == NULL);
  CHECK(npt_motion_of_character(transfer, NULL, NPT_VRM, &motion) == NPT_BAD_ARGUMENT);
  CHECK(npt_motion_of_character(transfer, character, (npt_joint_names)9, &motion) == NPT_BAD_ARGUMENT);
  npt_release_character(character);
  npt_close(transfer);
}

int main(void) {
  npt_motion* clip = NULL;
  npt_motion_data data = clip_data();
  make_frames();
  make_document();
  CHECK(npt_make_motion(&data, NULL, &clip) == NPT_OK);
  if (clip == NULL) return 1;
  described(clip);
  sampled(clip);
  refused_arrays();
  no_person(clip);
  transferred(clip);
  warned(clip);
  files(clip);
  refused_files();
  no_body();
  npt_release_motion(clip);
  if (failures == 0) puts("npt_c.h's motions: all checks passed");
  return failures != 0;
}
