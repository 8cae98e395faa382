/// A reference posture that people and four-legged animals can both take: the trunk upright on the legs, arms or
/// forelegs hanging along it. Turns from there mean the same to both, so that motions can go from the one to the other:
/// an animal that a person's motion moves walks upright, and a person walks on hands and feet.
///   trunk    from the hips to the arms along y, in the plane across the body's left
///   limbs    straight along y, downwards; an animal's forelegs are its arms
///   neck     along y; head, feet and tail in the directions that they have at rest
/// Limits    hands and forefeet aren't brought to the ground
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/feet_apart.hpp>
#include <npt/body/roles/joint_chains.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/retarget_side.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

class UprightStance {
 public:
  UprightStance(const Motion& motion, const JointRoles& roles)
      : motion_(motion), roles_(roles), rest_(bound_worlds(motion)), turns_(rest_.size()), worlds_(rest_) {
    Vec3d spine{};
    for (std::size_t side = 0; side < 2; ++side)
      for (const auto& [part, sign] : {std::pair(LimbPart::upper_arm, 1.0), std::pair(LimbPart::upper_leg, -1.0)})
        if (const std::size_t joint = roles.joint(part, side); joint != no_item) spine += at(joint) * sign;
    rise_ = turn_between(spine, up);
    tail_ = joint_chains(motion, roles, true)[2];
  }

  /// [joints] the lowest foot is where it was.
  std::vector<Affine> worlds() {
    for (std::size_t j = 0; j < rest_.size(); ++j) {
      const std::size_t parent = motion_.joints[j].parent;
      turns_[j] = turn(j, parent == no_item ? Quaternion{} : turns_[parent]);
      std::size_t bearer = parent;
      for (const auto& [foot, knee] : apart_)
        if (foot == j && knee < j) bearer = knee;
      const Vec3d shift = bearer == no_item ? at(j) : worlds_[bearer].shift + turns_[bearer](at(j) - at(bearer));
      worlds_[j] = {matrix_of(turns_[j]) * rest_[j].linear, shift};
    }
    const double lift = lowest_of_legs(roles_, rest_) - lowest_of_legs(roles_, worlds_);
    for (Affine& world : worlds_) world.shift.y += std::isfinite(lift) ? lift : 0;
    return worlds_;
  }

 private:
  static constexpr Vec3d up{0, 1, 0};

  Vec3d at(std::size_t joint) const { return rest_[joint].shift; }

  /// From where its bone points, behind the turn of what carries it, to where it belongs.
  Quaternion towards(std::size_t joint, std::size_t next, const Quaternion& above, Vec3d wanted) const {
    if (next == no_item) return above;
    const Vec3d bone = above(at(next) - at(joint));
    return length(bone) > 0 ? turn_between(bone, wanted) * above : above;
  }

  Quaternion turn(std::size_t joint, const Quaternion& above) const {
    const JointRole role = roles_.role_of(joint);
    if (role == JointRole::hips) return rise_;
    if (role == JointRole::head || std::ranges::find(tail_, joint) != tail_.end()) return {};
    if (role == JointRole::neck) return towards(joint, roles_.joint(JointRole::head), above, up);
    if (!is_of_limb(role)) return above;
    using enum LimbPart;
    const LimbPart part = part_of(role);
    if (part == foot || part == toes) return {};
    if (part == hand || part == shoulder || is_of_digit(role)) return above;
    return towards(joint, roles_.joint(RetargetSide::next_of(role)), above, up * -1.0);
  }

  const Motion& motion_;
  const JointRoles& roles_;
  std::vector<Affine> rest_;
  std::vector<Quaternion> turns_;  ///< [joints] from the rest, in the world
  std::vector<Affine> worlds_;
  Quaternion rise_{};
  std::vector<std::size_t> tail_;
  std::vector<FootApart> apart_ = feet_apart(motion_, roles_);
};

}  // namespace internal

}  // namespace npt::inline NPT_ABI
