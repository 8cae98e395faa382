/// How bones move: rotations of joints, rigid motions, and forward kinematics along a tree of joints.
///   G_j(x) = G_parent(R_j (x - c_j) + c_j),  c_j the joint in the rest pose, R_j its rotation relative to its parent
/// Shapes   parents, joints, rotations, motions: [J], parents before children; the root's parent is below 0
/// Source   Loper et al., "SMPL: A Skinned Multi-Person Linear Model", SIGGRAPH Asia 2015, section 3, eq. 2 to 4
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// x -> rotation x + shift
struct RigidMotion {
  Matrix3 rotation = Matrix3::identity();
  Vec3d shift;

  constexpr Vec3d operator()(Vec3d p) const { return rotation * p + shift; }
  /// x -> a(b(x))
  friend constexpr RigidMotion operator*(const RigidMotion& a, const RigidMotion& b) {
    return {a.rotation * b.rotation, a(b.shift)};
  }
  constexpr RigidMotion inverse() const {
    const Matrix3 back = rotation.transposed();
    return {back, -(back * shift)};
  }
};

/// Rodrigues' formula. The result is exactly the identity for the zero vector.
NPT_INLINE Matrix3 rotation_matrix(Vec3d axis_angle) {
  const double angle = length(axis_angle);
  if (angle == 0.0) return Matrix3::identity();
  const Vec3d a = axis_angle / angle;
  const double s = std::sin(angle), c = std::cos(angle), k = 1.0 - c;
  return {{{{c + a.x * a.x * k, a.x * a.y * k - a.z * s, a.x * a.z * k + a.y * s},
            {a.y * a.x * k + a.z * s, c + a.y * a.y * k, a.y * a.z * k - a.x * s},
            {a.z * a.x * k - a.y * s, a.z * a.y * k + a.x * s, c + a.z * a.z * k}}}};
}

/// The axis angle of a rotation, of at most half a turn.
NPT_INLINE Vec3d axis_angle(const Matrix3& r) {
  const Vec3d skew{r.rows[2].y - r.rows[1].z, r.rows[0].z - r.rows[2].x, r.rows[1].x - r.rows[0].y};
  const double sine = length(skew) / 2, cosine = (r.rows[0].x + r.rows[1].y + r.rows[2].z - 1) / 2;
  const double angle = std::atan2(sine, cosine);
  if (sine > 1e-6) return skew * (angle / (2 * sine));
  if (cosine > 0) return skew * 0.5;
  // Half a turn: r + I = 2 a a^T.
  const std::array<double, 3> d{r.rows[0].x, r.rows[1].y, r.rows[2].z};
  const std::size_t k = static_cast<std::size_t>(std::ranges::max_element(d) - d.begin());
  const Vec3d e{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
  return normalised(r.transposed() * e + e) * std::numbers::pi;
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
                                   std::span<const Matrix3> rotations, std::vector<RigidMotion>& motions) {
  motions.resize(joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const RigidMotion own{rotations[j], joints[j] - rotations[j] * joints[j]};
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
