/// A given number of points on a mesh, for networks that pair pose and identity vertices one to one.
/// Points are drawn by area, uniformly within a triangle, with counter-based random numbers: the same seed gives the
/// same points everywhere. They depend on the faces' order and points but not on the vertices' numbers. Drawn once,
/// they can be followed through a sequence of poses.
/// Shapes    xyz: [V, 3] floats, row major; result: [count]
/// Requires  triangle indices below V
#pragma once

#include <npt/config.hpp>
#include <npt/core/random.hpp>
#include <npt/core/view.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// A point of a surface, wherever its vertices go: the sum of three of them, times weights that add up to 1.
struct SurfacePoint {
  Triangle corners{};
  std::array<double, 3> weights{1, 0, 0};

  static SurfacePoint at_vertex(std::uint32_t v) { return {{v, v, v}, {1, 0, 0}}; }

  friend bool operator==(const SurfacePoint&, const SurfacePoint&) = default;
};

/// Where the vertices `xyz` put the points. [points]
inline std::vector<Vec3f> positions_of(std::span<const SurfacePoint> points, std::span<const float> xyz) {
  std::vector<Vec3f> positions(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [a, b, c] = points[i].corners;
    const auto [u, v, w] = points[i].weights;
    positions[i] = u == 1 ? point_at(xyz, a).as<float>()
                          : (point_at(xyz, a) * u + point_at(xyz, b) * v + point_at(xyz, c) * w).as<float>();
  }
  return positions;
}

namespace internal {

/// `count` of the vertices: without repeats while they last, then all of them and random repeats.
inline std::vector<SurfacePoint> draw_vertices(std::uint32_t vertices, std::size_t count, Random& random) {
  std::vector<std::uint32_t> chosen = random_permutation(vertices, random);
  if (count > vertices)
    for (std::uint32_t v = 0; v < vertices; ++v) chosen[v] = v;
  chosen.resize(std::min<std::size_t>(count, vertices));
  while (chosen.size() < count) chosen.push_back(random.below(vertices));
  std::vector<SurfacePoint> points(count);
  for (std::size_t i = 0; i < count; ++i) points[i] = SurfacePoint::at_vertex(chosen[i]);
  return points;
}

/// sums[t]: the area (times two) of triangles 0 .. t.
inline std::vector<double> cumulative_areas(std::span<const float> xyz, std::span<const Triangle> triangles) {
  std::vector<double> sums(triangles.size());
  double sum = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto [a, b, c] = triangles[t];
    const Vec3d p = point_at(xyz, a);
    sums[t] = sum += length(cross(point_at(xyz, b) - p, point_at(xyz, c) - p));
  }
  return sums;
}

}  // namespace internal

/// `count` points on the triangles. Exactly the vertices, in their order, when count is their number. Points instead of
/// a surface (no triangles, or none with an area): vertices, without repeats when count is less than their number,
/// otherwise all and random repeats. Throws npt::Error for no vertices.
inline std::vector<SurfacePoint> draw_points(std::span<const float> xyz, std::span<const Triangle> triangles,
                                             std::size_t count, Random random) {
  expect_points(xyz, "mesh to resample");
  const auto vertices = static_cast<std::uint32_t>(xyz.size() / 3);
  std::vector<SurfacePoint> points(count);
  if (count == vertices) {
    for (std::uint32_t v = 0; v < count; ++v) points[v] = SurfacePoint::at_vertex(v);
    return points;
  }
  const std::vector<double> areas = internal::cumulative_areas(xyz, triangles);
  if (areas.empty() || !(areas.back() > 0)) return internal::draw_vertices(vertices, count, random);
  for (SurfacePoint& point : points) {
    const double target = random.uniform() * areas.back();
    const auto found = std::upper_bound(areas.data(), areas.data() + areas.size() - 1, target);
    // The square root makes the density uniform over the triangle (Osada et al., "Shape Distributions", 2002, eq. 1).
    const double r = std::sqrt(random.uniform()), s = random.uniform();
    point = {triangles[static_cast<std::size_t>(found - areas.data())], {1 - r, r * (1 - s), r * s}};
  }
  return points;
}

/// The positions of points that are drawn with a seed. [count]
inline std::vector<Vec3f> resample(std::span<const float> xyz, std::span<const Triangle> triangles, std::size_t count,
                                   std::uint64_t seed) {
  return positions_of(internal::view(draw_points(xyz, triangles, count, Random(seed))), xyz);
}

inline std::vector<Vec3f> resample(const Mesh& mesh, std::size_t count, std::uint64_t seed) {
  return resample(mesh.coordinates(), internal::view(triangulate(mesh)), count, seed);
}

}  // namespace npt::inline NPT_ABI
