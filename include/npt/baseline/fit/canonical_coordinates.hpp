/// Canonical coordinates of a body: for each of its vertices, where on the resting mannequin it belongs, so that
/// networks that read meshes can learn from several bodies at once. The mannequin with proportions is fitted to the
/// resting body (bodies of ours end at 5 mm), and each vertex takes the point of it that is closest.
/// Shapes    result: [V, 3], metres, the mannequin's mean shape in its rest pose
/// Errors    npt::Error for a body without SMPL's joints or of quite another size
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/baseline/fit/body_fitter.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/proportions.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

inline std::vector<float> canonical_coordinates(const BodyModel& body) {
  const std::span<const float> rest = mannequin().tables().v_template;
  if (&body == &mannequin()) return {rest.begin(), rest.end()};
  const auto model = std::make_shared<const BodyModel>(with_proportions(mannequin(), human_proportion_deviations));
  const Mesh mesh = to_mesh(body);
  std::vector<Vec3d> points;
  for (const Vec3f p : mesh.positions) points.push_back(p.as<double>());
  const BodyFit fit = BodyFitter(model).fit(points, body.triangles(), "resting body");
  const std::vector<Vec3d> surface = fitted_points(*model, fit);
  const TriangleTree tree(surface, model->triangles());
  std::vector<float> canonical;
  for (const Vec3d p : points) {
    const ClosestPoint c = tree.closest(p);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (std::size_t corner = 0; corner < 3; ++corner)
        sum += c.weights[corner] * static_cast<double>(rest[3 * model->triangles()[c.triangle][corner] + axis]);
      canonical.push_back(static_cast<float>(sum));
    }
  }
  return canonical;
}

}  // namespace npt::inline NPT_ABI
