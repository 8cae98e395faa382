/// SMPL's skeleton (Loper et al., "SMPL: A Skinned Multi-Person Linear Model", SIGGRAPH Asia 2015): 24 joints, their
/// names, their order and their parents.
#pragma once

#include <npt/config.hpp>

#include <array>
#include <cstddef>
#include <string_view>

namespace npt::inline NPT_ABI {

inline constexpr std::size_t smpl_joint_count = 24;
/// With the finger joints that body estimation adds (body/mannequin/finger_joints.hpp): of the left hand, then of the
/// right one, the middle and the end joint of index, middle, ring and little finger.
inline constexpr std::size_t finger_count = 4;
inline constexpr std::size_t fingered_joint_count = smpl_joint_count + 4 * finger_count;
/// side: 0 left, 1 right. finger: from 0, the index finger, to 3. The end joint is the next one.
constexpr std::size_t middle_finger_joint(std::size_t side, std::size_t finger) {
  return smpl_joint_count + 2 * (finger_count * side + finger);
}

/// `left` is the body's own left, at x > 0 for a body that faces +z.
enum class SmplJoint : std::size_t {
  pelvis,
  left_hip,
  right_hip,
  spine1,
  left_knee,
  right_knee,
  spine2,
  left_ankle,
  right_ankle,
  spine3,
  left_foot,
  right_foot,
  neck,
  left_collar,
  right_collar,
  head,
  left_shoulder,
  right_shoulder,
  left_elbow,
  right_elbow,
  left_wrist,
  right_wrist,
  left_hand,
  right_hand
};

constexpr std::size_t joint_index(SmplJoint joint) { return static_cast<std::size_t>(joint); }
template <class... Joints>
constexpr std::array<std::size_t, sizeof...(Joints)> joint_indices(Joints... joints) {
  return {joint_index(joints)...};
}
template <class... Joints>
constexpr bool is_joint(std::size_t joint, Joints... joints) {
  return ((joint == joint_index(joints)) || ...);
}

inline constexpr std::array<int, smpl_joint_count> smpl_parents{-1, 0, 0, 0,  1,  2,  3,  4,  5,  6,  7,  8,
                                                                9,  9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21};

/// The joint of the other side; joints of the middle are their own.
inline constexpr std::array<std::size_t, smpl_joint_count> smpl_mirrored_joints{
    0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20, 23, 22};

inline constexpr std::array<std::string_view, smpl_joint_count> smpl_joint_names{
    "pelvis",     "l_hip",      "r_hip",   "spine1",  "l_knee",  "r_knee",   "spine2",   "l_ankle",
    "r_ankle",    "spine3",     "l_foot",  "r_foot",  "neck",    "l_collar", "r_collar", "head",
    "l_shoulder", "r_shoulder", "l_elbow", "r_elbow", "l_wrist", "r_wrist",  "l_hand",   "r_hand"};

}  // namespace npt::inline NPT_ABI
