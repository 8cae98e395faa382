/// Characters at rest that have no person's build: stylised figures in a T pose, as makers of games bind them.
///   std::vector<float> angles = npt::from_own_rest(identity.reading, axis_angles);
/// A body that is fitted to such a mesh bends where its proportions don't follow: a head that is set back tilts it,
/// arms that leave the shoulders lower raise them. In a T pose that is no posture but the character's build, and its
/// makers' skeleton calls it rest. The pose's angles are then taken from there:
///   R = R_pose exp(w log(R_person^-1 R_identity))
/// R_person being how the body fits people at rest. w is 1 for characters that keep a distance from the body and stand
/// in a T pose, and 0 for people, whose bend in a T pose is as much in the fit of their other poses.
/// Measured, PMD x 1e-4: a stylised man in a T pose, Table 6's poses of two people: 52 without and 19 with it. For
/// people with w = 1 a dressed man would have 21 instead of 6.6.
/// Shapes    axis angles: [24, 3], or [40, 3] with finger joints, which stay; radians, SMPL's order
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/build.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

namespace skeleton::internal {

/// [24, 3] degrees: the mannequin as it fits people in a T pose. Medians over 50 random shapes of human_6890 and
/// human_13380, made symmetric.
inline constexpr std::array<Vec3d, smpl_joint_count> people_at_rest{{
    {-0.4, 0, 0},     {1.5, -4.0, 2.2}, {1.5, 4.0, -2.2},   {-0.2, 0, 0},    {-2.6, -10.8, -2.6}, {-2.6, 10.8, 2.6},
    {0.9, 0, 0},      {0.9, 4.2, -3.0}, {0.9, -4.2, 3.0},   {1.7, 0, 0},     {0.2, 0.8, 0.1},     {0.2, -0.8, -0.1},
    {3.6, 0, 0},      {-2.4, 4.8, 1.1}, {-2.4, -4.8, -1.1}, {-2.7, 0, 0},    {-3.0, -5.7, 0.5},   {-3.0, 5.7, -0.5},
    {3.8, 4.3, -1.8}, {3.8, -4.3, 1.8}, {0.3, -3.0, -4.9},  {0.3, 3.0, 4.9}, {0.3, -0.1, -8.0},   {0.3, 0.1, 8.0},
}};

/// [24] How the joints are bent beyond people's at rest, as axis angles; the root without its direction.
NPT_INLINE std::array<Vec3d, smpl_joint_count> bend_beyond_rest(const BodyEstimate& reading) {
  std::array<Vec3d, smpl_joint_count> bend;
  for (std::size_t j = 0; j < smpl_joint_count; ++j) {
    const Matrix3 own = j == 0 ? reading.facing_front() * reading.joint_rotation(0) : reading.joint_rotation(j);
    const Matrix3 rest = rotation_matrix(people_at_rest[j] * (std::numbers::pi / 180));
    bend[j] = axis_angle(rest.transposed() * own);
  }
  return bend;
}

}  // namespace skeleton::internal

/// How far the mesh stands as a character of its own at rest, from 0 to 1: w above.
NPT_INLINE double own_rest(const BodyEstimate& reading) {
  const double strange = unlike_people(reading);
  if (reading.fit.body.axis_angles.empty() || !(strange > 0)) return 0;
  // A stylised man in a T pose is bent by up to 14 degrees, people who stand with their arms down by 60.
  double most = 0;
  const auto bend = skeleton::internal::bend_beyond_rest(reading);
  for (std::size_t j = 0; j < smpl_joint_count; ++j)
    if (j != joint_index(SmplJoint::left_hand) && j != joint_index(SmplJoint::right_hand))
      most = std::max(most, length(bend[j]));
  return strange * (1 - rising(most, 0.35, 0.5));
}

/// A pose's angles for an identity: the same, or from its own rest.
NPT_INLINE std::vector<float> from_own_rest(const BodyEstimate& identity, std::span<const float> axis_angles) {
  std::vector<float> result(axis_angles.begin(), axis_angles.end());
  const double weight = own_rest(identity);
  if (!(weight > 0)) return result;
  const auto bend = skeleton::internal::bend_beyond_rest(identity);
  for (std::size_t j = 0; j < smpl_joint_count; ++j) {
    set_joint_rotation(as_span(result), j, joint_rotation(axis_angles, j) * rotation_matrix(bend[j] * weight));
  }
  return result;
}

}  // namespace npt::inline NPT_ABI
