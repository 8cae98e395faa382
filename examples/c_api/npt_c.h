/* npt behind a C ABI: what a tool written in C, Python, C#, Rust or anything else with a foreign function interface
 * calls.
 *
 *   npt_transfer* transfer = NULL;
 *   if (npt_open("human.safetensors", NULL, &transfer) != NPT_OK) puts(npt_last_error());
 *   npt_mesh identity = {sizeof identity, xyz, vertices, triangles, triangle_count, "hero"}, pose = {...};
 *   npt_result result = {sizeof result};
 *   npt_run(transfer, &identity, &pose, posed_xyz, &result);
 *   for (size_t i = 0; i < result.warning_count; ++i) puts(npt_warning_text(&result.warnings[i], "hero", "pose"));
 *   npt_close(transfer);
 *
 * Every function that can fail returns a status. npt_last_error() then says what went wrong, in the thread that it
 * went wrong in, and outputs are as they were. No exception leaves the library. Memory that is passed in stays the
 * caller's and is not kept after the call.
 *
 * A struct whose first member is `size` wants its own sizeof there, so that later versions can have more members.
 */
#ifndef NPT_C_H
#define NPT_C_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(_WIN32) && defined(NPT_C_BUILDING)
#define NPT_C_API __declspec(dllexport)
#elif defined(_WIN32) && !defined(NPT_C_STATIC)
#define NPT_C_API __declspec(dllimport)
#elif defined(__GNUC__)
#define NPT_C_API __attribute__((visibility("default")))
#else
#define NPT_C_API
#endif

/* ---- Errors and warnings ---- */

typedef enum npt_status {
  NPT_OK = 0,
  NPT_BAD_ARGUMENT = 1, /* a null pointer, a wrong size of a struct, or a value that can't be */
  NPT_BAD_INPUT = 2,    /* a file or a mesh that can't be used; the message says what was found and expected */
  NPT_NO_MEMORY = 3,
  NPT_INTERNAL = 4, /* a mistake in the library */
  NPT_STOPPED = 5   /* npt_control.stop asked for it */
} npt_status;

/* What kind of fault the last failure was, for programs that act on it. */
typedef enum npt_error_code {
  NPT_ERROR_NONE = 0,          /* no failure yet */
  NPT_ERROR_BAD_INPUT = 1,     /* a file, a mesh or an argument that can't be used */
  NPT_ERROR_NOT_RECOGNISED,    /* a mesh isn't recognised in the domain of the weights */
  NPT_ERROR_UNKNOWN_UNIT,      /* the network needs the mesh's unit, and its size doesn't tell it */
  NPT_ERROR_MISSING_WEIGHTS,   /* weights that the opened ones go with are missing */
  NPT_ERROR_FOREIGN,           /* something that another transfer prepared */
  NPT_ERROR_DOMAINS_DIFFER,    /* a character of one domain and a pose of another */
  NPT_ERROR_NEEDS_RECOGNITION, /* what is asked for exists for recognised meshes only */
  NPT_ERROR_STOPPED,           /* the caller asked to stop */
  NPT_ERROR_ARGUMENT = 100,    /* NPT_BAD_ARGUMENT */
  NPT_ERROR_MEMORY = 101,      /* NPT_NO_MEMORY */
  NPT_ERROR_INTERNAL = 102     /* NPT_INTERNAL */
} npt_error_code;

/* What a user can do about an error or a warning. A program says it with its own options. */
typedef enum npt_remedy {
  NPT_REMEDY_NONE = 0,
  NPT_REMEDY_LOOK_AT_RESULT, /* look at the result before using it */
  NPT_REMEDY_CHOOSE_METHOD,  /* ask for one method: NPT_BODY or NPT_NETWORK */
  NPT_REMEDY_GIVE_UNIT,      /* say the meshes' unit: npt_import_options.unit */
  NPT_REMEDY_GIVE_WEIGHTS    /* put the missing weights beside the others, or use NPT_NETWORK */
} npt_remedy;

typedef enum npt_warning_code {
  NPT_WARNING_NOT_RECOGNISED = 0,  /* not recognised in any domain of the weights: left to the network */
  NPT_WARNING_LOW_CONFIDENCE,      /* recognised, but with a confidence below npt_body_options.high_confidence */
  NPT_WARNING_NO_SURFACE,          /* no triangle has an area, so no body was estimated: left to the network */
  NPT_WARNING_UPSIDE_DOWN,         /* the body stands on its head */
  NPT_WARNING_LYING,               /* the body lies or is bent over */
  NPT_WARNING_LYING_OR_Z_UP,       /* the body lies, or the mesh's vertical axis is z */
  NPT_WARNING_ARMS_UNCERTAIN,      /* an arm, of animals a foreleg, may be in the wrong place */
  NPT_WARNING_LEGS_UNCERTAIN,      /* a leg, of animals a hindleg, may be in the wrong place */
  NPT_WARNING_UNUSUAL_PROPORTIONS, /* no body of the kind has these proportions */
  NPT_WARNING_FACES_INWARD,        /* the mesh's faces are turned inwards */
  NPT_WARNING_UNIT_ASSUMED,        /* a unit other than metres was inferred from the mesh's size */
  NPT_WARNING_PART_OF_MESH         /* the body is some pieces of the mesh; the others stay where they are */
} npt_warning_code;

/* Which mesh of a pair something is said of. */
typedef enum npt_mesh_role { NPT_IDENTITY = 0, NPT_POSE = 1 } npt_mesh_role;

typedef struct npt_warning {
  npt_warning_code code;
  npt_mesh_role mesh;
  double value; /* a confidence from 0 to 1, or metres in one unit (NPT_WARNING_UNIT_ASSUMED); else 0 */
  npt_remedy remedy;
  const void* words; /* what npt_warning_text calls the body and its limbs; NULL: a body */
} npt_warning;
#define NPT_MOST_WARNINGS 16

/* What the last failure in this thread was: UTF-8, valid until the next one. Empty before the first. */
NPT_C_API const char* npt_last_error(void);
/* Its kind, and what a user can do about it. */
NPT_C_API npt_error_code npt_last_error_code(void);
NPT_C_API npt_remedy npt_last_remedy(void);

/* What a warning says in plain English, without its remedy: UTF-8, valid until this thread's next call of this or the
 * next function. identity, pose: what the meshes are called; NULL: "identity", "pose". Empty for NULL. */
NPT_C_API const char* npt_warning_text(const npt_warning* warning, const char* identity, const char* pose);
/* What a user can do, in words that name no option. Empty for NPT_REMEDY_NONE. */
NPT_C_API const char* npt_remedy_text(npt_remedy remedy);

/* Such as "1.0.0" */
NPT_C_API const char* npt_version(void);

/* ---- Meshes, options, results ---- */

/* A mesh in the caller's memory. */
typedef struct npt_mesh {
  size_t size;      /* sizeof(npt_mesh) */
  const float* xyz; /* [vertices][3] */
  size_t vertices;
  const uint32_t* triangles; /* [triangle_count][3] vertex numbers from 0; NULL: a cloud of points */
  size_t triangle_count;
  const char* name; /* stands in messages, UTF-8; NULL: "identity" or "pose" */
} npt_mesh;

/* How a transfer is made. */
typedef enum npt_method {
  NPT_AUTOMATIC = 0, /* by body estimation, which refuses what it doesn't recognise; by the pose transfer
                        network where the weights hold no body estimation */
  NPT_BODY = 1,      /* by body estimation, whatever the meshes are */
  NPT_NETWORK = 2    /* by the pose transfer network */
} npt_method;

/* How much time an estimate of a body may take. */
typedef enum npt_quality {
  NPT_FAST = 0,     /* half of the views, and fewer points of a mesh: about two thirds of the time */
  NPT_BALANCED = 1, /* the default */
  NPT_BEST = 2      /* all views of every mesh */
} npt_quality;

/* How a network with the per-vertex feature meets the vertices of pose and identity. */
typedef enum npt_pairing {
  NPT_RANDOM = 0,  /* each identity vertex with a random point of the pose mesh */
  NPT_AS_GIVEN = 1 /* by number, to compare with other implementations; the automatic method uses the network then */
} npt_pairing;

/* Body estimation. */
typedef struct npt_body_options {
  npt_quality quality;
  double least_confidence; /* 0 to 1: from this confidence on a mesh counts as recognised */
  double high_confidence;  /* 0 to 1: from this confidence on there is no warning of a low one */
  size_t figure; /* of several figures in one mesh this one, from 1 on, the one with the most vertices first; a mesh of
                    one figure is taken whole. 0: the one that is recognised */
} npt_body_options;

/* The pose transfer network. */
typedef struct npt_network_options {
  npt_pairing pairing;
  int pairings;  /* the mean over so many random pairings of vertices, at least 1; costs as many runs */
  int mirror;    /* nonzero: also transfer the mirror images, and average; twice the runs */
  int invariant; /* nonzero: permuting a mesh's vertices permutes the result bit for bit */
  int resample;  /* 0: refuse a pose mesh of another vertex count where the network pairs vertices */
} npt_network_options;

/* How meshes are understood. */
typedef struct npt_import_options {
  double unit; /* metres in one unit of the meshes; 0: inferred from their size */
} npt_import_options;

/* How transfers are done. Set `size`, then fill it with npt_default_options. */
typedef struct npt_options {
  size_t size;      /* sizeof(npt_options) */
  uint32_t version; /* NPT_OPTIONS_VERSION, set by npt_default_options */
  int threads;      /* 0: all that the process may use */
  npt_method method;
  npt_body_options body;
  npt_network_options network;
  npt_import_options import;
  int refine;           /* nonzero: give results the identity's surface detail; needs the identity's triangles */
  double refine_radius; /* detail below this fraction of the root of the mesh's area; 0: as the weights say, or 0.04 */
  uint64_t seed;        /* of every random choice */
} npt_options;
#define NPT_OPTIONS_VERSION 1

/* NPT_BAD_ARGUMENT: NULL, or a size that this library doesn't know. */
NPT_C_API npt_status npt_default_options(npt_options* options);

/* How a result was made. */
typedef struct npt_result {
  size_t size;                 /* sizeof(npt_result) */
  npt_method method;           /* NPT_BODY or NPT_NETWORK */
  double confidence;           /* the lower of both meshes', 0 to 1; -1: none, since no body was estimated */
  double character_confidence; /* 0 to 1: that it is of the kind, and that its pose was estimated rightly; -1: none */
  double pose_confidence;
  const char* kind; /* whose body made it, "person" or "four-legged animal"; "": the network. Lives with the process */
  size_t warning_count; /* 0: nothing needs to be said */
  npt_warning warnings[NPT_MOST_WARNINGS];
} npt_result;

/* What can be measured of a result without its ground truth. */
typedef struct npt_measures {
  size_t size;               /* sizeof(npt_measures) */
  double common_stretch;     /* edges of 99.9 % of the length are at most so many times as long as before */
  double largest_stretch;    /* the same of one edge; one shorter than the mean edge counts as a mean one */
  size_t stretched_vertex;   /* an end of that edge */
  double penetration;        /* fraction of the area inside another part of the mesh, and outside before */
  double character_coverage; /* fraction of the area that has its estimated body within 3 cm; -1: no body */
  double pose_coverage;
} npt_measures;

/* What was estimated for a mesh. */
typedef struct npt_estimate {
  size_t size;        /* sizeof(npt_estimate) */
  int recognised;     /* nonzero: its confidence is high enough for body estimation */
  double confidence;  /* 0 to 1; -1: none, since no body was estimated */
  double unit;        /* metres in one unit of a character's mesh, where the network asks for one; else 1 */
  const char* domain; /* of the weights that recognised it: "human"; "" without one. As long as its owner lives */
  const char*
      kind; /* what it is recognised as: "person", "four-legged animal"; "": as nothing. Lives with the process */
  size_t warning_count;
  npt_warning warnings[NPT_MOST_WARNINGS];
} npt_estimate;

#define NPT_JOINTS 40 /* the most of a skeleton: a person's has SMPL's 24, then two for each finger but the thumbs */

/* The joint angles of an estimated body: a person's in SMPL's order of joints, an animal's in that of its skeleton. */
typedef struct npt_joint_pose {
  size_t size;                      /* sizeof(npt_joint_pose) */
  size_t joints;                    /* 24 of a person */
  float axis_angles[NPT_JOINTS][3]; /* radians, each in its parent's frame; 0 beyond the joints */
  double root[3];                   /* the root joint's position, in the mesh's unit and place */
  double leg;                       /* length of a leg, hip to ankle, in the mesh's unit */
} npt_joint_pose;

/* Progress of long work, and a way to stop it: both are called in the caller's thread. Each may be NULL. */
typedef struct npt_control {
  size_t size;                               /* sizeof(npt_control) */
  void (*progress)(double done, void* user); /* done: 0 to 1 */
  int (*stop)(void* user);                   /* asked between steps; nonzero ends the work: NPT_STOPPED */
  void* user;
} npt_control;

/* ---- Opening ---- */

/* Weights, ready to run. Any number of threads may use one at a time. */
typedef struct npt_transfer npt_transfer;

/* Opens weights (.safetensors, UTF-8 path): any that npt ships or trains. options NULL: the default ones. */
NPT_C_API npt_status npt_open(const char* weights, const npt_options* options, npt_transfer** transfer);
/* Opens several files, each a domain: a mesh goes to the first that is sure of it, or else to the one that recognises it
 * with the highest confidence. A further file with body estimation is read when a mesh asks for it. */
NPT_C_API npt_status npt_open_files(const char* const* weights, size_t count, const npt_options* options,
                                    npt_transfer** transfer);
/* The weights that npt ships, of a folder: people's (human.safetensors) and, where it is there, those of four-legged
 * animals (quadruped.safetensors), which is read when a mesh isn't surely a person. With NPT_NETWORK people's alone. */
NPT_C_API npt_status npt_open_shipped(const char* folder, const npt_options* options, npt_transfer** transfer);
/* Random weights: for trying things out. bottleneck: 64, 128, 256, 512 or 1024; pooled: nonzero for the feature that
 * takes pose meshes of any vertex count without drawing points. */
NPT_C_API npt_status npt_open_random(int bottleneck, int pooled, uint64_t weights_seed, const npt_options* options,
                                     npt_transfer** transfer);
/* Does nothing for NULL. No call may be running, and nothing that it prepared may be used afterwards. */
NPT_C_API void npt_close(npt_transfer* transfer);
/* "bottleneck 256, conv_relu, per-vertex, 4 pairings". Lives as long as the transfer. NULL for NULL. */
NPT_C_API const char* npt_describe(const npt_transfer* transfer);

/* ---- A pair ---- */

/* Writes the identity's vertices in the pose mesh's pose to xyz, [vertices][3], in the identity's vertex order, unit
 * and place; xyz may be the identity's own memory. Meshes come in any order and with any vertex count. A NaN that goes
 * in comes out. result: how it was made, or NULL. */
NPT_C_API npt_status npt_run(const npt_transfer* transfer, const npt_mesh* identity, const npt_mesh* pose, float* xyz,
                             npt_result* result);

/* ---- Characters and poses ---- */

/* An identity mesh that takes many poses, and a pose that many characters take: what depends on one mesh, computed
 * once. Of the transfer that prepared them; another one refuses them. Any number of threads may use one at a time. */
typedef struct npt_character npt_character;
typedef struct npt_pose npt_pose;

/* control: NULL, or progress and stop. */
NPT_C_API npt_status npt_prepare_character(const npt_transfer* transfer, const npt_mesh* mesh,
                                           const npt_control* control, npt_character** character);
/* identity_vertices: of the characters that will take the pose. 0: any number; the network then runs anew each time. */
NPT_C_API npt_status npt_prepare_pose(const npt_transfer* transfer, const npt_mesh* mesh, size_t identity_vertices,
                                      const npt_control* control, npt_pose** pose);
/* Both of one pair, side by side on two threads. */
NPT_C_API npt_status npt_prepare(const npt_transfer* transfer, const npt_mesh* identity_mesh, const npt_mesh* pose_mesh,
                                 npt_character** character, npt_pose** pose);
/* These do nothing for NULL. */
NPT_C_API void npt_release_character(npt_character* character);
NPT_C_API void npt_release_pose(npt_pose* pose);

/* Writes a recognised character to a file, and reads it back for the same weights (UTF-8 paths).
 * NPT_BAD_INPUT: not recognised (NPT_ERROR_NEEDS_RECOGNITION), no file of a character, or of a domain that the
 * transfer doesn't have. */
NPT_C_API npt_status npt_character_save(const npt_character* character, const char* file);
NPT_C_API npt_status npt_load_character(const npt_transfer* transfer, const char* file, npt_character** character);

/* The character's mesh: pointers into its own memory, as long as it lives. */
NPT_C_API npt_status npt_character_mesh(const npt_character* character, npt_mesh* mesh);
NPT_C_API npt_status npt_character_estimate(const npt_character* character, npt_estimate* estimate);
NPT_C_API npt_status npt_pose_estimate(const npt_pose* pose, npt_estimate* estimate);
/* NPT_BAD_INPUT: not recognised. */
NPT_C_API npt_status npt_character_joints(const npt_character* character, npt_joint_pose* joints);
NPT_C_API npt_status npt_pose_joints(const npt_pose* pose, npt_joint_pose* joints);

/* The character in the pose: xyz as npt_run writes it, [vertices][3]. result: how it was made, or NULL. */
NPT_C_API npt_status npt_apply(const npt_transfer* transfer, const npt_character* character, const npt_pose* pose,
                               float* xyz, npt_result* result);
/* How npt_apply will make its result. */
NPT_C_API npt_status npt_report(const npt_transfer* transfer, const npt_character* character, const npt_pose* pose,
                                npt_result* result);
/* Measures what npt_apply wrote, xyz [vertices][3], in 26 ms for 6890 vertices. NPT_BAD_INPUT for a character without
 * triangles that have an area. */
NPT_C_API npt_status npt_measure(const npt_transfer* transfer, const npt_character* character, const npt_pose* pose,
                                 const float* xyz, npt_measures* measures);

/* ---- Sequences ---- */

/* The poses of a sequence, frame after frame: bodies are followed, and the network's random choices are made once, so
 * that nothing flickers. A mesh with other triangles begins another sequence. One thread at a time. The transfer must
 * outlive it. */
typedef struct npt_tracker npt_tracker;

NPT_C_API npt_status npt_open_tracker(const npt_transfer* transfer, npt_tracker** tracker);
NPT_C_API void npt_close_tracker(npt_tracker* tracker);
/* The next frame's pose, for characters of so many vertices. It is the tracker's, valid until its next call. */
NPT_C_API npt_status npt_next_pose(npt_tracker* tracker, const npt_mesh* frame, size_t identity_vertices,
                                   const npt_pose** pose);
/* The first frame of a sequence of which other meshes with the same triangles are known, such as further frames or a
 * rig at rest: where the first isn't recognised with high confidence, the sequence is followed from the best of them.
 * others: [count]. */
NPT_C_API npt_status npt_start_tracker(npt_tracker* tracker, const npt_mesh* first, const npt_mesh* others,
                                       size_t count, size_t identity_vertices, const npt_pose** pose);
/* Which frames of a sequence are worth a try for its start: writes their numbers, at most NPT_MOST_TRIES, and returns
 * how many. */
#define NPT_MOST_TRIES 3
NPT_C_API size_t npt_frames_to_try(size_t frames, size_t* numbers);
/* The next mesh is the first frame of another sequence. Does nothing for NULL. */
NPT_C_API void npt_restart_tracker(npt_tracker* tracker);

/* ---- Skeletons ---- */

/* What moves a recognised character: a skeleton and skin weights, in the mesh's own unit, place and pose. Joints have
 * no rotation of their own. */
typedef struct npt_influence {
  uint16_t joint;
  float weight;
} npt_influence;
typedef struct npt_skeleton {
  size_t size;              /* sizeof(npt_skeleton), of the library's version */
  size_t joints;            /* NPT_JOINTS of a person; fewer of an animal */
  const char* const* names; /* [joints] a person's as VRM calls them: "hips", "leftUpperLeg" ... */
  const int32_t* parents;   /* [joints] a joint's number, before its own; -1: the root */
  const double* places;     /* [joints][3] */
  size_t vertices;
  const size_t* start;             /* [vertices + 1] where a vertex's influences begin */
  const npt_influence* influences; /* a vertex's weights sum to 1 */
} npt_skeleton;

/* NPT_BAD_INPUT: not recognised, or results are refined, which no skeleton can do. */
NPT_C_API npt_status npt_open_skeleton(const npt_character* character, const npt_skeleton** skeleton);
NPT_C_API void npt_close_skeleton(const npt_skeleton* skeleton);
/* How the skeleton moves to a pose: motions is [NPT_JOINTS][3][4], rows of a rotation and a shift for each joint; rows
 * beyond the skeleton's joints stay as they were. Vertices that move by these and the skin weights are npt_apply's result. NPT_BAD_INPUT: the network makes it. */
NPT_C_API npt_status npt_move_joints(const npt_transfer* transfer, const npt_character* character, const npt_pose* pose,
                                     double* motions);

/* ---- Clips ---- */

/* What the joints of a moving result are called. */
typedef enum npt_joint_names { NPT_VRM = 0, NPT_MIXAMO = 1, NPT_SMPL = 2 } npt_joint_names;

typedef struct npt_clip_options {
  size_t size;      /* sizeof(npt_clip_options) */
  const char* clip; /* its name, UTF-8; NULL: the only one of the file */
  double fps;       /* frames a second; 0: 30 */
  int in_place;     /* nonzero: the root joint stays in its place instead of following the pose's root trajectory */
  npt_joint_names names;
} npt_clip_options;

/* Puts a clip of a .glb or .gltf file onto an identity mesh (.obj, .ply, .glb, .gltf) and writes a .glb that moves: on
 * a skeleton where every frame is made by body estimation, else with morph targets. As `npt transfer --clip`; UTF-8
 * paths. A clip without a mesh, also of a .bvh, moves the joints that body estimation gives the identity. options NULL:
 * the only clip at 30 frames a second. result: of the frame with the lowest confidence, or NULL.
 * NPT_BAD_INPUT: files, clips and meshes that can't be used. */
NPT_C_API npt_status npt_animate_file(const npt_transfer* transfer, const char* identity, const char* pose,
                                      const char* out, const npt_clip_options* options, const npt_control* control,
                                      npt_result* result);

/* ---- Motions ---- */

/* A skeleton, and the curves that move its joints where there are any: what a rigged character and a clip have in
 * common, with or without a mesh. Names and shape say which joint is which; no weights are needed.
 *
 *   npt_file character = {sizeof character, "hero.glb"}, clip = {sizeof clip, "walk.bvh"};
 *   npt_transfer_motion_file(&character, &clip, "hero_walk.glb", NULL, NULL, NULL);
 *
 * or by parts, with arrays for an engine:
 *
 *   npt_read_skeleton(&character, NULL, &hero);
 *   npt_read_motion(&clip, NULL, NULL, &walk);
 *   npt_transfer_motion(hero, walk, NULL, &moved, NULL);
 *   npt_sample_motion(moved, times, count, &frames);
 *
 * Any number of threads may use one at a time. */
typedef struct npt_motion npt_motion;

/* A file on disk, or its bytes. */
typedef struct npt_file {
  size_t size;       /* sizeof(npt_file) */
  const char* path;  /* UTF-8; beside bytes, what messages call them, or NULL */
  const void* bytes; /* NULL: they are read from path. Of .glb, .vrm, .bvh, and .gltf that names no files */
  size_t byte_count;
} npt_file;

/* Nonzero: this library reads .fbx and .dae, too (target npt_c_fbx, with assimp), by their paths. */
NPT_C_API int npt_reads_fbx(void);

/* Sentences, a line each, that the last of the functions below said in this thread: what was repaired in a file, or a
 * clip's name that was taken. UTF-8, valid until the next one of them; empty: nothing. */
NPT_C_API const char* npt_last_notes(void);

/* The skeleton of a character: of a .glb, .gltf, .vrm, .bvh, or .fbx and .dae. bone_map: which joint is which, as the
 * text that `npt info --bones` prints; NULL: as found. */
NPT_C_API npt_status npt_read_skeleton(const npt_file* file, const char* bone_map, npt_motion** motion);
/* A clip of such a file. clip: its name; NULL: the only one. */
NPT_C_API npt_status npt_read_motion(const npt_file* file, const char* clip, const char* bone_map, npt_motion** motion);

/* A motion in the caller's memory, such as an engine's: local places of joints, in their parents. */
typedef struct npt_motion_data {
  size_t size;                    /* sizeof(npt_motion_data) */
  const char* name;               /* stands in messages; NULL: "motion" */
  const char* clip;               /* the clip's name; NULL: as name */
  size_t joints;                  /* at least 1 */
  const char* const* names;       /* [joints] UTF-8 */
  const int32_t* parents;         /* [joints] a joint's number, before its own; -1: a root */
  const float* rest_translations; /* [joints][3] as the skin is bound: a T pose, an A pose or another one */
  const float* rest_rotations;    /* [joints][4] quaternions x, y, z, w; NULL: none */
  const float* rest_scales;       /* [joints][3]; NULL: 1 */
  const double* base;        /* [3][4] rows: from the roots' coordinates to metres with y up; NULL: they are in these */
  size_t frames;             /* 0: the skeleton alone */
  const double* times;       /* [frames] seconds, ascending, from 0 on; NULL: at 30 frames a second */
  const float* translations; /* [frames][joints][3]; NULL: as at rest */
  const float* rotations;    /* [frames][joints][4]; NULL: as at rest */
} npt_motion_data;

NPT_C_API npt_status npt_make_motion(const npt_motion_data* data, const char* bone_map, npt_motion** motion);
/* The skeleton that body estimation gives a recognised character without joints of its own: it stands in a T pose.
 * NPT_BAD_INPUT: not recognised. */
NPT_C_API npt_status npt_motion_of_character(const npt_transfer* transfer, const npt_character* character,
                                             npt_joint_names names, npt_motion** motion);
/* Does nothing for NULL. */
NPT_C_API void npt_release_motion(npt_motion* motion);

/* The pose in which a skeleton is bound. */
typedef enum npt_rest_pose {
  NPT_REST_T = 0,
  NPT_REST_A = 1,
  NPT_REST_ARMS_DOWN = 2,
  NPT_REST_OTHER = 3 /* or joints that are unknown */
} npt_rest_pose;

/* What a motion is: pointers into its own memory, as long as it lives. */
typedef struct npt_motion_info {
  size_t size; /* sizeof(npt_motion_info) */
  size_t joints;
  const char* const* names; /* [joints] UTF-8 */
  const int32_t* parents;   /* [joints] a joint's number, before its own; -1: a root */
  const int32_t* nodes;     /* [joints] their nodes in a glTF file; -1: none */
  const char* clip;         /* its name; "" for a skeleton alone */
  double length;            /* seconds; 0: a skeleton alone, or a single pose */
  double rate;              /* frames a second on which all keys lie; 0: keys of their own, or none */
  size_t clip_count;        /* in its file */
  const char* const* clips; /* [clip_count] their names */
  double unit;              /* metres in one of the joints' own numbers */
  const char* up;           /* the axis of the joints' own numbers that points up: "y", "-z" ... */
  double base[3][4];        /* from the roots' coordinates to metres with y up */
  npt_rest_pose rest_pose;
  const char* dialect;  /* of the joints' names: "Mixamo, HumanIK" ...; "" where none is known */
  double confidence;    /* 0 to 1: that it is a person's or a four-legged animal's skeleton */
  int32_t root_joint;   /* which joint takes the body over the ground; -1: in place */
  double root_shift[3]; /* of the hips, from the first to the last frame, in metres */
  int32_t four_legged;  /* 1: an animal's skeleton */
} npt_motion_info;

NPT_C_API npt_status npt_describe_motion(const npt_motion* motion, npt_motion_info* info);

/* What joints are for: hips, head, left foot ... VRM's bones but eyes and jaw, and behind them an animal's tail, ears and
 * the like. An animal's forelegs have the roles of arms. */
#define NPT_ROLES 64
/* "hips", "leftUpperArm" ...; NULL for a number that is none of a role. */
NPT_C_API const char* npt_role_name(int role);
/* The joint of each role, -1 for none, and how certain it is, 0 to 1. Each [NPT_ROLES]; may be NULL. */
NPT_C_API npt_status npt_motion_roles(const npt_motion* motion, int32_t* joints, double* confidences);

/* The times of a clip's frames: 0, 1 / fps, ... to its end. fps 0: the clip's own rate, or 30. times: NULL, or space for
 * all of them. NPT_BAD_INPUT: a skeleton alone, or more than 100,000. */
NPT_C_API npt_status npt_frame_times(const npt_motion* motion, double fps, size_t* count, double* times);

/* Joints over time, in the caller's memory. Each may be NULL. */
typedef struct npt_motion_frames {
  size_t size;         /* sizeof(npt_motion_frames) */
  float* translations; /* [count][joints][3] in their parents, in the joints' own numbers */
  float* rotations;    /* [count][joints][4] in their parents: x, y, z, w, of length 1 */
  float* scales;       /* [count][joints][3] in their parents */
  float* positions;    /* [count][joints][3] in metres with y up */
} npt_motion_frames;

/* times: [count] seconds; NULL: the rest, once, and count is 1. */
NPT_C_API npt_status npt_sample_motion(const npt_motion* motion, const double* times, size_t count,
                                       const npt_motion_frames* frames);

/* Which joint takes the body over the ground. */
typedef enum npt_root_motion {
  NPT_ROOT_KEEP = 0,   /* the hips */
  NPT_ROOT_EXTRACT = 1 /* the joint without parent, as game engines want it */
} npt_root_motion;

/* How a motion is put on a character. Set `size`, then fill it with npt_default_motion_options. */
typedef struct npt_motion_options {
  size_t size;                    /* sizeof(npt_motion_options) */
  uint32_t version;               /* NPT_MOTION_OPTIONS_VERSION, set by npt_default_motion_options */
  const char* clip;               /* npt_transfer_motion_file: the clip's name; NULL: all of the file */
  const char* character_bone_map; /* npt_transfer_motion_file: bone maps as text; NULL: joints as found */
  const char* motion_bone_map;
  const char* clip_name; /* of the result; NULL: as the clip's */
  double time;           /* the pose at this second, as a clip of one key; below 0, as by default: the whole clip */
  int apply;             /* nonzero, with a time: the pose becomes the rest of the joints, and no clip */
  double fps;            /* keys at so many frames a second; 0: at the clip's own times */
  int foot_lock;         /* feet that stand in the clip are held; by default 1 */
  double clearance;      /* 0 to 1: how far arms and thighs are kept out of the body; by default 1 */
  int touch;             /* hands that touch the own body in the clip touch it; by default 1 */
  int in_place;          /* nonzero: the way over the ground is left out */
  npt_root_motion root_motion;
  int twist;            /* twist joints take their share; by default 1 */
  double key_tolerance; /* metres at a height of 1.75 m by which keys may be left out; by default 0.0001; 0: none */
} npt_motion_options;
#define NPT_MOTION_OPTIONS_VERSION 1

/* NPT_BAD_ARGUMENT: NULL, or a size that this library doesn't know. */
NPT_C_API npt_status npt_default_motion_options(npt_motion_options* options);

typedef enum npt_motion_warning_code {
  NPT_MOTION_JOINTS_UNCERTAIN = 0, /* which joint is which is uncertain; value: the confidence */
  NPT_MOTION_JOINTS_MISSING = 1    /* main joints that only the other skeleton has; roles: theirs */
} npt_motion_warning_code;

typedef struct npt_motion_warning {
  npt_motion_warning_code code;
  npt_mesh_role skeleton; /* NPT_IDENTITY: the character's, NPT_POSE: the motion's */
  double value;           /* a confidence from 0 to 1; else 0 */
  uint64_t roles;         /* a bit for each role: bit 0 is the hips' */
  int32_t four_legged;    /* 1: of an animal's skeleton */
} npt_motion_warning;
#define NPT_MOST_MOTION_WARNINGS 16

/* What a warning says in plain English: UTF-8, valid until this thread's next call of this, npt_warning_text or
 * npt_remedy_text. character, motion: what they are called; NULL: "character", "motion". Empty for NULL. */
NPT_C_API const char* npt_motion_warning_text(const npt_motion_warning* warning, const char* character,
                                              const char* motion);

/* What to know of a result. */
typedef struct npt_motion_report {
  size_t size;       /* sizeof(npt_motion_report) */
  size_t clips;      /* that were put on the character */
  double confidence; /* the lower of both skeletons' */
  size_t warning_count;
  npt_motion_warning warnings[NPT_MOST_MOTION_WARNINGS];
} npt_motion_report;

/* The motion on the character's own joints, whose names and nodes it keeps. options NULL: the default ones; report: or
 * NULL. NPT_BAD_INPUT: a skeleton that isn't recognised as a person's (NPT_ERROR_NOT_RECOGNISED), has no hips, keys
 * that are no numbers, a clip of no length. */
NPT_C_API npt_status npt_transfer_motion(const npt_motion* character, const npt_motion* motion,
                                         const npt_motion_options* options, npt_motion** result,
                                         npt_motion_report* report);

/* Writes results of one character to a file:
 *   .glb .gltf .vrm   the character's file with the clips behind its own, all else byte for byte as it was. A character
 *                     of .fbx or .dae, and one of body estimation, becomes a .glb
 *   .bvh              one motion, at its own rate, or 30 frames a second; also one that is no result
 * The file may be the character's own. */
NPT_C_API npt_status npt_write_motions(const npt_motion* const* motions, size_t count, const char* path);
NPT_C_API npt_status npt_write_motion(const npt_motion* motion, const char* path);

/* What a motion may be as bytes. */
typedef enum npt_motion_format {
  NPT_FORMAT_RIG = 0,     /* the character's file with the clip: GLB, or JSON text where it was a .gltf */
  NPT_FORMAT_BVH = 1,     /* text */
  NPT_FORMAT_BONE_MAP = 2 /* text: which joint is which, to be corrected and given back */
} npt_motion_format;
typedef struct npt_bytes {
  size_t size;      /* sizeof(npt_bytes), of the library's version */
  const void* data; /* [count], and a 0 behind them */
  size_t count;
} npt_bytes;

NPT_C_API npt_status npt_motion_bytes(const npt_motion* motion, npt_motion_format format, const npt_bytes** bytes);
/* Does nothing for NULL. */
NPT_C_API void npt_close_bytes(const npt_bytes* bytes);

/* Puts clips onto the joints of a character, from files to a file, as `npt transfer --clip`. options NULL: all clips of
 * the file; control: NULL, or progress and stop; report: or NULL. */
NPT_C_API npt_status npt_transfer_motion_file(const npt_file* character, const npt_file* motion, const char* out,
                                              const npt_motion_options* options, const npt_control* control,
                                              npt_motion_report* report);

#ifdef __cplusplus
}
#endif

#endif
