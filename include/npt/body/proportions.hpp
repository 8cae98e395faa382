/// Proportions: a body whose limbs, head and trunk are longer, thicker or larger than people's, as characters are.
/// Each is one more linear shape direction: part j is stretched by A_j = I + sum_k p_k B_jk in the rest pose, its joint
/// carried along by the parts before it, v' = sum_j w_vj (c_j' + A_j (v - c_j)), which is linear in p.
/// Shapes    p: [body_proportion_count], after the body's own shape parameters; 0 everywhere is the body as it was
/// Units     p_k is a relative change: 0.5 makes the part half as long (or thick) again
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/plan_proportions.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// What can change. Lengths are along the bone, girths across it; both sides change alike.
enum class BodyProportion : std::size_t {
  size,
  trunk_length,
  trunk_width,
  trunk_depth,
  shoulder_width,
  hip_girth,
  neck_length,
  head_size,
  upper_arm_length,
  forearm_length,
  arm_girth,
  hand_size,
  thigh_length,
  shin_length,
  leg_girth,
  foot_size
};

inline constexpr std::size_t body_proportion_count = 16;

using Proportions = std::array<double, body_proportion_count>;

/// The spread of each among people beyond what a body's own shape directions tell, for a fit's prior.
inline constexpr Proportions human_proportion_deviations{0.10, 0.06, 0.08, 0.08, 0.08, 0.08, 0.10, 0.08,
                                                         0.06, 0.06, 0.12, 0.10, 0.06, 0.06, 0.12, 0.12};

namespace body::internal {

/// The matrices B_jk of a joint: how the part that it moves grows with each proportion. `along`: unit, of its bone.
NPT_INLINE void add_part_growth(std::size_t joint, Vec3d along, std::array<Matrix3, body_proportion_count>& growth) {
  using enum SmplJoint;
  using P = BodyProportion;
  const auto at = [&growth](P p) -> Matrix3& { return growth[static_cast<std::size_t>(p)]; };
  const auto axis = [](Vec3d u) { return outer(u, u); };
  const Matrix3 all = Matrix3::identity();
  const Matrix3 length = axis(along), girth = all - length;
  at(P::size) = all;
  const auto is = [joint](auto... joints) { return ((joint == joint_index(joints)) || ...); };
  if (is(pelvis, spine1, spine2, spine3)) {
    at(P::trunk_length) = axis({0, 1, 0});
    at(P::trunk_width) = axis({1, 0, 0});
    at(P::trunk_depth) = axis({0, 0, 1});
  }
  if (is(pelvis)) at(P::hip_girth) = axis({1, 0, 0}) + axis({0, 0, 1});
  if (is(left_collar, right_collar)) at(P::shoulder_width) = axis({1, 0, 0});
  if (is(neck)) at(P::neck_length) = axis({0, 1, 0});
  if (is(head)) at(P::head_size) = all;
  if (is(left_shoulder, right_shoulder)) at(P::upper_arm_length) = length, at(P::arm_girth) = girth;
  if (is(left_elbow, right_elbow)) at(P::forearm_length) = length, at(P::arm_girth) = girth;
  if (is(left_wrist, right_wrist, left_hand, right_hand)) at(P::hand_size) = all;
  if (is(left_hip, right_hip)) at(P::thigh_length) = length, at(P::leg_girth) = girth;
  if (is(left_knee, right_knee)) at(P::shin_length) = length, at(P::leg_girth) = girth;
  if (is(left_ankle, right_ankle, left_foot, right_foot)) at(P::foot_size) = all;
}

/// [J] for SMPL's skeleton: B_jk of every joint, for joints at these places in the rest pose.
NPT_INLINE std::vector<std::array<Matrix3, body_proportion_count>> part_growth(const std::vector<Vec3d>& joints) {
  std::vector<std::array<Matrix3, body_proportion_count>> growth(joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    Vec3d along{0, 1, 0};
    for (std::size_t child = j + 1; child < joints.size(); ++child)
      if (smpl_parents[child] == static_cast<int>(j)) {
        along = normalised(joints[child] - joints[j]);
        break;
      }
    add_part_growth(j, along, growth[j]);
  }
  return growth;
}

}  // namespace body::internal

inline constexpr Proportions unit_proportions{1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};

/// The body with body_proportion_count more shape directions. `unit`: the relative change at a shape parameter of 1;
/// with human_proportion_deviations all shape parameters are in standard deviations.
/// Errors  npt::Error for a body without SMPL's joints
NPT_INLINE BodyModel with_proportions(const BodyModel& body, const Proportions& unit = unit_proportions) {
  if (body.joint_count() != smpl_joint_count)
    throw Error({.file = "body",
                 .found = std::to_string(body.joint_count()) + " joints",
                 .expected = "SMPL's " + std::to_string(smpl_joint_count) + ", for proportions"});
  const std::vector<Vec3d> joints = body.joints({});
  std::vector<std::vector<Matrix3>> growth;
  for (const auto& b : body::internal::part_growth(joints)) growth.emplace_back(b.begin(), b.end());
  return body::internal::with_growth(body, growth, unit);
}

/// Proportions of characters: three bodies in ten nearly as they are, the others with a head of 0.85 to 2.3 times the
/// size, legs of 0.55 to 1.2 times the length, girths of 0.75 to 1.8, and more; each log-uniform. Always takes
/// 1 + body_proportion_count draws.
NPT_INLINE Proportions sample_proportions(Random& random) {
  struct Range {
    double low, high;
  };
  static constexpr std::array<Range, body_proportion_count> ranges{{{0.85, 1.15},
                                                                    {0.75, 1.25},
                                                                    {0.80, 1.60},
                                                                    {0.80, 1.70},
                                                                    {0.75, 1.35},
                                                                    {0.80, 1.40},
                                                                    {0.50, 1.20},
                                                                    {0.85, 2.30},
                                                                    {0.60, 1.20},
                                                                    {0.60, 1.20},
                                                                    {0.75, 1.80},
                                                                    {0.80, 1.80},
                                                                    {0.50, 1.20},
                                                                    {0.50, 1.20},
                                                                    {0.75, 1.80},
                                                                    {0.80, 1.80}}};
  Proportions p;
  const double kind = random.uniform();
  // The other seven in ten: half way to the ranges' ends for three, all the way for four.
  const double amount = kind < 0.3 ? 0.2 : kind < 0.6 ? 0.5 : 1.0;
  for (std::size_t k = 0; k < p.size(); ++k)
    p[k] = std::exp(amount * random.uniform(std::log(ranges[k].low), std::log(ranges[k].high))) - 1;
  return p;
}

/// Shape parameters of with_proportions(body): the body's own, `own_shapes` of them as sample_shape draws them, then
/// random proportions.
NPT_INLINE std::vector<float> sample_character(Random& random, std::size_t own_shapes,
                                               ShapeDistribution distribution = ShapeDistribution::normal) {
  std::vector<float> betas = sample_shape(random, own_shapes, distribution);
  for (const double p : sample_proportions(random)) betas.push_back(static_cast<float>(p));
  return betas;
}

}  // namespace npt::inline NPT_ABI
