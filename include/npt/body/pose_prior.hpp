/// How unlikely a pose is: what keeps a fit from explaining a surface by broken joints.
///   weight * (theta - m)^T K (theta - m) + hinge weight * sum over hinges of exp(angle to the wrong side)
/// By itself each joint has K = stiffness (I + twist a a^T), where a is the bone's direction in the rest pose: turning
/// about the bone itself costs more, since it hardly moves the surface, and a search would take it for a way out.
/// natural() has one K for all joints together: a pelvis and a spine that bend against each other are unlikely, though
/// neither bend is. The root turns freely. Hinges are joints that bend to one side only. Stiffness and hinges are a
/// plan's.
/// Shapes    theta, gradients: [3 J] axis angles; K: [3 (J - 1), 3 (J - 1)], of all joints but the root
/// Source    Bogo et al., "Keep it SMPL", ECCV 2016, section 3.3, for the one-sided joints (eq. 4); the rest is ours
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>
#include <npt/solve/dense_cholesky.hpp>
#include <npt/solve/normal_equations.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {
NPT_INLINE_CLASS(class, PosePrior);
template <class>
class BasicPosePrior {
 public:
  /// A joint that bends to one side: the axis angle's component along `axis` should not be positive.
  struct Hinge {
    std::size_t joint = 0;
    Vec3d axis;
  };

  /// Each joint by itself, all alike.
  explicit BasicPosePrior(const BodyModel& model) : BasicPosePrior(model.joint_count()) {
    const std::vector<Vec3d> joints = model.joints({});
    for (std::size_t j = 1; j < joints.size(); ++j) {
      Vec3d bone;
      for (std::size_t c = j + 1; c < joints.size(); ++c)
        if (model.tables().parents[c] == static_cast<int>(j)) bone += normalised(joints[c] - joints[j]);
      bone = normalised(bone);
      set_stiffness(j, Matrix3::identity() + outer(bone, bone) * twist);
    }
  }

  /// Each joint by itself, as the plan says.
  /// Requires  the plan's joints
  BasicPosePrior(const BodyModel& model, const BodyPlan& plan) : BasicPosePrior(model) {
    NPT_ASSERT(model.joint_count() == plan.joint_count());
    for (std::size_t j = 1; j < plan.joint_count(); ++j) {
      const JointPlan& joint = plan.joints[j];
      const std::size_t row = 3 * j - 3;
      for (std::size_t i = row * coupled_; i < (row + 3) * coupled_; ++i) stiffness_[i] *= joint.stiffness;
      if (joint.hinge == Vec3d{}) continue;
      hinges_.push_back({j, joint.hinge});
      const Matrix3 about = outer(joint.hinge, joint.hinge);
      set_stiffness(j, (Matrix3::identity() - about) * joint.stiffness + about);
    }
  }

  /// The angles of all joints but the root together as a Gaussian of the kind's poses with a wide margin, and the
  /// one-sided part; each joint by itself where the kind knows no moments.
  static BasicPosePrior natural(const BodyKind& kind) {
    // On 20 pairs of people that no body model of ours made: a mean squared distance of 17.7e-4 m^2 from the truth with
    // each joint by itself (at a strength of 0.3), 15.9 so; a strength of 1 gave 16.8.
    constexpr double margin = 0.15, strength = 3;
    BasicPosePrior prior(*kind.body, kind.plan);
    if (kind.moments.mean.empty()) return prior;
    const std::size_t coupled = prior.coupled_;
    std::vector<double> covariance = kind.moments.covariance;
    for (std::size_t i = 0; i < coupled; ++i) covariance[i * coupled + i] += margin * margin;
    const DenseCholesky factor(coupled, std::move(covariance));
    std::ranges::fill(prior.stiffness_, 0.0);
    for (std::size_t i = 0; i < coupled; ++i) {
      const std::span<double> row = std::span(prior.stiffness_).subspan(i * coupled, coupled);
      row[i] = strength;
      factor.solve_lower(row);
      factor.solve_upper(row);
    }
    for (std::size_t j = 1; j < kind.moments.mean.size(); ++j) {
      const Vec3d mean = kind.moments.mean[j];
      prior.mean_[3 * j - 3] = mean.x, prior.mean_[3 * j - 2] = mean.y, prior.mean_[3 * j - 1] = mean.z;
    }
    return prior;
  }

  /// K's entry for two of theta's numbers; 0 for the root's.
  double stiffness(std::size_t i, std::size_t k) const {
    return i < 3 || k < 3 ? 0 : stiffness_[(i - 3) * coupled_ + k - 3];
  }

  /// weight * (theta - m)^T K (theta - m) + hinge_weight * (sum exp). The gradient is added to `gradient`, if given.
  double operator()(std::span<const double> theta, double weight, double hinge_weight,
                    std::span<double> gradient = {}) const {
    std::vector<double> off(coupled_);
    for (std::size_t i = 0; i < coupled_; ++i) off[i] = theta[3 + i] - mean_[i];
    double value = 0;
    for (std::size_t i = 0; i < coupled_; ++i) {
      double k = 0;
      for (std::size_t c = 0; c < coupled_; ++c) k += stiffness_[i * coupled_ + c] * off[c];
      value += weight * k * off[i];
      if (!gradient.empty()) gradient[3 + i] += 2 * weight * k;
    }
    for (const Hinge& hinge : hinges_) {
      const auto [backwards, over] = bend(hinge, theta);
      value += hinge_weight * (backwards + folded * over * over);
      if (gradient.empty()) continue;
      const Vec3d g = hinge.axis * (hinge_weight * (backwards - 2 * folded * over));
      gradient[3 * hinge.joint] += g.x, gradient[3 * hinge.joint + 1] += g.y, gradient[3 * hinge.joint + 2] += g.z;
    }
    return value;
  }

  /// Half of the second derivatives at theta, which are positive, are added to `equations` from unknown `first` on.
  void add_curvature(std::span<const double> theta, double weight, double hinge_weight, std::size_t first,
                     NormalEquations& equations) const {
    for (std::size_t i = 3; i < 3 + coupled_; ++i)
      for (std::size_t c = 3; c <= i; ++c) equations.add_to_matrix(first + i, first + c, weight * stiffness(i, c));
    for (const Hinge& hinge : hinges_) {
      const auto [backwards, over] = bend(hinge, theta);
      const double curvature = hinge_weight * (0.5 * backwards + (over > 0 ? folded : 0));
      const std::array<double, 3> axis{hinge.axis.x, hinge.axis.y, hinge.axis.z};
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t c = 0; c <= i; ++c)
          equations.add_to_matrix(first + 3 * hinge.joint + i, first + 3 * hinge.joint + c,
                                  curvature * axis[i] * axis[c]);
    }
  }

  /// Adds its slope and curvature at theta, of one weight, to the equations of a step, from unknown `first` on.
  void linearise(std::span<const double> theta, double weight, std::size_t first, NormalEquations& equations) const {
    std::vector<double> gradient(theta.size());
    (*this)(theta, weight, weight, as_span(gradient));
    for (std::size_t i = 0; i < gradient.size(); ++i) equations.add_to_right(first + i, 0.5 * gradient[i]);
    add_curvature(theta, weight, weight, first, equations);
  }

 private:
  static constexpr double twist = 20;
  static constexpr double most_bend = 2.4;  ///< radians, of hinges
  static constexpr double folded = 20;      ///< costs a square radian beyond that

  explicit BasicPosePrior(std::size_t joints)
      : coupled_(3 * joints - 3), mean_(coupled_), stiffness_(coupled_ * coupled_) {}

  void set_stiffness(std::size_t joint, const Matrix3& k) {
    for (std::size_t i = 0; i < 3; ++i) {
      double* row = &stiffness_[(3 * joint - 3 + i) * coupled_ + 3 * joint - 3];
      row[0] = k.rows[i].x, row[1] = k.rows[i].y, row[2] = k.rows[i].z;
    }
  }

  /// exp of a hinge's angle to the wrong side, and how far it is bent too far.
  static std::pair<double, double> bend(const Hinge& hinge, std::span<const double> theta) {
    const double* a = &theta[3 * hinge.joint];
    const double wrong = dot(hinge.axis, Vec3d{a[0], a[1], a[2]});
    // Beyond 5 rad the penalty would overflow on a wild step of the search.
    return {std::exp(std::min(wrong, 5.0)), std::max(0.0, -wrong - most_bend)};
  }

  std::size_t coupled_;            ///< 3 (J - 1)
  std::vector<double> mean_;       ///< [coupled]
  std::vector<double> stiffness_;  ///< K
  std::vector<Hinge> hinges_;
};

}  // namespace npt::inline NPT_ABI
