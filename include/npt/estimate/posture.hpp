/// How a body of a kind stands at rest: a llama carries its neck upright, a fox its tail low, a cat's hocks are bent. A
/// pose is what a body does beyond that, so one goes from the pose mesh's rest to the identity's:
///   R_result = R_identity_rest R_pose_rest^T R_pose
/// Nobody says how the animal in a mesh stands at rest, so it is inferred, as the mean of a posterior. The mesh is one
/// of the rigs that were learned from, or another animal:
///   shape    betas ~ N(a rig's, W), or N(0, 1 + W) of another animal; W: what one rig's differ by from pose to pose
///   rest     within 0.03 rad of the rig's (0.1 where it stands), or N(the rigs' mean, C_rest) of another animal; both
///            sides alike
///   pose     beyond the rest, ~ N(0, s^2 C_motion), s one of four: from standing still to lying down
/// A mesh that stands still shows its rest. One that gives the pose is expected to move: a deer that stands with its
/// head low lowers it. The root's turn is no evidence, so that nothing depends on where the animal looks or lies.
/// Tensors   posture/shapes [R, S], shape_variances [S], angles [R, 3 J], other_odds [1]; rest_covariance,
///           motion_covariance [3 J, 3 J]
/// Learned   by examples/fit_posture, from rigs as they are bound and in their clips
/// Measured  on 15 rigs: a rest is off by 0.20 rad a joint where the animal is left out of them, else by 0.03
/// Errors    npt::Error that names the file, for a tensor of another shape and covariances that are none
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/solve/dense_cholesky.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// What is learned.
struct PostureModel {
  std::vector<double> shapes{};             ///< [R, S] of the rigs
  std::vector<double> shape_variances{};    ///< [S] W
  std::vector<double> angles{};             ///< [R, 3 J] of the rigs at rest
  std::vector<double> rest_covariance{};    ///< [3 J, 3 J] of animals that are none of the rigs
  std::vector<double> motion_covariance{};  ///< [3 J, 3 J] of clips, beyond the rest
  double other_odds = 0;                    ///< logarithm: of an animal that is none of the rigs against each of them

  std::size_t rig_count() const { return shapes.size() / shape_variances.size(); }
};

NPT_INLINE PostureModel read_posture_model(const SafetensorsFile& file, const BodyKind& kind) {
  const auto tensor = [&file](const char* name, const TensorShape& wanted) -> std::vector<double> {
    const FileTensor& found = file.at(name);
    if (found.shape != wanted)
      throw Error({.file = file.name(),
                   .place = "tensor '" + std::string(name) + "'",
                   .found = "shape " + to_string(found.shape),
                   .expected = to_string(wanted)});
    const std::vector<float> values = to_float(found);
    return {values.begin(), values.end()};
  };
  const TensorShape& shapes = file.at("shapes").shape;
  const std::uint64_t rigs = shapes.empty() ? 0 : shapes[0], n = 3 * kind.joint_count(), s = kind.body->shape_count();
  return {tensor("shapes", {rigs, s}),       tensor("shape_variances", {s}),      tensor("angles", {rigs, n}),
          tensor("rest_covariance", {n, n}), tensor("motion_covariance", {n, n}), tensor("other_odds", {1})[0]};
}

NPT_INLINE_CLASS(class, Posture);
template <class>
class BasicPosture {
 public:
  /// Requires  covariances that are some: of eigenvalues above zero
  BasicPosture(PostureModel model, const BodyKind& kind) : kind_(kind), model_(std::move(model)) {
    const std::size_t n = angle_count();
    std::vector<double> known(n * n), other = model_.rest_covariance;
    for (std::size_t i = 0; i < n; ++i) other[i * n + i] += known_variance(moving);
    for (std::size_t s = 0; s < scales.size(); ++s) {
      for (std::size_t i = 0; i < n; ++i) known[i * n + i] = known_variance(s);
      known_.push_back(evidence(known, scales[s]));
      other_.push_back(evidence(other, scales[s]));
    }
  }

  /// [J] Axis angles at rest of the body in a mesh. moves: whether it is expected to, as clips do in the mean or more
  std::vector<Vec3d> rest(const BodyEstimate& mesh, bool moves) const {
    std::vector<Guess> guesses;
    for (std::size_t r = 0; r <= model_.rig_count(); ++r) add_guesses(mesh, r, moves ? moving : 0, guesses);
    const double best = std::ranges::max_element(guesses, {}, &Guess::log_odds)->log_odds;
    std::vector<Vec3d> mean(kind_.joint_count());
    double sum = 0;
    for (const Guess& guess : guesses) {
      const double odds = std::exp(guess.log_odds - best);
      for (std::size_t j = 0; j < mean.size(); ++j) mean[j] += guess.angles[j] * odds;
      sum += odds;
    }
    for (Vec3d& angle : mean) angle = angle / sum;
    return mean;
  }

  /// [J, 3] The pose's angles for the identity.
  std::vector<float> angles(const BodyEstimate& identity, const BodyEstimate& pose) const {
    const std::vector<Vec3d> from = rest(pose, true), to = rest(identity, false);
    std::vector<float> result = pose.fit.body.axis_angles;
    for (std::size_t j = 0; j < from.size(); ++j) {
      const Matrix3 back = rotation_matrix(from[j]).transposed(), own = rotation_matrix(to[j]);
      // The root's bend stands before its direction, the others' behind the parent's.
      set_joint_rotation(as_span(result), j,
                         j == 0 ? pose.joint_rotation(0) * back * own : own * (back * pose.joint_rotation(j)));
    }
    return result;
  }

 private:
  /// Of the mean motion in clips. Eight in place of four change little: 0.114 in place of 0.117 rad on seven animals.
  static constexpr std::array scales{0.1, 0.3, 1.0, 3.0};
  /// The first scale of a mesh that moves: 8.0 in place of 11.5 (PMD x 1e-4) of known species in unseen clips.
  static constexpr std::size_t moving = 2;
  /// Of a rig's rest in another mesh of it; where that moves, of any estimated angle. Wider where it stands: what it
  /// shows is its rest, with errors of the estimate.
  static constexpr double known_variance(std::size_t scale) {
    const double deviation = scale < moving ? 0.1 : 0.03;
    return deviation * deviation;
  }

  struct Guess {
    double log_odds = 0;
    std::vector<Vec3d> angles;  ///< [J] at rest
  };
  /// What a mesh's angles but the root's say of the rest, for one scale of motion. Without the errors of angles the
  /// scale turns with the draw of samples: deer are 38, 47, 63 and 60 mm off with four instead of 38, 44, 66 and 45.
  struct Evidence {
    DenseCholesky spread;  ///< of rest and motion together
    double log_determinant = 0;
  };

  std::size_t angle_count() const { return 3 * kind_.joint_count(); }

  Evidence evidence(std::span<const double> rest, double scale) const {
    const std::size_t n = angle_count(), own = n - 3;
    std::vector<double> sum(own * own);
    for (std::size_t i = 0; i < own; ++i)
      for (std::size_t k = 0; k < own; ++k) {
        const std::size_t at = (i + 3) * n + k + 3;
        sum[i * own + k] = rest[at] + scale * scale * model_.motion_covariance[at];
      }
    DenseCholesky spread(own, std::move(sum));
    const double log_determinant = spread.log_determinant();
    return {std::move(spread), log_determinant};
  }

  /// The rig's angles at rest; behind the last rig: their mean.
  std::vector<Vec3d> told(std::size_t rig) const {
    const std::size_t n = angle_count(), rigs = model_.rig_count();
    std::vector<Vec3d> told(kind_.joint_count());
    for (std::size_t r = 0; r < rigs; ++r)
      for (std::size_t j = 0; j < told.size() && (r == rig || rig == rigs); ++j) {
        const double* a = &model_.angles[r * n + 3 * j];
        told[j] += Vec3d{a[0], a[1], a[2]} / (rig == rigs ? static_cast<double>(rigs) : 1.0);
      }
    return told;
  }

  /// Logarithm of the density of a mesh's shape.
  double shape_odds(std::span<const float> betas, std::size_t rig) const {
    const std::size_t count = model_.shape_variances.size();
    const bool known = rig < model_.rig_count();
    double sum = known ? 0 : model_.other_odds;
    for (std::size_t b = 0; b < std::min(count, betas.size()); ++b) {
      const double variance = model_.shape_variances[b] + (known ? 0 : 1);
      const double off = static_cast<double>(betas[b]) - (known ? model_.shapes[rig * count + b] : 0);
      sum -= 0.5 * (off * off / variance + std::log(variance));
    }
    return sum;
  }

  void add_guesses(const BodyEstimate& mesh, std::size_t rig, std::size_t first, std::vector<Guess>& guesses) const {
    const std::vector<Vec3d> told = this->told(rig);
    const bool known = rig < model_.rig_count();
    const double odds = shape_odds(as_span(mesh.fit.body.betas), rig);
    std::vector<double> off;
    for (std::size_t j = 1; j < told.size(); ++j) {
      const Vec3d a = axis_angle(rotation_matrix(told[j]).transposed() * mesh.joint_rotation(j));
      off.insert(off.end(), {a.x, a.y, a.z});
    }
    for (std::size_t s = first; s < scales.size(); ++s) {
      const Evidence& evidence = (known ? known_ : other_)[s];
      std::vector<double> x = off;
      evidence.spread.solve_lower(x);
      double sum = evidence.log_determinant;
      for (const double value : x) sum += value * value;
      evidence.spread.solve_upper(x);
      guesses.push_back({odds - 0.5 * sum, moved(told, as_span(x), known ? known_variance(s) : 0)});
    }
  }

  /// The told angles, and what evidence adds to them; of both sides. known: a rig's variance, 0 of another animal
  std::vector<Vec3d> moved(const std::vector<Vec3d>& told, std::span<const double> evidence, double known) const {
    const std::size_t n = angle_count();
    std::vector<Vec3d> added(told.size());
    for (std::size_t j = 0; j < told.size(); ++j) {
      std::array<double, 3> sum{};
      for (std::size_t i = 0; i < 3; ++i)
        if (known > 0)
          sum[i] = j == 0 ? 0 : known * evidence[3 * (j - 1) + i];
        else
          for (std::size_t k = 0; k < evidence.size(); ++k)
            sum[i] += model_.rest_covariance[(3 * j + i) * n + k + 3] * evidence[k];
      added[j] = {sum[0], sum[1], sum[2]};
    }
    std::vector<Vec3d> result(told.size());
    for (std::size_t j = 0; j < told.size(); ++j) {
      const Vec3d even = (added[j] + mirrored(added[kind_.plan.joints[j].mirrored])) * 0.5;
      result[j] = axis_angle(rotation_matrix(told[j]) * rotation_matrix(even));
    }
    return result;
  }

  const BodyKind& kind_;
  PostureModel model_;
  std::vector<Evidence> known_, other_;  ///< for each scale
};

}  // namespace npt::inline NPT_ABI
