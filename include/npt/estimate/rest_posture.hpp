/// Characters at rest that have no person's build: stylised figures in a T pose, as makers of games bind them.
///   std::vector<float> angles = npt::from_own_rest(kind, bias.people_at_rest(), identity, axis_angles);
/// A body that is fitted to such a mesh bends where its proportions don't follow: a head that is set back tilts it,
/// arms that leave the shoulders lower raise them. In a T pose that is no posture but the character's build, and its
/// makers' skeleton calls it rest. The pose's angles are then taken from there:
///   R = R_pose exp(w log(R_person^-1 R_identity))
/// R_person being how the body fits people at rest (FitBias::people_at_rest). w is 1 for characters that keep a
/// distance from the body and stand in a T pose, and 0 for people, whose bend in a T pose is as much in the fit of
/// their other poses. Measured, PMD x 1e-4: a stylised man in a T pose, Table 6's poses of two people: 52 without and
/// 19 with it. For people with w = 1 a dressed man would have 21 instead of 6.6.
/// Shapes    people_at_rest: [J] axis angles, or none: then nobody has a rest of his own; axis angles: [J, 3], or more
///           with finger joints, which stay; radians
#pragma once

#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/build.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

namespace estimate::internal {

/// [J] How the joints are bent beyond people's at rest, as axis angles; the root without its direction.
NPT_INLINE std::vector<Vec3d> bend_beyond_rest(std::span<const Vec3d> people_at_rest, const BodyEstimate& estimate) {
  std::vector<Vec3d> bend = estimate.angles_without_yaw();
  for (std::size_t j = 0; j < bend.size(); ++j)
    bend[j] = axis_angle(rotation_matrix(people_at_rest[j]).transposed() * rotation_matrix(bend[j]));
  return bend;
}

}  // namespace estimate::internal

/// How far the mesh stands as a character of its own at rest, from 0 to 1: w above.
NPT_INLINE double own_rest(const BodyKind& kind, std::span<const Vec3d> people_at_rest, const BodyEstimate& reading) {
  const double strange = unlike_people(reading);
  if (people_at_rest.empty() || reading.fit.body.axis_angles.empty() || !(strange > 0)) return 0;
  // A stylised man in a T pose is bent by up to 14 degrees, people who stand with their arms down by 60.
  double most = 0;
  const auto bend = estimate::internal::bend_beyond_rest(people_at_rest, reading);
  for (std::size_t j = 0; j < bend.size(); ++j)
    if (!kind.hands || (j != kind.hands->joints[0].hand && j != kind.hands->joints[1].hand))
      most = std::max(most, length(bend[j]));
  return strange * (1 - beyond_rest(most));
}

/// A pose's angles for an identity: the same, or from its own rest.
NPT_INLINE std::vector<float> from_own_rest(const BodyKind& kind, std::span<const Vec3d> people_at_rest,
                                            const BodyEstimate& identity, std::span<const float> axis_angles) {
  std::vector<float> result(axis_angles.begin(), axis_angles.end());
  const double weight = own_rest(kind, people_at_rest, identity);
  if (!(weight > 0)) return result;
  const auto bend = estimate::internal::bend_beyond_rest(people_at_rest, identity);
  for (std::size_t j = 0; j < bend.size(); ++j)
    set_joint_rotation(as_span(result), j, joint_rotation(axis_angles, j) * rotation_matrix(bend[j] * weight));
  return result;
}

}  // namespace npt::inline NPT_ABI
