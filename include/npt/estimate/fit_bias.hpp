/// What fits of the body to other bodies are off by, taken out of a transfer's joint angles. Skin that bends in another
/// way than the body's turns the fit's joints along: a thigh that is raised takes the pelvis with it, a trunk that
/// turns does so in another part of the spine. And the posture of a build (a heavy person's lean, round shoulders) is
/// taken for a pose. Both are nearly the same for all people, and grow with the pose and with the build:
///   R_true = R_fit exp(B x)      x = (theta, beta): the fitted angles of all joints but the root, and the fitted shape
/// B was learned by least squares from bodies whose joints are known (examples/fit_bias). A transfer takes it from
/// both meshes:
///   R = R_pose exp(B x_pose) exp(B x_identity)^-1
/// so that between equal poses of one build nothing changes. It counts where both keep a distance from the body as
/// people of other models do, and not for the mannequin. What is the same in all poses, c, is left out of that, but
/// tells how the body fits people at rest, by R_true = R_fit exp(B x + c).
/// Measured, PMD x 1e-4 from angles alone and from the build, too: two people that no body model made, every pose in
/// every other, 7.3 and 5.8; human_6890 in natural poses 4.9 and 4.4, on the paper's protocol, seen poses, 3.5 and 2.6.
/// Angles alone had taken 9.2 to 8.3 for the two people.
/// Shapes    B and c: [J, 3, 3 (J - 1) + S + 1], radians by radians and by units of shape: people's [24, 3, 95 + 1];
///           rotations by joint, in space
/// Threads   all members are const and may be called by any number of threads at a time
/// Errors    npt::Error for a file without B, for another shape, and for numbers that aren't finite
/// Source    ours
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/build.hpp>
#include <npt/estimate/fitted_body.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_values.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, FitBias);
template <class>
class BasicFitBias {
 public:
  using Rotations = std::vector<Matrix3>;

  static constexpr const char* tensor = "joints";
  /// How many numbers x has.
  static std::size_t input_count(const BodyKind& kind) {
    return 3 * (kind.joint_count() - 1) + kind.body->shape_count();
  }
  static TensorShape shape(const BodyKind& kind) { return {kind.joint_count(), 3, input_count(kind) + 1}; }

  BasicFitBias(const SafetensorsFile& file, const BodyKind& kind) : BasicFitBias(read(file, kind), kind) {}
  BasicFitBias(std::vector<float> b, const BodyKind& kind)
      : b_(std::move(b)), parents_(kind.plan.parents()), columns_(input_count(kind)) {
    NPT_ASSERT(b_.size() == 3 * parents_.size() * (columns_ + 1));
  }

  /// How much it counts for a pair, from 0 to 1: where both meshes are people's, and not the mannequin's. A stylised
  /// man, whose joints are his own, would have 24e-4 with it instead of 19e-4.
  static double share(const BodyEstimate& identity, const BodyEstimate& pose) {
    const auto of_one = [](const BodyEstimate& e) { return unlike_mannequin(e) * (1 - unlike_people(e)); };
    return std::min(of_one(identity), of_one(pose));
  }

  /// x of a fit: its angles of all joints but the root, and its shape.
  static std::vector<double> inputs(const BodyFit& fit) {
    std::vector<double> x(fit.axis_angles.begin() + 3, fit.axis_angles.end());
    x.insert(x.end(), fit.betas.begin(), fit.betas.end());
    return x;
  }

  /// [J] exp(share B x) of a mesh's fit, in the joints' own frames.
  Rotations correction(const BodyEstimate& reading, double share = 1) const {
    const std::vector<double> x = inputs(reading.fit.body);
    return rotations(as_span(x), share, 0);
  }

  /// [J] Axis angles of the body as it fits people at rest: those that B and c take to none.
  std::vector<Vec3d> people_at_rest() const {
    constexpr int rounds = 5;  // each takes a tenth of what is left
    std::vector<Vec3d> rest(parents_.size());
    std::vector<double> x(columns_);
    for (int round = 0; round < rounds; ++round) {
      const Rotations off = rotations(as_span(x), 1, 1);
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

  /// [J, 3] the joint angles for the identity in the pose.
  std::vector<float> angles(const BodyEstimate& identity, const BodyEstimate& pose) const {
    std::vector<float> result = pose.fit.body.axis_angles;
    const double share = FitBias::share(identity, pose);
    if (!(share > 0)) return result;
    const Rotations of_identity = correction(identity, share), of_pose = correction(pose, share);
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

 private:
  /// Radians: poses that the learning never saw take no joint farther.
  static constexpr double most = 0.35;

  /// [J] exp(share B x + constant c)
  Rotations rotations(std::span<const double> x, double share, double constant) const {
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

  std::vector<float> b_;  ///< [J, 3, columns + 1]
  std::vector<int> parents_;
  std::size_t columns_;
};

}  // namespace npt::inline NPT_ABI
