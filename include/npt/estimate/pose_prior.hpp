/// How unlikely a pose is: what keeps a fit from explaining a surface by broken joints.
///   weight * (theta - m)^T K (theta - m) + hinge weight * sum over hinges of exp(angle to the wrong side)
/// By itself each joint has K = stiffness (I + twist a a^T), where a is the bone's direction in the rest pose: turning
/// about the bone itself costs more, since it hardly moves the surface, and a search would take it for a way out.
/// natural() has one K for all joints together: a pelvis and a spine that bend against each other are unlikely, though
/// neither bend is. Hinges are joints that bend to one side only. Stiffness and hinges are a plan's.
/// Shapes    theta: [J] axis angles
/// Source    Bogo et al., "Keep it SMPL", ECCV 2016, section 3.3, for the one-sided joints (eq. 4); the rest is ours
#pragma once

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
  explicit BasicPosePrior(const BodyModel& model) : means_(model.joint_count()), stiffness_(model.joint_count()) {
    const std::vector<Vec3d> joints = model.joints({});
    for (std::size_t j = 1; j < joints.size(); ++j) {
      Vec3d bone;
      for (std::size_t c = j + 1; c < joints.size(); ++c)
        if (model.tables().parents[c] == static_cast<int>(j)) bone += normalised(joints[c] - joints[j]);
      bone = normalised(bone);
      stiffness_[j] = Matrix3::identity() + outer(bone, bone) * twist;
    }
  }

  /// Each joint by itself, as the plan says.
  /// Requires  the plan's joints
  BasicPosePrior(const BodyModel& model, const BodyPlan& plan) : BasicPosePrior(model) {
    NPT_ASSERT(model.joint_count() == plan.joint_count());
    for (std::size_t j = 1; j < stiffness_.size(); ++j) {
      const JointPlan& joint = plan.joints[j];
      stiffness_[j] = stiffness_[j] * joint.stiffness;
      if (joint.hinge == Vec3d{}) continue;
      hinges_.push_back({j, joint.hinge});
      const Matrix3 about = outer(joint.hinge, joint.hinge);
      stiffness_[j] = (Matrix3::identity() - about) * joint.stiffness + about;
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
    const std::size_t coupled = 3 * (kind.joint_count() - 1);
    std::vector<double> covariance = kind.moments.covariance;
    for (std::size_t i = 0; i < coupled; ++i) covariance[i * coupled + i] += margin * margin;
    const DenseCholesky factor(coupled, std::move(covariance));
    prior.coupling_.resize(coupled * coupled);
    for (std::size_t i = 0; i < coupled; ++i) {
      const std::span<double> row = std::span(prior.coupling_).subspan(i * coupled, coupled);
      row[i] = strength;
      factor.solve_lower(row);
      factor.solve_upper(row);
    }
    prior.means_ = kind.moments.mean;
    prior.stiffness_.assign(prior.stiffness_.size(), Matrix3{});
    return prior;
  }

  /// K of a joint by itself; zero for natural().
  const Matrix3& stiffness(std::size_t joint) const { return stiffness_[joint]; }

  /// weight * (theta - m)^T K (theta - m) + hinge_weight * (sum exp). The gradient is added to `gradient`. Both spans:
  /// [3 J].
  double operator()(std::span<const double> theta, double weight, double hinge_weight,
                    std::span<double> gradient) const {
    double value = 0;
    const auto add = [&](std::size_t joint, Vec3d g) {
      gradient[3 * joint] += g.x, gradient[3 * joint + 1] += g.y, gradient[3 * joint + 2] += g.z;
    };
    const auto angle = [&](std::size_t joint) {
      return Vec3d{theta[3 * joint], theta[3 * joint + 1], theta[3 * joint + 2]};
    };
    for (std::size_t j = 0; j < stiffness_.size(); ++j) {
      const Vec3d t = angle(j) - means_[j], k = stiffness_[j] * t;
      value += weight * dot(t, k);
      add(j, k * (2 * weight));
    }
    if (!coupling_.empty()) value += coupled_value(theta, weight, gradient);
    for (const Hinge& hinge : hinges_) {
      const double wrong = dot(hinge.axis, angle(hinge.joint));
      // Beyond 5 rad the penalty would overflow on a wild step of the search.
      const double backwards = hinge_weight * std::exp(std::min(wrong, 5.0));
      const double over = std::max(0.0, -wrong - most_bend), folded = hinge_weight * 20 * over;
      value += backwards + folded * over;
      add(hinge.joint, hinge.axis * (backwards - 2 * folded));
    }
    return value;
  }

  /// Half of the second derivatives at theta, which are positive, are added to `equations` from unknown `first` on.
  void add_curvature(std::span<const double> theta, double weight, double hinge_weight, std::size_t first,
                     NormalEquations& equations) const {
    const auto add = [&](std::size_t joint, const Matrix3& k) {
      const std::size_t at = first + 3 * joint;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::array<double, 3> row{k.rows[i].x, k.rows[i].y, k.rows[i].z};
        for (std::size_t c = 0; c <= i; ++c) equations.add_to_matrix(at + i, at + c, row[c]);
      }
    };
    for (std::size_t j = 0; j < stiffness_.size(); ++j) add(j, stiffness_[j] * weight);
    const std::size_t coupled = coupling_.empty() ? 0 : 3 * (means_.size() - 1);
    for (std::size_t i = 0; i < coupled; ++i)
      for (std::size_t c = 0; c <= i; ++c)
        equations.add_to_matrix(first + 3 + i, first + 3 + c, weight * coupling_[i * coupled + c]);
    for (const Hinge& hinge : hinges_) {
      const double wrong =
          dot(hinge.axis, Vec3d{theta[3 * hinge.joint], theta[3 * hinge.joint + 1], theta[3 * hinge.joint + 2]});
      const double backwards = 0.5 * hinge_weight * std::exp(std::min(wrong, 5.0));
      const double folded = -wrong > most_bend ? hinge_weight * 20 : 0;
      add(hinge.joint, outer(hinge.axis, hinge.axis) * (backwards + folded));
    }
  }

 private:
  /// What the coupled joints add.
  double coupled_value(std::span<const double> theta, double weight, std::span<double> gradient) const {
    const std::size_t coupled = 3 * (means_.size() - 1);
    std::vector<double> off(coupled);
    for (std::size_t j = 1; j < means_.size(); ++j) {
      off[3 * j - 3] = theta[3 * j] - means_[j].x;
      off[3 * j - 2] = theta[3 * j + 1] - means_[j].y;
      off[3 * j - 1] = theta[3 * j + 2] - means_[j].z;
    }
    double value = 0;
    for (std::size_t i = 0; i < coupled; ++i) {
      double k = 0;
      for (std::size_t c = 0; c < coupled; ++c) k += coupling_[i * coupled + c] * off[c];
      value += weight * k * off[i];
      gradient[3 + i] += 2 * weight * k;
    }
    return value;
  }

  static constexpr double twist = 20;
  static constexpr double most_bend = 2.4;  ///< radians, of hinges

  std::vector<Vec3d> means_;
  std::vector<Matrix3> stiffness_;
  std::vector<double> coupling_;  ///< [coupled, coupled] K of all joints but the root together, or empty
  std::vector<Hinge> hinges_;
};

}  // namespace npt::inline NPT_ABI
