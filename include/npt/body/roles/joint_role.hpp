/// What a joint of a person's skeleton is for, whatever a file calls it. The names are VRM's.
/// Source    VRM 1.0, VRMC_vrm humanoid bones
#pragma once

#include <npt/config.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

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
inline constexpr std::size_t joint_role_count = middle_role_count + 2 * limb_part_count;

/// Behind the six of the middle, limb_part_count roles of the left side, then those of the right one.
enum class JointRole : std::uint8_t { hips, spine, chest, upper_chest, neck, head, first_left, none = 255 };

constexpr std::size_t index_of(JointRole role) { return static_cast<std::size_t>(role); }
/// side: 0 left, 1 right
constexpr JointRole limb_role(LimbPart part, std::size_t side) {
  return static_cast<JointRole>(middle_role_count + limb_part_count * side + static_cast<std::size_t>(part));
}
/// digit: 0, the thumb, to 4, the little finger; joint: 0 to 2 from the hand on
constexpr LimbPart digit_part(std::size_t digit, std::size_t joint) {
  return static_cast<LimbPart>(static_cast<std::size_t>(LimbPart::thumb_1) + 3 * digit + joint);
}
constexpr bool is_of_limb(JointRole role) { return role != JointRole::none && index_of(role) >= middle_role_count; }
/// Requires is_of_limb().
constexpr std::size_t side_of(JointRole role) { return (index_of(role) - middle_role_count) / limb_part_count; }
constexpr LimbPart part_of(JointRole role) {
  return static_cast<LimbPart>((index_of(role) - middle_role_count) % limb_part_count);
}
constexpr bool is_of_digit(JointRole role) { return is_of_limb(role) && part_of(role) >= LimbPart::thumb_1; }
/// The role of the other side; those of the middle are their own.
constexpr JointRole mirrored(JointRole role) {
  return is_of_limb(role) ? limb_role(part_of(role), 1 - side_of(role)) : role;
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

/// "hips", "leftUpperArm"; "none".
inline std::string role_name(JointRole role) {
  if (role == JointRole::none) return "none";
  if (!is_of_limb(role)) return std::string(middle_role_names[index_of(role)]);
  return std::string(side_of(role) == 0 ? "left" : "right") +
         std::string(limb_part_names[static_cast<std::size_t>(part_of(role))]);
}

/// The role of a name; none where it is none's.
inline JointRole role_named(std::string_view name) {
  for (std::size_t r = 0; r < joint_role_count; ++r)
    if (role_name(static_cast<JointRole>(r)) == name) return static_cast<JointRole>(r);
  return JointRole::none;
}

}  // namespace npt::inline NPT_ABI
