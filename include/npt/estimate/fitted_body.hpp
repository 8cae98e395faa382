/// A body that was fitted to a mesh, as plain data, and where its vertices and joints lie.
/// Shapes    axis_angles: [J, 3], betas: [S]
/// Units     metres, radians; those of the mesh that it was fitted to
/// Source    Loper et al., "SMPL", 2015 (the parameters)
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/mesh/points.hpp>

#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

/// A body that was fitted: model(betas, axis_angles) + translation.
struct BodyFit {
  Vec3d translation;
  std::vector<float> axis_angles;  ///< [J, 3], radians
  std::vector<float> betas;        ///< [S]
  double distance = 0;  ///< root of the mean squared distance between the surfaces, in metres, outliers cut off at 5 cm
  int evaluations = 0;  ///< of the distance, in all starts and stages
  int starts = 0;       ///< that were optimised
};

/// [V] A fitted body's vertices, where they lie in the mesh.
NPT_INLINE std::vector<Vec3d> fitted_points(const BodyModel& model, const BodyFit& fit) {
  std::vector<float> xyz(3 * model.vertex_count());
  model.posed(as_span(fit.betas), as_span(fit.axis_angles), as_span(xyz));
  std::vector<Vec3d> points(model.vertex_count());
  for (std::size_t v = 0; v < points.size(); ++v) points[v] = point_at(as_span(xyz), v) + fit.translation;
  return points;
}

/// [J] A fitted body's joints, where they lie in the mesh.
NPT_INLINE std::vector<Vec3d> fitted_joints(const BodyModel& model, const BodyFit& fit) {
  std::vector<Vec3d> joints = model.joints(as_span(fit.betas));
  const std::vector<Rigid> motions = model.bone_motions(as_span(fit.betas), as_span(fit.axis_angles));
  for (std::size_t j = 0; j < joints.size(); ++j) joints[j] = motions[j](joints[j]) + fit.translation;
  return joints;
}

}  // namespace npt::inline NPT_ABI
