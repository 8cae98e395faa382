/// A reference pose for a motion without a skin whose rest is a pose of its clip, crouched or on the run: the same
/// skeleton stood up, as far as the places of its joints say how.
///   facing   along the file's axis that is nearest, thighs and shoulders level and across it
///   limbs    arms out and legs down, straight; the hinge of a bent elbow or knee says how they are rolled
///   hands    straight, fingers without their curl
///   feet     as they stand, or turned with the shin: whichever is nearer to a foot on the floor
/// Limits    how far trunk and head are bowed can't be inferred from places (a bound neck may lean by 57 degrees): they
///           keep it, unless a part of the spine leans by more than 30 degrees. A turn within the spine is undone at
///           its upper end
/// Numbers   joints' turns against those with the makers' bind poses, in degrees, 95th percentile: 48 to 7.5 and 67 to
///           29 (the fingers of a fist) where joints have the file's axes. Where they have not, three clips: 60 to 34,
///           114 to 31, 100 to 37; the median of the second rises from 19 to 28, since hands keep a roll
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/facing.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/retarget_side.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

class StraightStance {
 public:
  StraightStance(const Motion& motion, const JointRoles& roles)
      : motion_(motion), roles_(roles), rest_(bound_worlds(motion)), turns_(rest_.size()), worlds_(rest_) {
    std::vector<Vec3d> positions;
    for (const Affine& world : rest_) positions.push_back(world.shift);
    const BodyAxes axes = body_axes(roles.joints, positions);
    stands_ = axes.stands();
    axes_ = axes.upright();
    const bool along_x = std::abs(axes_.left.x) > std::abs(axes_.left.z);
    const double along = along_x ? axes_.left.x : axes_.left.z, sign = along < 0 ? -1 : 1;
    if (std::abs(along) > cos_30 && std::abs(along) < cos_6)
      axes_.left = along_x ? Vec3d{sign, 0, 0} : Vec3d{0, 0, sign};
    axes_.forward = cross(axes_.left, axes_.up);
  }

  /// Whether the skeleton's reference is a rest that no standing body has.
  bool is_needed() const {
    const auto bound = [this](std::size_t joint) { return joint != no_item && motion_.joints[joint].bind.has_value(); };
    if (!stands_ || roles_.kind() != SkeletonKind::person ||
        std::any_of(roles_.joints.begin(), roles_.joints.end(), bound))
      return false;
    using enum LimbPart;
    bool crouched = false;
    for (const LimbPart part : {upper_leg, lower_leg, upper_arm, lower_arm}) {
      const Vec3d left = bone(part, 0), right = bone(part, 1);
      if (length(left) == 0 || length(right) == 0) return false;
      const Vec3d mirrored = right - axes_.left * (2 * dot(right, axes_.left));
      crouched = crouched || dot(left, mirrored) < cos_30;
    }
    for (std::size_t side = 0; side < 2; ++side) {
      const Vec3d thigh = bone(upper_leg, side);
      crouched = crouched || -dot(thigh, axes_.up) < cos_30 || dot(thigh, bone(lower_leg, side)) < cos_30;
    }
    return crouched;
  }

  /// The joints' places with straight limbs, the lowest where it was.
  std::vector<Affine> worlds() {
    for (int pass = 0; pass < 2; ++pass) {  // feet that are moved apart from their legs may stand before these
      for (std::size_t j = 0; j < rest_.size(); ++j) turn(j);
      aligned_ = is_aligned();
    }
    const double up = lowest_of_legs(roles_, rest_) - lowest_of_legs(roles_, worlds_);
    for (Affine& world : worlds_) world.shift.y += std::isfinite(up) ? up : 0;
    return worlds_;
  }

 private:
  static constexpr double cos_6 = 0.9945, cos_30 = 0.8660;

  Vec3d at(std::size_t joint) const { return rest_[joint].shift; }
  Vec3d line(std::size_t from, std::size_t to) const {
    return from == no_item || to == no_item ? Vec3d{} : normalised(at(to) - at(from));
  }
  /// The middle of the knuckles, where the arm has fingers.
  Vec3d to_knuckles(std::size_t from, std::size_t side) const {
    Vec3d sum{};
    for (std::size_t digit = 1; digit < digit_count; ++digit)
      if (const std::size_t joint = roles_.joint(digit_part(digit, 0), side); joint != no_item && from != no_item)
        sum += at(joint) - at(from);
    return normalised(sum);
  }
  /// The direction of a limb's bone; without length where none is known.
  Vec3d bone(LimbPart part, std::size_t side) const {
    const std::size_t own = roles_.joint(part, side);
    if (part == LimbPart::hand) return to_knuckles(own, side);
    const auto next = static_cast<LimbPart>(static_cast<std::size_t>(part) + 1);
    const Vec3d way = line(own, roles_.joint(next, side));
    return length(way) == 0 && part == LimbPart::lower_arm ? to_knuckles(own, side) : way;
  }
  void turn(std::size_t joint) {
    const std::size_t parent = motion_.joints[joint].parent;
    const JointRole role = roles_.role_of(joint);
    turns_[joint] = parent == no_item ? Quaternion{} : turns_[parent];
    std::size_t bearer = parent;
    if (is_of_limb(role)) {
      const LimbPart part = part_of(role);
      if (part == LimbPart::foot) {
        turn_foot(joint, side_of(role));
        if (const std::size_t knee = roles_.joint(LimbPart::lower_leg, side_of(role)); knee != no_item) bearer = knee;
      } else if (is_of_digit(role)) {
        uncurl(joint, role);
      } else {
        straighten(joint, part, side_of(role));
      }
    } else if (role != JointRole::none) {
      turn_trunk(joint, role);
    }
    const Vec3d shift = bearer == no_item ? at(joint) : worlds_[bearer].shift + turns_[bearer](at(joint) - at(bearer));
    worlds_[joint] = {matrix_of(turns_[joint]) * rest_[joint].linear, shift};
  }

  /// By the shortest way, behind its turn so far.
  void point(std::size_t joint, Vec3d from, Vec3d to) {
    if (length(from) > 0 && length(to) > 0)
      turns_[joint] = normalised(turn_between(turns_[joint](from), to) * turns_[joint]);
  }

  void turn_trunk(std::size_t joint, JointRole role) {
    using enum JointRole;
    if (role == hips)
      return point(joint, line(roles_.joint(LimbPart::upper_leg, 1), roles_.joint(LimbPart::upper_leg, 0)), axes_.left);
    if (role > upper_chest) return;
    std::size_t above = no_item;
    for (JointRole next : {chest, upper_chest, neck, head})
      if (next > role && above == no_item) above = roles_.joint(next);
    const Vec3d way = line(joint, above);
    if (length(way) > 0 && dot(turns_[joint](way), axes_.up) < cos_30) point(joint, way, axes_.up);
    for (JointRole next : {chest, upper_chest})
      if (next > role && roles_.joint(next) != no_item) return;
    Vec3d shoulders = line(roles_.joint(LimbPart::shoulder, 1), roles_.joint(LimbPart::shoulder, 0));
    if (length(shoulders) == 0)
      shoulders = line(roles_.joint(LimbPart::upper_arm, 1), roles_.joint(LimbPart::upper_arm, 0));
    point(joint, shoulders, axes_.left);
  }

  /// A limb's bone; where its hinge is bent, this says how it is rolled.
  void straighten(std::size_t joint, LimbPart part, std::size_t side) {
    using enum LimbPart;
    if (part == shoulder || part == toes) return;
    const bool arm = part < upper_leg;
    const Vec3d out = axes_.left * (side == 0 ? 1.0 : -1.0), to = arm ? out : -axes_.up;
    const Vec3d own = bone(part, side);
    const Vec3d first = bone(arm ? upper_arm : upper_leg, side), second = bone(arm ? lower_arm : lower_leg, side);
    const Vec3d hinge = cross(first, second);
    if (part == hand || dot(first, second) > cos_30 || length(hinge) == 0) {
      point(joint, own, to);
    } else {
      const Vec3d axis = arm ? cross(out, axes_.forward) : axes_.left, unit = normalised(hinge);
      turns_[joint] = quaternion_of(Matrix3::from_columns(to, axis, cross(to, axis)) *
                                    Matrix3::from_columns(own, unit, cross(own, unit)).transposed());
    }
    if (arm && aligned_) align_roll(joint, to);
  }

  std::array<Vec3d, 3> columns(std::size_t joint) const {
    std::array<Vec3d, 3> all = (matrix_of(turns_[joint]) * rest_[joint].linear).columns();
    for (Vec3d& column : all) column = normalised(column);
    return all;
  }
  /// Whether the makers' joints have axes of the file: those of trunk and legs, whose rolls are known, say it.
  bool is_aligned() const {
    const auto across = [this](std::size_t joint) {
      if (joint == no_item) return false;
      const auto all = columns(joint);
      return std::any_of(all.begin(), all.end(), [this](Vec3d c) { return std::abs(dot(c, axes_.left)) > cos_6; });
    };
    bool all = across(roles_.joint(JointRole::hips));
    for (std::size_t side = 0; side < 2; ++side)
      for (const LimbPart part : {LimbPart::upper_leg, LimbPart::lower_leg})
        all = all && across(roles_.joint(part, side));
    return all;
  }
  /// About its bone, so that an axis points up or forwards.
  void align_roll(std::size_t joint, Vec3d bone) {
    Vec3d from{}, to{};
    for (const Vec3d& column : columns(joint)) {
      if (std::abs(dot(column, bone)) > 0.5) continue;
      const Vec3d around = normalised(column - bone * dot(column, bone));
      for (const Vec3d& axis : {axes_.up, -axes_.up, axes_.forward, -axes_.forward})
        if (dot(around, axis) > dot(from, to)) from = around, to = axis;
    }
    if (length(from) > 0) turns_[joint] = normalised(turn_between(from, to) * turns_[joint]);
  }

  /// Fingers lie in the plane of the hand; last bones, whose ends are unknown, keep to the ones before.
  void uncurl(std::size_t joint, JointRole role) {
    const auto number = static_cast<std::size_t>(part_of(role)) - static_cast<std::size_t>(LimbPart::thumb_1);
    if (number < 3 || number % 3 == 2) return;
    const Vec3d out = axes_.left * (side_of(role) == 0 ? 1.0 : -1.0);
    const Vec3d own = line(joint, roles_.joint(static_cast<JointRole>(index_of(role) + 1)));
    const Vec3d now = turns_[joint](own), flat = normalised(now - axes_.up * dot(now, axes_.up));
    point(joint, own, dot(now, out) > 0.5 ? flat : out);
  }

  /// How far a foot is from one on the floor, whose toes lie some 35 degrees below the ankle, or, without toes, whose
  /// axes are those of the file.
  double off_floor(std::size_t joint, std::size_t side, const Quaternion& turn) const {
    const Vec3d toes = line(joint, roles_.joint(LimbPart::toes, side));
    if (length(toes) > 0) return std::abs(turn(toes).y + 0.57) + 0.5 * std::max(0.0, -dot(turn(toes), axes_.forward));
    double most = 0;
    for (const Vec3d& column : (matrix_of(turn) * rest_[joint].linear).columns()) {
      const Vec3d axis = normalised(column);
      most = std::max({most, std::abs(axis.y)});
    }
    return 1 - most;
  }
  void turn_foot(std::size_t joint, std::size_t side) {
    const std::size_t shin = roles_.joint(LimbPart::lower_leg, side), hips = roles_.joint(JointRole::hips);
    if (shin == no_item || hips == no_item) return;
    const bool stands = off_floor(joint, side, turns_[hips]) <= off_floor(joint, side, turns_[shin]);
    turns_[joint] = turns_[stands ? hips : shin];
  }

  const Motion& motion_;
  const JointRoles& roles_;
  std::vector<Affine> rest_;
  bool stands_ = false, aligned_ = false;
  BodyAxes axes_{};
  std::vector<Quaternion> turns_;  ///< [joints] in the world, from the rest
  std::vector<Affine> worlds_;
};

/// The pose that a motion is relative to: as its skin was bound, or else its rest, stood up where that is needed.
inline std::vector<Affine> reference_pose(const Motion& motion, const JointRoles& roles) {
  StraightStance stance(motion, roles);
  return stance.is_needed() ? stance.worlds() : bound_worlds(motion);
}

}  // namespace internal

}  // namespace npt::inline NPT_ABI
