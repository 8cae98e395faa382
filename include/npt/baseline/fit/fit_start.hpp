/// Where a body fit may begin: the pose in which a mesh was read.
///   const auto read = method->read(mesh);                                       npt::body_method's
///   const BodyFit start = start_of(method->joints(*read), fitter.model());      where read->confidence > sure_start
///   const BodyFit fit = fitter.fit(points, triangles, "mesh", &start);
/// Units     the mesh's, which a fit takes for the model's
/// Requires  a model with SMPL's joints
/// Source    the reading: docs/transfer.md
#pragma once

#include <npt/baseline/fit/body_fitter.hpp>
#include <npt/body/body_model.hpp>
#include <npt/config.hpp>
#include <npt/transfer/body_interface.hpp>

namespace npt::inline NPT_ABI {

/// Trust of a reading from which on a fit should begin there.
inline constexpr double sure_start = 0.7;

/// A fit of the model's mean shape with the angles that were read, its root joint where the read body's is.
inline BodyFit start_of(const JointPose& read, const BodyModel& model) {
  BodyFit start;
  start.axis_angles = read.axis_angles;
  start.translation = read.root - model.joints({})[0];
  return start;
}

}  // namespace npt::inline NPT_ABI
