/// The roles of joints as the shape of the skeleton has them, without names: limbs from limbs.hpp, cut into their
/// joints by the lengths of their bones. Sides are those of the branches: the first one counts as left.
/// Limits    four fingers count as thumb, index, middle and little finger, three as the first three of them
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/limbs.hpp>
#include <npt/body/roles/named_roles.hpp>
#include <npt/body/roles/skeleton_shape.hpp>
#include <npt/config.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

class LimbCutter {
 public:
  LimbCutter(const SkeletonShape& shape, const Limbs& limbs) : shape_(shape), limbs_(limbs) { joints_.fill(no_item); }

  RoleTable cut() {
    for (std::size_t side = 0; side < 2; ++side) {
      cut_leg(side);
      cut_arm(side);
    }
    cut_head();
    const std::size_t legs = limbs_.legs.joint;
    set(JointRole::hips, limbs_.head.empty() ? legs : shape_.common(legs, limbs_.arms.joint));
    return joints_;
  }

 private:
  void set(JointRole role, std::size_t joint) { joints_[index_of(role)] = joint; }
  void set(LimbPart part, std::size_t side, std::size_t joint) { set(limb_role(part, side), joint); }

  /// A branch without ends; of joints in one place the one that turns, else the first.
  std::vector<std::size_t> bones_of(std::size_t branch) const {
    std::vector<std::size_t> path;
    for (const std::size_t joint : shape_.longest_path(branch)) {
      if (shape_.ends[joint]) break;
      if (path.empty() || shape_.distance(path.back(), joint) > 0.004 * shape_.size)
        path.push_back(joint);
      else if (shape_.turns[joint] && !shape_.turns[path.back()])
        path.back() = joint;
    }
    return path;
  }

  /// Where the upper bone of a limb begins: it and the next one are the longest two in a row, on both sides, so that
  /// what one hand holds doesn't count.
  std::size_t upper_of(const std::vector<std::size_t>& path, const std::vector<std::size_t>& other,
                       std::size_t first = 0) const {
    std::size_t upper = first;
    double most = -1;
    for (std::size_t i = first; i + 2 < std::min(path.size(), other.size()); ++i) {
      double shorter = shape_.size;
      for (const std::vector<std::size_t>* own : {&path, &other})
        for (const std::size_t k : {i, i + 1}) shorter = std::min(shorter, shape_.distance((*own)[k], (*own)[k + 1]));
      if (shorter > most) most = shorter, upper = i;
    }
    return upper;
  }

  void cut_leg(std::size_t side) {
    const std::vector<std::size_t> path = bones_of(limbs_.legs.branches[side]);
    const std::size_t first = upper_of(path, bones_of(limbs_.legs.branches[1 - side]));
    constexpr std::array<LimbPart, 4> parts{LimbPart::upper_leg, LimbPart::lower_leg, LimbPart::foot, LimbPart::toes};
    for (std::size_t i = 0; i < parts.size() && first + i < path.size(); ++i) set(parts[i], side, path[first + i]);
    const std::size_t upper = path[first], lower = first + 1 < path.size() ? path[first + 1] : no_item;
    if (lower == no_item || first + 2 < path.size()) return;
    if (const std::size_t foot = foot_apart(upper, lower); foot != no_item) set(LimbPart::foot, side, foot);
  }

  /// A foot that a rig moves by itself, as its goal, and that doesn't hang from the lower leg.
  std::size_t foot_apart(std::size_t upper, std::size_t lower) const {
    Vec3d ankle = shape_.positions[lower] * 2.0 - shape_.positions[upper];
    for (const std::size_t child : shape_.children[lower])
      if (shape_.ends[child]) ankle = shape_.positions[child];
    std::size_t best = no_item;
    double nearest = 0.35 * shape_.distance(upper, lower);
    for (std::size_t j = 0; j < shape_.count(); ++j) {
      if (shape_.ends[j] || shape_.is_below(lower, j) || shape_.is_below(j, limbs_.legs.branches[0]) ||
          shape_.is_below(j, limbs_.legs.branches[1]))
        continue;
      const double away = length(shape_.positions[j] - ankle);
      if (away < nearest) nearest = away, best = j;
    }
    return best;
  }

  /// The first joint of an arm that fingers branch from; its number in the path, or the path's size.
  std::size_t branching(const std::vector<std::size_t>& path) const {
    for (std::size_t i = 0; i < path.size(); ++i) {
      const auto counts = [&](std::size_t child) { return !shape_.ends[child]; };
      if (i >= 1 && std::ranges::count_if(shape_.children[path[i]], counts) >= 3) return i;
    }
    return path.size();
  }

  /// Whether fingers branch from the forearm, without a hand: a palm is shorter than a forearm, and wider than a point.
  bool is_elbow(const std::vector<std::size_t>& path, std::size_t branching) const {
    if (branching + 1 >= path.size()) return false;
    double spread = 0;
    for (const std::size_t child : shape_.children[path[branching]])
      spread = std::max(spread, shape_.distance(child, path[branching + 1]));
    const double bone = shape_.distance(path[branching], path[branching + 1]);
    const double before = shape_.distance(path[branching - 1], path[branching]);
    return bone > (spread > 0.004 * shape_.size ? 0.7 : 0.3) * before;
  }

  /// Whether fingers branch from a joint of the palm behind the wrist, as from the root of the middle finger in npt's own
  /// skeletons: a third of a forearm there, where other hands are a forearm from the elbow.
  bool is_palm(const std::vector<std::size_t>& path, std::size_t branching) const {
    if (branching < 3 || branching >= path.size()) return false;
    const double bone = shape_.distance(path[branching - 1], path[branching]);
    return bone < 0.6 * shape_.distance(path[branching - 2], path[branching - 1]);
  }

  void cut_arm(std::size_t side) {
    std::vector<std::size_t> path = bones_of(limbs_.arms.branches[side]);
    std::size_t hand = branching(path), upper = 0;
    if (hand < path.size()) {
      if (is_palm(path, hand))
        --hand;
      else if (is_elbow(path, hand) || (hand == 2 && begins_in_middle(side)))
        ++hand, path.resize(std::min(hand, path.size()));
      upper = hand >= 2 ? hand - 2 : 0;
    } else {
      upper =
          upper_of(path, bones_of(limbs_.arms.branches[1 - side]), path.size() > 2 && begins_in_middle(side) ? 1 : 0);
    }
    if (upper > 0) set(LimbPart::shoulder, side, path[upper - 1]);
    constexpr std::array<LimbPart, 3> parts{LimbPart::upper_arm, LimbPart::lower_arm, LimbPart::hand};
    for (std::size_t i = 0; i < parts.size() && upper + i < path.size(); ++i) set(parts[i], side, path[upper + i]);
    const std::size_t last = std::min(upper + 2, path.size() - 1);
    if (last > upper) cut_digits(side, path[last], path[last - 1]);
  }

  /// Whether an arm begins with a collar bone: much nearer to the other arm than its next joint is.
  bool begins_in_middle(std::size_t side) const {
    const std::vector<std::size_t> own = bones_of(limbs_.arms.branches[side]);
    const std::vector<std::size_t> other = bones_of(limbs_.arms.branches[1 - side]);
    return own.size() > 1 && other.size() > 1 &&
           shape_.distance(own[0], other[0]) < 0.3 * shape_.distance(own[1], other[1]);
  }

  /// Chains of joints that begin at a hand.
  std::vector<std::vector<std::size_t>> digits_of(std::size_t hand) const {
    std::vector<std::vector<std::size_t>> digits;
    for (const std::size_t child : shape_.children[hand]) {
      std::vector<std::size_t> digit = bones_of(child);
      if (digit.size() > 1 && shape_.distance(hand, digit.front()) < 0.004 * shape_.size) digit.erase(digit.begin());
      if (digit.empty()) continue;
      if (digit.size() == 4) digit.pop_back();  // the fourth is the tip
      digits.push_back(std::move(digit));
    }
    return digits;
  }

  void cut_digits(std::size_t side, std::size_t hand, std::size_t elbow) {
    if (shape_.children[hand].size() == 1) hand = shape_.children[hand].front();  // a palm
    std::vector<std::vector<std::size_t>> digits = digits_of(hand);
    if (digits.size() < 2 || digits.size() > digit_count) return;
    const Vec3d along = normalised(shape_.positions[hand] - shape_.positions[elbow]);
    const auto place = [&](const std::vector<std::size_t>& digit) {  // the first joints may be in one place
      return (shape_.positions[digit.front()] + shape_.positions[digit.back()]) * 0.5 - shape_.positions[hand];
    };
    // In a row from one side of the hand to the other: along the line between the two farthest from each other.
    Vec3d across{};
    for (const auto& a : digits)
      for (const auto& b : digits)
        if (const Vec3d way = place(b) - place(a); length(way - along * dot(way, along)) > length(across))
          across = way - along * dot(way, along);
    std::ranges::stable_sort(
        digits, [&](const auto& a, const auto& b) { return dot(place(a), across) < dot(place(b), across); });
    // The thumb begins, and ends, nearer to the wrist than the finger at the other end of the row.
    const auto out = [&](const std::vector<std::size_t>& digit) {
      return digits.size() == 2 ? shape_.bone(digit.front()) + shape_.reach[digit.front()] : dot(place(digit), along);
    };
    if (out(digits.front()) > out(digits.back())) std::ranges::reverse(digits);
    constexpr std::array<std::size_t, 4> of_four{0, 1, 2, 4};
    for (std::size_t d = 0; d < digits.size(); ++d)
      for (std::size_t i = 0; i < digits[d].size() && i < 3; ++i)
        set(digit_part(digits.size() == 4 ? of_four[d] : d, i), side, digits[d][i]);
  }

  /// Neck and head, or a head alone. What begins behind the head, eyes and jaw, branches from it, or turns forwards.
  void cut_head() {
    std::vector<std::size_t> path;
    for (const std::size_t joint : limbs_.head.empty() ? limbs_.head : bones_of(limbs_.head.front())) {
      path.push_back(joint);
      const auto branches =
          std::ranges::count_if(shape_.children[joint], [&](std::size_t c) { return !shape_.ends[c]; });
      if (branches > (path.size() > 1 ? 1 : 2)) break;
    }
    if (path.empty()) return;
    std::size_t head = path.size() - 1;
    const Vec3d up = normalised(shape_.positions[path[0]] - shape_.positions[limbs_.legs.joint]);
    const auto bone = [&](std::size_t i) { return shape_.positions[path[i]] - shape_.positions[path[i - 1]]; };
    // A bone much longer than the neck's ends at the top of the head.
    if (head >= 2 && (length(bone(head)) > 1.3 * length(bone(head - 1)) || dot(normalised(bone(head)), up) < 0.5))
      --head;
    set(JointRole::head, path[head]);
    if (head > 0)
      set(JointRole::neck, path[0]);
    else if (const std::size_t top = limbs_.arms.joint; neck_holds_arms(top))
      set(JointRole::neck, top);
  }

  /// In Biped's rigs the shoulders hang from the neck: they begin at its height, not above it as from a chest.
  bool neck_holds_arms(std::size_t joint) const {
    const Vec3d spine = shape_.positions[joint] - shape_.positions[limbs_.legs.joint];
    const double rise = dot(shape_.positions[limbs_.arms.branches[0]] - shape_.positions[joint], normalised(spine));
    const std::size_t upper = joints_[index_of(limb_role(LimbPart::shoulder, 0))];
    return upper != no_item && rise < 0.005 * shape_.size && joint != limbs_.legs.joint;
  }

  const SkeletonShape& shape_;
  const Limbs& limbs_;
  RoleTable joints_{};
};

}  // namespace internal

inline RoleTable shaped_roles(const SkeletonShape& shape, const Limbs& limbs) {
  return internal::LimbCutter(shape, limbs).cut();
}

}  // namespace npt::inline NPT_ABI
