/// The source triangles that each triangle of a target follows, by pairs of triangles. A triangle of the target without
/// a pair takes those of the nearest triangle that has some.
/// Errors   npt::Error for triangle numbers out of range, and for no pair whose source triangle has an area
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/deformation/correspondence.hpp>
#include <npt/baseline/deformation/surface.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI::deformation {

class TriangleSources {
 public:
  TriangleSources(const Surface& source, const Surface& target, std::span<const TrianglePair> pairs) {
    std::vector<std::vector<std::uint32_t>> lists(target.triangles.size());
    for (const auto& [s, t] : pairs) {
      if (s >= source.triangles.size()) out_of_range("source", s, source.triangles.size());
      if (t >= target.triangles.size()) out_of_range("target", t, target.triangles.size());
      if (source.flat[s] == 0) lists[t].push_back(s);
    }
    complete(target, lists);
    start_.push_back(0);
    for (std::vector<std::uint32_t>& list : lists) {
      std::ranges::sort(list);
      list.erase(std::unique(list.begin(), list.end()), list.end());
      sources_.insert(sources_.end(), list.begin(), list.end());
      start_.push_back(sources_.size());
    }
  }

  /// The sources of a triangle of the target, ascending.
  std::span<const std::uint32_t> of(std::size_t t) const {
    return {sources_.data() + start_[t], start_[t + 1] - start_[t]};
  }
  /// How many sources all triangles have together.
  std::size_t size() const noexcept { return sources_.size(); }

 private:
  [[noreturn]] static void out_of_range(const char* which, std::uint32_t triangle, std::size_t count) {
    throw Error({.file = "triangle pairs",
                 .found = std::string(which) + " triangle " + std::to_string(triangle),
                 .expected = "a number below " + std::to_string(count)});
  }

  static void complete(const Surface& target, std::vector<std::vector<std::uint32_t>>& lists) {
    std::vector<Vec3d> centres;
    std::vector<std::uint32_t> number;
    for (std::uint32_t t = 0; t < lists.size(); ++t) {
      if (lists[t].empty()) continue;
      centres.push_back(target.centroid(t));
      number.push_back(t);
    }
    if (number.empty())
      throw Error({.file = "triangle pairs", .found = "none", .expected = "a pair whose source triangle has an area"});
    if (number.size() == lists.size()) return;
    const PointTree tree(centres);
    for (std::uint32_t t = 0; t < lists.size(); ++t)
      if (lists[t].empty()) lists[t] = lists[number[tree.closest(target.centroid(t)).triangle]];
  }

  std::vector<std::size_t> start_;      ///< [Tt + 1]
  std::vector<std::uint32_t> sources_;  ///< of each target triangle, one after another
};

}  // namespace npt::inline NPT_ABI::deformation
