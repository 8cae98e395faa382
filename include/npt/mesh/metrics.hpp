/// How far a result is from the truth: the point-wise mesh Euclidean distance (PMD) and what goes with it.
///   PMD = 1/V * sum_v |a_v - b_v|^2
/// Shapes    a, b: [V, 3] floats, row major, vertex v of one belongs to vertex v of the other
/// Units     squares of the coordinates' unit; sums in double
/// Errors    npt::Error for no vertices, and for different vertex counts
/// Source    Wang et al., CVPR 2020, eq. 7
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/points.hpp>

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// Throws npt::Error for no vertices, and for different vertex counts.
NPT_INLINE void expect_comparable(std::span<const float> a, std::span<const float> b) {
  expect_points(a, "result to compare");
  expect_points(b, "truth to compare with");
  if (a.size() != b.size())
    throw Error({.file = "truth to compare with",
                 .found = std::to_string(b.size() / 3) + " vertices",
                 .expected = std::to_string(a.size() / 3) + ", as many as the result has"});
}

/// |a_v - b_v| for each vertex.
NPT_INLINE std::vector<double> vertex_distances(std::span<const float> a, std::span<const float> b) {
  expect_comparable(a, b);
  std::vector<double> distances(a.size() / 3);
  for (std::size_t v = 0; v < distances.size(); ++v) distances[v] = length(point_at(a, v) - point_at(b, v));
  return distances;
}

/// Eq. 7: the mean over vertices of the squared distance.
NPT_INLINE double pmd(std::span<const float> a, std::span<const float> b) {
  expect_comparable(a, b);
  const std::size_t vertices = a.size() / 3;
  double sum = 0;
  for (std::size_t v = 0; v < vertices; ++v) {
    const Vec3d d = point_at(a, v) - point_at(b, v);
    sum += dot(d, d);
  }
  return sum / static_cast<double>(vertices);
}

/// The mean over the 3 V coordinates, a third of pmd: what the paper's public evaluation computes.
NPT_INLINE double pmd_per_coordinate(std::span<const float> a, std::span<const float> b) { return pmd(a, b) / 3; }

/// The root of a PMD in square metres, in millimetres.
NPT_INLINE double root_pmd_mm(double pmd_in_square_metres) { return 1000 * std::sqrt(pmd_in_square_metres); }

}  // namespace npt::inline NPT_ABI
