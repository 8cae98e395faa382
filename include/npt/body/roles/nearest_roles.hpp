/// The part of the body that each joint of a skeleton belongs to: its own role, or that of the one that it hangs from.
///   std::vector<JointRole> parts = nearest_roles(motion, roles);
/// Joints above the hips belong to the hips: some rigs skin the bottom of the trunk to a root.
#pragma once

#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

/// [joints]; none for what hangs beside the hips
inline std::vector<JointRole> nearest_roles(const Motion& motion, const JointRoles& roles) {
  std::vector<JointRole> nearest(motion.joints.size());
  for (std::size_t j = 0; j < nearest.size(); ++j) {
    const std::size_t parent = motion.joints[j].parent;
    nearest[j] = roles.role_of(j);
    if (nearest[j] == JointRole::none && parent != no_item) nearest[j] = nearest[parent];
  }
  for (std::size_t j = roles.joint(JointRole::hips); j != no_item; j = motion.joints[j].parent)
    nearest[j] = JointRole::hips;
  return nearest;
}

constexpr bool is_of_trunk(JointRole role) {
  return role == JointRole::hips || (role >= JointRole::spine && role <= JointRole::upper_chest);
}

}  // namespace npt::inline NPT_ABI
