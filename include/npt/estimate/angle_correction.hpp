/// What is known of a fit's angles beside the fit, taken out of a transfer: two corrections, zero for the mannequin.
/// 1. Fit bias. Skin that bends in another way than the body's turns the fit's joints along, and the posture of a build
/// (a heavy person's lean) is taken for a pose. Both are nearly the same for all people, and grow with pose and build:
///   R_true = R_fit exp(B x)      x = (theta, beta): the fitted angles of all joints but the root, and the fitted shape
/// B was learned by least squares from bodies whose joints are known (examples/fit_bias). Of both meshes, so that
/// between equal poses of one build nothing changes:
///   R = R_pose exp(B x_pose) exp(B x_identity)^-1
/// What is the same in all poses, c, tells how the body fits people at rest: R_true = R_fit exp(B x + c) of R_person.
/// 2. Own rest. A body that is fitted to a stylised figure in a T pose bends where its proportions don't follow: a head
/// that is set back tilts it. That is no posture but the character's build, so the pose's angles begin there:
///   R = R_pose exp(w log(R_person^-1 R_identity))
/// w is 1 for characters that keep a distance from the body and stand in a T pose, and 0 for people. The mannequin's
/// own meshes keep 0.001, other models' bodies and dressed people 0.006 to 0.008, a stylised man 0.011. What both
/// bring: docs/notes/tuned-numbers.md.
/// Shapes    B and c: [J, 3, 3 (J - 1) + S + 1], radians by radians and by units of shape: people's [24, 3, 95 + 1];
///           rotations by joint, in space; axis angles: [J, 3], or more with finger joints, which stay; radians
/// Threads   all members are const and may be called by any number of threads at a time
/// Errors    npt::Error for a file without B, for another shape, and for numbers that aren't finite
/// Source    ours
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_values.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, AngleCorrection);
template <class>
class BasicAngleCorrection {
 public:
  using Rotations = std::vector<Matrix3>;

  static constexpr const char* tensor = "joints";
  /// How many numbers x has.
  static std::size_t input_count(const BodyKind& kind) {
    return 3 * (kind.joint_count() - 1) + kind.body->shape_count();
  }
  static TensorShape shape(const BodyKind& kind) { return {kind.joint_count(), 3, input_count(kind) + 1}; }

  /// From a file's tensors; without any there is no bias, and people at rest are fitted as the template stands.
  BasicAngleCorrection(const SafetensorsFile& file, const BodyKind& kind)
      : BasicAngleCorrection(file.tensors().empty() ? std::vector<float>{} : read(file, kind), kind) {}
  /// b: B and c, or empty. The kind must outlive it.
  BasicAngleCorrection(std::vector<float> b, const BodyKind& kind)
      : kind_(kind), b_(std::move(b)), parents_(kind.plan.parents()), columns_(input_count(kind)) {
    NPT_ASSERT(b_.empty() || b_.size() == 3 * parents_.size() * (columns_ + 1));
    rest_ = people_at_rest();
  }

  /// How far the build is another one than the mannequin's, and how far it is nobody's, from 0 to 1.
  static double unlike_mannequin(const BodyEstimate& estimate) {
    return rising(estimate.fit.relative_distance, 0.002, 0.005);
  }
  static double unlike_people(const BodyEstimate& estimate) {
    return rising(estimate.fit.relative_distance, 0.0085, 0.0105);
  }

  /// x of a fit: its angles of all joints but the root, and its shape.
  static std::vector<double> inputs(const BodyFit& fit) {
    std::vector<double> x(fit.axis_angles.begin() + 3, fit.axis_angles.end());
    x.insert(x.end(), fit.betas.begin(), fit.betas.end());
    return x;
  }

  /// [J] exp(share B x) of a mesh's fit, in the joints' own frames.
  Rotations bias(const BodyEstimate& estimate, double share = 1) const {
    return rotations(inputs(estimate.fit.body), share, 0);
  }

  /// [J] Axis angles of the body as it fits people at rest: those that B and c take to none.
  std::span<const Vec3d> rest() const noexcept { return as_span(rest_); }

  /// [J, 3] The joint angles for the identity in the pose, without the bias. That counts where both meshes are
  /// people's, and not the mannequin's: a stylised man would have 24e-4 with it instead of 19e-4.
  std::vector<float> without_bias(const BodyEstimate& identity, const BodyEstimate& pose) const {
    const auto of_people = [](const BodyEstimate& e) { return unlike_mannequin(e) * (1 - unlike_people(e)); };
    std::vector<float> result = pose.fit.body.axis_angles;
    const double share = std::min(of_people(identity), of_people(pose));
    if (b_.empty() || !(share > 0)) return result;
    const Rotations of_identity = bias(identity, share), of_pose = bias(pose, share);
    Rotations fitted(parents_.size()), turned(parents_.size());
    for (std::size_t j = 0; j < parents_.size(); ++j) {
      const int parent = parents_[j];
      const Matrix3 own = pose.joint_rotation(j);
      fitted[j] = parent < 0 ? own : fitted[static_cast<std::size_t>(parent)] * own;
      turned[j] = fitted[j] * of_pose[j] * of_identity[j].transposed();
      set_joint_rotation(as_span(result), j,
                         parent < 0 ? turned[j] : turned[static_cast<std::size_t>(parent)].transposed() * turned[j]);
    }
    return result;
  }

  /// How far a mesh stands as a character of its own at rest, from 0 to 1: w above.
  double own_rest(const BodyEstimate& estimate) const {
    const double strange = unlike_people(estimate);
    if (!kind_.has_own_rest || estimate.fit.body.axis_angles.empty() || !(strange > 0)) return 0;
    // A stylised man in a T pose is bent by up to 14 degrees, people who stand with their arms down by 60.
    double largest = 0;
    const std::vector<Vec3d> bend = bend_beyond_rest(estimate);
    for (std::size_t j = 0; j < bend.size(); ++j)
      if (!kind_.hands || (j != kind_.hands->joints[0].hand && j != kind_.hands->joints[1].hand))
        largest = std::max(largest, length(bend[j]));
    return strange * (1 - rising(largest, most, 2 * most));
  }

  /// A pose's angles for an identity: the same, or from its own rest.
  std::vector<float> from_own_rest(const BodyEstimate& identity, std::vector<float> angles) const {
    const double weight = own_rest(identity);
    if (!(weight > 0)) return angles;
    const std::vector<Vec3d> bend = bend_beyond_rest(identity);
    for (std::size_t j = 0; j < bend.size(); ++j)
      set_joint_rotation(as_span(angles), j, joint_rotation(as_span(angles), j) * rotation_matrix(bend[j] * weight));
    return angles;
  }

 private:
  /// Radians: poses that the learning never saw take no joint farther.
  static constexpr double most = 0.35;

  /// 0 up to `from`, 1 from `to` on, linear between.
  static constexpr double rising(double x, double from, double to) {
    return std::clamp((x - from) / (to - from), 0.0, 1.0);
  }

  std::vector<Vec3d> people_at_rest() const {
    constexpr int rounds = 4;  // each takes a tenth of what is left
    std::vector<Vec3d> rest(parents_.size());
    std::vector<double> x(columns_);
    for (int round = 0; !b_.empty() && round < rounds; ++round) {
      const Rotations off = rotations(x, 1, 1);
      for (std::size_t j = 0; j < rest.size(); ++j) {
        const int parent = parents_[j];
        const Matrix3 fitted = off[j].transposed();
        rest[j] = axis_angle(parent < 0 ? fitted : off[static_cast<std::size_t>(parent)] * fitted);
        if (j == 0) continue;
        x[3 * j - 3] = rest[j].x, x[3 * j - 2] = rest[j].y, x[3 * j - 1] = rest[j].z;
      }
    }
    return rest;
  }

  /// [J] How the joints are bent beyond people's at rest, as axis angles; the root without its direction.
  std::vector<Vec3d> bend_beyond_rest(const BodyEstimate& estimate) const {
    std::vector<Vec3d> bend = estimate.angles_without_direction();
    for (std::size_t j = 0; j < bend.size(); ++j)
      bend[j] = axis_angle(rotation_matrix(rest_[j]).transposed() * rotation_matrix(bend[j]));
    return bend;
  }

  /// [J] exp(share B x + constant c)
  Rotations rotations(const std::vector<double>& x, double share, double constant) const {
    NPT_ASSERT(x.size() == columns_);
    Rotations result(parents_.size());
    for (std::size_t j = 0; j < result.size(); ++j) {
      std::array<double, 3> turn{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::span<const float> row = std::span(b_).subspan((3 * j + k) * (columns_ + 1), columns_ + 1);
        for (std::size_t i = 0; i < columns_; ++i) turn[k] += share * static_cast<double>(row[i]) * x[i];
        turn[k] += constant * static_cast<double>(row[columns_]);
      }
      const Vec3d v{turn[0], turn[1], turn[2]};
      result[j] = rotation_matrix(v * (most / std::max(most, length(v))));
    }
    return result;
  }

  static std::vector<float> read(const SafetensorsFile& file, const BodyKind& kind) {
    const FileTensor& found = file.at(tensor);
    if (found.shape != shape(kind)) invalid_tensor(file.name(), tensor, to_string(found.shape), to_string(shape(kind)));
    return to_float(found);
  }

  const BodyKind& kind_;
  std::vector<float> b_;  ///< [J, 3, columns + 1] or none
  std::vector<int> parents_;
  std::size_t columns_;
  std::vector<Vec3d> rest_;  ///< [J]
};

}  // namespace npt::inline NPT_ABI
