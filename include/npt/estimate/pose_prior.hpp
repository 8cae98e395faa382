/// How unlikely a pose is: what keeps a fit from explaining a surface by broken joints.
///   weight * (theta - m)^T K (theta - m) + hinge weight * sum over hinges of exp(angle to the wrong side)
/// By itself each joint has K = stiffness (I + twist a a^T), where a is the bone's direction in the rest pose: turning
/// about the bone itself costs more, since it hardly moves the surface, and a search would take it for a way out.
/// natural() has one K for all joints together: a pelvis and a spine that bend against each other are unlikely, though
/// neither bend is. Hinges are joints that bend to one side only.
/// Shapes    theta: [J] axis angles
/// Source    Bogo et al., "Keep it SMPL", ECCV 2016, section 3.3, for the one-sided joints (eq. 4); the rest is ours
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/skeleton.hpp>
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

  explicit BasicPosePrior(const BodyModel& model) : means_(model.joint_count()), stiffness_(model.joint_count()) {
    const std::vector<Vec3d> joints = model.joints({});
    const bool human = model.joint_count() == smpl_joint_count;
    for (std::size_t j = 1; j < joints.size(); ++j) {
      Vec3d bone;
      for (std::size_t c = j + 1; c < joints.size(); ++c)
        if (model.tables().parents[c] == static_cast<int>(j)) bone += normalised(joints[c] - joints[j]);
      bone = normalised(bone);
      stiffness_[j] = (Matrix3::identity() + outer(bone, bone) * twist) * (human ? human_stiffness(j) : 1.0);
    }
    stiffness_[0] = {};
    if (human)
      hinges_ = {{joint_index(SmplJoint::left_knee), {-1, 0, 0}},
                 {joint_index(SmplJoint::right_knee), {-1, 0, 0}},
                 {joint_index(SmplJoint::left_elbow), {0, 1, 0}},
                 {joint_index(SmplJoint::right_elbow), {0, -1, 0}}};
    for (const Hinge& hinge : hinges_)
      stiffness_[hinge.joint] =
          (Matrix3::identity() - outer(hinge.axis, hinge.axis)) * stiff + outer(hinge.axis, hinge.axis) * loose;
  }

  /// The angles of all joints but the root together as a Gaussian of natural poses (natural_poses.hpp) with a wide
  /// margin, and the one-sided part.
  /// Requires  SMPL's joints
  static BasicPosePrior natural(const BodyModel& model) {
    NPT_ASSERT(model.joint_count() == smpl_joint_count);
    // On 20 pairs of people that no body model of ours made: a mean squared distance of 17.7e-4 m^2 from the truth with
    // each joint by itself (at a strength of 0.3), 15.9 so; a strength of 1 gave 16.8.
    constexpr double margin = 0.15, strength = 3;
    BasicPosePrior prior(model);
    const Moments& natural = natural_moments();
    std::vector<double> covariance = natural.covariance;
    for (std::size_t i = 0; i < coupled; ++i) covariance[i * coupled + i] += margin * margin;
    const DenseCholesky factor(coupled, std::move(covariance));
    prior.coupling_.resize(coupled * coupled);
    for (std::size_t i = 0; i < coupled; ++i) {
      const std::span<double> row = std::span(prior.coupling_).subspan(i * coupled, coupled);
      row[i] = strength;
      factor.solve_lower(row);
      factor.solve_upper(row);
    }
    prior.means_ = natural.mean;
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
    for (std::size_t i = 0; i < coupling_.size() / coupled; ++i)
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
  /// Angles of SMPL's joints but the root, which may look anywhere.
  static constexpr std::size_t coupled = 3 * (smpl_joint_count - 1);

  struct Moments {
    std::vector<Vec3d> mean;         ///< [24]
    std::vector<double> covariance;  ///< [coupled, coupled]
  };

  /// Of natural poses, over draws.
  static const Moments& natural_moments() {
    static const Moments all = [] {
      constexpr int draws = 2000;
      Moments moments{std::vector<Vec3d>(smpl_joint_count), std::vector<double>(coupled * coupled)};
      std::vector<double> mean(coupled);
      Random random(1);
      for (int d = 0; d < draws; ++d) {
        const NaturalPoses::Pose pose = natural_poses().sample(random);
        for (std::size_t i = 0; i < coupled; ++i) {
          const double a = static_cast<double>(pose[3 + i]) / draws;
          mean[i] += a;
          for (std::size_t k = 0; k <= i; ++k)
            moments.covariance[i * coupled + k] += a * static_cast<double>(pose[3 + k]);
        }
      }
      for (std::size_t i = 0; i < coupled; ++i)
        for (std::size_t k = 0; k <= i; ++k) moments.covariance[i * coupled + k] -= mean[i] * mean[k];
      for (std::size_t j = 1; j < smpl_joint_count; ++j)
        moments.mean[j] = {mean[3 * j - 3], mean[3 * j - 2], mean[3 * j - 1]};
      return moments;
    }();
    return all;
  }

  /// What the coupled joints add.
  double coupled_value(std::span<const double> theta, double weight, std::span<double> gradient) const {
    std::array<double, coupled> off{};
    for (std::size_t j = 1; j < smpl_joint_count; ++j) {
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

  static constexpr double twist = 20, stiff = 10, loose = 1;
  static constexpr double most_bend = 2.4;  ///< radians, of knees and elbows

  /// Hips, shoulders, elbows and knees move most; the trunk and the ends of the limbs little.
  static double human_stiffness(std::size_t joint) {
    switch (static_cast<SmplJoint>(joint)) {
      case SmplJoint::left_hip:
      case SmplJoint::right_hip:
      case SmplJoint::left_shoulder:
      case SmplJoint::right_shoulder:
        return loose;
      case SmplJoint::left_collar:
      case SmplJoint::right_collar:
        return 1;
      default:
        return stiff;
    }
  }

  std::vector<Vec3d> means_;
  std::vector<Matrix3> stiffness_;
  std::vector<double> coupling_;  ///< [coupled, coupled] K of all joints but the root together, or empty
  std::vector<Hinge> hinges_;
};

}  // namespace npt::inline NPT_ABI
