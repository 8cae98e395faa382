/// A mesh with its vertices in another order (vertex_order.hpp).
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/vertex_order.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// A mesh with its vertices in another order: positions, normals (where one a vertex) and properties move, corners
/// point to the new places. Faces and all else stay. Throws npt::Error unless `order` is a permutation of the vertices.
NPT_INLINE Mesh permute_vertices(const Mesh& mesh, std::span<const std::uint32_t> order) {
  if (order.size() != mesh.vertex_count())
    throw Error({.file = "vertex order",
                 .found = std::to_string(order.size()) + " entries",
                 .expected = std::to_string(mesh.vertex_count()) + ", one for each vertex"});
  const std::vector<std::uint32_t> place = inverse_order(order);
  const auto gather = [&order](auto& to, const auto& from) {
    for (std::size_t i = 0; i < order.size(); ++i) to[i] = from[order[i]];
  };
  Mesh result = mesh;
  gather(result.positions, mesh.positions);
  if (mesh.corner_normal.empty() && mesh.normals.size() == mesh.vertex_count()) gather(result.normals, mesh.normals);
  for (std::size_t p = 0; p < mesh.properties.size(); ++p)
    gather(result.properties[p].values, mesh.properties[p].values);
  for (std::uint32_t& corner : result.corners) corner = place[corner];
  return result;
}

}  // namespace npt::inline NPT_ABI
