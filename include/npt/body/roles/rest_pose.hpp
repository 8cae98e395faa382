/// The pose that a skeleton was bound in, or else stands in at rest: T, A, arms down, or another one.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/facing.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

enum class RestPose { t, a, arms_down, other };

constexpr std::string_view to_string(RestPose pose) {
  return pose == RestPose::t ? "T" : pose == RestPose::a ? "A" : pose == RestPose::arms_down ? "arms down" : "other";
}

/// T: both upper arms within 20 degrees of level, A: up to 70 degrees lower, and both thighs within 40 degrees of down.
inline RestPose rest_pose_of(const Motion& motion, const JointRoles& roles) {
  using enum LimbPart;
  std::vector<Vec3d> positions;
  for (const Affine& world : bound_worlds(motion)) positions.push_back(world.shift);
  const BodyAxes axes = body_axes(roles.joints, positions);
  double lowest = 90, highest = -90;  // of the arms, in degrees below level
  for (std::size_t side = 0; side < 2; ++side) {
    const auto bone = [&](LimbPart from, LimbPart to) {
      const std::size_t a = roles.joint(from, side), b = roles.joint(to, side);
      return a == no_item || b == no_item ? Vec3d{} : normalised(positions[b] - positions[a]);
    };
    const Vec3d arm = bone(upper_arm, lower_arm), leg = bone(upper_leg, lower_leg);
    if (length(arm) == 0 || dot(leg, axes.up) > -0.77) return RestPose::other;
    const double below = std::asin(std::clamp(-dot(arm, axes.up), -1.0, 1.0)) * 180 / std::numbers::pi;
    if (std::abs(dot(arm, axes.forward)) > 0.6) return RestPose::other;
    lowest = std::min(lowest, below), highest = std::max(highest, below);
  }
  if (lowest > -20 && highest < 20) return RestPose::t;
  if (lowest > 10 && highest < 70) return RestPose::a;
  return lowest >= 60 ? RestPose::arms_down : RestPose::other;
}

}  // namespace npt::inline NPT_ABI
