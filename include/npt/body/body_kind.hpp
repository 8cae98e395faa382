/// A kind of body, such as people, as data: all that estimation and skinning know of it.
///   npt::BodyEstimator estimator(reader, npt::people_kind());
/// Another kind needs a plan, a body with its joints, and some of its poses; hands are people's own.
/// Shapes    J joints of the plan, J' with those of fingers; poses [J, 3] axis angles
/// Units     metres, radians
#pragma once

#include <npt/base/error.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/hands.hpp>
#include <npt/config.hpp>

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// Mean and covariance of the angles of all joints but the root, in natural poses.
struct PoseMoments {
  std::vector<Vec3d> mean;         ///< [J], the root's unused; empty: not known
  std::vector<double> covariance;  ///< [3 (J - 1), 3 (J - 1)], of which the lower half is read
};

/// poses: [n][J, 3]
/// Errors    npt::Error for poses of several sizes
NPT_INLINE PoseMoments moments_of(std::span<const std::vector<float>> poses) {
  if (poses.empty()) return {};
  const std::size_t joints = poses.front().size() / 3, angles = 3 * (joints - 1);
  PoseMoments moments{std::vector<Vec3d>(joints), std::vector<double>(angles * angles)};
  std::vector<double> mean(angles);
  for (const std::vector<float>& pose : poses) {
    if (pose.size() != 3 * joints)
      throw Error({.file = "poses",
                   .found = std::to_string(pose.size()) + " angles",
                   .expected = std::to_string(3 * joints) + " as of the first pose"});
    for (std::size_t i = 0; i < angles; ++i) {
      const double a = static_cast<double>(pose[3 + i]) / static_cast<double>(poses.size());
      mean[i] += a;
      for (std::size_t k = 0; k <= i; ++k) moments.covariance[i * angles + k] += a * static_cast<double>(pose[3 + k]);
    }
  }
  for (std::size_t i = 0; i < angles; ++i)
    for (std::size_t k = 0; k <= i; ++k) moments.covariance[i * angles + k] -= mean[i] * mean[k];
  for (std::size_t j = 1; j < joints; ++j) moments.mean[j] = {mean[3 * j - 3], mean[3 * j - 2], mean[3 * j - 1]};
  return moments;
}

struct BodyKind {
  /// Fingers that follow the plan's joints.
  struct Hands {
    std::shared_ptr<const BodyModel> fingered;  ///< the body with the joints of fingers, J'
    BothHands joints;
  };

  BodyPlan plan;
  /// What is fitted: the plan's joints, the mean shape, and shapes in standard deviations, proportions among them.
  std::shared_ptr<const BodyModel> body;
  PoseMoments moments{};                    ///< unknown ones: each joint by itself, by the plan's stiffness
  std::vector<std::vector<float>> poses{};  ///< [n][J, 3] that limbs may have, in random order
  std::optional<Hands> hands{};
  /// Whether characters of another build keep how they stand at rest (estimate/angle_correction.hpp).
  bool has_own_rest = false;
  std::vector<std::string> skeleton_names{};  ///< [J'] of joints in skeletons that are made for characters

  std::size_t joint_count() const noexcept { return plan.joint_count(); }
  /// What characters are bound to.
  const BodyModel& bound_body() const noexcept { return hands ? *hands->fingered : *body; }
  /// [J', 3] Angles of the bound body, from [J, 3].
  std::vector<float> bound_angles(std::span<const float> axis_angles, const std::array<HandBend, 2>& bends) const {
    return hands ? with_fingers(axis_angles, bends, hands->joints)
                 : std::vector<float>(axis_angles.begin(), axis_angles.end());
  }
};

/// Errors    npt::Error for no kind, one without a body that has a surface, and one whose body has other joints than
///           its plan
NPT_INLINE std::shared_ptr<const BodyKind> checked_kind(std::shared_ptr<const BodyKind> kind) {
  if (!kind || !kind->body) throw Error({.file = "body", .found = "none", .expected = "a body model"});
  if (kind->body->triangles().empty()) throw Error({.file = "body", .found = "no triangles", .expected = "a surface"});
  if (kind->body->tables().parents != kind->plan.parents())
    throw Error({.file = "body",
                 .found = std::to_string(kind->body->joint_count()) + " joints",
                 .expected = "the " + std::to_string(kind->joint_count()) + " of the plan '" + kind->plan.name +
                             "', each on its parent"});
  return kind;
}

}  // namespace npt::inline NPT_ABI
