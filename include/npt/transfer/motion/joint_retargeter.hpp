/// Rotations from joint to joint by their roles, in the target's own frames, and the way of the hips: the plain motion
/// on another skeleton, before feet, bodies and twist are looked at.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
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
#include <npt/transfer/motion/shared_rig.hpp>
#include <npt/transfer/motion/straight_stance.hpp>
#include <npt/transfer/motion/upright_stance.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// Rotations from joint to joint, and the hips' way: the plain motion, frame by frame.
class JointRetargeter {
 public:
  JointRetargeter(const Motion& source, const JointRoles& from, const Motion& target, const JointRoles& to)
      : across_kinds_(from.kind() != to.kind()),
        from_(source, from, across_kinds_ ? UprightStance(source, from).worlds() : reference_pose(source, from)),
        to_(target, to, across_kinds_ ? UprightStance(target, to).worlds() : bound_worlds(target)),
        parts_(target.joints.size()),
        follows_(feet_apart(target, to)),
        moving_(target.joints.size()) {
    across_ = from_.frame == to_.frame ? Quaternion{} : quaternion_of(to_.frame * from_.frame.transposed());
    from_.find_ground();
    const double own = to_.leg(), other = from_.leg();
    if (own > 0 && other > 0) scale_ = own / other;
    chains_ = {joint_chains(source, from, across_kinds_), joint_chains(target, to, across_kinds_)};
    likes_ = same_joints(source, from, target, to);
    if (share_rig(from_, to_, across_)) bearers_ = bearers(to_);
    for (std::size_t j = 0; j < target.joints.size(); ++j) {
      const std::size_t parent = target.joints[j].parent;
      parts_[j] = place_of(inverse(parent == no_item ? target.base : to_.worlds[parent]) * to_.worlds[j]);
    }
    correct_limbs();
    order_joints();
  }

  /// The places of the target's joints in their parents at a time; `source`: the source's joints then.
  std::vector<NodePlace> frame(const std::vector<Affine>& source) {
    const std::vector<Quaternion> now = world_rotations(source);
    std::vector<NodePlace> places = parts_;
    std::vector<Affine> worlds(places.size());
    std::vector<Quaternion> rotations(places.size());
    const Quaternion base = place_of(to_.motion.base).rotation;
    for (const std::size_t j : order_) {
      const std::size_t parent = to_.motion.joints[j].parent;
      const Quaternion& above = parent == no_item ? base : rotations[parent];
      const Affine& outer = parent == no_item ? to_.motion.base : worlds[parent];
      rotations[j] = above * places[j].rotation;
      const JointRole role = to_.roles.role_of(j);
      if (const std::optional<Quaternion> turned = turned_joint(j, role, rotations, now)) {
        rotations[j] = *turned;
        places[j].rotation = normalised(inverse(above) * rotations[j]);
        moving_[j][0] = true;
      }
      if (role == JointRole::hips) place_hips(j, outer, source, places[j]);
      for (const auto& [foot, knee] : follows_)
        if (j == foot) {
          const Vec3d ankle = worlds[knee](inverse(to_.worlds[knee])(to_.worlds[foot].shift));
          places[j].translation = inverse(outer)(ankle);
          moving_[j][1] = true;
        }
      worlds[j] = outer * places[j].affine();
    }
    return places;
  }

  const RetargetSide& source() const { return from_; }
  const RetargetSide& target() const { return to_; }
  Quaternion across() const { return across_; }
  double scale() const { return scale_; }
  const std::vector<std::array<bool, 2>>& moving() const { return moving_; }
  /// Feet that a rig moves apart from their legs, and the lower legs.
  const std::vector<FootApart>& follows() const { return follows_; }

 private:
  /// Between two rests: from the direction of the target's bone to that of the source's. Animals keep how their species
  /// stands.
  void correct_limbs() {
    if (across_kinds_ || to_.roles.kind() == SkeletonKind::four_legged) return;
    for (std::size_t r = middle_role_count; r < limb_role_end; ++r) {
      const auto role = static_cast<JointRole>(r);
      const LimbPart part = part_of(role);
      if (part == LimbPart::shoulder || part == LimbPart::foot || part == LimbPart::toes) continue;
      const Vec3d own = to_.direction(role), other = from_.direction(role);
      if (length(own) > 0 && length(other) > 0)
        corrections_[r] = turn_between(own, across_(other));
      else if (part == LimbPart::hand || is_of_digit(role))  // without a bone of its own, as the one before it
        corrections_[r] = corrections_[part == LimbPart::hand || (r - middle_role_count - 8) % 3 != 0
                                           ? r - 1
                                           : index_of(limb_role(LimbPart::hand, side_of(role)))];
    }
  }

  /// Parents before children, and what is moved apart from its limb behind that.
  void order_joints() {
    std::vector<bool> late(parts_.size());
    for (const FootApart& apart : follows_) late[apart.foot] = true;
    for (std::size_t j = 0; j < parts_.size(); ++j) {
      const std::size_t parent = to_.motion.joints[j].parent;
      if (parent != no_item && late[parent]) late[j] = true;
    }
    for (const bool now : {false, true})
      for (std::size_t j = 0; j < parts_.size(); ++j)
        if (late[j] == now) order_.push_back(j);
  }
  /// The rotation of a target's joint in the world, where those above it have theirs; nothing where it keeps its place.
  std::optional<Quaternion> turned_joint(std::size_t joint, JointRole role, const std::vector<Quaternion>& rotations,
                                         const std::vector<Quaternion>& now) const {
    if (role != JointRole::none && !bearers_.empty() && bearers_[joint] != no_item)
      return turned_in_bearer(joint, role, rotations[bearers_[joint]], now);
    const std::optional<Quaternion> turn = turn_for(joint, role, now);
    if (!turn) return std::nullopt;
    const Quaternion correction = role == JointRole::none ? Quaternion{} : corrections_[index_of(role)];
    return across_ * *turn * inverse(across_) * correction * to_.rotations[joint];
  }
  /// Of a joint of one rig: turned in the joint that bears it as the source's is, from how both were bound.
  Quaternion turned_in_bearer(std::size_t joint, JointRole role, const Quaternion& bearer,
                              const std::vector<Quaternion>& now) const {
    const std::size_t other = from_.roles.joint(role);
    const std::size_t carries = from_.roles.joint(to_.roles.role_of(bearers_[joint]));
    const Quaternion bound = inverse(to_.rotations[bearers_[joint]]) * to_.rotations[joint];
    const Quaternion others = inverse(from_.rotations[carries]) * from_.rotations[other];
    return bearer * bound * inverse(others) * inverse(now[carries]) * now[other];
  }
  /// How a joint of the source has turned since its rest; nothing where there is none.
  std::optional<Quaternion> turn_of(std::size_t joint, const std::vector<Quaternion>& now) const {
    if (joint == no_item) return std::nullopt;
    return now[joint] * inverse(from_.rotations[joint]);
  }

  /// By its place in the chain, whatever the number of joints; a chain that the source lacks goes with what carries it.
  std::optional<Quaternion> chain_turn(std::size_t chain, std::size_t own, const std::vector<Quaternion>& now) const {
    const std::vector<std::size_t>& other = chains_[0][chain];
    std::optional<Quaternion> base = turn_of(from_.roles.joint(JointRole::hips), now);
    if (const std::vector<std::size_t>& spine = chains_[0].front(); chain == neck_chain && !spine.empty())
      base = turn_of(spine.back(), now);
    if (!base || other.empty()) return base;
    const double along = static_cast<double>((own + 1) * other.size()) / static_cast<double>(chains_[1][chain].size());
    const auto above = static_cast<std::size_t>(std::ceil(along));  // from 1 on
    const Quaternion high = *turn_of(other[above - 1], now);
    const Quaternion low = above == 1 ? *base : *turn_of(other[above - 2], now);
    const double share = along - static_cast<double>(above - 1);
    return share == 1 ? high : slerp(low, high, share);
  }

  std::optional<Quaternion> turn_for(std::size_t joint, JointRole role, const std::vector<Quaternion>& now) const {
    for (std::size_t chain = 0; chain < chains_[1].size(); ++chain) {
      const std::vector<std::size_t>& own = chains_[1][chain];
      if (const auto at = std::ranges::find(own, joint); at != own.end())
        return chain_turn(chain, static_cast<std::size_t>(at - own.begin()), now);
    }
    if (role == JointRole::none) return turn_of(likes_[joint], now);
    const std::optional<Quaternion> own = turn_of(from_.roles.joint(role), now);
    if (own || role != JointRole::neck) return own;
    const std::optional<Quaternion> head = turn_of(from_.roles.joint(JointRole::head), now);
    const std::vector<std::size_t>& spine = chains_[0].front();
    const std::optional<Quaternion> chest =
        turn_of(spine.empty() ? from_.roles.joint(JointRole::hips) : spine.back(), now);
    return head && chest ? std::optional(slerp(*chest, *head, 0.5)) : std::nullopt;
  }

  void place_hips(std::size_t hips, const Affine& outer, const std::vector<Affine>& source, NodePlace& place) {
    const Vec3d way = across_(from_.pelvis_at(source) - from_.pelvis) * scale_;
    const Vec3d inside = inverse(to_.worlds[hips])(to_.middle);  // in the joint's own coordinates
    NodePlace turned = place;
    turned.translation = {};
    place.translation = inverse(outer)(to_.pelvis + way) - turned.affine()(inside);
    moving_[hips][1] = true;
  }

  bool across_kinds_;  ///< from a person to an animal or back
  RetargetSide from_, to_;
  std::array<JointChains, 2> chains_;  ///< of source and target
  std::vector<std::size_t> likes_;     ///< [joints] the source's joint of the same name, where none has a role
  std::vector<std::size_t> bearers_;   ///< [joints] the next ones above with roles, where both are one rig; else empty
  Quaternion across_{};                ///< from the source's directions to the target's
  double scale_ = 1;
  std::vector<NodePlace> parts_;  ///< [joints] of the target, in their parents, as it was bound
  std::array<Quaternion, joint_role_count> corrections_{};
  std::vector<std::size_t> order_;
  std::vector<FootApart> follows_;
  std::vector<std::array<bool, 2>> moving_;  ///< [joints] rotation, translation
};

}  // namespace internal

}  // namespace npt::inline NPT_ABI
