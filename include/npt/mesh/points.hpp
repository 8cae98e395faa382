/// Lists of points as flat coordinates.
/// Shapes    xyz: [V, 3] floats, row major
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE Vec3d point_at(std::span<const float> xyz, std::size_t v) {
  return {static_cast<double>(xyz[3 * v]), static_cast<double>(xyz[3 * v + 1]), static_cast<double>(xyz[3 * v + 2])};
}
/// [V]
NPT_INLINE std::vector<Vec3d> points_of(std::span<const float> xyz) {
  std::vector<Vec3d> points(xyz.size() / 3);
  for (std::size_t v = 0; v < points.size(); ++v) points[v] = point_at(xyz, v);
  return points;
}

NPT_INLINE void move_points(std::span<float> xyz, Vec3d step) {
  const std::array<double, 3> steps{step.x, step.y, step.z};
  for (std::size_t i = 0; i < xyz.size(); ++i) xyz[i] = static_cast<float>(static_cast<double>(xyz[i]) + steps[i % 3]);
}

/// Throws npt::Error, which calls them `name`, unless xyz holds whole points, at least one.
NPT_INLINE void expect_points(std::span<const float> xyz, std::string_view name) {
  if (xyz.empty()) throw Error({.file = std::string(name), .found = "no vertices", .expected = "at least one vertex"});
  if (xyz.size() % 3 != 0)
    throw Error({.file = std::string(name),
                 .found = std::to_string(xyz.size()) + " coordinates",
                 .expected = "a multiple of 3"});
}

/// An axis-aligned box.
struct BoundingBox {
  Vec3d low, high;

  Vec3d centre() const { return {(low.x + high.x) / 2, (low.y + high.y) / 2, (low.z + high.z) / 2}; }
  double longest_side() const { return std::max({high.x - low.x, high.y - low.y, high.z - low.z}); }
};

/// The smallest box around all points. Coordinates that are NaN don't count.
NPT_INLINE BoundingBox bounding_box(std::span<const float> xyz) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  std::array<double, 3> low{inf, inf, inf}, high{-inf, -inf, -inf};
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    for (std::size_t k = 0; k < 3; ++k) {  // std::min and max keep their first argument against a NaN
      low[k] = std::min(low[k], static_cast<double>(xyz[i + k]));
      high[k] = std::max(high[k], static_cast<double>(xyz[i + k]));
    }
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

}  // namespace npt::inline NPT_ABI
