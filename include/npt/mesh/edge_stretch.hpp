/// How much longer the edges of a mesh are than before it was moved: where a surface is torn or drawn out.
/// Shapes    before, after: [V, 3] floats, row major
/// Numerics  double, in the edges' order; NaN where a coordinate isn't finite
#pragma once

#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct EdgeStretch {
  /// Length after by length before that edges with 99.9 % of the length of all don't exceed. An edge counts by its
  /// length before, so that degenerate ones have no weight.
  double common = 1;
  /// The largest length after by length before, where an edge shorter than the mean edge counts as one of that length.
  double largest = 0;
  std::uint32_t vertex = no_index;  ///< an end of that edge
};

/// Requires  vertex numbers below V
NPT_INLINE EdgeStretch edge_stretch(std::span<const Edge> edges, std::span<const float> before,
                                    std::span<const float> after) {
  std::vector<std::pair<double, double>> ratios;  // and lengths before
  ratios.reserve(edges.size());
  double sum = 0;
  for (const auto& [a, b] : edges) {
    const double from = length(point_at(before, a) - point_at(before, b));
    const double to = length(point_at(after, a) - point_at(after, b));
    if (!std::isfinite(from) || !std::isfinite(to)) {
      constexpr double nan = std::numeric_limits<double>::quiet_NaN();
      return {nan, nan, a};
    }
    sum += from;
    ratios.emplace_back(to, from);
  }
  EdgeStretch result;
  if (sum == 0) return result;
  result.vertex = edges[0][0];
  const double mean = sum / static_cast<double>(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    auto& [ratio, from] = ratios[e];
    if (const double stretch = ratio / std::max(from, mean); stretch > result.largest)
      result.largest = stretch, result.vertex = edges[e][0];
    ratio = from > 0 ? ratio / from : 0;
  }
  stable_sort_by(ratios, [](const auto& edge) { return edge.first; });
  double passed = 0;
  for (const auto& [ratio, from] : ratios) {
    result.common = ratio;
    passed += from;
    if (passed >= 0.999 * sum) break;
  }
  return result;
}

}  // namespace npt::inline NPT_ABI
