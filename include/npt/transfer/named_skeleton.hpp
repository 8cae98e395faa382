/// A character's skeleton with the joints of a dialect: its names, and axes in which local rotations of the dialect's
/// clips turn the bones as they turn those of its own skeletons, without a retargeting.
///   Mixamo    in T pose, y along the bones of arms and legs; z down in arms, forwards in trunk and legs, up in toes
///   SMPL      the body's axes in T pose
///   VRM       the mesh's axes in the mesh's pose: who plays VRM clips looks at a T pose first
/// Limits    bones point as the clip's, and are as long as the character's: its hands are elsewhere than the clip's
/// Source    Mixamo's rigs as FBX: the axes of their bind matrices
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/joint_names.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/character.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// Axes of a joint in T pose, of a body that looks along +z, and where its bone points then, if it is to point as the
/// clip's. Collar bones and feet aren't: shoulders would rise or fall, and soles not stand.
struct JointAxes {
  Quaternion axes{};
  Vec3d bone{};
};

/// joint: of SMPL's, or a finger's
inline JointAxes mixamo_axes(std::size_t joint) {
  using enum SmplJoint;
  constexpr double half = 0.5;
  constexpr Quaternion leg{0, 0, 1, 0};                              // x: -x, y: -y, z: z
  constexpr JointAxes left{{half, half, -half, half}, {1, 0, 0}};    // x: -z, y: x, z: -y
  constexpr JointAxes right{{half, -half, half, half}, {-1, 0, 0}};  // x: z, y: -x, z: -y
  if (joint >= smpl_joint_count) return joint < middle_finger_joint(1, 0) ? left : right;
  if (is_joint(joint, left_shoulder, left_elbow, left_wrist, left_hand)) return left;
  if (is_joint(joint, right_shoulder, right_elbow, right_wrist, right_hand)) return right;
  // In radians: collar bones fall, feet point on from the shins, and toes are level.
  constexpr double fall = 0.2, on = 0.87, level = std::numbers::pi / 2;
  const auto about_x = [](double turn) { return Quaternion{std::sin(turn / 2), 0, 0, std::cos(turn / 2)}; };
  const auto about_z = [](double turn) { return Quaternion{0, 0, std::sin(turn / 2), std::cos(turn / 2)}; };
  if (is_joint(joint, left_collar)) return {about_z(-fall) * left.axes, {}};
  if (is_joint(joint, right_collar)) return {about_z(fall) * right.axes, {}};
  if (is_joint(joint, left_hip, right_hip, left_knee, right_knee)) return {leg, {0, -1, 0}};
  if (is_joint(joint, left_ankle, right_ankle)) return {leg * about_x(on), {}};
  if (is_joint(joint, left_foot, right_foot)) return {leg * about_x(level), {}};
  return {};
}

/// Where each joint's bone points in the body's rest: to its first child, or else on as its parent's.
inline std::vector<Vec3d> bones_at_rest(const SkinnedSkeleton& skeleton, const std::vector<Affine>& rest) {
  std::vector<Vec3d> bones(skeleton.joint_count());
  const auto bone_to = [&](std::size_t child) {
    const std::size_t parent = skeleton.parents[child];
    return rest[child](skeleton.joints[child]) - rest[parent](skeleton.joints[parent]);
  };
  for (std::size_t j = bones.size(); j-- > 0;)
    if (skeleton.parents[j] != SkinnedSkeleton::no_parent) bones[skeleton.parents[j]] = bone_to(j);
  for (std::size_t j = 0; j < bones.size(); ++j)
    if (bones[j] == Vec3d{} && skeleton.parents[j] != SkinnedSkeleton::no_parent) bones[j] = bone_to(j);
  return bones;
}

}  // namespace internal

/// Nothing where the character has no skeleton. Another kind's than people's stays as it is.
inline std::optional<SkinnedSkeleton> named_skeleton(const Character& character, JointNames names) {
  std::optional<SkinnedSkeleton> skeleton = character.skeleton();
  // No dialect has names for another kind of body: its joints keep their own.
  if (!skeleton || skeleton->names.empty() || skeleton->names.front() != joint_name(0, JointNames::vrm))
    return skeleton;
  const std::size_t count = std::min(skeleton->joint_count(), fingered_joint_count);
  for (std::size_t j = 0; j < count; ++j) skeleton->names[j] = std::string(joint_name(j, names));
  if (names == JointNames::vrm) return skeleton;
  const std::vector<Affine> rest = character.rest_motions();
  const std::vector<Vec3d> bones = internal::bones_at_rest(*skeleton, rest);
  for (std::size_t j = 0; j < count; ++j) {
    Quaternion axes = inverse(quaternion_of(rest[j].linear));
    if (names == JointNames::mixamo) {
      const internal::JointAxes own = internal::mixamo_axes(j);
      if (own.bone != Vec3d{}) axes = axes * turn_between(own.bone, bones[j]);
      axes = axes * own.axes;
    }
    skeleton->frames.push_back(normalised(axes));
  }
  skeleton->frames.resize(skeleton->joint_count());
  return skeleton;
}

}  // namespace npt::inline NPT_ABI
