/// How deep a figure's arms are inside its trunk: arm vertices behind the trunk's surface, by their distance to it.
///   LimbPenetration depths(mesh, motion, roles);
///   depths.add(joint_worlds(motion, time));   frame by frame
///   depths.mean(), depths.worst()             metres, over all arm vertices of all frames
/// What is inside where the skin was bound doesn't count, nor does the third of an upper arm that is next to the trunk,
/// nor what hands hold.
/// Numerics  inside: a winding number over 0.5 around the trunk's triangles, which have holes where arms begin
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/held_props.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/body/roles/nearest_roles.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/winding_number.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_mesh.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace npt::inline NPT_ABI {

class LimbPenetration {
 public:
  /// Keeps references.
  LimbPenetration(const MotionMesh& mesh, const Motion& motion, const JointRoles& roles)
      : mesh_(mesh), motion_(motion) {
    const std::vector<JointRole> nearest = nearest_roles(motion, roles);
    const std::vector<Affine> bound = bound_worlds(motion);
    const std::vector<bool> held = held_props(mesh, nearest);
    std::vector<bool> trunk(mesh.vertex_count());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      const JointRole role = nearest[mesh.main_joint(v)];
      trunk[v] = is_of_trunk(role);
      if (!is_of_limb(role) || held[v]) continue;
      if (is_of_forearm(role) ||
          (part_of(role) == LimbPart::upper_arm && along(roles, bound, side_of(role), mesh.positions[v]) > 1.0 / 3))
        arms_.push_back(v);
    }
    for (const Triangle& t : mesh.triangles)
      if (trunk[t[0]] && trunk[t[1]] && trunk[t[2]]) trunk_.push_back(t);
    // A figure of many vertices is measured on some of them.
    constexpr std::size_t most = 400;
    if (arms_.size() > most) {
      for (std::size_t i = 0; i < most; ++i) arms_[i] = arms_[i * arms_.size() / most];
      arms_.resize(most);
    }
    if (trunk_.empty()) return;
    tree_.emplace(mesh.positions, trunk_);
    std::erase_if(arms_, [&](std::size_t v) { return tree_->winding(mesh.positions[v]) > inside; });
  }

  /// Whether there is something to measure.
  bool has_mesh() const { return !trunk_.empty() && !arms_.empty(); }

  void add(const std::vector<Affine>& worlds) {
    if (!has_mesh()) return;
    const std::vector<Vec3d> now = mesh_.moved(motion_, worlds);
    tree_->move(now, trunk_);
    count_ += arms_.size();
    for (const std::size_t v : arms_) {
      const Vec3d p = now[v];
      if (tree_->winding(p) <= inside) continue;
      const double depth = std::sqrt(tree_->closest(p).squared_distance);
      sum_ += depth;
      worst_ = std::max(worst_, depth);
    }
  }

  double mean() const { return count_ == 0 ? 0 : sum_ / static_cast<double>(count_); }
  double worst() const { return worst_; }

 private:
  static constexpr double inside = 0.5;

  /// Where a point is between shoulder and elbow, 0 to 1.
  static double along(const JointRoles& roles, const std::vector<Affine>& bound, std::size_t side, Vec3d p) {
    const std::size_t shoulder = roles.joint(LimbPart::upper_arm, side), elbow = roles.joint(LimbPart::lower_arm, side);
    if (shoulder == no_item || elbow == no_item) return 0;
    return closest_on_segment(p, bound[shoulder].shift, bound[elbow].shift);
  }

  const MotionMesh& mesh_;
  const Motion& motion_;
  std::vector<std::size_t> arms_;  ///< vertices
  std::vector<Triangle> trunk_;
  std::optional<WindingTree> tree_;
  double sum_ = 0, worst_ = 0;
  std::size_t count_ = 0;
};

}  // namespace npt::inline NPT_ABI
