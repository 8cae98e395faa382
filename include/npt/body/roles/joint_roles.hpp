/// Which joint of a person's or an animal's skeleton is which: names say it where they are of a known dialect and the
/// skeleton agrees, its shape where they are silent or wrong. Left and right are the body's own, by its shape.
///   JointRoles roles = joint_roles(motion);
///   std::size_t hips = roles.joint(JointRole::hips);
/// Joints that are nobody's, as hair, props, twist and control joints, have no role. JointRoles::joints.kind says which
/// of both it is: the one with the higher confidence, an animal's where this is certain.
/// Numerics  confidences are judgements, not frequencies: 1 where name and shape agree, 0.85 for a name alone, 0.6 for
///           a name against the shape, and at most 0.7 for the shape alone; of the whole the mean of the main joints,
///           less where arms are as long as wings, or where an animal's legs don't all hang from a trunk that lies, to
///           one ground
#pragma once

#include <npt/body/roles/facing.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/limbs.hpp>
#include <npt/body/roles/named_roles.hpp>
#include <npt/body/roles/shaped_roles.hpp>
#include <npt/body/roles/skeleton_shape.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct JointRoles {
  RoleTable joints{};
  std::array<double, joint_role_count> confidences{};  ///< 0 where a role has no joint
  std::string dialect{};                               ///< of the names; empty: none that is known
  double confidence = 0;                               ///< that it is a whole skeleton of its kind, 0 to 1

  SkeletonKind kind() const { return joints.kind; }
  std::string role_name(JointRole role) const { return npt::role_name(role, kind()); }
  std::size_t joint(JointRole role) const { return joints[index_of(role)]; }
  std::size_t joint(LimbPart part, std::size_t side) const { return joint(limb_role(part, side)); }
  double confidence_of(JointRole role) const { return confidences[index_of(role)]; }
  /// none where the joint is nobody's
  JointRole role_of(std::size_t joint) const {
    const auto found = std::ranges::find(joints, joint);
    return found == joints.end() ? JointRole::none : static_cast<JointRole>(found - joints.begin());
  }
};

namespace internal {

class RoleJudge {
 public:
  RoleJudge(const Motion& motion, SkeletonKind kind)
      : motion_(motion), shape_(motion), named_(named_roles(motion, kind)) {
    shaped_.fill(no_item);
    shaped_.kind = kind;
    if (shape_.count() > most_joints) return;
    constexpr double least = 0.1;  // below it what looks like limbs is something else: goals, controls, a tail
    if (const std::optional<Limbs> limbs = find_limbs(shape_, kind); limbs && limbs->confidence > least) {
      shaped_ = shaped_roles(shape_, *limbs, kind);
      shape_confidence_ = limbs->confidence;
    }
  }

  JointRoles judge() {
    face();
    name_upper_bones();
    leave_palms();
    const bool by_name = names_hold();
    JointRoles roles{.joints = by_name ? named_.joints : shaped_, .dialect = std::string(named_.dialect)};
    if (by_name) move_digits(roles.joints);
    fill(roles.joints, by_name ? shaped_ : named_.joints);
    place_hips(roles.joints);
    place_spine(roles.joints);
    if (is_animal()) place_chains(roles.joints);
    rate(roles);
    return roles;
  }

 private:
  // No body has so many; the search over the shape takes their square.
  static constexpr std::size_t most_joints = 4096;
  static constexpr std::array<LimbPart, 4> arm{LimbPart::shoulder, LimbPart::upper_arm, LimbPart::lower_arm,
                                               LimbPart::hand};
  static constexpr std::array<LimbPart, 4> leg{LimbPart::upper_leg, LimbPart::lower_leg, LimbPart::foot,
                                               LimbPart::toes};
  static constexpr std::array<JointRole, 10> core{JointRole::hips,
                                                  JointRole::head,
                                                  limb_role(LimbPart::upper_arm, 0),
                                                  limb_role(LimbPart::lower_arm, 0),
                                                  limb_role(LimbPart::upper_leg, 0),
                                                  limb_role(LimbPart::lower_leg, 0),
                                                  limb_role(LimbPart::upper_arm, 1),
                                                  limb_role(LimbPart::lower_arm, 1),
                                                  limb_role(LimbPart::upper_leg, 1),
                                                  limb_role(LimbPart::lower_leg, 1)};

  bool is_animal() const { return shaped_.kind == SkeletonKind::four_legged; }

  /// Both tables' left becomes the body's; names are only overruled where the shape is plain.
  void face() {
    const double of_shape = left_is_left(motion_, shape_, shaped_);
    if (of_shape < 0) shaped_ = swapped_sides(shaped_);
    side_confidence_ = std::abs(of_shape);
    const double of_names = left_is_left(motion_, shape_, named_.joints);
    if (of_names < -0.3) {
      named_.joints = swapped_sides(named_.joints);
      names_swapped_ = true;
    } else if (agree_crosswise()) {
      shaped_ = swapped_sides(shaped_);  // doubtful by shape: as the names have it
    }
  }
  bool agree_crosswise() const {
    int same = 0;
    for (std::size_t r = middle_role_count; r < joint_role_count; ++r) {
      const std::size_t joint = named_.joints[r];
      if (joint == no_item) continue;
      same += shaped_[r] == joint ? 1 : 0;
      same -= shaped_[index_of(mirrored(static_cast<JointRole>(r)))] == joint ? 1 : 0;
    }
    return same < 0;
  }

  /// A limb of one word: "leg" is a lower leg only where there is an upper one, or where the shape has it so.
  void name_upper_bones() {
    for (std::size_t side = 0; side < 2; ++side)
      for (const auto& [near_part, far_part] :
           {std::pair(LimbPart::upper_arm, LimbPart::lower_arm), std::pair(LimbPart::upper_leg, LimbPart::lower_leg)}) {
        std::size_t& first = named_.joints[index_of(limb_role(near_part, side))];
        std::size_t& second = named_.joints[index_of(limb_role(far_part, side))];
        if (first == no_item && joint_of(shaped_, far_part, side) != second) std::swap(first, second);
      }
  }

  /// Fingers whose bones in the palm are counted in their names: "index1" is the first joint behind it elsewhere. From
  /// such a bone hangs one finger alone; npt's own skeletons have all fingers at the first joint of the middle one.
  void leave_palms() {
    for (std::size_t r = 0; r < joint_role_count; ++r) {
      const auto role = static_cast<JointRole>(r);
      if (!is_of_digit(role) || part_of(role) < digit_part(1, 0)) continue;
      const bool first =
          (static_cast<std::size_t>(part_of(role)) - static_cast<std::size_t>(LimbPart::thumb_1)) % 3 == 0;
      if (first && shaped_[r] != no_item && named_.joints[r] == shape_.parents[shaped_[r]] &&
          named_.joints[r + 1] == shaped_[r] &&
          std::count(shape_.parents.begin(), shape_.parents.end(), named_.joints[r]) == 1)
        std::copy_n(shaped_.begin() + static_cast<std::ptrdiff_t>(r), 3,
                    named_.joints.begin() + static_cast<std::ptrdiff_t>(r));
    }
  }

  /// Whether the names make a body: most of the main joints are there, each below the one before it.
  bool names_hold() const {
    int known = 0, wrong = 0;
    const RoleTable& joints = named_.joints;
    for (const JointRole role : core) known += joints[index_of(role)] != no_item ? 1 : 0;
    for (std::size_t side = 0; side < 2; ++side)
      for (const auto& parts : {arm, leg})
        for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
          const std::size_t above = joint_of(joints, parts[i], side), below = joint_of(joints, parts[i + 1], side);
          const bool apart = parts[i + 1] == LimbPart::foot || (is_animal() && i > 0);  // feet may stand apart
          if (above == no_item || below == no_item || apart) continue;
          wrong += shape_.is_below(below, above) ? 0 : 1;
        }
    const bool shape_is_better = shape_confidence_ > 0.5 && known < 6;
    return known > 0 && wrong == 0 && !shape_is_better;
  }

  /// A digit that is named for one side and hangs from the other side's arm.
  void move_digits(RoleTable& joints) const {
    RoleTable moved = joints;
    for (std::size_t r = 0; r < joint_role_count; ++r) {
      const auto role = static_cast<JointRole>(r);
      if (!is_of_digit(role) || joints[r] == no_item) continue;
      const std::size_t other = joint_of(joints, LimbPart::lower_arm, 1 - side_of(role));
      if (other == no_item || !shape_.is_below(joints[r], other)) continue;
      moved[index_of(mirrored(role))] = joints[r];
      if (const std::size_t twin = joints[index_of(mirrored(role))]; twin == no_item || shape_.is_below(twin, other))
        moved[r] = no_item;
    }
    joints = moved;
  }

  /// Takes from the other table what one lacks, where it hangs between the joints that are known.
  void fill(RoleTable& joints, const RoleTable& from) const {
    for (std::size_t r = 0; r < joint_role_count; ++r) {
      const auto role = static_cast<JointRole>(r);
      if (joints[r] != no_item || from[r] == no_item || std::ranges::find(joints, from[r]) != joints.end()) continue;
      if (is_of_digit(role) && !takes_digit(joints, role)) continue;
      if (fits(joints, role, from[r])) joints[r] = from[r];
    }
  }
  /// A finger whose other joints are named is named whole.
  static bool takes_digit(const RoleTable& joints, JointRole role) {
    const std::size_t digit =
        (static_cast<std::size_t>(part_of(role)) - static_cast<std::size_t>(LimbPart::thumb_1)) / 3;
    for (std::size_t i = 0; i < 3; ++i)
      if (joint_of(joints, digit_part(digit, i), side_of(role)) != no_item) return false;
    return true;
  }
  bool fits(const RoleTable& joints, JointRole role, std::size_t joint) const {
    if (!is_of_limb(role)) return true;
    const std::size_t side = side_of(role);
    const auto order_holds = [&](const std::array<LimbPart, 4>& parts) {
      const auto own = std::ranges::find(parts, part_of(role));
      for (auto it = parts.begin(); it != parts.end(); ++it) {
        const std::size_t other = joint_of(joints, *it, side);
        if (other == no_item || own == parts.end() || it == own) continue;
        const bool apart = *own == LimbPart::foot || *own == LimbPart::toes || *it == LimbPart::foot ||
                           (is_animal() && (*own == LimbPart::hand || *it >= LimbPart::hand));
        if (it < own ? !shape_.is_below(joint, other) && !apart : !shape_.is_below(other, joint) && !apart)
          return false;
      }
      return true;
    };
    if (is_of_digit(role)) {
      const std::size_t hand = joint_of(joints, LimbPart::hand, side),
                        elbow = joint_of(joints, LimbPart::lower_arm, side);
      const std::size_t above = hand != no_item ? hand : elbow;
      return above != no_item && shape_.is_below(joint, above);
    }
    return order_holds(arm) && order_holds(leg);
  }

  /// The hips carry both legs and the spine, whatever a file calls so.
  void place_hips(RoleTable& joints) const {
    std::size_t legs = no_item;
    for (std::size_t side = 0; side < 2; ++side)
      if (const std::size_t upper = joint_of(joints, LimbPart::upper_leg, side); upper != no_item)
        legs = legs == no_item ? upper : shape_.common(legs, upper);
    if (legs == no_item) return;
    std::size_t& hips = joints[index_of(JointRole::hips)];
    if (hips != no_item && hips != legs && shape_.is_below(legs, hips)) return;
    const std::size_t head = joints[index_of(JointRole::head)], own = shape_.parents[legs];
    const bool is_leg =
        legs == joint_of(joints, LimbPart::upper_leg, 0) || legs == joint_of(joints, LimbPart::upper_leg, 1);
    hips = head != no_item && shape_.common(legs, head) != no_item ? shape_.common(legs, head) : is_leg ? own : legs;
    for (std::size_t r = 1; r < joint_role_count; ++r)
      if (joints[r] == hips) joints[r] = no_item;
  }

  /// Spine, chest and upper chest: of the joints between hips and arms the first, the last, and one between.
  void place_spine(RoleTable& joints) const {
    const std::size_t hips = joints[index_of(JointRole::hips)];
    std::size_t top = no_item;
    for (std::size_t side = 0; side < 2; ++side) {
      const std::size_t collar = joint_of(joints, LimbPart::shoulder, side);
      const std::size_t first = collar != no_item ? collar : joint_of(joints, LimbPart::upper_arm, side);
      if (first == no_item || shape_.parents[first] == no_item) continue;
      top = top == no_item ? shape_.parents[first] : shape_.common(top, shape_.parents[first]);
    }
    const std::size_t neck = joints[index_of(JointRole::neck)], head = joints[index_of(JointRole::head)];
    if (is_animal()) top = no_item;  // shoulder blades may hang from any part of the trunk
    if (top == no_item && neck != no_item) top = shape_.parents[neck];
    if (top == no_item && head != no_item) top = shape_.parents[head];
    if (hips == no_item || top == no_item || !shape_.is_below(top, hips)) return;
    std::vector<std::size_t> spine;
    for (std::size_t joint = top; joint != hips; joint = shape_.parents[joint]) {
      if (joint == neck || joint == head) continue;
      const bool helper = !spine.empty() && !shape_.turns[joint] && shape_.turns[spine.back()] &&
                          shape_.distance(joint, spine.back()) < 0.004 * shape_.size;
      if (!helper) spine.push_back(joint);
    }
    std::ranges::reverse(spine);
    constexpr std::array<JointRole, 3> roles{JointRole::spine, JointRole::chest, JointRole::upper_chest};
    for (const JointRole role : roles) joints[index_of(role)] = no_item;
    for (std::size_t i = 0; i < std::min(spine.size(), roles.size()); ++i)
      joints[index_of(roles[i])] = spine[spine.size() <= 3 ? i : i * (spine.size() - 1) / 2];
  }

  /// Neck and tail: of their joints up to three and five, from the first to the last.
  void place_chains(RoleTable& joints) const {
    using enum JointRole;
    const std::size_t first = joints[index_of(neck)], top = joints[index_of(head)], tail = joints[index_of(tail_1)];
    std::vector<std::size_t> path;
    if (first != no_item && top != no_item && shape_.is_below(top, first))
      for (std::size_t joint = top; joint != first;) path.insert(path.begin(), joint = shape_.parents[joint]);
    spread(joints, std::array{neck, neck_2, neck_3}, path);
    path.clear();
    if (tail != no_item)
      for (const std::size_t joint : shape_.longest_path(tail))
        if (!shape_.ends[joint]) path.push_back(joint);
    spread(joints, std::array{tail_1, tail_2, tail_3, tail_4, tail_5}, path);
  }
  template <std::size_t N>
  static void spread(RoleTable& joints, const std::array<JointRole, N>& roles, const std::vector<std::size_t>& path) {
    for (std::size_t i = 0; i < std::min(N, path.size()); ++i)
      joints[index_of(roles[i])] = path[path.size() <= N ? i : i * (path.size() - 1) / (N - 1)];
  }

  void rate(JointRoles& roles) const {
    for (std::size_t r = 0; r < joint_role_count; ++r) {
      const std::size_t joint = roles.joints[r];
      if (joint == no_item) continue;
      const auto role = static_cast<JointRole>(r);
      const bool placed = (r >= index_of(JointRole::spine) && r <= index_of(JointRole::upper_chest)) ||
                          (role >= JointRole::neck_2 && role <= JointRole::tail_5 && role != JointRole::tail_1);
      const bool named = named_.joints[r] == joint, shaped = shaped_[r] == joint;
      double rating = 0.7 * shape_confidence_;
      if (placed)
        rating = std::min(roles.confidences[index_of(JointRole::hips)], 0.95);
      else if (named && shaped)
        rating = 1;
      else if (named)
        rating = shaped_[r] == no_item ? 0.85 : 0.6;
      else if (named_.joints[r] != no_item)
        rating = std::max(0.5, rating);  // the name is of another joint, which can't be it
      if (is_of_limb(role) && !named) rating *= 0.5 + 0.5 * side_confidence_;
      if (names_swapped_) rating *= 0.7;
      roles.confidences[r] = rating;
    }
    for (const JointRole role : core) roles.confidence += roles.confidence_of(role) / core.size();
    roles.confidence *= likeness(roles.joints);
  }

  /// 1 where arms, without hands, are at most 1.4 times as long as the legs, else less: wings are longer. The longest of
  /// 53 figures' arms are 1.3 times as long, the wings of a dragon, a bat and an eagle 1.7, 2.3 and 3.8 times.
  double likeness(const RoleTable& joints) const {
    if (is_animal()) return stance(joints);
    double arms = 0, legs = 0;
    const auto bones = [&](const std::array<LimbPart, 3>& parts, std::size_t side, double& sum) {
      for (std::size_t i = 0; i < 2; ++i) {
        const std::size_t from = joint_of(joints, parts[i], side), to = joint_of(joints, parts[i + 1], side);
        if (from == no_item || to == no_item) return false;
        sum += shape_.distance(from, to);
      }
      return true;
    };
    using enum LimbPart;
    for (std::size_t side = 0; side < 2; ++side)
      if (!bones({upper_arm, lower_arm, hand}, side, arms) || !bones({upper_leg, lower_leg, foot}, side, legs))
        return 1;
    const double longest = 1.4 * legs;
    return arms > longest ? longest * longest / (arms * arms) : 1;
  }

  /// 1 where fore and hind legs reach down to one ground from a trunk that lies across them, else less: a tyrannosaur's
  /// skeleton has a confidence of 0 by it, those of seven mammals and three dinosaurs on four legs of 0.96 and more.
  double stance(const RoleTable& joints) const {
    const BodyAxes axes = body_axes(joints, shape_.positions);
    std::array<double, 2> low{}, high{}, count{};  // of forelegs and hind legs
    std::array<Vec3d, 2> roots{};
    for (std::size_t limb = 0; limb < 4; ++limb) {
      std::vector<JointRole> parts = limb_roles(joints.kind, limb < 2, limb % 2);
      if (limb < 2) parts.erase(parts.begin());
      std::erase_if(parts, [&](JointRole role) { return joints[index_of(role)] == no_item; });
      if (parts.empty()) continue;
      const Vec3d root = shape_.positions[joints[index_of(parts.front())]];
      double lowest = dot(root, axes.up);
      for (const JointRole role : parts)
        for (const std::size_t at : shape_.longest_path(joints[index_of(role)]))
          lowest = std::min(lowest, dot(shape_.positions[at], axes.up));
      roots[limb / 2] += root, ++count[limb / 2];
      low[limb / 2] += lowest, high[limb / 2] += dot(root, axes.up);
    }
    if (count[0] == 0 || count[1] == 0) return 0;
    for (std::size_t pair = 0; pair < 2; ++pair)
      low[pair] /= count[pair], high[pair] /= count[pair], roots[pair] = roots[pair] / count[pair];
    const double size = std::max(high[0] - low[0], high[1] - low[1]);
    if (!(size > 0)) return 0;
    const double lean = std::abs(dot(normalised(roots[0] - roots[1]), axes.up));
    return std::clamp(2 - 4 * std::abs(low[0] - low[1]) / size, 0.0, 1.0) * std::clamp(2.5 - 2.5 * lean, 0.0, 1.0);
  }

  const Motion& motion_;
  SkeletonShape shape_;
  NamedRoles named_;
  RoleTable shaped_{};
  double shape_confidence_ = 0, side_confidence_ = 0;
  bool names_swapped_ = false;
};

}  // namespace internal

/// The roles as those of a skeleton of one kind.
inline JointRoles joint_roles(const Motion& motion, SkeletonKind kind) {
  return internal::RoleJudge(motion, kind).judge();
}

inline JointRoles joint_roles(const Motion& motion) {
  JointRoles person = joint_roles(motion, SkeletonKind::person);
  JointRoles animal = joint_roles(motion, SkeletonKind::four_legged);
  // Both may have the same words for hips and knees; their shape distinguishes who stands on four legs. Of 60 people's
  // skeletons the highest confidence as an animal's is 0.25, of ten animals' without their names the lowest is 0.65.
  constexpr double certain = 0.5;
  return animal.confidence > std::min(person.confidence, certain) ? animal : person;
}

}  // namespace npt::inline NPT_ABI
