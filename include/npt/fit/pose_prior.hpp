/// How unlikely a pose is: what keeps a fit from explaining a surface by broken joints.
///   weight * sum over joints of (theta - m)^T K (theta - m) + hinge weight * sum over hinges of exp(angle to the wrong
///   side)
/// K = stiffness (I + twist a a^T), where a is the bone's direction in the rest pose: a rotation about the bone itself
/// costs more, since it hardly moves the surface, and a search would take it for a way out. Hinges are joints that bend
/// to one side only.
/// Shapes    theta: [J] axis angles
/// Source    Bogo et al., "Keep it SMPL", ECCV 2016, section 3.3, for the one-sided joints (eq. 4); the rest is ours
#pragma once

#include <npt/body/body_model.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/core/matrix3.hpp>
#include <npt/core/random.hpp>
#include <npt/core/vec3.hpp>
#include <npt/linear/normal_equations.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

class PosePrior {
 public:
  /// A joint that bends to one side: the axis angle's component along `axis` should not be positive.
  struct Hinge {
    std::size_t joint = 0;
    Vec3d axis;
  };

  explicit PosePrior(const BodyModel& model) : means_(model.joint_count()), stiffness_(model.joint_count()) {
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

  /// Each joint's angles as a Gaussian of natural poses (natural_poses.hpp) with a wide margin, and the one-sided part.
  /// Requires  SMPL's joints
  static PosePrior natural(const BodyModel& model) {
    NPT_ASSERT(model.joint_count() == smpl_joint_count);
    // Bodies of one model in poses of another: a squared distance of 6.4e-4 m^2 after a transfer without this prior,
    // 5.7 with it; a margin of 0.05 rad or a strength of 0.1 gave 5.8 and 6.0.
    constexpr double margin = 0.15, strength = 0.3;
    PosePrior prior(model);
    const std::vector<std::array<Vec3d, 4>>& moments = natural_moments();
    for (std::size_t j = 1; j < smpl_joint_count; ++j) {
      const Vec3d mean = moments[j][3];
      const Matrix3 covariance = Matrix3{{moments[j][0], moments[j][1], moments[j][2]}} - outer(mean, mean) +
                                 Matrix3::identity() * (margin * margin);
      const auto& [x, y, z] = covariance.rows;
      prior.stiffness_[j] =
          Matrix3::from_columns(cross(y, z), cross(z, x), cross(x, y)) * (strength / covariance.determinant());
      prior.means_[j] = mean;
    }
    return prior;
  }

  /// K of a joint.
  const Matrix3& stiffness(std::size_t joint) const { return stiffness_[joint]; }

  /// weight * (sum (theta - m)^T K (theta - m)) + hinge_weight * (sum exp). The gradient is added to `gradient`. Both
  /// spans: [3 J].
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
    for (const Hinge& hinge : hinges_) {
      const double wrong =
          dot(hinge.axis, Vec3d{theta[3 * hinge.joint], theta[3 * hinge.joint + 1], theta[3 * hinge.joint + 2]});
      const double backwards = 0.5 * hinge_weight * std::exp(std::min(wrong, 5.0));
      const double folded = -wrong > most_bend ? hinge_weight * 20 : 0;
      add(hinge.joint, outer(hinge.axis, hinge.axis) * (backwards + folded));
    }
  }

 private:
  /// [24] Of each joint's angles the mean products, row by row, and the mean, over draws.
  static const std::vector<std::array<Vec3d, 4>>& natural_moments() {
    static const std::vector<std::array<Vec3d, 4>> all = [] {
      constexpr int draws = 1000;
      std::vector<std::array<Vec3d, 4>> moments(smpl_joint_count);
      Random random(1);
      for (int i = 0; i < draws; ++i) {
        const NaturalPoses::Pose pose = natural_poses().sample(random);
        for (std::size_t j = 0; j < smpl_joint_count; ++j) {
          const Vec3d a = Vec3f{pose[3 * j], pose[3 * j + 1], pose[3 * j + 2]}.as<double>() / draws;
          moments[j][0] += a * static_cast<double>(pose[3 * j]);
          moments[j][1] += a * static_cast<double>(pose[3 * j + 1]);
          moments[j][2] += a * static_cast<double>(pose[3 * j + 2]);
          moments[j][3] += a;
        }
      }
      return moments;
    }();
    return all;
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
  std::vector<Hinge> hinges_;
};

}  // namespace npt::inline NPT_ABI
