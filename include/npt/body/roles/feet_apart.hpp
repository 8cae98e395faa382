/// Feet that a rig for inverse kinematics moves apart from their legs: no joint of the leg is above them.
#pragma once

#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>

#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

/// Such a foot, and the lower leg at whose end it belongs; of an animal any of a limb's joints, and the one before.
struct FootApart {
  std::size_t foot, knee;
};

inline std::vector<FootApart> feet_apart(const Motion& motion, const JointRoles& roles) {
  std::vector<FootApart> feet;
  const auto add = [&](std::size_t knee, std::size_t foot) {
    if (foot == no_item || knee == no_item) return;
    std::size_t above = foot;
    while (above != no_item && above != knee) above = motion.joints[above].parent;
    if (above == no_item) feet.push_back({foot, knee});
  };
  for (std::size_t side = 0; side < 2; ++side) {
    if (roles.kind() == SkeletonKind::person) {
      add(roles.joint(LimbPart::lower_leg, side), roles.joint(LimbPart::foot, side));
      continue;
    }
    for (const bool arm : {true, false}) {
      const std::vector<JointRole> limb = limb_roles(roles.kind(), arm, side);
      for (std::size_t i = 1; i < limb.size(); ++i) add(roles.joint(limb[i - 1]), roles.joint(limb[i]));
    }
  }
  return feet;
}

}  // namespace npt::inline NPT_ABI
