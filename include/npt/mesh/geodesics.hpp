/// Shortest paths along the edges of a mesh, from several points at once.
/// Source    Dijkstra, "A note on two problems in connexion with graphs", 1959
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/topology.hpp>

#include <cstdint>
#include <functional>
#include <limits>
#include <queue>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// What no path reaches has an infinite distance and no_index.
struct Geodesics {
  std::vector<double> distance;        ///< [P] along the edges, from the nearest start
  std::vector<std::uint32_t> nearest;  ///< [P] number of that start
};

/// From the points `starts`, through points that `inside` accepts.
template <class Inside>
Geodesics geodesics(std::span<const Vec3d> points, const Neighbours& around, std::span<const std::uint32_t> starts,
                    const Inside& inside) {
  using Reached = std::pair<double, std::uint32_t>;
  Geodesics result{std::vector<double>(points.size(), std::numeric_limits<double>::infinity()),
                   std::vector<std::uint32_t>(points.size(), no_index)};
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> front;
  for (std::uint32_t i = 0; i < starts.size(); ++i) {
    result.distance[starts[i]] = 0;
    result.nearest[starts[i]] = i;
    front.emplace(0.0, starts[i]);
  }
  while (!front.empty()) {
    const auto [so_far, p] = front.top();
    front.pop();
    if (so_far > result.distance[p]) continue;
    for (const std::uint32_t n : around.of(p)) {
      const double through = so_far + length(points[n] - points[p]);
      if (!inside(n) || !(through < result.distance[n])) continue;
      result.distance[n] = through;
      result.nearest[n] = result.nearest[p];
      front.emplace(through, n);
    }
  }
  return result;
}

NPT_INLINE Geodesics geodesics(std::span<const Vec3d> points, const Neighbours& around,
                               std::span<const std::uint32_t> starts) {
  return geodesics(points, around, starts, [](std::uint32_t) { return true; });
}

}  // namespace npt::inline NPT_ABI
