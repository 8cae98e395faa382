/// Where each point of a resting surface belongs on the resting template: its part is stretched onto the template's
/// (limbs by length and girth; head, hands and feet by the spread of their points; the trunk by the joints along it and
/// by the spread across), then the nearest point of the template that belongs to the same limb and looks the same way
/// is taken.
/// Shapes    places: [V, 3], metres, the template's mean shape in its rest pose
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>
#include <npt/mesh/skinning.hpp>
#include <training/plan_parts.hpp>
#include <training/rest_surface.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace npt::inline NPT_ABI {

namespace rig::internal {

/// model: the template's surface. left_out: [V] what a weapon's joint moves, which goes with the middle of its hand
class CanonicalPlaces {
 public:
  CanonicalPlaces(const PlanParts& parts, const RestSurface& own, const RestSurface& model,
                  const std::vector<bool>& left_out)
      : parts_(parts), own_(own), model_(model), left_out_(left_out) {}

  /// [V, 3]
  std::vector<float> places() const {
    std::vector<std::vector<double>> limbs;
    const BodyPlan& plan = parts_.plan();
    const std::size_t limb_count = plan.limbs.size();
    const auto limbs_of = [&](const JointWeights& row) {
      std::vector<double> sums(limb_count);
      for (std::size_t j = 0; j < row.size(); ++j) sums[plan.joints[j].limb] += row[j];
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
      const std::vector<double> own = limbs_of(row);
      const bool on_head = head_weight(row) > 0.3;
      double best = std::numeric_limits<double>::infinity();
      std::size_t chosen = 0;
      for (std::size_t m = 0; m < model_.points.size(); ++m) {
        const Vec3d off = model_.points[m] - goal;
        double cost = dot(off, off);
        if (cost >= best) continue;
        double common = 0;
        for (std::size_t l = 0; l < limb_count; ++l) common += std::min(own[l], limbs[m][l]);
        if (common < 0.3 || (!on_head && !model_.appendage.empty() && model_.appendage[m])) continue;
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

  /// Of the head, and of ears and jaw: a neck doesn't reach these.
  double head_weight(const JointWeights& row) const {
    double sum = 0;
    for (std::size_t j = 0; j < row.size(); ++j)
      if (parts_.kind(j) == JointKind::head || parts_.kind(j) == JointKind::appendage) sum += row[j];
    return sum;
  }

  static double ratio(double a, double b) { return b > 1e-6 ? std::clamp(a / b, 0.1, 10.0) : 1.0; }

  /// Where a point of part j lies on the template's part, as if that were this one stretched.
  Vec3d stretched(std::size_t j, Vec3d p) const {
    const std::vector<Vec3d>&own = own_.joints, &to = model_.joints;
    const Spread &from = own_.spread[j], &goal = model_.spread[j];
    if (parts_.is_round(j)) {
      if (!(from.area > 1e-6) || !(goal.area > 0)) return to[j] + p - own[j];
      const Vec3d off = p - from.mean;
      return goal.mean + Vec3d{off.x * ratio(goal.deviation.x, from.deviation.x),
                               off.y * ratio(goal.deviation.y, from.deviation.y),
                               off.z * ratio(goal.deviation.z, from.deviation.z)};
    }
    if (parts_.is_trunk(j) || parts_.is_girdle(j)) return on_trunk(j, p);
    const std::size_t end = parts_.toward(j);
    // A tail's tip has no bone: it goes on as the one before it does.
    const std::size_t first = end == j ? parts_.parent(j) : j, second = end == j ? j : end;
    const Vec3d bone = own[second] - own[first], model_bone = to[second] - to[first];
    const Vec3d along = normalised(bone), off = p - own[j];
    const double far = dot(off, along);
    const Vec3d across = off - along * far;
    const double girth = from.area > 1e-6 ? ratio(goal.girth, from.girth) : ratio(length(model_bone), length(bone));
    // A short neck's ruff would reach over the head.
    const double share = parts_.axis() == 2 ? std::clamp(far / length(bone), -0.6, 1.6) : far / length(bone);
    return to[j] + model_bone * share + shortest_turn(along, normalised(model_bone)) * across * girth;
  }

  /// Along the trunk by its joints, across it by the spread of the slice.
  Vec3d on_trunk(std::size_t j, Vec3d p) const {
    const std::vector<Vec3d>&own = own_.joints, &to = model_.joints;
    const bool girdle = parts_.is_girdle(j);
    const std::size_t axis = parts_.axis(), across = parts_.across(), end = parts_.trunk().back();
    const auto at = [](const Vec3d& q, std::size_t k) { return coordinate(q, k); };
    const double along = (at(to[end], axis) - at(to[0], axis)) / (at(own[end], axis) - at(own[0], axis));
    const std::size_t slice = girdle ? parts_.parent(j) : j;
    const Spread &f = own_.spread[slice], &g = model_.spread[slice];
    const double x =
        girdle ? ratio(to[parts_.toward(j)].x, own[parts_.toward(j)].x) : ratio(g.deviation.x, f.deviation.x);
    if (girdle && axis == 2) {
      // A shoulder blade lies on the leg: as far from the shoulder as it is there. Placed like the trunk's slices, 0.7
      // % of a horse's edges were torn apart, with this 0.02 %.
      const std::size_t limb = parts_.toward(j);
      const Vec3d off = p - own[limb];
      return to[limb] + Vec3d{off.x * x, off.y * ratio(g.deviation.y, f.deviation.y), off.z * along};
    }
    Vec3d result{to[0].x + (p.x - own[0].x) * x, 0, 0};
    coordinate(result, axis) = at(to[0], axis) + (at(p, axis) - at(own[0], axis)) * along;
    coordinate(result, across) = f.area > 1e-6
                                     ? at(g.mean, across) + (at(p, across) - at(f.mean, across)) *
                                                                ratio(at(g.deviation, across), at(f.deviation, across))
                                     : at(p, across);
    return result;
  }

  const PlanParts& parts_;
  const RestSurface &own_, &model_;
  const std::vector<bool>& left_out_;
};

}  // namespace rig::internal

}  // namespace npt::inline NPT_ABI
