/// A vertex's skin weights as engines want them: four.
#pragma once

#include <npt/config.hpp>
#include <npt/scene/skinned_skeleton.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

inline constexpr std::size_t skin_influences = 4;

/// A vertex's largest influences, largest first, with weights that sum to 1 as floats do.
inline std::array<SkinnedSkeleton::Influence, skin_influences> largest_influences(
    std::span<const SkinnedSkeleton::Influence> influences) {
  std::vector<SkinnedSkeleton::Influence> sorted(influences.begin(), influences.end());
  std::ranges::stable_sort(sorted, [](const auto& a, const auto& b) { return a.weight > b.weight; });
  if (sorted.size() > skin_influences) sorted.resize(skin_influences);
  double sum = 0;
  for (const auto& influence : sorted) sum += static_cast<double>(influence.weight);
  std::array<SkinnedSkeleton::Influence, skin_influences> result{};
  double rest = 1;
  for (std::size_t i = sorted.size(); i-- > 0;) {
    const float weight = static_cast<float>(i == 0 ? rest : static_cast<double>(sorted[i].weight) / sum);
    if (!(weight > 0)) continue;
    result[i] = {sorted[i].joint, weight};
    rest -= static_cast<double>(weight);
  }
  if (sorted.empty() || !(sum > 0)) result = {{{0, 1}, {}, {}, {}}};
  return result;
}

}  // namespace npt::inline NPT_ABI
