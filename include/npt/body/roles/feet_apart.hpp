/// Feet that a rig for inverse kinematics moves apart from their legs: no joint of the leg is above them.
#pragma once

#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>

#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

/// Such a foot, and the lower leg at whose end it belongs.
struct FootApart {
  std::size_t foot, knee;
};

inline std::vector<FootApart> feet_apart(const Motion& motion, const JointRoles& roles) {
  std::vector<FootApart> feet;
  for (std::size_t side = 0; side < 2; ++side) {
    const std::size_t foot = roles.joint(LimbPart::foot, side), knee = roles.joint(LimbPart::lower_leg, side);
    if (foot == no_item || knee == no_item) continue;
    std::size_t above = foot;
    while (above != no_item && above != knee) above = motion.joints[above].parent;
    if (above == no_item) feet.push_back({foot, knee});
  }
  return feet;
}

}  // namespace npt::inline NPT_ABI
