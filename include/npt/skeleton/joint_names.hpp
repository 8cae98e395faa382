/// What tools call the joints of a person, so that they know a skeleton by its names and put clips of their own on it.
/// Source    VRM 1.0, VRMC_vrm humanoid bones; Mixamo's rigs; SMPL's joints (body/skeleton.hpp)
#pragma once

#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>

#include <array>
#include <cstddef>
#include <string_view>

namespace npt::inline NPT_ABI {

enum class JointNames { vrm, mixamo, smpl };

/// In SMPL's order. Its hands are where both others have the middle finger's first joint.
inline constexpr std::array<std::string_view, smpl_joint_count> vrm_joint_names{
    "hips",         "leftUpperLeg",  "rightUpperLeg", "spine",      "leftLowerLeg",       "rightLowerLeg",
    "chest",        "leftFoot",      "rightFoot",     "upperChest", "leftToes",           "rightToes",
    "neck",         "leftShoulder",  "rightShoulder", "head",       "leftUpperArm",       "rightUpperArm",
    "leftLowerArm", "rightLowerArm", "leftHand",      "rightHand",  "leftMiddleProximal", "rightMiddleProximal"};

inline constexpr std::array<std::string_view, smpl_joint_count> mixamo_joint_names{
    "mixamorig:Hips",      "mixamorig:LeftUpLeg",    "mixamorig:RightUpLeg",      "mixamorig:Spine",
    "mixamorig:LeftLeg",   "mixamorig:RightLeg",     "mixamorig:Spine1",          "mixamorig:LeftFoot",
    "mixamorig:RightFoot", "mixamorig:Spine2",       "mixamorig:LeftToeBase",     "mixamorig:RightToeBase",
    "mixamorig:Neck",      "mixamorig:LeftShoulder", "mixamorig:RightShoulder",   "mixamorig:Head",
    "mixamorig:LeftArm",   "mixamorig:RightArm",     "mixamorig:LeftForeArm",     "mixamorig:RightForeArm",
    "mixamorig:LeftHand",  "mixamorig:RightHand",    "mixamorig:LeftHandMiddle1", "mixamorig:RightHandMiddle1"};

/// Of one of SMPL's 24 joints.
constexpr std::string_view joint_name(std::size_t joint, JointNames names) {
  const auto& all = names == JointNames::vrm      ? vrm_joint_names
                    : names == JointNames::mixamo ? mixamo_joint_names
                                                  : smpl_joint_names;
  return all[joint];
}

}  // namespace npt::inline NPT_ABI
