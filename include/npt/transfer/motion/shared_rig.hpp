/// Whether two skeletons are one rig: joints of the same names below each other, which were bound nearly alike. Makers
/// then give both the same turns of each joint in its parent, from how it was bound; so a retargeting does, and bones
/// keep the small differences of builds. Elsewhere bones are turned to point where the source's point.
/// Measured  against makers' own clips on pairs of characters with one rig, joints' errors at the 95th percentile in
///           shares of the height: men and women 0.4 instead of 3.1 %, six monsters 2.8 instead of 5.3 %
#pragma once

#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/retarget_side.hpp>

#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// [joints] The next joint above that has a role; no_item: none.
inline std::vector<std::size_t> bearers(const RetargetSide& side) {
  std::vector<std::size_t> all(side.motion.joints.size(), no_item);
  for (std::size_t j = 0; j < all.size(); ++j) {
    const std::size_t parent = side.motion.joints[j].parent;
    if (parent != no_item) all[j] = side.roles.role_of(parent) != JointRole::none ? parent : all[parent];
  }
  return all;
}

/// across: from the source's directions to the target's
inline bool share_rig(const RetargetSide& source, const RetargetSide& target, const Quaternion& across) {
  // Half of the angle between arms of an A and a T pose, at least; one rig's joints differ by 5 degrees.
  constexpr double alike = 0.94;  // cos 20 degrees
  if (source.roles.kind() != target.roles.kind()) return false;
  const std::vector<std::size_t> above = bearers(source), below = bearers(target);
  for (std::size_t r = 0; r < joint_role_count; ++r) {
    const auto role = static_cast<JointRole>(r);
    const std::size_t own = target.roles.joint(role), other = source.roles.joint(role);
    if (own == no_item) continue;
    if (other == no_item || target.motion.joints[own].name != source.motion.joints[other].name ||
        (below[own] == no_item) != (above[other] == no_item) ||
        (below[own] != no_item && target.roles.role_of(below[own]) != source.roles.role_of(above[other])))
      return false;
    const Quaternion turn = target.rotations[own] * inverse(across * source.rotations[other] * inverse(across));
    const Vec3d bone = target.direction(role), others = across(source.direction(role));
    if (2 * turn.w * turn.w - 1 < alike || dot(bone, others) < alike * length(bone) * length(others)) return false;
  }
  return true;
}

}  // namespace internal

}  // namespace npt::inline NPT_ABI
