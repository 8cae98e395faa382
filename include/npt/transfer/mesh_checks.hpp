/// What a transfer checks of meshes and of memory for results before it works on them.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace npt::inline NPT_ABI::internal {

/// Everything about a mesh that a transfer can't take.
/// Errors    npt::Error for no vertices, all vertices in one point (NaN counts as different), and triangles of other
///           vertices
NPT_INLINE void expect_transferable(const MeshView& mesh) {
  const std::string_view name = mesh.name;
  expect_points(mesh.xyz, name);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t corner : mesh.triangles[t])
      if (corner >= mesh.vertex_count())
        throw Error({.file = std::string(name),
                     .place = "triangle " + std::to_string(t),
                     .found = "vertex " + std::to_string(corner),
                     .expected = "a number below " + std::to_string(mesh.vertex_count())});
  for (std::size_t i = 3; i < mesh.xyz.size(); ++i)
    if (!(mesh.xyz[i] == mesh.xyz[i % 3])) return;
  throw Error({.file = std::string(name), .found = "all vertices in one point", .expected = "a mesh with an extent"});
}

/// Whether a body can be estimated: some triangle has an area, and all coordinates are finite.
NPT_INLINE bool has_surface(const MeshView& mesh) {
  for (const float x : mesh.xyz)
    if (!std::isfinite(x)) return false;
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a = point_at(mesh.xyz, t[0]);
    area += length(cross(point_at(mesh.xyz, t[1]) - a, point_at(mesh.xyz, t[2]) - a));
  }
  return area > 0 && std::isfinite(area);
}

/// A mesh with the name of what it is used for, where it has none.
inline MeshView named(MeshView mesh, std::string_view name) {
  if (mesh.name.empty()) mesh.name = name;
  return mesh;
}

/// Whether two views are of the same mesh in the same place.
inline bool same_memory(const MeshView& a, const MeshView& b) {
  return a.xyz.data() == b.xyz.data() && a.xyz.size() == b.xyz.size() && a.triangles.data() == b.triangles.data() &&
         a.triangles.size() == b.triangles.size();
}

/// Errors    npt::Error for a result of another size
NPT_INLINE void expect_result(std::size_t found, std::size_t expected) {
  if (found != expected)
    throw Error({.file = "result",
                 .found = std::to_string(found) + " numbers",
                 .expected = std::to_string(expected) + ", three for each of the identity's vertices"});
}

}  // namespace npt::inline NPT_ABI::internal
