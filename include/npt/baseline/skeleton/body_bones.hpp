/// The bones of a fitted body. A bone goes from a joint to each of its children and is moved by the joint that it
/// starts from. A joint without children (head, hands, toes) has a bone to the far side of what it moves: from the
/// joint through the centre of its skin.
/// Source    Wang et al., CVPR 2020, supplement C.1
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/config.hpp>

#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

struct Bone {
  Vec3d from, to;
  std::size_t joint = 0;  ///< that moves it
};

/// The bones of a body as it was fitted to a mesh.
inline std::vector<Bone> bones_of(const BodyModel& model, const BodyFit& fit) {
  const BodyTables& tables = model.tables();
  const std::size_t joints = model.joint_count();
  const std::vector<Vec3d> place = fitted_joints(model, fit), vertices = fitted_points(model, fit);
  std::vector<Vec3d> skin(joints);
  std::vector<double> weight(joints);
  for (std::size_t v = 0; v < model.vertex_count(); ++v)
    for (std::size_t i = tables.weights.start[v]; i < tables.weights.start[v + 1]; ++i) {
      // Squared: a leaf's centre is that of the skin which is its own, not of what fades in along the limb.
      const double w = static_cast<double>(tables.weights.value[i]) * static_cast<double>(tables.weights.value[i]);
      skin[tables.weights.column[i]] += vertices[v] * w;
      weight[tables.weights.column[i]] += w;
    }
  std::vector<Bone> bones;
  std::vector<bool> leaf(joints, true);
  for (std::size_t j = 1; j < joints; ++j) {
    const auto parent = static_cast<std::size_t>(tables.parents[j]);
    bones.push_back({place[parent], place[j], parent});
    leaf[parent] = false;
  }
  // From the joint to the centre of the skin and half as far again stays inside of it.
  for (std::size_t j = 0; j < joints; ++j)
    if (leaf[j])
      bones.push_back({place[j], weight[j] > 0 ? place[j] + (skin[j] / weight[j] - place[j]) * 1.5 : place[j], j});
  return bones;
}

}  // namespace npt::inline NPT_ABI
