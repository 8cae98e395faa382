/// Which joint has which role, as a text that people may correct: a line for each role, with the joint's name and how
/// certain it is.
///   # role joint confidence
///   hips "mixamorig:Hips" 1
///   leftHand - 0                       nobody's
///   rightHand @17                      joint 17, where its name isn't its own
/// Quotes stand around names with blanks; # begins a comment. Roles without a line stay as they were found.
/// Errors    npt::Error that names file and line: a role or a joint that there is none of, a role or a joint twice
#pragma once

#include <npt/base/error.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>
#include <npt/io/words.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace npt::inline NPT_ABI {

namespace internal {

class BoneMapReader {
 public:
  BoneMapReader(const Motion& motion, JointRoles roles, const std::string& file)
      : motion_(motion), roles_(std::move(roles)), file_(file) {}

  JointRoles read(std::string_view text) {
    choose_kind(text);
    lines_ = TextLines(text);
    for (std::string_view line; lines_.next(line);) {
      const auto words = list_words(line);
      if (words && words->empty()) continue;
      if (!words || words->size() < 2 || words->size() > 3) fail(found_words(words), "ROLE JOINT [CONFIDENCE]");
      const JointRole role = role_named((*words)[0]);
      if (role == JointRole::none) fail(in_quotes((*words)[0]), "a role: hips, spine, head, leftUpperArm, ...");
      if ((*words)[0] != roles_.role_name(role)) fail(in_quotes((*words)[0]), "roles of people or of animals alone");
      if (given_[index_of(role)]) fail(in_quotes((*words)[0]) + " twice", "each role once");
      given_[index_of(role)] = true;
      set(role, joint_of((*words)[1]), words->size() == 3 ? confidence_of((*words)[2]) : 1);
    }
    return std::move(roles_);
  }

 private:
  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({.file = file_,
                 .place = "line " + std::to_string(lines_.number()),
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

  /// Where a line names what only the other kind of body has, nothing that was found counts.
  void choose_kind(std::string_view text) {
    TextLines lines(text);
    for (std::string_view line; lines.next(line);) {
      const auto words = list_words(line);
      const JointRole role = words && !words->empty() ? role_named(words->front()) : JointRole::none;
      if (role == JointRole::none || words->front() == roles_.role_name(role)) continue;
      const bool person = roles_.kind() == SkeletonKind::person;
      roles_ = JointRoles{};
      roles_.joints.fill(no_item);
      roles_.joints.kind = person ? SkeletonKind::four_legged : SkeletonKind::person;
      return;
    }
  }

  double confidence_of(const std::string& word) const {
    const auto value = parse_number<double>(word);
    if (!value || !(*value >= 0 && *value <= 1)) fail(in_quotes(word), "a confidence from 0 to 1");
    return *value;
  }

  std::size_t joint_of(const std::string& word) const {
    if (word == "-") return no_item;
    const auto count = std::ranges::count(motion_.joints, word, &MotionJoint::name);
    if (count == 1)
      return static_cast<std::size_t>(std::ranges::find(motion_.joints, word, &MotionJoint::name) -
                                      motion_.joints.begin());
    if (count > 1) fail(std::to_string(count) + " joints " + in_quotes(word), "@NUMBER for one of them");
    const auto number =
        word.starts_with('@') ? parse_number<std::size_t>(std::string_view(word).substr(1)) : std::nullopt;
    if (!number || *number >= motion_.joints.size())
      fail("no joint " + in_quotes(word), "one of the skeleton's joints");
    return *number;
  }

  /// What a line says goes before what was found: a joint found for another role loses that one.
  void set(JointRole role, std::size_t joint, double confidence) {
    if (joint != no_item)
      if (const JointRole other = roles_.role_of(joint); other != JointRole::none && other != role) {
        if (given_[index_of(other)])
          fail("joint " + in_quotes(motion_.joints[joint].name) + " twice", "one role a joint");
        roles_.joints[index_of(other)] = no_item;
        roles_.confidences[index_of(other)] = 0;
      }
    roles_.joints[index_of(role)] = joint;
    roles_.confidences[index_of(role)] = joint == no_item ? 0 : confidence;
  }

  const Motion& motion_;
  JointRoles roles_;
  const std::string& file_;
  TextLines lines_{""};
  std::array<bool, joint_role_count> given_{};
};

/// A joint's name as the map has it, or its number where the name isn't its own or can't stand in quotes.
inline std::string name_in_map(const Motion& motion, std::size_t joint) {
  const std::string& name = motion.joints[joint].name;
  const bool own = std::ranges::count(motion.joints, name, &MotionJoint::name) == 1;
  const bool plain =
      std::ranges::none_of(name, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == '"'; });
  return own && plain && !name.empty() && name != "-" ? '"' + name + '"' : "@" + std::to_string(joint);
}

}  // namespace internal

/// `found`: what joint_roles() found. `file` stands in the messages of errors.
inline JointRoles parse_bone_map(std::string_view text, const Motion& motion, const JointRoles& found,
                                 const std::string& file) {
  return internal::BoneMapReader(motion, found, file).read(text);
}

/// All roles that have a joint, in the roles' order.
inline std::string format_bone_map(const Motion& motion, const JointRoles& roles) {
  std::string text = "# role joint confidence\n";
  for (std::size_t r = 0; r < joint_role_count; ++r) {
    if (roles.joints[r] == no_item) continue;
    text += roles.role_name(static_cast<JointRole>(r)) + " " + internal::name_in_map(motion, roles.joints[r]) + " ";
    append_number(text, std::round(100 * roles.confidences[r]) / 100);
    text += '\n';
  }
  return text;
}

}  // namespace npt::inline NPT_ABI
