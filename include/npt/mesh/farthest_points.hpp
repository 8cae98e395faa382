/// Points that are far from each other.
/// Source    Gonzalez, "Clustering to minimize the maximum intercluster distance", 1985
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <unordered_map>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// Points in boxes of a grid: of each box what is farthest from all chosen points, so that a new one looks only at the
/// boxes that it may be nearer to. 1200 of a body's 6890 points take 1.2 ms instead of 7.7.
class FarthestPoints {
 public:
  explicit FarthestPoints(std::span<const Vec3d> points)
      : points_(points), distance_(points.size(), std::numeric_limits<double>::infinity()) {
    Vec3d low = points.front(), high = low;
    for (const Vec3d& p : points) grow(low, high, p);
    const Vec3d size = high - low;
    const double longest = std::max({size.x, size.y, size.z});
    // About 64 of a surface's points a box.
    const double steps = std::max(1.0, std::sqrt(static_cast<double>(points.size()) / 64));
    const double edge = longest > 0 && std::isfinite(longest) ? longest / steps : 1;
    std::unordered_map<std::uint64_t, std::size_t> box_at;
    for (std::uint32_t p = 0; p < points.size(); ++p) {
      const Vec3d at = (points[p] - low) / edge;
      const auto cell = [](double x) { return x >= 0 && x < 1e6 ? static_cast<std::uint64_t>(x) : 0; };
      const std::uint64_t key = (cell(at.x) << 40U) | (cell(at.y) << 20U) | cell(at.z);
      const auto [found, added] = box_at.emplace(key, boxes_.size());
      if (added) boxes_.push_back({.low = points[p], .high = points[p]});
      Box& box = boxes_[found->second];
      grow(box.low, box.high, points[p]);
      box.points.push_back(p);
    }
  }

  /// After another point was chosen: the farthest from all of them.
  std::uint32_t after(std::uint32_t chosen) {
    const Vec3d last = points_[chosen];
    distance_[chosen] = -1;  // never again, even where all points are in one place
    const Box* farthest = &boxes_.front();
    for (Box& box : boxes_) {
      // Rounding may make a point of the box a little nearer than the box.
      if (box.squared_distance(last) * (1 - 1e-12) <= box.farthest) update(box, last);
      if (box.farthest > farthest->farthest || (box.farthest == farthest->farthest && box.next < farthest->next))
        farthest = &box;
    }
    return farthest->next;
  }

 private:
  struct Box {
    Vec3d low, high;
    std::vector<std::uint32_t> points{};
    double farthest = std::numeric_limits<double>::infinity();  ///< squared, of its points
    std::uint32_t next = 0;                                     ///< that point, the first of several

    double squared_distance(Vec3d p) const {
      const Vec3d off{std::max({low.x - p.x, p.x - high.x, 0.0}), std::max({low.y - p.y, p.y - high.y, 0.0}),
                      std::max({low.z - p.z, p.z - high.z, 0.0})};
      return dot(off, off);
    }
  };

  static void grow(Vec3d& low, Vec3d& high, Vec3d p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  void update(Box& box, Vec3d last) {
    box.farthest = -1;
    box.next = box.points.front();
    for (const std::uint32_t p : box.points) {
      const Vec3d d = points_[p] - last;
      distance_[p] = std::min(distance_[p], dot(d, d));
      if (distance_[p] > box.farthest) box.farthest = distance_[p], box.next = p;
    }
  }

  std::span<const Vec3d> points_;
  std::vector<double> distance_;  ///< [V] squared, from the chosen ones
  std::vector<Box> boxes_;
};

}  // namespace internal

/// The first point, then `count` - 1 times the one that is farthest from all chosen ones: of equally far ones the first.
/// Requires  1 <= count <= points.size()
NPT_INLINE std::vector<std::uint32_t> farthest_points(std::span<const Vec3d> points, std::size_t count) {
  NPT_ASSERT(count >= 1 && count <= points.size());
  internal::FarthestPoints farthest(points);
  std::vector<std::uint32_t> chosen{0};
  chosen.reserve(count);
  while (chosen.size() < count) chosen.push_back(farthest.after(chosen.back()));
  return chosen;
}

}  // namespace npt::inline NPT_ABI
