/// Midpoint subdivision: every triangle becomes four, with a new vertex in the middle of each edge. The surface stays
/// what it was, so a mesh of any size is made from a small one.
/// Shapes    V vertices and E edges become V + E vertices: the old ones first, then one an edge, ascending
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace npt::inline NPT_ABI {

/// Positions and triangles after one step. A triangle with a corner twice stays one; faces with more than three corners
/// are cut into triangles first.
NPT_INLINE Mesh subdivide(const Mesh& mesh) {
  const std::vector<Triangle> triangles = triangulate(mesh);
  const std::vector<Edge> edges = edges_of_triangles(as_span(triangles));
  Mesh result;
  result.positions = mesh.positions;
  result.positions.reserve(mesh.vertex_count() + edges.size());
  for (const Edge& edge : edges) {
    const Vec3d sum = mesh.positions[edge[0]].as<double>() + mesh.positions[edge[1]].as<double>();
    result.positions.push_back((sum * 0.5).as<float>());
  }
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    if (a == b) return a;
    const Edge edge{std::min(a, b), std::max(a, b)};
    const auto found = std::lower_bound(edges.begin(), edges.end(), edge);
    return static_cast<std::uint32_t>(mesh.vertex_count()) + static_cast<std::uint32_t>(found - edges.begin());
  };
  std::vector<Triangle> smaller;
  smaller.reserve(4 * triangles.size());
  for (const auto& [a, b, c] : triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const Triangle& t : {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}})
      smaller.push_back(t);
  }
  set_faces(result, as_span(smaller));
  return result;
}

}  // namespace npt::inline NPT_ABI
