/* npt behind a C ABI: what a tool written in C, Python, C#, Rust or anything else with a foreign function interface
 * calls.
 *
 *   npt_transfer* transfer = NULL;
 *   if (npt_open("human.safetensors", NULL, &transfer) != NPT_OK) puts(npt_last_error());
 *   npt_mesh identity = {xyz, vertices, triangles, triangle_count, "identity"}, pose = {...};
 *   npt_run(transfer, &identity, &pose, result);
 *   npt_close(transfer);
 *
 * Every function that can fail returns a status; npt_last_error() then says what went wrong, in the thread that it
 * went wrong in, and outputs are as they were. No exception leaves the library. All memory that is passed in stays
 * the caller's and is not kept after the call.
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

typedef enum npt_status {
  NPT_OK = 0,
  NPT_BAD_ARGUMENT = 1, /* a null pointer, or a value that can't be */
  NPT_BAD_INPUT = 2,    /* a file or a mesh that can't be used; the message says what was found and expected */
  NPT_NO_MEMORY = 3,
  NPT_INTERNAL = 4 /* a mistake in the library */
} npt_status;

/* A network with its weights, ready to run. Any number of threads may use one at a time. */
typedef struct npt_transfer npt_transfer;
/* An identity mesh that takes many poses, and a pose that many identities take: what depends on one mesh, computed
 * once. Of the transfer that prepared them. Any number of threads may use one at a time. */
typedef struct npt_identity npt_identity;
typedef struct npt_pose npt_pose;
/* Frames of a sequence, one after another, for one identity. One thread at a time. */
typedef struct npt_sequence npt_sequence;

/* A mesh in the caller's memory. */
typedef struct npt_mesh {
  const float* xyz; /* 3 a vertex: x0 y0 z0 x1 y1 z1 ... */
  size_t vertices;
  const uint32_t* triangles; /* 3 vertex numbers each, from 0; NULL: a cloud of points */
  size_t triangle_count;
  const char* name; /* stands in messages, UTF-8; NULL: "identity" or "pose" */
} npt_mesh;

/* How a transfer is made. */
typedef enum npt_method {
  NPT_AUTOMATIC = 0, /* by body estimation where both meshes are recognised as people, else by the network */
  NPT_BODY = 1,      /* by body estimation, whatever the meshes are */
  NPT_NETWORK = 2    /* by the pose transfer network */
} npt_method;

/* How a transfer was made, and how sure it is; npt_last_notes() says it in words. */
typedef struct npt_report {
  npt_method method;                 /* NPT_BODY or NPT_NETWORK */
  double identity_confidence, pose_confidence; /* 0 to 1: that it is a person, and was estimated rightly; -1: no body was estimated */
} npt_report;

/* How transfers are done. Fill it with npt_default_options first: later versions may have more. */
typedef struct npt_options {
  size_t size;          /* sizeof(npt_options), set by npt_default_options */
  int threads;          /* 0: all that the process may use */
  int pairings;         /* the mean over so many random pairings of vertices, at least 1; costs as many runs */
  int mirror;           /* also transfer the mirror images, and average; twice the runs */
  int refine;           /* give results the identity's surface detail; needs the identity's triangles */
  double refine_radius; /* 0: as the weights say, or 0.04 */
  int invariant;        /* permuting a mesh's vertices permutes the result bit for bit */
  int pair_as_given;    /* meet vertices by number instead of at random; to compare with other implementations */
  int resample;         /* 0: refuse a pose mesh of another vertex count where the network pairs vertices */
  double unit;          /* metres in one unit of the meshes; 0: inferred from their size */
  uint64_t seed;        /* of every random choice */
  npt_method method;    /* how transfers are made */
} npt_options;

/* "0.1.0" */
NPT_C_API const char* npt_version(void);

/* What the last failure in this thread was: UTF-8, valid until the next one. Empty before the first. */
NPT_C_API const char* npt_last_error(void);

/* What the user should know of the transfer that npt_explain or npt_explain_frame last spoke of in this thread, such as
 * a mesh that is not recognised as a person: a line for each thing, UTF-8, valid until the next one. Empty: all is well. */
NPT_C_API const char* npt_last_notes(void);

NPT_C_API void npt_default_options(npt_options* options);

/* Opens weights (.safetensors, UTF-8 path): any that npt ships or trains. options NULL: the default ones. */
NPT_C_API npt_status npt_open(const char* weights, const npt_options* options, npt_transfer** transfer);

/* Random weights: for trying things out. bottleneck: 64, 128, 256, 512 or 1024; pooled: nonzero for the feature that
 * takes pose meshes of any vertex count as they are. */
NPT_C_API npt_status npt_open_random(int bottleneck, int pooled, uint64_t weights_seed, const npt_options* options,
                                     npt_transfer** transfer);

/* Does nothing for NULL. No call may be running, and nothing that it prepared may be used afterwards. */
NPT_C_API void npt_close(npt_transfer* transfer);

/* "bottleneck 256, conv_relu, per-vertex, 4 pairings". Lives as long as the transfer. NULL for NULL. */
NPT_C_API const char* npt_describe(const npt_transfer* transfer);

/* Writes the identity's 3 * vertices coordinates in the pose mesh's pose to result, in the identity's vertex order,
 * units and place. Meshes come as they are: in any order, of any vertex count. A NaN that goes in comes out. */
NPT_C_API npt_status npt_run(const npt_transfer* transfer, const npt_mesh* identity, const npt_mesh* pose,
                             float* result);

NPT_C_API npt_status npt_prepare_identity(const npt_transfer* transfer, const npt_mesh* mesh, npt_identity** identity);
NPT_C_API void npt_release_identity(npt_identity* identity);

/* identity_vertices: of the identities that will take the pose; it doesn't matter to the pooled feature. */
NPT_C_API npt_status npt_prepare_pose(const npt_transfer* transfer, const npt_mesh* mesh, size_t identity_vertices,
                                      npt_pose** pose);
NPT_C_API void npt_release_pose(npt_pose* pose);

/* Both of one pair, read side by side. */
NPT_C_API npt_status npt_prepare(const npt_transfer* transfer, const npt_mesh* identity_mesh, const npt_mesh* pose_mesh,
                                 npt_identity** identity, npt_pose** pose);

/* How npt_run_prepared makes a result of these. */
NPT_C_API npt_status npt_explain(const npt_transfer* transfer, const npt_identity* identity, const npt_pose* pose,
                                 npt_report* report);

/* npt_run's result, from what was prepared. */
NPT_C_API npt_status npt_run_prepared(const npt_transfer* transfer, const npt_identity* identity, const npt_pose* pose,
                                      float* result);

/* Frames share their random choices, made on the first one, so that nothing flickers; a mesh with other triangles
 * begins another sequence. The transfer and the identity must outlive the sequence. */
NPT_C_API npt_status npt_open_sequence(const npt_transfer* transfer, const npt_identity* identity,
                                       npt_sequence** sequence);
NPT_C_API npt_status npt_run_frame(npt_sequence* sequence, const npt_mesh* pose, float* result);
/* How the last frame's result was made. */
NPT_C_API npt_status npt_explain_frame(const npt_sequence* sequence, npt_report* report);
NPT_C_API void npt_close_sequence(npt_sequence* sequence);

/* What moves a recognised identity: a skeleton and skin weights. In the identity's own unit, place and
 * pose; joints have no rotation of their own. */
typedef struct npt_influence {
  uint16_t joint;
  float weight;
} npt_influence;
#define NPT_JOINTS 40 /* of every skeleton: SMPL's 24, then two for each finger but the thumbs */
typedef struct npt_skeleton {
  size_t joints;            /* NPT_JOINTS */
  const char* const* names; /* [joints] as VRM calls them: "hips", "leftUpperLeg" ... */
  const int32_t* parents;   /* [joints] a joint's number, before its own; -1: the root */
  const double* places;     /* [joints][3] */
  size_t vertices;
  const size_t* start;             /* [vertices + 1] where a vertex's influences begin */
  const npt_influence* influences; /* a vertex's weights sum to 1 */
} npt_skeleton;

/* NPT_BAD_INPUT: the identity is not recognised as a person, or results are refined, which no skeleton can do. */
NPT_C_API npt_status npt_open_skeleton(const npt_transfer* transfer, const npt_identity* identity,
                                       const npt_skeleton** skeleton);
NPT_C_API void npt_close_skeleton(const npt_skeleton* skeleton);

/* How the skeleton moves to a pose: [NPT_JOINTS][3][4], rows of a rotation and a shift for each joint. Vertices that go
 * by these and the skin weights are npt_run_prepared's result. NPT_BAD_INPUT: the network makes the result. */
NPT_C_API npt_status npt_move_joints(const npt_transfer* transfer, const npt_identity* identity, const npt_pose* pose,
                                     double* motions);
/* The same of a sequence's last frame. */
NPT_C_API npt_status npt_move_frame_joints(const npt_sequence* sequence, double* motions);

#ifdef __cplusplus
}
#endif

#endif
