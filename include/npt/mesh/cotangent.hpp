/// The weights by which the points of a triangle mesh hold together: cotangents along its edges, areas at its points.
///   edge    half the sum of the cotangents of the angles that face it in its triangles
///   point   a third of the area of its triangles
/// Meshes    Any number of triangles may meet at an edge, and sides may be free: each triangle gives its share. A
///           triangle without an area (and one so thin that its angles are noise) counts as equilateral for its edges
///           and gives no area; a triangle that names a point twice is none. An edge's weight is kept between
///           least_weight and most_weight: obtuse angles give negative ones, which don't hold anything, slivers huge
///           ones
/// Shapes    points: [P]; triangles of numbers below P
/// Source    Pinkall and Polthier, "Computing discrete minimal surfaces and their conjugates", 1993
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

struct CotangentWeights {
  std::vector<Edge> edges;      ///< {a, b}, a < b, each once, ascending
  std::vector<double> weights;  ///< [edges]
  std::vector<double> areas;    ///< [P]
  double total_area = 0;
};

/// An equilateral triangle gives each of its edges 0.29.
inline constexpr double least_weight = 0.01, most_weight = 20;

NPT_INLINE CotangentWeights cotangent_weights(std::span<const Vec3d> points, std::span<const Triangle> triangles) {
  struct Share {
    Edge edge;
    double weight;
  };
  CotangentWeights result;
  result.areas.assign(points.size(), 0);
  std::vector<Share> shares;
  shares.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    const std::array<Vec3d, 3> p{points[t[0]], points[t[1]], points[t[2]]};
    const double area2 = length(cross(p[1] - p[0], p[2] - p[0]));
    double longest2 = 0;
    for (std::size_t k = 0; k < 3; ++k)
      longest2 = std::max(longest2, dot(p[(k + 1) % 3] - p[k], p[(k + 1) % 3] - p[k]));
    const bool flat = !(area2 > 1e-6 * longest2);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[(k + 1) % 3], b = t[(k + 2) % 3];
      const double cotangent = flat ? 0.5773502691896258 : dot(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]) / area2;
      shares.push_back({{std::min(a, b), std::max(a, b)}, cotangent / 2});
      if (!flat) result.areas[t[k]] += area2 / 6;
    }
    if (!flat) result.total_area += area2 / 2;
  }
  // Stable, so that the sums have one order.
  std::ranges::stable_sort(shares, {}, &Share::edge);
  for (const Share& share : shares) {
    if (result.edges.empty() || result.edges.back() != share.edge) {
      result.edges.push_back(share.edge);
      result.weights.push_back(0);
    }
    result.weights.back() += share.weight;
  }
  for (double& w : result.weights) w = std::clamp(w, least_weight, most_weight);
  return result;
}

}  // namespace npt::inline NPT_ABI
