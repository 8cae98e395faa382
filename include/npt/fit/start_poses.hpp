/// Where a fit may start from: what people do with their limbs, on a coarse grid. Axis angles for SMPL's 24 joints.
/// The grid knows nothing of any data set: it covers what shoulders, elbows, hips and knees can do, in steps of about 40 degrees,
/// which is what a search finds its way home from.
#pragma once

#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/core/vec3.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace npt::inline NPT_ABI {

/// Axis angles of some joints of a body; the others stay as they are.
struct LimbPose {
  std::array<std::size_t, 5> joints{};  ///< from the trunk outwards
  std::array<Vec3d, 5> axis_angles;
};

/// The poses of each of the four limbs: left and right arm, left and right leg. Only shoulders and elbows, hips and knees vary;
/// the limb's other joints are straight.
inline std::array<std::vector<LimbPose>, 4> limb_poses() {
  using enum SmplJoint;
  constexpr double degree = std::numbers::pi / 180.0;
  std::array<std::vector<LimbPose>, 4> limbs;
  for (const double side : {1.0, -1.0}) {
    const bool left = side > 0;
    const auto joints = [left](SmplJoint a, SmplJoint b) { return joint_index(left ? a : b); };
    const std::array<std::size_t, 5> arm{joints(left_collar, right_collar), joints(left_shoulder, right_shoulder),
                                         joints(left_elbow, right_elbow), joints(left_wrist, right_wrist),
                                         joints(left_hand, right_hand)};
    for (const double forward : {0.0, 40.0, 80.0, -35.0})
      for (const double down : {0.0, 40.0, 80.0, -40.0})
        for (const double bend : {0.0, 55.0, 110.0})
          limbs[left ? 0 : 1].push_back(
              {arm, {Vec3d{}, Vec3d{0, -forward, -down} * (side * degree), Vec3d{0, -bend, 0} * (side * degree)}});
    const std::array<std::size_t, 5> leg{joints(left_hip, right_hip), joints(left_knee, right_knee),
                                         joints(left_ankle, right_ankle), joints(left_foot, right_foot),
                                         joints(left_foot, right_foot)};
    for (const double forward : {0.0, 35.0, 70.0, 105.0, -25.0})
      for (const double apart : {0.0, 25.0, 50.0})
        for (const double bend : {0.0, 50.0, 100.0})
          limbs[left ? 2 : 3].push_back({leg, {Vec3d{-forward, 0, side * apart} * degree, Vec3d{bend, 0, 0} * degree}});
  }
  return limbs;
}

/// Axis angles of a body that has been turned about its own vertical axis, y, and then laid or stood so that this axis points elsewhere.
/// All directions of one `up` stand together, [6][yaws]: y first, then z, -z, x, -x, -y.
inline std::vector<Vec3d> start_directions(int yaws) {
  /// w, x, y, z
  using Quaternion = std::array<double, 4>;
  const double h = std::sqrt(0.5);
  constexpr Quaternion none{1, 0, 0, 0}, over{0, 1, 0, 0};
  const std::array<Quaternion, 6> ups{none, {h, h, 0, 0}, {h, -h, 0, 0}, {h, 0, 0, -h}, {h, 0, 0, h}, over};
  std::vector<Vec3d> result;
  for (const auto& [w, x, y, z] : ups)
    for (int i = 0; i < yaws; ++i) {
      const double half = std::numbers::pi * i / yaws, c = std::cos(half), s = std::sin(half);
      double real = w * c - y * s;
      Vec3d axis{x * c - z * s, y * c + w * s, z * c + x * s};
      if (real < 0) real = -real, axis = -axis;
      const double sine = length(axis);
      result.push_back(sine > 0 ? axis * (2 * std::atan2(sine, real) / sine) : Vec3d{});
    }
  return result;
}

}  // namespace npt::inline NPT_ABI
