/// How bones move: rotations of joints, and forward kinematics along a tree of joints.
///   G_j(x) = G_parent(R_j (x - c_j) + c_j),  c_j the joint in the rest pose, R_j its rotation relative to its parent
/// Shapes   parents, joints, rotations, motions: [J], parents before children; the root's parent is below 0
/// Source   Loper et al., "SMPL: A Skinned Multi-Person Linear Model", SIGGRAPH Asia 2015, section 3, eq. 2 to 4
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// How many bones lead from one joint to another.
/// Requires  every joint after its parent
constexpr std::size_t bones_between(std::span<const int> parents, std::uint32_t a, std::uint32_t b) {
  std::size_t bones = 0;
  for (; a != b; ++bones) (a > b ? a : b) = static_cast<std::uint32_t>(parents[a > b ? a : b]);
  return bones;
}

/// Joint j of axis angles [J, 3] as a rotation in its parent's frame.
NPT_INLINE Matrix3 joint_rotation(std::span<const float> axis_angles, std::size_t j) {
  return rotation_matrix(Vec3f{axis_angles[3 * j], axis_angles[3 * j + 1], axis_angles[3 * j + 2]}.as<double>());
}
NPT_INLINE void set_joint_rotation(std::span<float> axis_angles, std::size_t j, const Matrix3& rotation) {
  const Vec3f a = axis_angle(rotation).as<float>();
  axis_angles[3 * j] = a.x, axis_angles[3 * j + 1] = a.y, axis_angles[3 * j + 2] = a.z;
}

/// The motion of every bone from the rest pose; at rotations that are the identity it is the identity without any
/// rounding.
NPT_INLINE void forward_kinematics(std::span<const int> parents, std::span<const Vec3d> joints,
                                   std::span<const Matrix3> rotations, std::vector<Rigid>& motions) {
  motions.resize(joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const Rigid own = Rigid::about(joints[j], rotations[j]);
    motions[j] = parents[j] < 0 ? own : motions[static_cast<std::size_t>(parents[j])] * own;
  }
}

/// SMPL's input to the pose-dependent corrections: R - I of each joint but the root, row by row. feature: [9 (J - 1)]
NPT_INLINE void pose_feature(std::span<const Matrix3> rotations, std::span<double> feature) {
  for (std::size_t j = 1; j < rotations.size(); ++j) {
    const Matrix3 bend = rotations[j] - Matrix3::identity();
    for (std::size_t i = 0; i < 3; ++i) {
      double* to = &feature[9 * (j - 1) + 3 * i];
      to[0] = bend.rows[i].x, to[1] = bend.rows[i].y, to[2] = bend.rows[i].z;
    }
  }
}

}  // namespace npt::inline NPT_ABI
