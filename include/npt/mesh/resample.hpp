/// A given number of points on a mesh, for networks that pair pose and identity vertices one to one.
/// Points are drawn by area, uniformly within a triangle, with counter-based random numbers: the same seed gives the
/// same points everywhere. They depend on the faces' order and points but not on the vertices' numbers. Drawn once,
/// they can be followed through a sequence of poses.
/// Shapes    xyz: [V, 3] floats, row major; result: [count]
/// Requires  triangle indices below V
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/random.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/config.hpp>
#include <npt/mesh/area_sampler.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A point of a surface, wherever its vertices go: the sum of three of them, times weights that add up to 1.
struct SurfacePoint {
  Triangle corners{};
  std::array<double, 3> weights{1, 0, 0};

  static SurfacePoint at_vertex(std::uint32_t v) { return {{v, v, v}, {1, 0, 0}}; }

  friend bool operator==(const SurfacePoint&, const SurfacePoint&) = default;
};

/// Where the vertices `xyz` put the point.
NPT_INLINE Vec3f position_of(const SurfacePoint& point, std::span<const float> xyz) {
  const auto [a, b, c] = point.corners;
  const auto [u, v, w] = point.weights;
  if (u == 1) return point_at(xyz, a).as<float>();
  return (point_at(xyz, a) * u + point_at(xyz, b) * v + point_at(xyz, c) * w).as<float>();
}

/// Where the vertices `xyz` put the points. [points]
NPT_INLINE std::vector<Vec3f> positions_of(std::span<const SurfacePoint> points, std::span<const float> xyz) {
  std::vector<Vec3f> positions(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) positions[i] = position_of(points[i], xyz);
  return positions;
}

namespace internal {

/// points.size() of the vertices: without repeats while they last, then all of them and random repeats.
NPT_INLINE void draw_vertices(std::uint32_t vertices, Random& random, std::vector<std::uint32_t>& chosen,
                              std::span<SurfacePoint> points) {
  random_permutation(vertices, random, chosen);
  if (points.size() > vertices)
    for (std::uint32_t v = 0; v < vertices; ++v) chosen[v] = v;
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = SurfacePoint::at_vertex(i < vertices ? chosen[i] : random.below(vertices));
}

}  // namespace internal

/// Memory of draw_points, for calls that must not allocate.
struct DrawScratch {
  WeightedChoice areas;               ///< [F]
  std::vector<std::uint32_t> chosen;  ///< [V]
};

/// `count` points on the triangles, into memory that is used again. Exactly the vertices, in their order, when count is
/// their number. Points instead of a surface (no triangles, or none with an area): vertices, without repeats when count
/// is less than their number, otherwise all and random repeats.
/// Errors    npt::Error for no vertices
NPT_INLINE void draw_points(std::span<const float> xyz, std::span<const Triangle> triangles, std::size_t count,
                            Random random, DrawScratch& scratch, std::vector<SurfacePoint>& points) {
  expect_points(xyz, "mesh to resample");
  const auto vertices = static_cast<std::uint32_t>(xyz.size() / 3);
  points.resize(count);
  if (count == vertices) {
    for (std::uint32_t v = 0; v < count; ++v) points[v] = SurfacePoint::at_vertex(v);
    return;
  }
  WeightedChoice& areas = scratch.areas;
  areas = weigh_by_area(
      triangles, [xyz](std::uint32_t v) { return point_at(xyz, v); }, std::move(areas));
  if (!(areas.total() > 0)) {
    internal::draw_vertices(vertices, random, scratch.chosen, as_span(points));
    return;
  }
  for (SurfacePoint& point : points) {
    const Triangle& triangle = triangles[areas(random)];
    // The square root makes the density uniform over the triangle (Osada et al., "Shape Distributions", 2002, eq. 1).
    const double r = std::sqrt(random.uniform()), s = random.uniform();
    // Weights of 24 bits make products with coordinates exact in double: whether the compiler fuses them with the sum,
    // which it does differently from place to place, then changes no bit of a point.
    const auto rounded = [](double weight) { return static_cast<double>(static_cast<float>(weight)); };
    point = {triangle, {rounded(1 - r), rounded(r * (1 - s)), rounded(r * s)}};
  }
}

/// `count` points on the triangles, as the overload that is given its memory draws them.
NPT_INLINE std::vector<SurfacePoint> draw_points(std::span<const float> xyz, std::span<const Triangle> triangles,
                                                 std::size_t count, Random random) {
  DrawScratch scratch;
  std::vector<SurfacePoint> points;
  draw_points(xyz, triangles, count, random, scratch, points);
  return points;
}

/// The positions of points that are drawn with a seed. [count]
NPT_INLINE std::vector<Vec3f> resample(std::span<const float> xyz, std::span<const Triangle> triangles,
                                       std::size_t count, std::uint64_t seed) {
  return positions_of(as_span(draw_points(xyz, triangles, count, Random(seed))), xyz);
}

NPT_INLINE std::vector<Vec3f> resample(const Mesh& mesh, std::size_t count, std::uint64_t seed) {
  return resample(mesh.coordinates(), as_span(triangulate(mesh)), count, seed);
}

}  // namespace npt::inline NPT_ABI
