/// An identity bound to the body that was fitted to it: its joints, skin weights and hands, and how angles move it.
/// Shapes    joint angles [40, 3]: SMPL's 24 and the fingers'
/// Units     metres and radians, in the body's coordinates
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/mannequin/finger_joints.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/finger_fit.hpp>
#include <npt/estimate/fitted_body.hpp>
#include <npt/skin/skeleton_pose.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// An identity bound to the body that was fitted to it.
struct BoundCharacter {
  BodyEstimate reading;
  BodyFit body;                   ///< the reading's, with finger joints: 40
  std::vector<Vec3d> joints;      ///< [40] where they are, in the body's coordinates
  std::array<HandBend, 2> hands;  ///< as measured on the mesh itself
  std::array<bool, 2> fingers{};  ///< whether the hands have any
  std::vector<Vec3d> points;      ///< [V] in the body's coordinates
  SparseMatrix weights;           ///< [V, 40]

  /// [40, 3] the pose's joint angles [24, 3] with its hands, where this character has fingers to close.
  std::vector<float> angles(std::span<const float> axis_angles, const BodyEstimate& pose) const {
    return with_fingers(axis_angles, {fingers[0] ? pose.hands[0] : hands[0], fingers[1] ? pose.hands[1] : hands[1]});
  }

  /// [40] How the joints move to joint angles [40, 3], in the body's coordinates. `fingered`: the body with finger
  /// joints
  std::vector<RigidMotion> motions(const BodyModel& fingered, std::span<const float> axis_angles) const {
    std::vector<RigidMotion> result = skeleton_motions(fingered, body, axis_angles);
    for (std::size_t j = smpl_joint_count; j < result.size(); ++j) {
      const auto parent = static_cast<std::size_t>(fingered.tables().parents[j]);
      result[j].shift = result[parent](joints[j]) - result[j].rotation * joints[j];
    }
    return result;
  }

  /// Where the joints' motions [J] bring a vertex, in the body's coordinates.
  Vec3d moved(std::size_t v, std::span<const RigidMotion> motions) const {
    Vec3d sum;
    for (std::size_t i = weights.start[v]; i < weights.start[v + 1]; ++i)
      sum += motions[weights.column[i]](points[v]) * static_cast<double>(weights.value[i]);
    return sum;
  }
};

}  // namespace npt::inline NPT_ABI
