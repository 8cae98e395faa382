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

/// The finger joints that follow (middle_finger_joint()). SMPL has none; its names are like those of its others.
inline constexpr std::array<std::string_view, fingered_joint_count - smpl_joint_count> vrm_finger_names{
    "leftIndexIntermediate",  "leftIndexDistal",  "leftMiddleIntermediate",  "leftMiddleDistal",
    "leftRingIntermediate",   "leftRingDistal",   "leftLittleIntermediate",  "leftLittleDistal",
    "rightIndexIntermediate", "rightIndexDistal", "rightMiddleIntermediate", "rightMiddleDistal",
    "rightRingIntermediate",  "rightRingDistal",  "rightLittleIntermediate", "rightLittleDistal"};

inline constexpr std::array<std::string_view, fingered_joint_count - smpl_joint_count> mixamo_finger_names{
    "mixamorig:LeftHandIndex2",  "mixamorig:LeftHandIndex3",   "mixamorig:LeftHandMiddle2",
    "mixamorig:LeftHandMiddle3", "mixamorig:LeftHandRing2",    "mixamorig:LeftHandRing3",
    "mixamorig:LeftHandPinky2",  "mixamorig:LeftHandPinky3",   "mixamorig:RightHandIndex2",
    "mixamorig:RightHandIndex3", "mixamorig:RightHandMiddle2", "mixamorig:RightHandMiddle3",
    "mixamorig:RightHandRing2",  "mixamorig:RightHandRing3",   "mixamorig:RightHandPinky2",
    "mixamorig:RightHandPinky3"};

inline constexpr std::array<std::string_view, fingered_joint_count - smpl_joint_count> smpl_finger_names{
    "l_index_middle",  "l_index_end",  "l_middle_middle", "l_middle_end", "l_ring_middle",   "l_ring_end",
    "l_little_middle", "l_little_end", "r_index_middle",  "r_index_end",  "r_middle_middle", "r_middle_end",
    "r_ring_middle",   "r_ring_end",   "r_little_middle", "r_little_end"};

/// Of one of SMPL's 24 joints or the finger joints behind them.
constexpr std::string_view joint_name(std::size_t joint, JointNames names) {
  const auto pick = [names](const auto& vrm, const auto& mixamo, const auto& smpl) -> const auto& {
    return names == JointNames::vrm ? vrm : names == JointNames::mixamo ? mixamo : smpl;
  };
  if (joint >= smpl_joint_count)
    return pick(vrm_finger_names, mixamo_finger_names, smpl_finger_names)[joint - smpl_joint_count];
  return pick(vrm_joint_names, mixamo_joint_names, smpl_joint_names)[joint];
}

}  // namespace npt::inline NPT_ABI
