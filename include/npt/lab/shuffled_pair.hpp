/// Pairs of known meshes with their vertices in random orders, each mesh's its own: an order of the meshes' own would
/// tell a network that pairs vertices which belongs to which.
#pragma once

#include <npt/base/random.hpp>
#include <npt/config.hpp>
#include <npt/lab/assembly.hpp>
#include <npt/lab/draws.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/mesh/topology.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI::data {

/// A random order of all vertices of a mesh.
struct VertexOrder {
  std::vector<std::uint32_t> rows, places;  ///< the vertex at each place, the place of each vertex

  VertexOrder(std::size_t count, Random random) {
    const auto n = static_cast<std::uint32_t>(count);
    VertexChoice().draw(n, n, random, rows);
    places_of(rows, places);
  }
};

/// What a pair of known meshes consists of: their vertices as they came, row major, and what names these.
struct KnownPair {
  std::span<const float> pose, identity, truth;
  std::span<const Triangle> pose_triangles, identity_triangles;
  std::span<const Edge> edges;  ///< of the identity
};

/// The pair with both meshes' vertices in these orders.
inline EvaluationPair shuffled_pair(const KnownPair& pair, const VertexOrder& of_pose, const VertexOrder& of_identity) {
  EvaluationPair result;
  gather({}, pair.pose, of_pose.rows, result.pose);
  renumber_triangles(of_pose.places, pair.pose_triangles, result.pose_triangles);
  gather({}, pair.identity, of_identity.rows, result.identity);
  gather({}, pair.truth, of_identity.rows, result.truth);
  renumber_edges(of_identity.places, pair.edges, result.edges);
  renumber_triangles(of_identity.places, pair.identity_triangles, result.identity_triangles);
  return result;
}

}  // namespace npt::inline NPT_ABI::data
