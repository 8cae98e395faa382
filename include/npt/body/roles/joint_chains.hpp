/// Joints that follow each other in spine, neck and tail, whose numbers differ between skeletons; and joints without a
/// role that two skeletons of one maker have in common, as ears and hooves.
#pragma once

#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <vector>

namespace npt::inline NPT_ABI {

/// From the hips on, each: spine, neck without the head, tail. A person's spine is that of its roles.
using JointChains = std::array<std::vector<std::size_t>, 3>;
inline constexpr std::size_t neck_chain = 1;

/// across: with a person's neck, which counts where animals and people take each other's motions
inline JointChains joint_chains(const Motion& motion, const JointRoles& roles, bool across = false) {
  using enum JointRole;
  JointChains chains;
  const auto add = [&](std::vector<std::size_t>& chain, std::initializer_list<JointRole> parts) {
    for (const JointRole role : parts)
      if (roles.joint(role) != no_item) chain.push_back(roles.joint(role));
  };
  add(chains[0], {spine, chest, upper_chest});
  if (roles.kind() == SkeletonKind::person && !across) return chains;
  add(chains[neck_chain], {neck, neck_2, neck_3});
  add(chains[2], {tail_1, tail_2, tail_3, tail_4, tail_5});
  for (std::vector<std::size_t>& chain : chains) {  // with those between the roles' joints
    if (chain.empty()) continue;
    const std::size_t first = chain.front();
    std::vector<std::size_t> whole{chain.back()};
    while (whole.back() != first && whole.back() != no_item) whole.push_back(motion.joints[whole.back()].parent);
    if (whole.back() == no_item) continue;
    chain.assign(whole.rbegin(), whole.rend());
  }
  return chains;
}

/// [joints of the target] Those of the source, where both are animals with names of one dialect; no_item: none.
inline std::vector<std::size_t> same_joints(const Motion& source, const JointRoles& from, const Motion& target,
                                            const JointRoles& to) {
  std::vector<std::size_t> same(target.joints.size(), no_item);
  if (to.kind() == SkeletonKind::person || from.kind() != to.kind() || from.dialect != to.dialect) return same;
  const auto nearest = [](const Motion& motion, const JointRoles& roles, std::size_t joint) {
    while (joint != no_item && roles.role_of(joint) == JointRole::none) joint = motion.joints[joint].parent;
    return joint == no_item ? JointRole::none : roles.role_of(joint);
  };
  for (std::size_t j = 0; j < same.size(); ++j) {
    const JointRole role = nearest(target, to, j);
    if (role == JointRole::none || to.role_of(j) != JointRole::none) continue;
    const auto found = std::ranges::find(source.joints, target.joints[j].name, &MotionJoint::name);
    const auto joint = static_cast<std::size_t>(found - source.joints.begin());
    if (found != source.joints.end() && from.role_of(joint) == JointRole::none && nearest(source, from, joint) == role)
      same[j] = joint;
  }
  return same;
}

}  // namespace npt::inline NPT_ABI
