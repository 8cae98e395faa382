/// Which of a rig's joints are those of a person: SMPL's 24 by the names that tools give them.
/// Known     Mixamo, VRM, Unreal, Rigify and Blender's ".L", Biped, VRoid, SMPL, and game packs' (UpperArm.L, Torso)
/// Shapes    result: [24] joints of the rig, or no_item where it has none; the spine's three stand open, since the
///           chain from the hips to the neck says more than its names
/// Errors    npt::Error for joints that a person must have and for two joints of one name
#pragma once

#include <npt/base/error.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/lab/rig/rig.hpp>

#include <array>
#include <cctype>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

using HumanoidJoints = std::array<std::size_t, smpl_joint_count>;

namespace rig::internal {

/// A joint's name in parts: "mixamorig:LeftUpLeg" is (upleg, left), "UpperArm.L.001" (upperarm1, left).
struct JointName {
  enum class Side { middle, left, right };
  std::string base;
  Side side = Side::middle;
};

inline JointName parse_joint_name(std::string_view name) {
  if (const std::size_t colon = name.find_last_of(":|"); colon != std::string_view::npos) name.remove_prefix(colon + 1);
  if (name.starts_with("mixamorig")) name.remove_prefix(9);
  std::vector<std::string> words;
  char last = '_';
  for (const char c : name) {
    const auto u = static_cast<unsigned char>(c), before = static_cast<unsigned char>(last);
    const bool letter = std::isalpha(u) != 0, digit = std::isdigit(u) != 0;
    const bool begins = (letter && !std::isalpha(before)) || (digit && !std::isdigit(before)) ||
                        (std::isupper(u) && std::islower(before));
    if (letter || digit) {
      if (begins) words.emplace_back();
      words.back() += static_cast<char>(std::tolower(u));
    }
    last = c;
  }
  JointName result;
  for (const std::string& word : words) {
    using enum JointName::Side;
    if (word == "l" || word == "left")
      result.side = left;
    else if (word == "r" || word == "right")
      result.side = right;
    else if (std::isdigit(static_cast<unsigned char>(word.front())) != 0) {
      const std::size_t zeros = word.find_first_not_of('0');
      if (!result.base.empty() && zeros != std::string::npos) result.base += word.substr(zeros);
    } else if (word != "def" && word != "org" && word != "bip" && word != "j" && word != "c" && word != "jnt" &&
               word != "joint" && word != "bone" && word != "b")
      result.base += word;
  }
  return result;
}

class HumanoidFinder {
 public:
  explicit HumanoidFinder(const Rig& rig) : rig_(rig) {
    found_.fill(no_item);
    for (std::size_t j = 0; j < rig.joint_count(); ++j) names_.push_back(parse_joint_name(rig.joint_name(j)));
  }

  HumanoidJoints find() {
    using enum SmplJoint;
    // A joint's names, the likeliest first. "Shoulder" is the collar bone beside an upper arm's joint, "foot" the toes'
    // beside an ankle's.
    look(pelvis, {"hips", "pelvis", "hip"});
    look(neck, {"neck", "neck1"});
    look(head, {"head"});
    both(left_hip, right_hip, {"upleg", "upperleg", "thigh", "hip", "upperleg1", "thigh1"});
    both(left_knee, right_knee, {"lowerleg", "shin", "calf", "knee", "lowleg", "leg", "shin1"});
    both(left_ankle, right_ankle, {"ankle", "foot"});
    const bool ankles = names_of(left_ankle) == "ankle";
    both(left_foot, right_foot,
         ankles ? std::initializer_list<std::string_view>{"toe", "toes", "toebase", "ball", "toe0", "foot"}
                : std::initializer_list<std::string_view>{"toe", "toes", "toebase", "ball", "toe0"});
    both(left_shoulder, right_shoulder, {"upperarm", "uparm", "arm", "upperarm1"});
    if (at(left_shoulder) == no_item) {
      both(left_shoulder, right_shoulder, {"shoulder"});
      both(left_collar, right_collar, {"collar", "clavicle", "collarbone"});
    } else {
      both(left_collar, right_collar, {"collar", "clavicle", "collarbone", "shoulder"});
    }
    both(left_elbow, right_elbow, {"lowerarm", "forearm", "lowarm", "elbow", "forearm1"});
    both(left_wrist, right_wrist, {"wrist", "hand", "palm"});
    const bool wrists = names_of(left_wrist) == "wrist";
    both(left_hand, right_hand,
         wrists ? std::initializer_list<std::string_view>{"hand", "middle1", "middleproximal", "handmiddle1"}
                : std::initializer_list<std::string_view>{"middle1", "middleproximal", "handmiddle1", "fmiddle1",
                                                          "middlehand", "fingers"});
    for (const SmplJoint joint :
         {left_hip, right_hip, left_knee, right_knee, left_shoulder, right_shoulder, left_elbow, right_elbow})
      if (at(joint) == no_item) miss(joint);
    if (at(neck) == no_item && at(head) == no_item) miss(head);
    return found_;
  }

 private:
  std::size_t& at(SmplJoint joint) { return found_[joint_index(joint)]; }
  std::string names_of(SmplJoint joint) { return at(joint) == no_item ? std::string() : names_[at(joint)].base; }

  std::optional<std::size_t> named(std::string_view base, JointName::Side side) const {
    std::optional<std::size_t> result;
    for (std::size_t j = 0; j < names_.size(); ++j) {
      if (names_[j].base != base || names_[j].side != side) continue;
      if (result)
        throw Error({.file = rig_.name,
                     .place = "joint '" + rig_.joint_name(j) + "'",
                     .found = "a name that reads like that of joint '" + rig_.joint_name(*result) + "'",
                     .expected = "one joint of a person for each name"});
      result = j;
    }
    return result;
  }
  void look(SmplJoint joint, std::initializer_list<std::string_view> bases,
            JointName::Side side = JointName::Side::middle) {
    for (const std::string_view base : bases)
      if (const auto j = named(base, side)) {
        at(joint) = *j;
        return;
      }
  }
  void both(SmplJoint left, SmplJoint right, std::initializer_list<std::string_view> bases) {
    look(left, bases, JointName::Side::left);
    look(right, bases, JointName::Side::right);
  }

  [[noreturn]] void miss(SmplJoint joint) const {
    std::string names;
    for (std::size_t j = 0; j < rig_.joint_count() && names.size() < 200; ++j)
      names += (names.empty() ? "'" : ", '") + rig_.joint_name(j) + "'";
    throw Error({.file = rig_.name,
                 .place = "joint " + std::string(smpl_joint_names[joint_index(joint)]),
                 .found = std::to_string(rig_.joint_count()) + " joints without it (" + names + ")",
                 .expected = "a person's joints under names that tools give them, such as UpperArm.L, LeftForeArm, "
                             "leftUpperLeg, calf_l"});
  }

  const Rig& rig_;
  std::vector<JointName> names_;
  HumanoidJoints found_{};
};

}  // namespace rig::internal

inline HumanoidJoints humanoid_joints(const Rig& rig) { return rig::internal::HumanoidFinder(rig).find(); }

}  // namespace npt::inline NPT_ABI
