/// A body that was fitted to a mesh, as plain data, where its vertices and joints lie, and how its bones move.
/// Shapes    axis_angles: [J, 3], betas: [S]
/// Units     metres, radians; those of the mesh that it was fitted to
/// Source    Loper et al., "SMPL", 2015 (the parameters)
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/config.hpp>
#include <npt/mesh/points.hpp>

#include <cstddef>
#include <span>
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

/// [n] x of DifferentiableBody: translation, axis angles, betas; those that a fit lacks are 0.
NPT_INLINE std::vector<double> parameters_of(const BodyFit& fit, std::size_t count) {
  std::vector<double> x{fit.translation.x, fit.translation.y, fit.translation.z};
  x.insert(x.end(), fit.axis_angles.begin(), fit.axis_angles.end());
  x.insert(x.end(), fit.betas.begin(), fit.betas.end());
  x.resize(count);
  return x;
}
/// The same back.
NPT_INLINE BodyFit fit_of(std::span<const double> x, std::size_t joints) {
  BodyFit fit;
  fit.translation = {x[0], x[1], x[2]};
  for (std::size_t i = 3; i < x.size(); ++i)
    (i < 3 + 3 * joints ? fit.axis_angles : fit.betas).push_back(static_cast<float>(x[i]));
  return fit;
}

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

/// [J] The motion that takes each bone of the identity's skeleton from where it was fitted to the pose's angles. Bone
/// lengths are the identity's; its root joint stays in place.
NPT_INLINE std::vector<Rigid> skeleton_motions(const BodyModel& model, const BodyFit& identity,
                                               std::span<const float> axis_angles) {
  std::vector<Rigid> from = model.bone_motions(as_span(identity.betas), as_span(identity.axis_angles));
  std::vector<Rigid> to = model.bone_motions(as_span(identity.betas), axis_angles);
  for (std::size_t j = 0; j < to.size(); ++j) {
    from[j].shift += identity.translation;
    to[j].shift += identity.translation;
    to[j] = to[j] * inverse(from[j]);
  }
  return to;
}

}  // namespace npt::inline NPT_ABI
