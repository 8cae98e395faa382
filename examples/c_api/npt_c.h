/* npt behind a C ABI: what a tool written in C, Python, C#, Rust or anything else with a foreign function interface calls.
 *
 * Every function that can fail returns a status; npt_last_error() then says what went wrong, in the thread that it went wrong
 * in. No exception leaves the library. Coordinates are 3 floats a vertex: x0 y0 z0 x1 y1 z1 ... All memory that is passed in
 * stays the caller's and is not kept.
 */
#ifndef NPT_C_H
#define NPT_C_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define NPT_C_API __attribute__((visibility("default")))
#else
#define NPT_C_API
#endif

typedef enum npt_status {
  NPT_OK = 0,
  NPT_BAD_ARGUMENT = 1, /* a null pointer, or a value that can't be */
  NPT_BAD_INPUT = 2, /* a file or a mesh that can't be used; the message names what was found and what was expected */
  NPT_NO_MEMORY = 3,
  NPT_INTERNAL = 4 /* a mistake in the library */
} npt_status;

/* A network with its weights, ready to run. Any number of threads may use one at a time. */
typedef struct npt_network npt_network;

/* "0.1.0" */
NPT_C_API const char* npt_version(void);

/* What the last failure in this thread was: UTF-8, valid until the next one. Empty before the first. */
NPT_C_API const char* npt_last_error(void);

/* Reads weights (.safetensors, UTF-8 path) into *network. threads: 0 for all that the process may use. */
NPT_C_API npt_status npt_open_weights(const char* path, int threads, npt_network** network);

/* Random weights: for trying things out. bottleneck: 64 or 1024; pooled: nonzero for the feature that takes pose meshes of any
 * vertex count as they are. */
NPT_C_API npt_status npt_open_random(int bottleneck, int pooled, uint64_t seed, int threads, npt_network** network);

/* Does nothing for NULL. No call may be running. */
NPT_C_API void npt_close(npt_network* network);

/* "bottleneck 1024, conv_relu, per-vertex". Lives as long as the network. NULL for NULL. */
NPT_C_API const char* npt_describe(const npt_network* network);

/* Writes the identity mesh's 3 * identity_vertices coordinates in the pose mesh's pose to result, in the identity's vertex
 * order, units and place. Where the vertex counts differ and the network pairs vertices, points are drawn from the pose
 * mesh's surface, by its triangles (3 vertex numbers from 0 each), or from its vertices where triangles are NULL. A NaN that
 * goes in comes out. After a failure result is as it was. */
NPT_C_API npt_status npt_transfer(const npt_network* network, const float* identity, size_t identity_vertices,
                                  const float* pose, size_t pose_vertices, const uint32_t* pose_triangles,
                                  size_t pose_triangle_count, float* result);

#ifdef __cplusplus
}
#endif

#endif
