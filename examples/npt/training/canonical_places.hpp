/// Where each point of a person's resting surface belongs on the resting mannequin: its part is stretched onto the
/// mannequin's (limbs by length and girth, head, hands and feet by the spread of their points), then the nearest point
/// of the mannequin that belongs to the same limb and looks the same way is taken.
/// Shapes    places: [V, 3], metres, the mannequin's mean shape in its rest pose
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/mesh/skinning.hpp>
#include <training/limbs.hpp>
#include <training/rest_surface.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <vector>

namespace npt::inline NPT_ABI {

namespace rig::internal {

/// model: the mannequin's surface. left_out: [V] what a weapon's joint moves, which goes with the middle of its hand
class CanonicalPlaces {
 public:
  CanonicalPlaces(const RestSurface& own, const RestSurface& model, const std::vector<bool>& left_out)
      : own_(own), model_(model), left_out_(left_out) {}

  /// [V, 3]
  std::vector<float> places() const {
    std::vector<std::array<double, limb_count>> limbs;
    const auto limbs_of = [](const JointWeights& row) {
      std::array<double, limb_count> sums{};
      for (std::size_t j = 0; j < smpl_joint_count; ++j) sums[static_cast<std::size_t>(limb_of(j))] += row[j];
      return sums;
    };
    for (const JointWeights& row : model_.weights) limbs.push_back(limbs_of(row));
    std::vector<float> canonical;
    canonical.reserve(3 * own_.points.size());
    for (std::size_t v = 0; v < own_.points.size(); ++v) {
      const JointWeights& row = own_.weights[v];
      const Vec3d p = own_.points[v];
      Vec3d goal = skinned(row, [&](std::size_t j) { return stretched(j, p); });
      if (left_out_[v]) {
        const auto part = static_cast<std::size_t>(std::ranges::max_element(row) - row.begin());
        goal = model_.spread[part].mean;
      }
      const std::array<double, limb_count> own = limbs_of(row);
      double best = std::numeric_limits<double>::infinity();
      std::size_t chosen = 0;
      for (std::size_t m = 0; m < model_.points.size(); ++m) {
        const Vec3d off = model_.points[m] - goal;
        double cost = dot(off, off);
        if (cost >= best) continue;
        double common = 0;
        for (std::size_t l = 0; l < limb_count; ++l) common += std::min(own[l], limbs[m][l]);
        if (common < 0.3) continue;
        if (!left_out_[v]) cost += turned_away * (1 - dot(model_.normals[m], own_.normals[v]));
        if (cost < best) best = cost, chosen = m;
      }
      const Vec3f place = model_.points[chosen].as<float>();
      canonical.insert(canonical.end(), {place.x, place.y, place.z});
    }
    return canonical;
  }

 private:
  /// Square metres that a normal at right angles costs: as far as 4 cm.
  static constexpr double turned_away = 0.04 * 0.04;

  /// Where a point of part j lies on the mannequin's part, as if that were this one stretched.
  Vec3d stretched(std::size_t j, Vec3d p) const {
    const std::array<Vec3d, smpl_joint_count>&own = own_.joints, &to = model_.joints;
    const Spread &from = own_.spread[j], &goal = model_.spread[j];
    const auto ratio = [](double a, double b) { return b > 1e-6 ? std::clamp(a / b, 0.1, 10.0) : 1.0; };
    constexpr std::size_t pelvis = joint_index(SmplJoint::pelvis), neck = joint_index(SmplJoint::neck);
    const double trunk = (to[neck].y - to[pelvis].y) / (own[neck].y - own[pelvis].y);
    if (is_joint(j, SmplJoint::head) || is_hand(j) || is_foot(j)) {
      if (!(from.area > 1e-6)) return to[j] + p - own[j];
      const Vec3d off = p - from.mean;
      return goal.mean + Vec3d{off.x * ratio(goal.deviation.x, from.deviation.x),
                               off.y * ratio(goal.deviation.y, from.deviation.y),
                               off.z * ratio(goal.deviation.z, from.deviation.z)};
    }
    if (is_trunk(j) || is_collar(j)) {
      const std::size_t slice = is_collar(j) ? joint_index(SmplJoint::spine3) : j;
      const Spread &f = own_.spread[slice], &g = model_.spread[slice];
      const double x =
          is_collar(j) ? ratio(to[bone_end(j)].x, own[bone_end(j)].x) : ratio(g.deviation.x, f.deviation.x);
      return {to[pelvis].x + (p.x - own[pelvis].x) * x, to[pelvis].y + (p.y - own[pelvis].y) * trunk,
              f.area > 1e-6 ? g.mean.z + (p.z - f.mean.z) * ratio(g.deviation.z, f.deviation.z) : p.z};
    }
    const std::size_t end = bone_end(j);
    const Vec3d bone = own[end] - own[j], model_bone = to[end] - to[j];
    const Vec3d along = normalised(bone), off = p - own[j];
    const double far = dot(off, along);
    const Vec3d across = off - along * far;
    const double girth = from.area > 1e-6 ? ratio(goal.girth, from.girth) : ratio(length(model_bone), length(bone));
    return to[j] + model_bone * (far / length(bone)) + shortest_turn(along, normalised(model_bone)) * across * girth;
  }

  const RestSurface &own_, &model_;
  const std::vector<bool>& left_out_;
};

}  // namespace rig::internal

}  // namespace npt::inline NPT_ABI
