/// From meshes to the network's coordinates and back: what stands between a file and an engine.
///
/// The identity mesh gives the frame of the result: its centre and scale are taken out before the network and put back
/// after it, so that the result is in the identity's units and place (training expresses the truth in the identity's
/// scale). The pose mesh is normalised by its own frame. Vertices come in any order; only positions change.
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/permute.hpp>
#include <npt/mesh/resample.hpp>
#include <npt/mesh/topology.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct TransferOptions {
  /// Must be what the weights were trained with (the metadata key `normalisation`).
  Normalisation normalisation = Normalisation::centre;
  /// Where the network pairs vertices and the counts differ: draw as many points from the pose mesh's surface as the
  /// identity has. False: an Error instead.
  bool resample = true;
  /// Of every random choice: resampled points, the pairing in the invariant mode.
  std::uint64_t seed = 0;
  /// Permuting either mesh's vertices permutes the result bit for bit: vertices are brought into an order derived from
  /// their coordinates first. False: the paper's plain mode, in which vertices are paired as they come.
  bool invariant = false;
};

/// An identity mesh as the network sees it, and the way back.
struct IdentityInput {
  std::vector<float> coordinates;  ///< [V, 3], normalised, in the network's order
  Frame frame;
  std::vector<std::uint32_t> place;  ///< [V] position in the network's order of each vertex; empty: the same order
};

namespace internal {

/// A mesh in one point has no pose and no shape, whatever it is normalised by.
inline void expect_extent(std::span<const float> xyz, const std::string& name) {
  for (std::size_t i = 3; i < xyz.size(); ++i)
    if (!(xyz[i] == xyz[i % 3])) return;  // NaN counts as different: it goes through to the result
  if (!xyz.empty())
    throw Error({.file = name, .found = "all vertices in one point", .expected = "a mesh with an extent"});
}

}  // namespace internal

/// Normalises an identity. `name` stands in messages of errors.
inline IdentityInput identity_input(std::span<const float> xyz, const TransferOptions& options,
                                    const std::string& name = "identity") {
  internal::expect_extent(xyz, name);
  IdentityInput input;
  input.frame = frame_of(xyz, options.normalisation, name);
  input.coordinates.resize(xyz.size());
  apply(input.frame, xyz, input.coordinates);
  if (!options.invariant) return input;
  // Coincident vertices can't be told apart, so they all take the result of one of them.
  const std::vector<std::uint32_t> order = canonical_shuffle(xyz, options.seed);
  const std::vector<std::uint32_t> representative = coincident_representatives(xyz);
  const std::vector<std::uint32_t> place = inverse_order(order);
  std::vector<float> ordered(xyz.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) ordered[3 * i + axis] = input.coordinates[3 * order[i] + axis];
  input.coordinates = std::move(ordered);
  input.place.resize(order.size());
  for (std::size_t v = 0; v < order.size(); ++v) input.place[v] = place[representative[v]];
  return input;
}

/// A pose mesh as the network sees it: [count, 3], normalised. `count` 0: as many points as it has vertices.
inline std::vector<float> pose_input(std::span<const float> xyz, std::span<const Triangle> triangles, std::size_t count,
                                     const TransferOptions& options, const std::string& name = "pose") {
  internal::expect_extent(xyz, name);
  const Frame frame = frame_of(xyz, options.normalisation, name);
  const std::size_t vertices = xyz.size() / 3;
  if (count == 0) count = vertices;
  std::vector<float> points(xyz.begin(), xyz.end());
  std::vector<Triangle> faces(triangles.begin(), triangles.end());
  if (options.invariant) {
    // Another seed than the identity's: a mesh that takes its own pose must not be paired vertex by vertex.
    const std::vector<std::uint32_t> order = canonical_shuffle(xyz, options.seed + 1);
    const std::vector<std::uint32_t> place = inverse_order(order);
    for (std::size_t i = 0; i < vertices; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) points[3 * i + axis] = xyz[3 * order[i] + axis];
    for (Triangle& t : faces) t = {place[t[0]], place[t[1]], place[t[2]]};
  }
  if (count != vertices) {
    if (!options.resample)
      throw Error({.file = name,
                   .found = std::to_string(vertices) + " vertices",
                   .expected = std::to_string(count) +
                               ", as many as the identity has (or resampling, or weights with the pooled feature)"});
    const std::vector<Vec3f> drawn = npt::resample(points, faces, count, options.seed);
    points.resize(3 * count);
    for (std::size_t i = 0; i < count; ++i) {
      points[3 * i] = drawn[i].x;
      points[3 * i + 1] = drawn[i].y;
      points[3 * i + 2] = drawn[i].z;
    }
  }
  apply(frame, points, points);
  return points;
}

/// The network's result [V, 3] as positions in the identity's order, units and place. `out` may not be `result`.
inline void restore(const IdentityInput& identity, std::span<const float> result, std::span<float> out) {
  if (identity.place.empty()) {
    apply_inverse(identity.frame, result, out);
    return;
  }
  for (std::size_t v = 0; v < identity.place.size(); ++v)
    apply_inverse(identity.frame, result.subspan(3 * std::size_t{identity.place[v]}, 3), out.subspan(3 * v, 3));
}

/// The identity mesh with new positions; normals are recomputed if it has any.
inline Mesh with_positions(Mesh identity, const IdentityInput& input, std::span<const float> result) {
  restore(input, result, identity.coordinates());
  recompute_normals(identity);
  return identity;
}

/// The identity mesh in the pose mesh's pose.
/// Errors  npt::Error for empty meshes, for a mesh whose vertices are all in one point, and for unequal vertex counts
///         where the network pairs vertices and resampling is off
template <class Engine>
Mesh transfer(const Engine& engine, const Mesh& identity, const Mesh& pose, const TransferOptions& options = {}) {
  const IdentityInput input = identity_input(identity.coordinates(), options);
  const std::size_t count = Engine::pairs_vertices() ? identity.vertex_count() : 0;
  const std::vector<float> posed = pose_input(pose.coordinates(), triangulate(pose), count, options);
  std::vector<float> result(input.coordinates.size());
  engine(posed, input.coordinates, result);
  return with_positions(identity, input, result);
}

}  // namespace npt::inline NPT_ABI
