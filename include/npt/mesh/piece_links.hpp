/// What lies on what: hair on a head, cloth on skin, a shoe on a foot. They are pieces (connected components) of their
/// own, which nothing holds together when a mesh is deformed piece by piece. A link joins a point to the nearest point
/// of another piece that is near and faces the same way. A hand at a hip is near, too, but faces it, and isn't linked.
/// Shapes      points: [P]; triangles of numbers below P
/// Complexity  linear in the points, if few lie within `reach` of each other
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// Points sorted by the cells of a grid; equal cells stand together.
class PointGrid {
 public:
  PointGrid(std::span<const Vec3d> points, double cell) : cell_(cell), entries_(points.size()) {
    for (std::uint32_t p = 0; p < points.size(); ++p) entries_[p] = {key(place(points[p])), p};
    std::ranges::sort(entries_);
  }
  /// Calls visit(point) for all points whose distance from `at` may be within a cell's size, in a fixed order.
  template <class Visit>
  void near(Vec3d at, Visit&& visit) const {
    const auto [x, y, z] = place(at);
    for (std::int64_t i = x - 1; i <= x + 1; ++i)
      for (std::int64_t j = y - 1; j <= y + 1; ++j)
        for (std::int64_t k = z - 1; k <= z + 1; ++k) {
          const auto wanted = key({i, j, k});
          for (auto e = std::ranges::lower_bound(entries_, wanted, {}, &Entry::first);
               e != entries_.end() && e->first == wanted; ++e)
            visit(e->second);
        }
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  using Entry = std::pair<Cell, std::uint32_t>;

  static Cell key(const Cell& cell) { return cell; }
  Cell place(Vec3d p) const {
    const auto along = [this](double v) {
      return static_cast<std::int64_t>(std::floor(std::clamp(v / cell_, -1e15, 1e15)));
    };
    return {along(p.x), along(p.y), along(p.z)};
  }

  double cell_;
  std::vector<Entry> entries_;
};

}  // namespace internal

/// Links {a, b}, a < b, each once, ascending: for every point the nearest one of another piece, where one is within
/// `reach` and the normals are less than 60 degrees apart. Points of no triangle aren't linked.
NPT_INLINE std::vector<Edge> piece_links(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                                         double reach) {
  const std::vector<std::uint32_t> piece = connected_components(triangles, points.size());
  std::vector<Vec3d> normals = area_vectors(points, triangles);
  bool several = false;
  for (std::size_t p = 0; p < points.size(); ++p) {
    normals[p] = normalised(normals[p]);
    several = several || (normals[p] != Vec3d{} && piece[p] != piece[triangles.front()[0]]);
  }
  std::vector<Edge> links;
  if (!several || !(reach > 0)) return links;
  const internal::PointGrid grid(points, reach);
  for (std::uint32_t p = 0; p < points.size(); ++p) {
    if (normals[p] == Vec3d{}) continue;
    double nearest = reach * reach;
    std::uint32_t found = p;
    grid.near(points[p], [&](std::uint32_t q) {
      const Vec3d d = points[q] - points[p];
      if (piece[q] == piece[p] || !(dot(d, d) < nearest) || !(dot(normals[p], normals[q]) > 0.5)) return;
      nearest = dot(d, d);
      found = q;
    });
    if (found != p) links.push_back({std::min(p, found), std::max(p, found)});
  }
  return unique_edges(links);
}

}  // namespace npt::inline NPT_ABI
