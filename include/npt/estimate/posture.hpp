/// How bodies of a kind stand at rest, by their shape: a llama carries its neck upright, a fox its tail low, a cat's
/// hocks are bent. A pose is what a body does beyond that, so one goes from the pose mesh's rest to the identity's:
///   R_result = R_identity_rest R_pose_rest^T R_pose
/// The pose mesh's rest is inferred from its shape: a linear function of the betas. So is the identity's, but where it
/// stands at rest itself: then its own angles are taken.
/// Tensors   posture/joints [3 J, S + 1]: axis angles by betas, and constants
/// Learned   by examples/fit_posture, from rigs as they are bound
/// Measured  on animals in each other's clips, PMD beside the makers' own clip: see docs/results.md
/// Errors    npt::Error that names the file, for a tensor of another shape
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
#include <npt/estimate/build.hpp>
#include <npt/io/safetensors.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, Posture);
template <class>
class BasicPosture {
 public:
  BasicPosture(const SafetensorsFile& file, const BodyKind& kind) : kind_(kind) {
    const FileTensor& tensor = file.at("joints");
    const std::vector<std::uint64_t> wanted{3 * kind.joint_count(), kind.body->shape_count() + 1};
    if (!std::ranges::equal(tensor.shape, wanted))
      throw Error({.file = file.name(),
                   .place = "tensor 'joints'",
                   .found = "shape " + to_string(tensor.shape),
                   .expected = "[" + std::to_string(wanted[0]) + ", " + std::to_string(wanted[1]) + "]"});
    weights_ = to_float(tensor);
  }

  /// A beta as it counts: beyond three deviations a shape says no more.
  static double limited(float beta) { return std::clamp(static_cast<double>(beta), -3.0, 3.0); }

  /// [J] Axis angles at rest of a body of this shape.
  std::vector<Vec3d> rest(std::span<const float> betas) const {
    const std::size_t columns = kind_.body->shape_count() + 1;
    std::vector<double> angles(3 * kind_.joint_count());
    for (std::size_t i = 0; i < angles.size(); ++i) {
      const std::span<const float> row = as_span(weights_).subspan(i * columns, columns);
      angles[i] = static_cast<double>(row.back());
      for (std::size_t b = 0; b < betas.size(); ++b) angles[i] += static_cast<double>(row[b]) * limited(betas[b]);
    }
    std::vector<Vec3d> result(kind_.joint_count());
    for (std::size_t j = 0; j < result.size(); ++j) result[j] = {angles[3 * j], angles[3 * j + 1], angles[3 * j + 2]};
    return result;
  }

  /// [J, 3] The pose's angles for the identity.
  std::vector<float> angles(const BodyEstimate& identity, const BodyEstimate& pose) const {
    const std::vector<Vec3d> from = rest_of(pose, true), to = rest_of(identity, false);
    std::vector<float> result = pose.fit.body.axis_angles;
    for (std::size_t j = 0; j < from.size(); ++j) {
      const Matrix3 moved = rotation_matrix(from[j]).transposed() * pose.joint_rotation(j);
      const Matrix3 own = rotation_matrix(to[j]);
      // The root's bend stands before its direction, the others' behind the parent's.
      set_joint_rotation(as_span(result), j,
                         j == 0 ? pose.joint_rotation(0) * rotation_matrix(from[0]).transposed() * own : own * moved);
    }
    return result;
  }

  /// How far the mesh stands at rest, from 0 to 1: both sides alike, and no limb bent much beyond what its shape says.
  double standing(const BodyEstimate& estimate) const {
    const std::vector<Vec3d> own = estimate.angles_without_yaw(), told = rest(as_span(estimate.fit.body.betas));
    double uneven = 0, bent = 0, count = 0;
    for (const LimbPair& pair : kind_.plan.limb_pairs())
      for (std::size_t k = 0; k < pair.joints[0].size(); ++k) {
        const std::size_t left = pair.joints[0][k], right = pair.joints[1][k];
        uneven += length(own[left] - mirrored(own[right]));
        bent += 0.5 * (length(own[left] - told[left]) + length(own[right] - told[right]));
        ++count;
      }
    // Of six animals' rests the means are up to 0.1 and 0.25 radians, of their walks 0.3 and more. What sides differ by
    // counts twice: the mean of both is off by half of it.
    return count > 0 ? (1 - beyond_rest(2 * uneven / count)) * (1 - beyond_rest(bent / count)) : 0;
  }

 private:
  /// [J] The mesh's own rest where it stands so, else what its shape says. An identity that stands is taken to be at
  /// rest as a whole. Of a pose mesh that stands, what is far from what its shape says is its pose: it may graze.
  std::vector<Vec3d> rest_of(const BodyEstimate& mesh, bool is_pose) const {
    std::vector<Vec3d> result = rest(as_span(mesh.fit.body.betas));
    const double share = standing(mesh);
    if (!(share > 0)) return result;
    const std::vector<Vec3d> own = mesh.angles_without_yaw();
    for (std::size_t j = 0; j < result.size(); ++j) {
      const Vec3d off = own[j] - result[j];
      result[j] += off * (is_pose ? share * (1 - beyond_rest(length(off))) : share);
    }
    return result;
  }

  const BodyKind& kind_;
  std::vector<float> weights_;
};

}  // namespace npt::inline NPT_ABI
