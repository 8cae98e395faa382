/// Vertices at one point, made one. Exporters split vertices along seams of texture or of hard edges; unwelded, such a
/// mesh falls apart when it is deformed.
/// Shapes    xyz: [V, 3] floats, row major
/// Numerics  points are compared by value, -0 being 0; a NaN is equal to itself
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/vertex_order.hpp>

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// Which vertices of a mesh are one point. Points are numbered in the order of their first vertices.
struct Welding {
  std::vector<std::uint32_t> point_of;   ///< [V] the point that a vertex lies at
  std::vector<std::uint32_t> vertex_of;  ///< [P] the first vertex at a point

  std::size_t point_count() const noexcept { return vertex_of.size(); }

  /// The triangles between points. Requires corners below V. Some may have lost their area.
  std::vector<Triangle> welded(std::span<const Triangle> triangles) const {
    std::vector<Triangle> result(triangles.begin(), triangles.end());
    for (Triangle& t : result)
      for (std::uint32_t& corner : t) corner = point_of[corner];
    return result;
  }
};

NPT_INLINE Welding weld(std::span<const float> xyz) {
  const std::vector<std::uint32_t> representative = coincident_representatives(xyz);
  Welding welding{std::vector<std::uint32_t>(representative.size()), {}};
  std::vector<std::uint32_t> point(representative.size(), no_index);
  for (std::uint32_t v = 0; v < representative.size(); ++v) {
    std::uint32_t& p = point[representative[v]];
    if (p == no_index) {
      p = static_cast<std::uint32_t>(welding.point_count());
      welding.vertex_of.push_back(v);
    }
    welding.point_of[v] = p;
  }
  return welding;
}

/// Every vertex a point of its own, for meshes whose seams are to open.
NPT_INLINE Welding unwelded(std::size_t vertex_count) {
  Welding welding{std::vector<std::uint32_t>(vertex_count), {}};
  std::iota(welding.point_of.begin(), welding.point_of.end(), 0U);
  welding.vertex_of = welding.point_of;
  return welding;
}

}  // namespace npt::inline NPT_ABI
