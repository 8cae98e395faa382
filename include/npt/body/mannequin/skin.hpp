/// How the mannequin's skin follows its bones: smooth weights, and joints as averages of the skin around them.
/// A weight is a product of ramps along the chain from the trunk to the vertex: each joint passes on a share that rises
/// from 0 to 1 across it. The shares of one vertex sum to 1 by construction.
/// Source    joints: Sukumar, "Construction of polygonal interpolants: a maximum entropy approach", 2004
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/anatomy.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI::anatomy {

/// 0 below `low`, 1 above `high`, smooth between.
NPT_INLINE double ramp(double x, double low, double high) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

using JointWeights = std::array<double, smpl_joint_count>;

/// Share of one arm at q = (|x|, y, z): everything from the collar bone outwards.
NPT_INLINE double arm_share(Vec3d q) {
  const double height = ramp(q.y, 1.14, 1.37), beside_neck = ramp(q.y, 1.44, 1.50) * (1.0 - ramp(q.x, 0.05, 0.13));
  const double below_head = 1.0 - ramp(q.y, 1.48, 1.53);
  const double chest = ramp(q.x, 0.0, 0.170) * height * (1.0 - beside_neck) * below_head;
  return std::max(chest, ramp(q.x, 0.175, 0.24));
}

/// Adds one arm's joints. `share` is what the trunk leaves to the arm.
NPT_INLINE void add_arm(Vec3d q, double share, std::size_t side, JointWeights& w) {
  // Ribs under the armpit stay with the trunk, however far out they are.
  const double below_armpit = 1.0 - ramp(q.y, 1.23, 1.36);
  const double shoulder = ramp(q.x - 0.06 * below_armpit, 0.115, 0.235);
  const double elbow = ramp(q.x, 0.405, 0.505), wrist = ramp(q.x, 0.672, 0.745);
  // The thumb stands beside the knuckles and does not bend with the fingers.
  const double fingers = ramp(q.x - 1.5 * std::max(q.z - 0.043, 0.0), 0.770, 0.815);
  w[joint_index(SmplJoint::left_collar) + side] += share * (1.0 - shoulder);
  w[joint_index(SmplJoint::left_shoulder) + side] += share * shoulder * (1.0 - elbow);
  w[joint_index(SmplJoint::left_elbow) + side] += share * elbow * (1.0 - wrist);
  w[joint_index(SmplJoint::left_wrist) + side] += share * wrist * (1.0 - fingers);
  w[joint_index(SmplJoint::left_hand) + side] += share * wrist * fingers;
}

/// Share of both legs at q: below a plane through the hip joint that rises outwards, like the fold of the groin.
NPT_INLINE double legs_share(Vec3d q) {
  const double below = 0.42 * (q.x - 0.090) - 0.91 * (q.y - 0.912);
  // The crotch stays with the pelvis: pulled by both thighs it would become a web between them.
  const double beside_crotch = std::max(ramp(q.x, -0.04, 0.07), ramp(-q.y, -0.815, -0.700));
  return ramp(below, -0.075, 0.085) * beside_crotch;
}

NPT_INLINE void add_leg(Vec3d q, double share, std::size_t side, JointWeights& w) {
  // Narrow in front, so that the knee cap keeps its roundness; wide behind, where the skin folds.
  const double half = std::clamp(0.055 - 0.35 * q.z, 0.036, 0.070);
  const double knee = ramp(-q.y, -0.487 - half, -0.487 + half);
  const double ankle = ramp(0.3 * (q.z + 0.02) - q.y, -0.125, -0.060);
  const double toes = ramp(q.z, 0.085, 0.130) * ankle;
  w[joint_index(SmplJoint::left_hip) + side] += share * (1.0 - knee);
  w[joint_index(SmplJoint::left_knee) + side] += share * knee * (1.0 - ankle);
  w[joint_index(SmplJoint::left_ankle) + side] += share * knee * ankle * (1.0 - toes);
  w[joint_index(SmplJoint::left_foot) + side] += share * knee * ankle * toes;
}

NPT_INLINE void add_trunk(Vec3d q, double share, JointWeights& w) {
  const double spine1 = ramp(q.y, 0.985, 1.115), spine2 = ramp(q.y, 1.100, 1.230), spine3 = ramp(q.y, 1.180, 1.300);
  // Neck and skull begin higher behind than in front.
  const double tilted = q.y + 0.45 * q.z;
  const double neck = ramp(tilted, 1.405, 1.485), head = ramp(tilted, 1.505, 1.575);
  w[joint_index(SmplJoint::pelvis)] += share * (1.0 - spine1);
  w[joint_index(SmplJoint::spine1)] += share * spine1 * (1.0 - spine2);
  w[joint_index(SmplJoint::spine2)] += share * spine1 * spine2 * (1.0 - spine3);
  w[joint_index(SmplJoint::spine3)] += share * spine1 * spine2 * spine3 * (1.0 - neck);
  w[joint_index(SmplJoint::neck)] += share * spine3 * neck * (1.0 - head);
  w[joint_index(SmplJoint::head)] += share * spine3 * neck * head;
}

NPT_INLINE JointWeights joint_weights(Vec3d p) {
  const Vec3d q{std::abs(p.x), p.y, p.z};
  const double arm = arm_share(q), legs = legs_share(q);
  JointWeights w{};
  add_trunk(q, 1.0 - arm - legs, w);
  add_arm(q, arm, p.x < 0.0 ? 1 : 0, w);
  // Between the thighs both legs pull.
  const double left = ramp(p.x, -0.045, 0.045);
  add_leg(q, legs * left, 0, w);
  add_leg(q, legs * (1.0 - left), 1, w);
  return w;
}

/// [V, 24], at most `bones` entries a row.
NPT_INLINE SparseMatrix mannequin_weights(std::span<const Vec3d> positions, std::size_t bones = 4) {
  SparseMatrix result;
  result.columns = smpl_joint_count;
  for (const Vec3d p : positions) {
    const JointWeights w = joint_weights(p);
    std::array<double, smpl_joint_count> sorted = w;
    std::sort(sorted.begin(), sorted.end(), std::greater<>());
    const double least = std::max(sorted[bones - 1], 2e-3);
    double sum = 0.0;
    for (const double x : w) sum += x >= least ? x : 0.0;
    for (std::uint32_t j = 0; j < smpl_joint_count; ++j) {
      if (w[j] >= least) result.append(j, static_cast<float>(w[j] / sum));
    }
    result.end_row();
  }
  return result;
}

/// Positive weights with sum 1 whose average of `points` is `target`: of all such weights those nearest to `prior`
/// (least relative entropy), found by Newton's method. Requires the target inside the points' convex hull.
NPT_INLINE std::vector<double> convex_weights(std::span<const Vec3d> points, std::span<const double> prior,
                                              Vec3d target) {
  std::vector<double> w(points.size());
  Vec3d lambda{};
  for (int step = 0; step < 30; ++step) {
    double sum = 0.0;
    Vec3d mean{};
    std::array<double, 6> m{};  // second moments: xx, xy, xz, yy, yz, zz
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3d d = points[i] - target;
      w[i] = prior[i] * std::exp(dot(lambda, d));
      sum += w[i];
      mean += d * w[i];
      const std::array<double, 6> square{d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z};
      for (std::size_t k = 0; k < 6; ++k) m[k] += w[i] * square[k];
    }
    mean = mean / sum;
    for (double& x : w) x /= sum;
    if (length(mean) < 1e-12) break;
    const Vec3d a{m[0] / sum - mean.x * mean.x, m[1] / sum - mean.x * mean.y, m[2] / sum - mean.x * mean.z};
    const Vec3d b{a.y, m[3] / sum - mean.y * mean.y, m[4] / sum - mean.y * mean.z};
    const Vec3d c{a.z, b.z, m[5] / sum - mean.z * mean.z};
    const double det = dot(a, cross(b, c));
    Vec3d move{dot(mean, cross(b, c)) / det, dot(mean, cross(c, a)) / det, dot(mean, cross(a, b)) / det};
    // Far from the solution a full step could overflow the exponentials.
    const double n = length(move), most = 20.0;
    if (n > most) move *= most / n;
    lambda = lambda - move;
  }
  return w;
}

/// Reach of the skin around each joint that its place is averaged from.
NPT_INLINE double joint_reach(SmplJoint joint) {
  switch (joint) {
    case SmplJoint::left_hand:
      return 0.06;
    case SmplJoint::left_wrist:
      return 0.05;
    case SmplJoint::left_elbow:
      return 0.07;
    case SmplJoint::left_foot:
      return 0.08;
    case SmplJoint::left_ankle:
      return 0.075;
    case SmplJoint::left_knee:
      return 0.085;
    case SmplJoint::left_shoulder:
      return 0.10;
    case SmplJoint::left_collar:
    case SmplJoint::left_hip:
      return 0.15;
    case SmplJoint::neck:
    case SmplJoint::head:
      return 0.12;
    default:
      return 0.20;
  }
}

/// [24, V]. `mirror` pairs vertices at x and -x: the right side's rows mirror the left side's.
NPT_INLINE SparseMatrix mannequin_joint_regressor(std::span<const Vec3d> positions,
                                                  std::span<const std::uint32_t> mirror) {
  const std::size_t n = positions.size();
  std::vector<float> dense(smpl_joint_count * n, 0.0F);
  for (const JointPlace& place : joint_places) {
    const double reach = joint_reach(place.joint);
    std::vector<std::uint32_t> ring;
    std::vector<Vec3d> points;
    std::vector<double> prior;
    for (std::uint32_t v = 0; v < n; ++v) {
      const Vec3d d = positions[v] - place.position;
      const double rest = 1.0 - dot(d, d) / (reach * reach);
      if (rest <= 0.0) continue;
      ring.push_back(v);
      points.push_back(positions[v]);
      prior.push_back(rest);
    }
    const std::vector<double> w = convex_weights(as_span(points), as_span(prior), place.position);
    const std::size_t row = joint_index(place.joint);
    for (std::size_t i = 0; i < ring.size(); ++i) {
      dense[row * n + ring[i]] = static_cast<float>(w[i]);
      if (place.position.x != 0.0) dense[(row + 1) * n + mirror[ring[i]]] = static_cast<float>(w[i]);
    }
  }
  return SparseMatrix::from_dense(as_span(dense), smpl_joint_count, n);
}

}  // namespace npt::inline NPT_ABI::anatomy
