/// Where a body fit may begin: the pose that was estimated for a mesh.
///   const npt::Character character = transfer.character(mesh);                where confidence() > sure_start
///   const BodyFit start = start_of(*character.joints(), fitter.model());
///   const BodyFit fit = fitter.fit(points, triangles, "mesh", &start);
/// Units     the mesh's, which a fit takes for the model's
/// Requires  a model with SMPL's joints
#pragma once

#include <npt/baseline/fit/body_fitter.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/joint_pose.hpp>
#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

/// Confidence of an estimate from which on a fit should begin there.
inline constexpr double sure_start = 0.7;

/// A fit of the model's mean shape with the estimated angles, its root joint where the estimated body's is.
inline BodyFit start_of(const JointPose& pose, const BodyModel& model) {
  BodyFit start;
  start.axis_angles = pose.axis_angles;
  start.translation = pose.root - model.joints({})[0];
  return start;
}

}  // namespace npt::inline NPT_ABI
