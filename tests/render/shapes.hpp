/// Small meshes for pictures.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/mesh/mesh.hpp>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace shapes {

inline npt::Mesh mesh(std::vector<npt::Vec3f> positions, const std::vector<std::vector<std::uint32_t>>& faces) {
  npt::Mesh mesh;
  mesh.positions = std::move(positions);
  mesh.face_start = {0};
  for (const auto& face : faces) {
    mesh.corners.insert(mesh.corners.end(), face.begin(), face.end());
    mesh.face_start.push_back(mesh.corners.size());
  }
  return mesh;
}

/// A sphere of quads and, at its poles, of squeezed ones.
inline npt::Mesh sphere(float radius, npt::Vec3f centre = {}, std::uint32_t rings = 48) {
  std::vector<npt::Vec3f> positions;
  std::vector<std::vector<std::uint32_t>> faces;
  const std::uint32_t around = 2 * rings;
  for (std::uint32_t i = 0; i <= rings; ++i)
    for (std::uint32_t j = 0; j < around; ++j) {
      const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * j / around;
      const npt::Vec3d p{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
      positions.push_back(centre + p.as<float>() * radius);
    }
  for (std::uint32_t i = 0; i < rings; ++i)
    for (std::uint32_t j = 0; j < around; ++j) {
      const std::uint32_t next = (j + 1) % around;
      faces.push_back({i * around + j, i * around + next, (i + 1) * around + next, (i + 1) * around + j});
    }
  return mesh(std::move(positions), faces);
}

/// A square in the plane z, facing +z.
inline npt::Mesh square(float half, float z) {
  return mesh({{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}}, {{0, 1, 2, 3}});
}

}  // namespace shapes
