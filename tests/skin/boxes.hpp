// Boxes for meshes of several pieces.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/mesh/triangles.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace boxes {

/// Adds a box of 8 points and 12 triangles that face outwards; the number of its first point.
inline std::uint32_t add(npt::Vec3d centre, npt::Vec3d half, std::vector<npt::Vec3d>& points,
                         std::vector<npt::Triangle>& triangles) {
  const auto first = static_cast<std::uint32_t>(points.size());
  for (const std::uint32_t i : {0U, 1U, 2U, 3U, 4U, 5U, 6U, 7U}) {
    const auto sign = [i](std::uint32_t bit) { return (i & bit) != 0 ? 1.0 : -1.0; };
    points.push_back(centre + npt::Vec3d{half.x * sign(1), half.y * sign(2), half.z * sign(4)});
  }
  for (const std::array<std::uint32_t, 4> q : {std::array{0U, 4U, 6U, 2U},
                                               {1U, 3U, 7U, 5U},
                                               {0U, 1U, 5U, 4U},
                                               {2U, 6U, 7U, 3U},
                                               {0U, 2U, 3U, 1U},
                                               {4U, 5U, 7U, 6U}}) {
    triangles.push_back({first + q[0], first + q[1], first + q[2]});
    triangles.push_back({first + q[0], first + q[2], first + q[3]});
  }
  return first;
}

}  // namespace boxes
