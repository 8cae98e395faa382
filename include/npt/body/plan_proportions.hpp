/// Proportions by a body plan's table: how each part grows, and the shape directions that this makes for any body.
/// Part j is stretched by A_j = I + sum_k p_k B_jk in the rest pose, its joint carried along by the parts before it,
/// v' = sum_j w_vj (c_j' + A_j (v - c_j)), which is linear in p.
/// Shapes    p, units: [K] proportions in the plan's order; growth B: [J][K]
/// Units     p_k is a relative change: 0.5 makes the part half as long (or thick) again
/// Errors    npt::Error for a body whose number of joints isn't the plan's
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// The unit direction of each joint's bone: to the joint that the plan names; of a last one, away from its parent.
NPT_INLINE std::vector<Vec3d> bone_directions(const BodyPlan& plan, std::span<const Vec3d> joints) {
  std::vector<Vec3d> directions;
  for (std::size_t j = 0; j < plan.joint_count(); ++j) {
    const JointPlan& joint = plan.joints[j];
    if (joint.toward != j)
      directions.push_back(normalised(joints[joint.toward] - joints[j]));
    else if (joint.parent >= 0)
      directions.push_back(normalised(joints[j] - joints[static_cast<std::size_t>(joint.parent)]));
    else
      directions.push_back({0, 1, 0});
  }
  return directions;
}

namespace body::internal {

/// `along`: unit, of the part's bone.
NPT_INLINE Matrix3 growth_matrix(PartGrowth way, Vec3d along) {
  const Matrix3 all = Matrix3::identity(), length = outer(along, along);
  switch (way) {
    case PartGrowth::length:
      return length;
    case PartGrowth::girth:
      return all - length;
    case PartGrowth::x:
      return outer({1, 0, 0}, {1, 0, 0});
    case PartGrowth::y:
      return outer({0, 1, 0}, {0, 1, 0});
    case PartGrowth::z:
      return outer({0, 0, 1}, {0, 0, 1});
    case PartGrowth::across_y:
      return outer({1, 0, 0}, {1, 0, 0}) + outer({0, 0, 1}, {0, 0, 1});
    case PartGrowth::all:
      break;
  }
  return all;
}

/// By proportion k every part becomes larger in all directions.
NPT_INLINE bool grows_whole_body(const std::vector<std::vector<Matrix3>>& growth, std::size_t k) {
  return std::ranges::all_of(growth, [k](const std::vector<Matrix3>& b) { return b[k] == Matrix3::identity(); });
}

/// [J][K] How far each joint is carried by the parts before it. The root stays, but where the whole body grows, it
/// grows about the origin.
NPT_INLINE std::vector<std::vector<Vec3d>> carried_joints(std::span<const int> parents, std::span<const Vec3d> joints,
                                                          const std::vector<std::vector<Matrix3>>& growth) {
  const std::size_t count = growth.empty() ? 0 : growth[0].size();
  std::vector<std::vector<Vec3d>> carried(joints.size(), std::vector<Vec3d>(count));
  for (std::size_t j = 0; j < joints.size(); ++j)
    for (std::size_t k = 0; k < count; ++k) {
      if (parents[j] < 0) {
        if (grows_whole_body(growth, k)) carried[j][k] = joints[j];
        continue;
      }
      const auto parent = static_cast<std::size_t>(parents[j]);
      carried[j][k] = carried[parent][k] + growth[parent][k] * (joints[j] - joints[parent]);
    }
  return carried;
}

/// The body with a shape direction more for each proportion. growth: [J][K]; units: [K], the relative change at a shape
/// parameter of 1.
NPT_INLINE BodyModel with_growth(const BodyModel& body, const std::vector<std::vector<Matrix3>>& growth,
                                 std::span<const double> units) {
  BodyTables tables = body.tables();
  const std::vector<Vec3d> joints = body.joints({});
  const std::size_t vertices = body.vertex_count(), old = body.shape_count(), now = old + units.size();
  const auto carried = carried_joints(as_span(tables.parents), as_span(joints), growth);
  std::vector<float> directions(vertices * 3 * now);
  std::vector<Vec3d> moved(units.size());
  for (std::size_t v = 0; v < vertices; ++v) {
    const Vec3d at =
        Vec3f{tables.v_template[3 * v], tables.v_template[3 * v + 1], tables.v_template[3 * v + 2]}.as<double>();
    std::ranges::fill(moved, Vec3d{});
    for (std::size_t i = tables.weights.start[v]; i < tables.weights.start[v + 1]; ++i) {
      const std::size_t j = tables.weights.column[i];
      const double w = static_cast<double>(tables.weights.value[i]);
      for (std::size_t k = 0; k < units.size(); ++k) moved[k] += (carried[j][k] + growth[j][k] * (at - joints[j])) * w;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float* row = directions.data() + (3 * v + axis) * now;
      for (std::size_t b = 0; b < old; ++b) row[b] = tables.shapedirs[(3 * v + axis) * old + b];
      for (std::size_t k = 0; k < units.size(); ++k) {
        const Vec3f m = (moved[k] * units[k]).as<float>();
        row[old + k] = axis == 0 ? m.x : axis == 1 ? m.y : m.z;
      }
    }
  }
  tables.shapedirs = std::move(directions);
  return BodyModel(std::move(tables), "body with proportions");
}

}  // namespace body::internal

/// [J][K] The matrices B_jk of a plan's proportions, for joints at these places in the rest pose.
NPT_INLINE std::vector<std::vector<Matrix3>> part_growth(const BodyPlan& plan, std::span<const Vec3d> joints) {
  const std::vector<Vec3d> along = bone_directions(plan, joints);
  std::vector<std::vector<Matrix3>> growth(plan.joint_count(), std::vector<Matrix3>(plan.proportions.size()));
  for (std::size_t k = 0; k < plan.proportions.size(); ++k)
    for (const auto& [joint, way] : plan.proportions[k].grows)
      growth[joint][k] = body::internal::growth_matrix(way, along[joint]);
  return growth;
}

/// The body with a shape direction more for each of the plan's proportions, in standard deviations of its kind.
NPT_INLINE BodyModel with_proportions(const BodyModel& body, const BodyPlan& plan) {
  if (body.joint_count() != plan.joint_count())
    throw Error({.file = "body",
                 .found = std::to_string(body.joint_count()) + " joints",
                 .expected = "the " + std::to_string(plan.joint_count()) + " of plan '" + plan.name + "'"});
  const std::vector<Vec3d> joints = body.joints({});
  const auto growth = part_growth(plan, as_span(joints));
  std::vector<double> units;
  for (const ProportionPlan& p : plan.proportions) units.push_back(p.deviation);
  return body::internal::with_growth(body, growth, as_span(units));
}

/// [K] Random relative changes: three bodies in ten nearly as they are, three half way to the ends of the plan's
/// ranges, four all the way; each log-uniform. Shape parameters of with_proportions(body, plan) are these divided by
/// the deviations. Always takes 1 + K draws.
/// Numerics  the others are relative to the size: directions add up where factors multiply, and a small body's short
///           legs would otherwise be 0.45 - 0.2 = 0.25 instead of 0.8 * 0.45 = 0.36 times the length
NPT_INLINE std::vector<double> sample_proportions(const BodyPlan& plan, Random& random) {
  const double kind = random.uniform();
  const double amount = kind < 0.3 ? 0.2 : kind < 0.6 ? 0.5 : 1.0;
  std::vector<double> changes;
  std::vector<bool> whole;
  double size = 1;
  for (const ProportionPlan& p : plan.proportions) {
    changes.push_back(std::exp(amount * random.uniform(std::log(p.low), std::log(p.high))) - 1);
    whole.push_back(p.grows.size() == plan.joint_count() &&
                    std::ranges::all_of(p.grows, [](const auto& g) { return g.second == PartGrowth::all; }));
    if (whole.back()) size += changes.back();
  }
  for (std::size_t k = 0; k < changes.size(); ++k)
    if (!whole[k]) changes[k] *= size;
  return changes;
}

/// [own_shapes + K] Shape parameters of with_proportions(body, plan): the body's own, normal, then random proportions.
NPT_INLINE std::vector<float> sample_character(const BodyPlan& plan, Random& random, std::size_t own_shapes) {
  std::vector<float> betas;
  for (std::size_t s = 0; s < own_shapes; ++s) betas.push_back(static_cast<float>(random.normal()));
  const std::vector<double> changes = sample_proportions(plan, random);
  for (std::size_t k = 0; k < changes.size(); ++k)
    betas.push_back(static_cast<float>(changes[k] / plan.proportions[k].deviation));
  return betas;
}

}  // namespace npt::inline NPT_ABI
