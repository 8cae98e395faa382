/// A mesh that is quickly made: nothing of people, and no two of its points alike.
#pragma once

#include <npt/mesh/mesh.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

namespace support {

/// A bumpy sphere: rings of quads, open at the poles. `seam`: its last sector lies on the first, vertex on vertex.
inline npt::Mesh bumpy_sphere(std::size_t rings, std::size_t sectors, double bump, bool seam = false) {
  npt::Mesh mesh;
  const auto add_face = [&mesh](std::initializer_list<std::uint32_t> corners) {
    if (mesh.face_start.empty()) mesh.face_start.push_back(0);
    mesh.corners.insert(mesh.corners.end(), corners);
    mesh.face_start.push_back(mesh.corners.size());
  };
  for (std::size_t r = 0; r <= rings; ++r)
    for (std::size_t s = 0; s < sectors; ++s) {
      const double theta = 3.14159265358979 * (static_cast<double>(r) + 0.5) / (static_cast<double>(rings) + 1);
      const std::size_t turn = seam && s + 1 == sectors ? 0 : s;
      const double phi = 6.28318530717959 * static_cast<double>(turn) / static_cast<double>(sectors);
      const double radius = 1 + bump * std::sin(3 * phi) * std::sin(2 * theta + 0.3);
      mesh.positions.push_back({static_cast<float>(radius * std::sin(theta) * std::cos(phi) + 3),
                                static_cast<float>(1.7 * radius * std::cos(theta) - 1),
                                static_cast<float>(radius * std::sin(theta) * std::sin(phi) + 0.5)});
    }
  for (std::size_t r = 0; r < rings; ++r)
    for (std::size_t s = 0; s < sectors; ++s) {
      const auto at = [&](std::size_t ring, std::size_t sector) {
        return static_cast<std::uint32_t>(ring * sectors + sector % sectors);
      };
      add_face({at(r, s), at(r, s + 1), at(r + 1, s + 1), at(r + 1, s)});
    }
  return mesh;
}

}  // namespace support
