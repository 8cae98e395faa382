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
/// Shapes    B and c: [24, 3, 95 + 1], radians by radians (23 x 3) and by units of shape (26); rotations by joint, in
///           space
/// Threads   all members are const and may be called by any number of threads at a time
/// Errors    npt::Error for a file without B, for another shape, and for numbers that aren't finite
/// Source    ours
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/mannequin/shape.hpp>
#include <npt/body/proportions.hpp>
#include <npt/body/skeleton.hpp>
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
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, FitBias);
template <class>
class BasicFitBias {
 public:
  static constexpr std::size_t angle_count = 3 * (smpl_joint_count - 1);
  static constexpr std::size_t shape_count = anatomy::mannequin_shape_count + body_proportion_count;
  static constexpr std::size_t columns = angle_count + shape_count, rows = 3 * smpl_joint_count;
  using Rotations = std::array<Matrix3, smpl_joint_count>;

  static constexpr const char* tensor = "joints";
  static TensorShape shape() { return {smpl_joint_count, 3, columns + 1}; }

  explicit BasicFitBias(const SafetensorsFile& file) : BasicFitBias(read(file)) {}
  explicit BasicFitBias(std::vector<float> b) : b_(std::move(b)) { NPT_ASSERT(b_.size() == rows * (columns + 1)); }

  /// How much it counts for a pair, from 0 to 1: where both meshes are people's, and not the mannequin's. A stylised
  /// man, whose joints are his own, would have 24e-4 with it instead of 19e-4.
  static double share(const BodyEstimate& identity, const BodyEstimate& pose) {
    const auto of_one = [](const BodyEstimate& e) { return unlike_mannequin(e) * (1 - unlike_people(e)); };
    return std::min(of_one(identity), of_one(pose));
  }

  /// x of a fit: its angles of all joints but the root, and its shape.
  static std::array<double, columns> inputs(const BodyFit& fit) {
    std::array<double, columns> x{};
    for (std::size_t i = 0; i < angle_count; ++i) x[i] = static_cast<double>(fit.axis_angles[3 + i]);
    for (std::size_t i = 0; i < shape_count; ++i) x[angle_count + i] = static_cast<double>(fit.betas[i]);
    return x;
  }

  /// [24] exp(share B x) of a mesh's fit, in the joints' own frames.
  Rotations correction(const BodyEstimate& reading, double share = 1) const {
    return rotations(inputs(reading.fit.body), share, 0);
  }

  /// [24] Axis angles of the mannequin as it fits people at rest: those that B and c take to none.
  std::array<Vec3d, smpl_joint_count> people_at_rest() const {
    constexpr int rounds = 5;  // each takes a tenth of what is left
    std::array<Vec3d, smpl_joint_count> rest{};
    std::array<double, columns> x{};
    for (int round = 0; round < rounds; ++round) {
      const Rotations off = rotations(x, 1, 1);
      for (std::size_t j = 0; j < smpl_joint_count; ++j) {
        const int parent = smpl_parents[j];
        const Matrix3 fitted = off[j].transposed();
        rest[j] = axis_angle(parent < 0 ? fitted : off[static_cast<std::size_t>(parent)] * fitted);
        if (j == 0) continue;
        x[3 * j - 3] = rest[j].x, x[3 * j - 2] = rest[j].y, x[3 * j - 1] = rest[j].z;
      }
    }
    return rest;
  }

  /// [24, 3] the joint angles for the identity in the pose.
  std::vector<float> angles(const BodyEstimate& identity, const BodyEstimate& pose) const {
    std::vector<float> result = pose.fit.body.axis_angles;
    const double share = FitBias::share(identity, pose);
    if (!(share > 0)) return result;
    const Rotations of_identity = correction(identity, share), of_pose = correction(pose, share);
    Rotations fitted, turned;
    for (std::size_t j = 0; j < smpl_joint_count; ++j) {
      const int parent = smpl_parents[j];
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

  /// [24] exp(share B x + constant c)
  Rotations rotations(const std::array<double, columns>& x, double share, double constant) const {
    Rotations result;
    for (std::size_t j = 0; j < smpl_joint_count; ++j) {
      std::array<double, 3> turn{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::span<const float> row = std::span(b_).subspan((3 * j + k) * (columns + 1), columns + 1);
        for (std::size_t i = 0; i < columns; ++i) turn[k] += share * static_cast<double>(row[i]) * x[i];
        turn[k] += constant * static_cast<double>(row[columns]);
      }
      const Vec3d v{turn[0], turn[1], turn[2]};
      result[j] = rotation_matrix(v * (most / std::max(most, length(v))));
    }
    return result;
  }

  static std::vector<float> read(const SafetensorsFile& file) {
    const FileTensor& found = file.at(tensor);
    if (found.shape != shape()) invalid_tensor(file.name(), tensor, to_string(found.shape), to_string(shape()));
    return to_float(found);
  }

  std::vector<float> b_;  ///< [rows, columns + 1]
};

}  // namespace npt::inline NPT_ABI
