/// A prior of natural poses: standing, walking, running, sitting, crouching, fighting, dancing, falling, lying.
///   p(f) = sum over k of w_k / 2 (N(f; m_k, F_k F_k^T + diag(d_k^2)) + N(mirrored f; the same))
/// f: the tilt of the root, without its direction about the vertical, and the axis angles of joints 1 to 23. Left and
/// right are alike. Twelve components were fitted by EM to 327 poses of animation libraries under CC0, 21 made by hand
/// for what those lack: arms overhead, chairs, floors, lying, crouching (examples/convert/fit_pose_prior.py).
/// Numerics  a draw takes 86 uniform or normal numbers whatever it becomes, so it depends on seed and stream only.
///           Poses left out of the fit, clip by clip, have a log density of 33 on average, which hardly changes from 4
///           to 12 components
#pragma once

#include <npt/base/digits.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/body/natural_pose_data.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {
NPT_INLINE_CLASS(class, NaturalPoses);
template <class>
class BasicNaturalPoses {
 public:
  /// [24, 3] axis angles in radians, SMPL's order of joints, the root's direction first.
  using Pose = std::array<float, 3 * smpl_joint_count>;

  BasicNaturalPoses()
      : means_(numbers(body::internal::natural_pose_means, body::internal::natural_pose_means_largest)),
        deviations_(numbers(body::internal::natural_pose_deviations, body::internal::natural_pose_deviations_largest)),
        factors_(numbers(body::internal::natural_pose_factors, body::internal::natural_pose_factors_largest)),
        limits_(numbers(body::internal::natural_pose_limits, body::internal::natural_pose_limits_largest)) {
    const std::vector<double> weights =
        numbers(body::internal::natural_pose_weights, body::internal::natural_pose_weights_largest);
    double sum = 0;
    for (const double w : weights) sum += w;
    for (const double w : weights) choice_.add(w / sum);
  }

  /// A pose in any direction about the vertical (y). Angles end at the limits of the poses that the prior is made of.
  Pose sample(Random& random) const {
    const std::size_t k = choice_.at(random.uniform());
    const bool mirror = random.uniform() < 0.5;
    const double yaw = random.uniform(-std::numbers::pi, std::numbers::pi);
    std::array<double, rank> along{};
    for (double& x : along) x = random.normal();
    Features drawn{};
    for (std::size_t i = 0; i < features; ++i) {
      double x = means_[k * features + i] + deviations_[spread_of(k) * features + i] * random.normal();
      for (std::size_t r = 0; r < rank; ++r) x += factor(spread_of(k), r)[i] * along[r];
      drawn[i] = std::clamp(x, limits_[i], limits_[features + i]);
    }
    if (mirror) drawn = mirrored(drawn);
    Pose pose{};
    const Vec3d root = root_direction(yaw, drawn[0], drawn[1]);
    pose[0] = static_cast<float>(root.x), pose[1] = static_cast<float>(root.y), pose[2] = static_cast<float>(root.z);
    for (std::size_t i = 3; i < pose.size(); ++i) pose[i] = static_cast<float>(drawn[i - 1]);
    return pose;
  }

  /// Lowest and highest angle that a draw takes, of axis `axis` (0 to 2) of joint 1 to 23.
  std::array<double, 2> limits(SmplJoint joint, std::size_t axis) const {
    NPT_ASSERT(joint != SmplJoint::pelvis && axis < 3);
    const std::size_t i = 3 * joint_index(joint) + axis - 1;
    return {limits_[i], limits_[features + i]};
  }

 private:
  static constexpr std::size_t features = 3 * smpl_joint_count - 1, spreads = body::internal::natural_pose_spreads,
                               rank = body::internal::natural_pose_rank;
  /// [71] tilt about x and z, then axis angles of joints 1 to 23.
  using Features = std::array<double, features>;

  static std::vector<double> numbers(std::string_view text, double largest) {
    std::vector<double> values;
    for (const std::uint32_t n : digits::numbers_of(text, 2))
      values.push_back((static_cast<double>(n) / 4095 * 2 - 1) * largest);
    return values;
  }
  static constexpr std::size_t spread_of(std::size_t component) { return std::min(component, spreads - 1); }
  /// [71] direction r of a component's covariance.
  const double* factor(std::size_t spread, std::size_t r) const {
    return factors_.data() + (spread * rank + r) * features;
  }

  static Features mirrored(const Features& f) {
    Features result{};
    result[0] = f[0], result[1] = -f[1];
    for (std::size_t j = 1; j < smpl_joint_count; ++j) {
      const double* from = &f[3 * smpl_mirrored_joints[j] - 1];
      double* to = &result[3 * j - 1];
      to[0] = from[0], to[1] = -from[1], to[2] = -from[2];
    }
    return result;
  }

  /// The axis angle of a turn about y after a tilt about the horizontal axis (x, 0, z).
  static Vec3d root_direction(double yaw, double x, double z) {
    const double angle = std::hypot(x, z), half = angle / 2;
    const double scale = angle < 1e-9 ? 0.5 : std::sin(half) / angle;
    const Quaternion turn{0, std::sin(yaw / 2), 0, std::cos(yaw / 2)}, tilt{x * scale, 0, z * scale, std::cos(half)};
    return axis_angle(turn * tilt);
  }

  WeightedChoice choice_;           ///< of a component
  std::vector<double> means_;       ///< [K, 71]
  std::vector<double> deviations_;  ///< [spreads, 71]
  std::vector<double> factors_;     ///< [spreads, rank, 71]
  std::vector<double> limits_;      ///< [2, 71]
};

/// The prior that ships with npt, read from its digits at the first call and then shared.
NPT_INLINE const NaturalPoses& natural_poses() {
  static const NaturalPoses poses;
  return poses;
}

}  // namespace npt::inline NPT_ABI
