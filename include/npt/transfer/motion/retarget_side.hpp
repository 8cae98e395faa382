/// One of the two skeletons of a retargeting, in the pose that motions are relative to: its directions, its legs, and
/// where it stands.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/facing.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

inline std::vector<Quaternion> world_rotations(const std::vector<Affine>& worlds) {
  std::vector<Quaternion> rotations;
  rotations.reserve(worlds.size());
  for (const Affine& world : worlds) rotations.push_back(place_of(world).rotation);
  return rotations;
}

/// The height of the lowest joint of the legs; infinity without any.
inline double lowest_of_legs(const JointRoles& roles, const std::vector<Affine>& worlds) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t side = 0; side < 2; ++side)
    for (const LimbPart part : {LimbPart::lower_leg, LimbPart::foot, LimbPart::toes})
      if (const std::size_t joint = roles.joint(part, side); joint != no_item)
        least = std::min(least, worlds[joint].shift.y);
  return least;
}

/// One of the two skeletons, in the pose that motions are relative to.
struct RetargetSide {
  RetargetSide(const Motion& from, const JointRoles& own) : RetargetSide(from, own, bound_worlds(from)) {}
  RetargetSide(const Motion& from, const JointRoles& own, std::vector<Affine> reference)
      : motion(from), roles(own), worlds(std::move(reference)), rotations(world_rotations(worlds)) {
    std::vector<Vec3d> positions;
    for (const Affine& world : worlds) positions.push_back(world.shift);
    // An animal's forelegs are before its hind legs where it stands on all of them, as it was bound.
    BodyAxes axes = body_axes(roles.joints, positions);
    if (roles.kind() == SkeletonKind::four_legged) {
      std::vector<Vec3d> bound;
      for (const Affine& world : bound_worlds(from)) bound.push_back(world.shift);
      axes = body_axes(roles.joints, bound);
    }
    if (axes.stands()) axes = axes.upright();  // or else the way of a walk would lean as the spine does
    frame = Matrix3::from_columns(axes.left, axes.up, axes.forward);
    const std::size_t left = roles.joint(LimbPart::upper_leg, 0), right = roles.joint(LimbPart::upper_leg, 1);
    const std::size_t hips = roles.joint(JointRole::hips);
    if (left != no_item && right != no_item)
      middle = (positions[left] + positions[right]) * 0.5;
    else if (hips != no_item)
      middle = positions[hips];
    pelvis = middle;
    if (roles.kind() == SkeletonKind::four_legged) return;  // whose legs are bent where it stands
    if (leg() > 0 && axes.up == Vec3d{0, 1, 0}) pelvis.y = lowest_of_legs(roles, worlds) + standing_height();
  }

  /// A rest may hang below the ground, as BVH's do around the origin: then feet stand where the lowest joint is for most
  /// of the clip, if that is off by more than a quarter of a leg. Its lowest place isn't the ground: one who climbs out
  /// of a grave would hover 73 cm above it.
  void find_ground() {
    const double at_rest = lowest_of_legs(roles, worlds), off = leg() / 4;
    if (!(std::abs(at_rest) > off) || !std::isfinite(at_rest) || motion.clip.channels.empty()) return;
    std::array<double, 31> heights{};
    const double end = motion.clip.length();
    for (std::size_t i = 0; i < heights.size(); ++i)
      heights[i] = lowest_of_legs(
          roles, joint_worlds(motion, end * static_cast<double>(i) / static_cast<double>(heights.size() - 1)));
    const double usual = median(std::span<double>(heights));
    if (std::abs(usual - at_rest) > off) ground = usual - at_rest;
    pelvis.y += ground;
  }

  /// Where the pelvis is at other places of the joints: it goes with the hips, also where thighs are moved apart.
  Vec3d pelvis_at(const std::vector<Affine>& at) const {
    const std::size_t hips = roles.joint(JointRole::hips);
    return hips == no_item ? middle : at[hips](inverse(worlds[hips])(middle));
  }
  /// Thigh and shin, the mean of both sides, and all bones of an animal's hind leg; 0 where there are none.
  double leg() const {
    double sum = 0;
    for (std::size_t side = 0; side < 2; ++side) {
      if (roles.kind() == SkeletonKind::four_legged) {
        const std::vector<JointRole> limb = limb_roles(roles.kind(), false, side);
        for (std::size_t i = 1; i < limb.size(); ++i)
          if (roles.joint(limb[i]) != no_item && roles.joint(limb[i - 1]) != no_item)
            sum += length(worlds[roles.joint(limb[i])].shift - worlds[roles.joint(limb[i - 1])].shift) / 2;
        continue;
      }
      const std::size_t hip = roles.joint(LimbPart::upper_leg, side), knee = roles.joint(LimbPart::lower_leg, side);
      const std::size_t foot = roles.joint(LimbPart::foot, side);
      if (hip == no_item || knee == no_item) continue;
      sum += length(worlds[knee].shift - worlds[hip].shift) / 2;
      if (foot != no_item) sum += length(worlds[foot].shift - worlds[knee].shift) / 2;
    }
    return sum;
  }
  /// Of the pelvis above the ground, with straight legs and flat feet: legs may be apart or bent at rest.
  double standing_height() const {
    double ankle = 0;
    for (std::size_t side = 0; side < 2; ++side)
      if (const std::size_t foot = roles.joint(LimbPart::foot, side); foot != no_item)
        ankle += (worlds[foot].shift.y - lowest_of_legs(roles, worlds)) / 2;
    return leg() + ankle;
  }
  /// Where the bone of a role points: to the next joint of its limb.
  Vec3d direction(JointRole role) const {
    const std::size_t own = roles.joint(role), next = is_of_limb(role) ? roles.joint(next_of(role)) : no_item;
    return own == no_item || next == no_item ? Vec3d{} : worlds[next].shift - worlds[own].shift;
  }
  static JointRole next_of(JointRole role) {
    const auto part = static_cast<std::size_t>(part_of(role));
    const bool last = part == 3 || part == 7 || (part >= 8 && (part - 8) % 3 == 2);
    return last ? role : static_cast<JointRole>(index_of(role) + 1);
  }

  const Motion& motion;
  const JointRoles& roles;
  std::vector<Affine> worlds;
  std::vector<Quaternion> rotations;
  Matrix3 frame;      ///< left, up and forward as columns
  Vec3d middle{};     ///< between the thighs, or else the hips
  Vec3d pelvis{};     ///< the same, where it stands on the ground with straight legs
  double ground = 0;  ///< how much higher the clip's ground is than that of the rest
};

}  // namespace internal

}  // namespace npt::inline NPT_ABI
