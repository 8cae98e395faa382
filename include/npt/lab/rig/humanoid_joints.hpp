/// Which of a rig's joints are a person's: SMPL's 24, by the roles that names and shape of the skeleton give them.
/// Shapes    result: [24] joints of the rig, or no_item where it has none; the spine's three stand open, since the
///           chain from the hips to the neck says more than its names
/// Errors    npt::Error for a skeleton that is hardly a person's, and for joints that a person must have
/// Source    joint_roles.hpp
#pragma once

#include <npt/base/error.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

namespace npt::inline NPT_ABI {

using HumanoidJoints = std::array<std::size_t, smpl_joint_count>;

inline HumanoidJoints humanoid_joints(const Rig& rig) {
  // A dog's has 0.67, the least of 50 game characters 0.75. What is wrongly a person spoils a training.
  constexpr double least = 0.69;
  using enum SmplJoint;
  const Motion motion = motion_of(rig.scene, nullptr, rig.name);
  const JointRoles roles = joint_roles(motion);
  if (roles.kind() != SkeletonKind::person)
    throw Error({.file = rig.name,
                 .found = std::to_string(rig.joint_count()) + " joints that are a four-legged animal's",
                 .expected = "a person's joints: npt info --bones lists what is found"});
  if (roles.confidence < least)
    throw Error({.file = rig.name,
                 .found = std::to_string(rig.joint_count()) + " joints that are a person's with a confidence of " +
                          std::to_string(std::lround(100 * roles.confidence)) + " %",
                 .expected = "a person's joints, with 69 %: npt info --bones lists what is found"});
  HumanoidJoints found;
  found.fill(no_item);
  const auto put = [&](SmplJoint joint, JointRole role, bool needed = false) {
    const std::size_t own = roles.joint(role);
    const auto at =
        own == no_item ? rig.joints.end() : std::find(rig.joints.begin(), rig.joints.end(), motion.joints[own].node);
    if (at != rig.joints.end())
      found[joint_index(joint)] = static_cast<std::size_t>(at - rig.joints.begin());
    else if (needed)
      throw Error({.file = rig.name,
                   .place = "joint " + std::string(smpl_joint_names[joint_index(joint)]),
                   .found = std::to_string(rig.joint_count()) + " joints without it",
                   .expected = "a joint of a skin for " + role_name(role) + ": npt info --bones lists what is found"});
  };
  put(pelvis, JointRole::hips);
  put(neck, JointRole::neck);
  put(head, JointRole::head, roles.joint(JointRole::neck) == no_item);
  struct Pair {
    SmplJoint left, right;
    LimbPart part;
    bool needed;
  };
  for (const Pair& p : {Pair{left_hip, right_hip, LimbPart::upper_leg, true},
                        {left_knee, right_knee, LimbPart::lower_leg, true},
                        {left_ankle, right_ankle, LimbPart::foot, false},
                        {left_foot, right_foot, LimbPart::toes, false},
                        {left_collar, right_collar, LimbPart::shoulder, false},
                        {left_shoulder, right_shoulder, LimbPart::upper_arm, true},
                        {left_elbow, right_elbow, LimbPart::lower_arm, true},
                        {left_wrist, right_wrist, LimbPart::hand, false},
                        {left_hand, right_hand, digit_part(2, 0), false}}) {
    put(p.left, limb_role(p.part, 0), p.needed);
    put(p.right, limb_role(p.part, 1), p.needed);
  }
  return found;
}

}  // namespace npt::inline NPT_ABI
