/// What a user should know of a motion that was put on another skeleton.
///   for (const MotionWarning& warning : result.warnings) puts(text_of(warning, "hero.glb", "walk.bvh").c_str());
#pragma once

#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/warning.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

enum class MotionWarningCode {
  joints_uncertain,  ///< which joint is which is uncertain; value: the confidence
  joints_missing     ///< main joints that only the other skeleton has; roles: theirs
};

struct MotionWarning {
  MotionWarningCode code = MotionWarningCode::joints_uncertain;
  MeshRole skeleton = MeshRole::identity;  ///< identity: the character's, pose: the motion's
  SkeletonKind kind = SkeletonKind::person;
  double value = 0;
  std::vector<JointRole> roles{};

  friend bool operator==(const MotionWarning&, const MotionWarning&) = default;
};

namespace internal {

/// Hips, head and the limbs' bones. Hands and feet aren't among them: low-poly figures have none, and look right.
inline std::vector<JointRole> main_roles() {
  using enum LimbPart;
  std::vector<JointRole> roles{JointRole::hips, JointRole::head};
  for (std::size_t side = 0; side < 2; ++side)
    for (const LimbPart part : {upper_arm, lower_arm, upper_leg, lower_leg}) roles.push_back(limb_role(part, side));
  return roles;
}

inline void warn_of_skeleton(const JointRoles& own, const JointRoles& other, MeshRole which,
                             std::vector<MotionWarning>& warnings) {
  const std::vector<JointRole> all = main_roles();
  std::vector<JointRole> missing;
  double there = 0;
  for (const JointRole role : all) {
    if (own.joint(role) != no_item)
      ++there;
    else if (other.joint(role) != no_item)
      missing.push_back(role);
  }
  // A figure without arms or legs is certain of what it has: the next warning names what it lacks.
  constexpr double certain = 0.6;
  if (own.confidence * static_cast<double>(all.size()) < certain * there)
    warnings.push_back({MotionWarningCode::joints_uncertain, which, own.kind(), own.confidence, {}});
  if (!missing.empty())
    warnings.push_back({MotionWarningCode::joints_missing, which, own.kind(), 0, std::move(missing)});
}

/// "head, leftFoot, both LowerArm"
inline std::string listed(const std::vector<JointRole>& roles, SkeletonKind kind) {
  const auto has = [&roles](JointRole role) { return std::find(roles.begin(), roles.end(), role) != roles.end(); };
  std::string text;
  for (const JointRole role : roles) {
    const bool both = is_of_limb(role) && has(mirrored(role));
    if (both && side_of(role) == 1) continue;
    if (!text.empty()) text += ", ";
    text += both ? "both " + part_name(part_of(role), kind) : role_name(role, kind);
  }
  return text;
}

}  // namespace internal

inline std::vector<MotionWarning> motion_warnings(const JointRoles& source, const JointRoles& target) {
  std::vector<MotionWarning> warnings;
  internal::warn_of_skeleton(source, target, MeshRole::pose, warnings);
  internal::warn_of_skeleton(target, source, MeshRole::identity, warnings);
  return warnings;
}

/// A sentence without a full stop. identity, pose: what the character and the motion are called
inline std::string text_of(const MotionWarning& warning, const std::string& identity, const std::string& pose) {
  const bool of_target = warning.skeleton == MeshRole::identity;
  const std::string& name = of_target ? identity : pose;
  if (warning.code == MotionWarningCode::joints_uncertain)
    return name + " hardly looks like a " + std::string(to_string(warning.kind)) +
           "'s skeleton, so which joint is which is uncertain (confidence " +
           std::to_string(std::lround(100 * warning.value)) + " %); a bone map (--bone-map) says it";
  return name + " has no joint for " + internal::listed(warning.roles, warning.kind) +
         (of_target ? ": what the clip does with it is left out" : ": it stays in the character's rest");
}

}  // namespace npt::inline NPT_ABI
