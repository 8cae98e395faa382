/// What a joint of a person's or a four-legged animal's skeleton is for, whatever a file calls it. People's names are
/// VRM's. An animal's forelegs have the roles of arms, its hind legs those of legs, under names of their own:
///   scapula       leftShoulder, leftForeShoulder in an animal's table; shoulder and elbow: upper and lower arm
///   knee, hock    lower leg and foot; what stands on the ground: fore feet, and toes
/// Source    VRM 1.0, VRMC_vrm humanoid bones
#pragma once

#include <npt/config.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

/// The joints of one side, in the order of their roles.
enum class LimbPart : std::uint8_t {
  shoulder,
  upper_arm,
  lower_arm,
  hand,
  upper_leg,
  lower_leg,
  foot,
  toes,
  thumb_1  ///< and so on: three joints for each of thumb, index, middle, ring and little finger
};

inline constexpr std::size_t middle_role_count = 6, digit_count = 5, limb_part_count = 8 + 3 * digit_count;
inline constexpr std::size_t limb_role_end = middle_role_count + 2 * limb_part_count, animal_role_count = 12;
inline constexpr std::size_t joint_role_count = limb_role_end + animal_role_count;

/// Behind the six of the middle, limb_part_count roles of the left side, then those of the right one; then what only
/// animals have.
enum class JointRole : std::uint8_t {
  hips,
  spine,
  chest,
  upper_chest,
  neck,
  head,
  first_left,
  neck_2 = limb_role_end,
  neck_3,
  tail_1,
  tail_2,
  tail_3,
  tail_4,
  tail_5,
  jaw,
  left_ear,
  right_ear,
  left_fore_toes,
  right_fore_toes,
  none = 255
};

/// The kinds of bodies whose skeletons are known.
enum class SkeletonKind : std::uint8_t { person, four_legged };

/// As in "a person's skeleton".
constexpr std::string_view to_string(SkeletonKind kind) {
  return kind == SkeletonKind::person ? "person" : "four-legged animal";
}

constexpr std::size_t index_of(JointRole role) { return static_cast<std::size_t>(role); }
/// side: 0 left, 1 right
constexpr JointRole limb_role(LimbPart part, std::size_t side) {
  return static_cast<JointRole>(middle_role_count + limb_part_count * side + static_cast<std::size_t>(part));
}
/// digit: 0, the thumb, to 4, the little finger; joint: 0 to 2 from the hand on
constexpr LimbPart digit_part(std::size_t digit, std::size_t joint) {
  return static_cast<LimbPart>(static_cast<std::size_t>(LimbPart::thumb_1) + 3 * digit + joint);
}
constexpr bool is_of_limb(JointRole role) {
  return index_of(role) >= middle_role_count && index_of(role) < limb_role_end;
}
/// Requires is_of_limb().
constexpr std::size_t side_of(JointRole role) { return (index_of(role) - middle_role_count) / limb_part_count; }
constexpr LimbPart part_of(JointRole role) {
  return static_cast<LimbPart>((index_of(role) - middle_role_count) % limb_part_count);
}
constexpr bool is_of_digit(JointRole role) { return is_of_limb(role) && part_of(role) >= LimbPart::thumb_1; }
/// The role of the other side; those of the middle are their own.
constexpr JointRole mirrored(JointRole role) {
  using enum JointRole;
  if (role == left_ear || role == left_fore_toes) return static_cast<JointRole>(index_of(role) + 1);
  if (role == right_ear || role == right_fore_toes) return static_cast<JointRole>(index_of(role) - 1);
  return is_of_limb(role) ? limb_role(part_of(role), 1 - side_of(role)) : role;
}

/// The joints of a limb from the trunk on, as far as a kind has them; an arm's or foreleg's begin with the girdle's.
inline std::vector<JointRole> limb_roles(SkeletonKind kind, bool arm, std::size_t side) {
  using enum LimbPart;
  std::vector<JointRole> roles;
  for (const LimbPart part :
       arm ? std::array{shoulder, upper_arm, lower_arm, hand} : std::array{upper_leg, lower_leg, foot, toes})
    roles.push_back(limb_role(part, side));
  if (kind == SkeletonKind::four_legged && arm)
    roles.push_back(side == 0 ? JointRole::left_fore_toes : JointRole::right_fore_toes);
  return roles;
}

inline constexpr std::array<std::string_view, middle_role_count> middle_role_names{"hips",       "spine", "chest",
                                                                                   "upperChest", "neck",  "head"};
inline constexpr std::array<std::string_view, limb_part_count> limb_part_names{"Shoulder",
                                                                               "UpperArm",
                                                                               "LowerArm",
                                                                               "Hand",
                                                                               "UpperLeg",
                                                                               "LowerLeg",
                                                                               "Foot",
                                                                               "Toes",
                                                                               "ThumbMetacarpal",
                                                                               "ThumbProximal",
                                                                               "ThumbDistal",
                                                                               "IndexProximal",
                                                                               "IndexIntermediate",
                                                                               "IndexDistal",
                                                                               "MiddleProximal",
                                                                               "MiddleIntermediate",
                                                                               "MiddleDistal",
                                                                               "RingProximal",
                                                                               "RingIntermediate",
                                                                               "RingDistal",
                                                                               "LittleProximal",
                                                                               "LittleIntermediate",
                                                                               "LittleDistal"};

/// Of the first parts of an animal's limbs; they have no digits.
inline constexpr std::array<std::string_view, 8> animal_part_names{
    "ForeShoulder", "ForeUpperLeg", "ForeLowerLeg", "ForeFoot", "HindUpperLeg", "HindLowerLeg", "HindFoot", "HindToes"};
inline constexpr std::array<std::string_view, animal_role_count> animal_role_names{
    "neck2", "neck3", "tail1",   "tail2",    "tail3",        "tail4",
    "tail5", "jaw",   "leftEar", "rightEar", "leftForeToes", "rightForeToes"};

/// Without its side: "UpperArm", or "ForeUpperLeg" of an animal.
inline std::string part_name(LimbPart part, SkeletonKind kind) {
  const auto number = static_cast<std::size_t>(part);
  return std::string(kind == SkeletonKind::four_legged && number < animal_part_names.size() ? animal_part_names[number]
                                                                                            : limb_part_names[number]);
}

/// "hips", "leftUpperArm", of an animal "leftForeUpperLeg"; "none".
inline std::string role_name(JointRole role, SkeletonKind kind = SkeletonKind::person) {
  if (role == JointRole::none) return "none";
  if (index_of(role) >= limb_role_end) return std::string(animal_role_names[index_of(role) - limb_role_end]);
  if (!is_of_limb(role)) return std::string(middle_role_names[index_of(role)]);
  return (side_of(role) == 0 ? "left" : "right") + part_name(part_of(role), kind);
}

/// The role of a name, of either kind; none where it is none's.
inline JointRole role_named(std::string_view name) {
  for (const SkeletonKind kind : {SkeletonKind::person, SkeletonKind::four_legged})
    for (std::size_t r = 0; r < joint_role_count; ++r)
      if (role_name(static_cast<JointRole>(r), kind) == name) return static_cast<JointRole>(r);
  return JointRole::none;
}

}  // namespace npt::inline NPT_ABI
