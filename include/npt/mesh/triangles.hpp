/// A mesh's faces as triangles, and triangles as faces.
/// Requires  a valid mesh (validate.hpp)
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

using Triangle = std::array<std::uint32_t, 3>;

/// Each face as a fan around its first corner: (0, i, i + 1). By topology only, so that one mesh in two poses has the
/// same triangles; choosing the shorter diagonal of a quad, as tinyobjloader does, breaks that. Face order is kept.
NPT_INLINE std::vector<Triangle> triangulate(const Mesh& mesh) {
  std::vector<Triangle> triangles;
  triangles.reserve(mesh.corners.size() - std::min(mesh.corners.size(), 2 * mesh.face_count()));
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const std::span<const std::uint32_t> face = mesh.face(f);
    for (std::size_t i = 1; i + 1 < face.size(); ++i) triangles.push_back({face[0], face[i], face[i + 1]});
  }
  return triangles;
}

/// Gives a mesh these triangles for faces. Requires a mesh without faces.
NPT_INLINE void set_faces(Mesh& mesh, std::span<const Triangle> triangles) {
  NPT_ASSERT(mesh.face_start.empty());
  mesh.face_start.resize(triangles.size() + 1);
  for (std::size_t f = 0; f < mesh.face_start.size(); ++f) mesh.face_start[f] = 3 * f;
  mesh.corners.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) mesh.corners.insert(mesh.corners.end(), t.begin(), t.end());
}

}  // namespace npt::inline NPT_ABI
