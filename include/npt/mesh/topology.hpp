/// What a mesh's faces say without its positions: edges, neighbours and components; triangles.hpp has the triangles.
/// Requires  a valid mesh (validate.hpp)
#pragma once

#include <npt/base/sort.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/union_find.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

using Edge = std::array<std::uint32_t, 2>;

/// Edges {a, b}, a < b, in any order: each once, ascending.
NPT_INLINE std::vector<Edge> unique_edges(std::span<const Edge> edges) {
  // By their first ends, and then the few of each: of 881,664 triangles in 0.10 instead of 0.19 s.
  std::vector<std::size_t> ends(1);
  for (const auto& [a, b] : edges) ends.resize(std::max(ends.size(), a + std::size_t{2})), ++ends[a + 1];
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<std::uint64_t> keys(edges.size());
  for (const auto& [a, b] : edges) keys[ends[a]++] = pair_key(a, b);
  std::vector<Edge> sorted;
  std::size_t first = 0;
  for (const std::size_t end : ends) {
    sort_keys({keys.data() + first, end - first});
    for (; first < end; ++first)
      if (const Edge edge{first_of_key(keys[first]), second_of_key(keys[first])};
          sorted.empty() || sorted.back() != edge)
        sorted.push_back(edge);
  }
  return sorted;
}

/// A mesh's undirected edges {a, b}, a < b, each once, ascending: sides of faces, not the diagonals of their triangles.
/// A side from a vertex to itself is none.
NPT_INLINE std::vector<Edge> unique_edges(const Mesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(mesh.corners.size());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const std::span<const std::uint32_t> face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t a = face[i], b = face[i + 1 < face.size() ? i + 1 : 0];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b)});
    }
  }
  return unique_edges(as_span(edges));
}

/// The undirected edges {a, b}, a < b, of triangles, each once, ascending. A side from a vertex to itself is none.
NPT_INLINE std::vector<Edge> edges_of_triangles(std::span<const Triangle> triangles) {
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i], b = t[(i + 1) % 3];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b)});
    }
  return unique_edges(as_span(edges));
}

/// [V] The least vertex that each vertex hangs together with by triangles.
NPT_INLINE std::vector<std::uint32_t> connected_components(std::span<const Triangle> triangles,
                                                           std::size_t vertex_count) {
  UnionFind components(vertex_count);
  for (const Triangle& t : triangles) {
    components.unite(t[0], t[1]);
    components.unite(t[0], t[2]);
  }
  return components.sets();
}

/// The neighbours of every vertex in compressed rows: those of v are vertices[start[v]] .. vertices[start[v + 1] - 1],
/// ascending.
struct Neighbours {
  std::vector<std::size_t> start;       ///< [V + 1]
  std::vector<std::uint32_t> vertices;  ///< [2 E]

  std::span<const std::uint32_t> of(std::size_t v) const {
    return {vertices.data() + start[v], start[v + 1] - start[v]};
  }
};

/// The neighbours that `edges` (each once) give `vertex_count` vertices.
NPT_INLINE Neighbours neighbours(std::span<const Edge> edges, std::size_t vertex_count) {
  // Ascending edges give ascending neighbours: first the smaller ones, as second ends.
  if (!std::is_sorted(edges.begin(), edges.end())) return neighbours(as_span(unique_edges(edges)), vertex_count);
  Neighbours result;
  result.start.assign(vertex_count + 1, 0);
  for (const Edge& edge : edges)
    for (const std::uint32_t v : edge) ++result.start[v + 1];
  for (std::size_t v = 0; v < vertex_count; ++v) result.start[v + 1] += result.start[v];
  result.vertices.resize(2 * edges.size());
  std::vector<std::size_t> next(result.start.begin(), result.start.end() - 1);
  for (const Edge& edge : edges) {
    result.vertices[next[edge[0]]++] = edge[1];
    result.vertices[next[edge[1]]++] = edge[0];
  }
  return result;
}

NPT_INLINE Neighbours neighbours(const Mesh& mesh) {
  return neighbours(as_span(unique_edges(mesh)), mesh.vertex_count());
}

}  // namespace npt::inline NPT_ABI
