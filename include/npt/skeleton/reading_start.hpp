/// Where a body fit may begin: the pose in which a mesh was read.
///   const BodyReading reading = transfer.read(mesh);
///   const BodyFit start = start_of(transfer.body(), reading, fitter.model());      where reading.trust() > sure_start
///   const BodyFit fit = fitter.fit(points, triangles, "mesh", &start);
/// Units     the model's; the mesh's, which a fit takes for the same
/// Requires  a model with SMPL's joints
/// Source    the reading: docs/transfer.md
#pragma once

#include <npt/body/body_model.hpp>
#include <npt/config.hpp>
#include <npt/core/vec3.hpp>
#include <npt/fit/body_fit.hpp>
#include <npt/skeleton/body_transfer.hpp>

#include <vector>

namespace npt::inline NPT_ABI {

/// Trust of a reading from which on a fit should begin there.
inline constexpr double sure_start = 0.7;

/// A fit of the model's mean shape with the angles that were read, its root joint where the read body's is.
/// read: the body that the reading fitted
inline BodyFit start_of(const BodyModel& read, const BodyReading& reading, const BodyModel& model) {
  const BodyFit& fit = reading.fit.body;
  const Vec3d root = (read.joints(fit.betas)[0] + fit.translation) / reading.metres + reading.centre;
  BodyFit start;
  start.axis_angles = fit.axis_angles;
  start.translation = root - model.joints({})[0];
  return start;
}

}  // namespace npt::inline NPT_ABI
