/// The roles of joints as the shape of the skeleton has them, without names: limbs from limbs.hpp, cut into their
/// joints by the lengths of their bones. Sides are those of the branches: the first one counts as left.
/// An animal's limbs are cut by the direction of their bones: what leads aside ties a limb to the trunk.
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
  LimbCutter(const SkeletonShape& shape, const Limbs& limbs, SkeletonKind kind) : shape_(shape), limbs_(limbs) {
    joints_.fill(no_item);
    joints_.kind = kind;
  }

  RoleTable cut() {
    if (joints_.kind == SkeletonKind::four_legged) return cut_animal();
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

  /// Joints nearer to each other than this are in one place.
  double one_place() const { return 0.004 * shape_.size; }
  std::ptrdiff_t branches_at(std::size_t joint) const {
    return std::ranges::count_if(shape_.children[joint], [&](std::size_t child) { return !shape_.ends[child]; });
  }

  /// A branch without ends; of joints in one place the one that turns, else the first.
  std::vector<std::size_t> bones_of(std::size_t branch) const {
    std::vector<std::size_t> path;
    for (const std::size_t joint : shape_.longest_path(branch)) {
      if (shape_.ends[joint]) break;
      if (path.empty() || shape_.distance(path.back(), joint) > one_place())
        path.push_back(joint);
      else if (shape_.turns[joint] && !shape_.turns[path.back()])
        path.back() = joint;
    }
    return path;
  }

  RoleTable cut_animal() {
    for (std::size_t side = 0; side < 2; ++side) {
      cut_animal_limb(limbs_.legs, false, side);
      cut_animal_limb(limbs_.arms, true, side);
    }
    // The neck begins before the forelegs, the head where ears and jaw do.
    const auto at = [&](const BranchPair& pair) {
      return (shape_.positions[pair.branches[0]] + shape_.positions[pair.branches[1]]) * 0.5;
    };
    const Vec3d chest = at(limbs_.arms), forward = normalised(chest - at(limbs_.legs));
    std::vector<std::size_t> neck;
    for (const std::size_t joint : limbs_.head) {
      if (shape_.ends[joint]) break;
      if (dot(shape_.positions[joint] - chest, forward) > -0.02 * shape_.size) neck.push_back(joint);
      if (!neck.empty() && neck.back() == joint && branches_at(joint) > 1) break;
    }
    if (!neck.empty()) set(JointRole::head, neck.back());
    if (neck.size() > 1) set(JointRole::neck, neck.front());
    set(JointRole::hips, shape_.common(limbs_.legs.joint, limbs_.arms.joint));
    cut_tail(forward);
    return joints_;
  }

  void cut_animal_limb(const BranchPair& pair, bool arm, std::size_t side) {
    const std::vector<std::size_t> path = shape_.longest_path(pair.branches[side]);
    const Vec3d limb = normalised(shape_.positions[path.back()] - shape_.positions[path.front()]);
    std::size_t first = 0;
    while (first + 2 < path.size() &&
           dot(normalised(shape_.positions[path[first + 1]] - shape_.positions[path[first]]), limb) < 0.5)
      ++first;
    std::vector<JointRole> roles = limb_roles(joints_.kind, arm, side);
    if (arm && first > 0) set(roles.front(), path[first - 1]);
    if (arm) roles.erase(roles.begin());
    std::size_t next = 0;
    for (std::size_t i = first; i < path.size() && next < roles.size() && !shape_.ends[path[i]]; ++i)
      set(roles[next++], path[i]);
    for (std::size_t joint = stands_at(path.back()); joint != no_item && next < roles.size();) {
      set(roles[next++], joint);
      joint = shape_.children[joint].empty() || shape_.ends[shape_.children[joint].front()]
                  ? no_item
                  : shape_.children[joint].front();
    }
  }

  /// A joint that a rig moves by itself in the place where a limb's last one ends.
  std::size_t stands_at(std::size_t end) const {
    for (std::size_t j = 0; j < shape_.count(); ++j)
      if (!shape_.ends[j] && !shape_.is_below(end, j) && shape_.distance(j, end) < one_place()) return j;
    return no_item;
  }

  /// The longest branch that leads backwards from the hips or what they hang from, without legs and trunk.
  void cut_tail(Vec3d forward) {
    double most = 0.1 * shape_.size;
    const std::size_t hips = joints_[index_of(JointRole::hips)];
    for (std::size_t j = 0; j < shape_.count(); ++j) {
      const std::size_t parent = shape_.parents[j];
      if (parent == no_item || shape_.ends[j] || !shape_.is_below(parent, hips)) continue;
      bool other =
          !limbs_.head.empty() && (shape_.is_below(limbs_.head.back(), j) || shape_.is_below(j, limbs_.head.front()));
      for (const BranchPair* pair : {&limbs_.legs, &limbs_.arms})
        for (const std::size_t branch : pair->branches)
          other = other || shape_.is_below(branch, j) || shape_.is_below(j, branch);
      if (other) continue;
      const Vec3d way = shape_.positions[shape_.longest_path(j).back()] - shape_.positions[hips];
      if (shape_.reach[j] > most && dot(way, forward) < 0) most = shape_.reach[j], set(JointRole::tail_1, j);
    }
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
    const std::vector<std::size_t> other = bones_of(limbs_.legs.branches[1 - side]);
    const std::size_t first = upper_of(path, other);
    constexpr std::array<LimbPart, 4> parts{LimbPart::upper_leg, LimbPart::lower_leg, LimbPart::foot, LimbPart::toes};
    for (std::size_t i = 0; i < parts.size() && first + i < path.size(); ++i) set(parts[i], side, path[first + i]);
    if (first + 2 == path.size() && other.size() >= path.size()) set(LimbPart::foot, side, foot_apart(path, other));
  }

  /// A foot that a rig moves by itself, as its goal, and that doesn't hang from the lower leg: where this ends, or else
  /// about a thigh's length from its own knee, which may bend by a right angle.
  std::size_t foot_apart(const std::vector<std::size_t>& leg, const std::vector<std::size_t>& other) const {
    const std::size_t lower = leg.back();
    const Vec3d knee = shape_.positions[lower], thigh = knee - shape_.positions[leg[leg.size() - 2]];
    const auto end =
        std::ranges::find_if(shape_.children[lower], [&](std::size_t child) { return shape_.ends[child]; });
    std::size_t best = no_item;
    double nearest = 0.35 * length(thigh);
    for (std::size_t j = 0; j < shape_.count(); ++j) {
      if (shape_.ends[j] || shape_.is_below(lower, j) || shape_.is_below(j, limbs_.legs.branches[0]) ||
          shape_.is_below(j, limbs_.legs.branches[1]) ||
          shape_.distance(j, lower) > shape_.distance(j, other[leg.size() - 1]))
        continue;
      const Vec3d shin = shape_.positions[j] - knee;
      const double away = end != shape_.children[lower].end() ? shape_.distance(j, *end)
                          : dot(shin, thigh) > 0              ? std::abs(length(shin) - length(thigh))
                                                              : shape_.size;
      if (away < nearest) nearest = away, best = j;
    }
    return best;
  }

  /// The first joint of an arm that fingers branch from; its number in the path, or the path's size.
  std::size_t branching(const std::vector<std::size_t>& path) const {
    for (std::size_t i = 1; i < path.size(); ++i)
      if (branches_at(path[i]) >= 3) return i;
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
    return bone > (spread > one_place() ? 0.7 : 0.3) * before;
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

  /// A chain of joints that begins at a hand; where it leaves the palm, and where its first bone ends.
  struct Digit {
    std::vector<std::size_t> joints{};
    Vec3d root{}, next{};

    Vec3d direction() const { return normalised(next - root); }
  };

  /// What hangs from the hand, and from the forearm beside it and off its axis, as some rigs' thumbs. Props are longer:
  /// the longest fingers are 1.1 forearms long, in cartoons.
  std::vector<Digit> digits_of(std::size_t hand, std::size_t elbow) const {
    std::vector<Digit> digits;
    const Vec3d wrist = shape_.positions[hand], forearm = wrist - shape_.positions[elbow];
    const auto add = [&](std::size_t child) {
      std::vector<std::size_t> joints = bones_of(child);
      if (joints.size() > 1 && shape_.distance(hand, joints.front()) < one_place()) joints.erase(joints.begin());
      if (!joints.empty() && shape_.reach[joints.front()] < 1.5 * length(forearm))
        digits.push_back({std::move(joints)});
    };
    for (const std::size_t child : shape_.children[hand]) add(child);
    for (const std::size_t child : shape_.children[elbow]) {
      const Vec3d to = shape_.positions[child] - wrist;
      const bool beside = length(cross(to, normalised(forearm))) > one_place() && length(to) < 0.5 * length(forearm);
      if (beside && !shape_.is_below(hand, child)) add(child);
    }
    return digits;
  }

  /// Sets where digits leave the palm and where their first bones end; gives the wrist. Where several begin in one
  /// place, this is the wrist, and they leave the palm at their second joints.
  Vec3d measure(std::vector<Digit>& digits, std::size_t hand) const {
    Vec3d wrist = shape_.positions[hand];
    std::vector<std::size_t> first(digits.size());
    for (std::size_t i = 0; i < digits.size(); ++i) first[i] = begins_in_palm(digits[i].joints, hand) ? 1 : 0;
    for (std::size_t i = 0; i < digits.size(); ++i)
      for (std::size_t k = 0; k < digits.size(); ++k)
        if (i != k && shape_.distance(digits[i].joints.front(), digits[k].joints.front()) < one_place())
          first[i] = 1, wrist = shape_.positions[digits[i].joints.front()];
    for (std::size_t i = 0; i < digits.size(); ++i) {
      const std::vector<std::size_t> path = shape_.longest_path(digits[i].joints.front());
      const auto place = [&](std::size_t joint) { return shape_.positions[path[std::min(joint, path.size() - 1)]]; };
      digits[i].root = place(first[i]), digits[i].next = place(first[i] + 1);
      if (length(digits[i].next - digits[i].root) < one_place()) digits[i].next = digits[i].root * 2.0 - wrist;
    }
    return wrist;
  }

  /// The thumb first, then the others in their row from its side on. The thumb leaves the palm nearest to the wrist and
  /// points least where all point. along: from the elbow to the wrist
  static void sort_digits(std::vector<Digit>& digits, Vec3d wrist, Vec3d along) {
    Vec3d common = along;
    double size = 0;
    for (const Digit& digit : digits) common += digit.direction(), size += length(digit.root - wrist);
    size = std::max(size / static_cast<double>(digits.size()), 1e-12);
    const auto apart = [&](const Digit& digit) {
      return -dot(digit.root - wrist, along) / size - dot(digit.direction(), normalised(common));
    };
    std::swap(digits.front(), *std::ranges::max_element(digits, {}, apart));
    Vec3d row{}, middle{};
    for (auto a = digits.begin() + 1; a != digits.end(); ++a) {
      middle += a->root / static_cast<double>(digits.size() - 1);
      for (auto b = digits.begin() + 1; b != digits.end(); ++b)
        if (const Vec3d way = b->root - a->root; length(way) > length(row)) row = way;
    }
    if (dot(row, (digits.front().root + digits.front().next) * 0.5 - middle) > 0) row = -row;
    std::stable_sort(digits.begin() + 1, digits.end(),
                     [&](const Digit& a, const Digit& b) { return dot(a.root, row) < dot(b.root, row); });
  }

  void cut_digits(std::size_t side, std::size_t hand, std::size_t elbow) {
    if (const std::vector<std::size_t>& only = shape_.children[hand]; only.size() == 1 && branches_at(only.front()) > 1)
      hand = only.front();  // a palm
    std::vector<Digit> digits = digits_of(hand, elbow);
    if (digits.size() > digit_count)  // places for props are among them
      std::erase_if(digits, [](const Digit& digit) { return digit.joints.size() == 1; });
    if (digits.empty() || digits.size() > digit_count) return;
    if (digits.size() == 1) {  // all fingers in one, of three joints: one of two may be a prop's place
      if (digits.front().joints.size() > 2) set_digit(side, 1, digits.front().joints, hand);
      return;
    }
    const Vec3d at = shape_.positions[hand], wrist = measure(digits, hand);
    sort_digits(digits, wrist,
                normalised((length(wrist - at) < one_place() ? at - shape_.positions[elbow] : wrist - at)));
    constexpr std::array<std::size_t, 4> of_four{0, 1, 2, 4};
    for (std::size_t d = 0; d < digits.size(); ++d)
      set_digit(side, digits.size() == 4 ? of_four[d] : d, digits[d].joints, hand);
  }

  /// Whether the first of four joints is in the palm: near to the wrist, and its bone long.
  bool begins_in_palm(const std::vector<std::size_t>& digit, std::size_t hand) const {
    return digit.size() > 3 && shape_.distance(hand, digit[0]) < 0.7 * shape_.distance(digit[0], digit[1]);
  }
  /// Its first three joints behind the palm: a fourth is the tip. A thumb's bone in the palm counts.
  void set_digit(std::size_t side, std::size_t digit, const std::vector<std::size_t>& joints, std::size_t hand) {
    const std::size_t first = digit > 0 && begins_in_palm(joints, hand) ? 1 : 0;
    for (std::size_t i = first; i < std::min(first + 3, joints.size()); ++i)
      set(digit_part(digit, i - first), side, joints[i]);
  }

  /// Neck and head, or a head alone. What begins behind the head, eyes and jaw, branches from it, or turns forwards.
  void cut_head() {
    std::vector<std::size_t> path;
    for (const std::size_t joint : limbs_.head.empty() ? limbs_.head : bones_of(limbs_.head.front())) {
      path.push_back(joint);
      if (branches_at(joint) > (path.size() > 1 ? 1 : 2)) break;
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

inline RoleTable shaped_roles(const SkeletonShape& shape, const Limbs& limbs,
                              SkeletonKind kind = SkeletonKind::person) {
  return internal::LimbCutter(shape, limbs, kind).cut();
}

}  // namespace npt::inline NPT_ABI
