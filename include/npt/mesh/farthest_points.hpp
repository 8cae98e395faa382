/// Points that are far from each other.
/// Source    Gonzalez, "Clustering to minimize the maximum intercluster distance", 1985
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// The first point, then `count` - 1 times the one that is farthest from all chosen ones: of equally far ones the first.
/// Requires  1 <= count <= points.size()
NPT_INLINE std::vector<std::uint32_t> farthest_points(std::span<const Vec3d> points, std::size_t count) {
  NPT_ASSERT(count >= 1 && count <= points.size());
  std::vector<double> distance(points.size(), std::numeric_limits<double>::infinity());
  std::vector<std::uint32_t> chosen{0};
  chosen.reserve(count);
  while (chosen.size() < count) {
    const Vec3d last = points[chosen.back()];
    distance[chosen.back()] = -1;  // never again, even where all points are in one place
    std::uint32_t next = 0;
    double farthest = -1;
    for (std::uint32_t p = 0; p < points.size(); ++p) {
      const Vec3d d = points[p] - last;
      distance[p] = std::min(distance[p], dot(d, d));
      if (distance[p] > farthest) farthest = distance[p], next = p;
    }
    chosen.push_back(next);
  }
  return chosen;
}

}  // namespace npt::inline NPT_ABI
