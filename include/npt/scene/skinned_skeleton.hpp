/// A skeleton and skin weights for a mesh, in the mesh's own pose; animate.hpp puts them into a scene.
/// Shapes    weights: [V, influences], any number of influences a vertex
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// A mesh's skeleton in the mesh's own pose.
struct SkinnedSkeleton {
  static constexpr std::size_t no_parent = static_cast<std::size_t>(-1);

  struct Influence {
    std::uint16_t joint = 0;
    float weight = 0;
  };

  std::vector<std::string> names;
  std::vector<std::size_t> parents;  ///< no_parent: a root; parents stand before children
  std::vector<Vec3d> joints;
  std::vector<Quaternion> frames{};   ///< [joints] how their axes stand in the mesh's; empty: as the mesh's
  std::vector<std::size_t> start;     ///< [V + 1] where a vertex's influences begin
  std::vector<Influence> influences;  ///< not negative, a vertex's sum to 1

  std::size_t joint_count() const noexcept { return joints.size(); }
  Quaternion frame(std::size_t joint) const {
    return frames.empty() || joint == no_parent ? Quaternion{} : frames[joint];
  }
  /// From a joint's own coordinates to the mesh's.
  Affine bind(std::size_t joint) const { return {matrix_of(frame(joint)), joints[joint]}; }
};

}  // namespace npt::inline NPT_ABI
