/// Triangles, and points on them, drawn by area.
/// Requires  triangle indices below the number of points
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/config.hpp>
#include <npt/mesh/triangles.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// Triangles to choose from, each with twice its area for a weight, into memory that is used again. point(v): vertex v
template <class PointOf>
void weigh_by_area(std::span<const Triangle> triangles, const PointOf& point, WeightedChoice& areas) {
  areas.clear();
  areas.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    const Vec3d a = point(t[0]);
    areas.add(length(cross(point(t[1]) - a, point(t[2]) - a)));
  }
}

/// A point of a triangle: the sum of its corners times weights that add up to 1.
struct TrianglePoint {
  std::uint32_t triangle = 0;
  std::array<double, 3> weights{1, 0, 0};
};

/// One point in each of `count` equal shares of the area, in random order: the first n of them are spread over the area
/// as all are. The density is uniform within a triangle.
/// Requires  a total area above 0
/// Source    Osada et al., "Shape Distributions", 2002, eq. 1 (the square root)
NPT_INLINE std::vector<TrianglePoint> stratified_points(const WeightedChoice& areas, std::size_t count, Random random) {
  std::vector<TrianglePoint> ordered, points;
  ordered.reserve(count);
  points.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    const auto triangle = static_cast<std::uint32_t>(areas(random, k, count));
    const double root = std::sqrt(random.uniform()), second = random.uniform() * root, first = 1 - root;
    ordered.push_back({triangle, {first, second, 1 - first - second}});
  }
  for (const std::uint32_t k : random_permutation(static_cast<std::uint32_t>(count), random))
    points.push_back(ordered[k]);
  return points;
}

}  // namespace npt::inline NPT_ABI
