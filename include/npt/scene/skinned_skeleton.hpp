/// A skeleton and skin weights for a mesh, in the mesh's own pose; animate.hpp puts them into a scene.
/// Shapes    weights: [V, influences], any number of influences a vertex
#pragma once

#include <npt/config.hpp>
#include <npt/core/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// A mesh's skeleton in the mesh's own pose. Joints have no rotation of their own: their axes are the mesh's.
struct SkinnedSkeleton {
  static constexpr std::size_t no_parent = static_cast<std::size_t>(-1);

  struct Influence {
    std::uint16_t joint = 0;
    float weight = 0;
  };

  std::vector<std::string> names;
  std::vector<std::size_t> parents;  ///< no_parent: a root; parents stand before children
  std::vector<Vec3d> joints;
  std::vector<std::size_t> start;     ///< [V + 1] where a vertex's influences begin
  std::vector<Influence> influences;  ///< not negative, a vertex's sum to 1

  std::size_t joint_count() const noexcept { return joints.size(); }
};

/// Four influences, the largest, as engines want them.
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
