// A four-legged kind of body made of flattened capsules, its natural poses, and meshes of it that were read.
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/io/file.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/sampled_surface.hpp>

#include <estimate/simulated_correspondences.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace four_legged {

using npt::Vec3d;

/// Where joints are in the rest pose, and how thick their parts; the right side is the left one's mirror image.
struct RestJoint {
  Vec3d place;
  double radius = 0;
  Vec3d tip{};  ///< from the joint to its part's end, where that is no other joint
};
inline const std::map<std::string, RestJoint>& rest_joints() {
  static const std::map<std::string, RestJoint> all{{"pelvis", {{0, 1.1, -0.6}, 0.18}},
                                                    {"spine1", {{0, 1.12, -0.35}, 0.18}},
                                                    {"spine2", {{0, 1.12, -0.1}, 0.19}},
                                                    {"spine3", {{0, 1.12, 0.15}, 0.2}},
                                                    {"chest", {{0, 1.12, 0.4}, 0.18}},
                                                    {"neck1", {{0, 1.2, 0.6}, 0.13}},
                                                    {"neck2", {{0, 1.35, 0.7}, 0.11}},
                                                    {"neck3", {{0, 1.5, 0.8}, 0.1}},
                                                    {"head", {{0, 1.62, 0.9}, 0.1, {0, 0, 0.3}}},
                                                    {"jaw", {{0, 1.52, 0.95}, 0.05, {0, -0.05, 0.2}}},
                                                    {"l_ear", {{0.07, 1.72, 0.9}, 0.03, {0.02, 0.15, 0}}},
                                                    {"tail1", {{0, 1.1, -0.8}, 0.05}},
                                                    {"tail2", {{0, 1.0, -0.9}, 0.04}},
                                                    {"tail3", {{0, 0.87, -0.97}, 0.04}},
                                                    {"tail4", {{0, 0.73, -1.0}, 0.03}},
                                                    {"tail5", {{0, 0.6, -1.02}, 0.03, {0, -0.15, 0}}},
                                                    {"l_scapula", {{0.13, 1.2, 0.4}, 0.1}},
                                                    {"l_shoulder", {{0.16, 0.95, 0.5}, 0.09}},
                                                    {"l_elbow", {{0.16, 0.72, 0.42}, 0.06}},
                                                    {"l_wrist", {{0.16, 0.38, 0.45}, 0.05}},
                                                    {"l_forefoot", {{0.16, 0.1, 0.45}, 0.05, {0, -0.06, 0.1}}},
                                                    {"l_hip", {{0.14, 1.05, -0.6}, 0.11}},
                                                    {"l_knee", {{0.15, 0.75, -0.5}, 0.07}},
                                                    {"l_hock", {{0.15, 0.42, -0.68}, 0.05}},
                                                    {"l_hindfoot", {{0.15, 0.1, -0.62}, 0.05, {0, -0.06, 0.1}}}};
  return all;
}
inline RestJoint rest_joint(const npt::BodyPlan& plan, std::size_t j) {
  if (plan.side(j) >= 0) return rest_joints().at(plan.joints[j].name);
  RestJoint left = rest_joints().at(plan.joints[plan.joints[j].mirrored].name);
  left.place.x = -left.place.x, left.tip.x = -left.tip.x;
  return left;
}

/// One closed piece for each joint; one shape, the size.
inline npt::BodyTables tables_of(const npt::BodyPlan& plan) {
  constexpr std::uint32_t around = 10, rings = 6;
  npt::BodyTables body;
  body.parents = plan.parents();
  const std::size_t joints = plan.joint_count();
  body.weights.columns = joints;
  const std::uint32_t vertices = static_cast<std::uint32_t>(joints) * (around * rings + 2);
  body.J_regressor.columns = vertices;
  for (std::size_t j = 0; j < joints; ++j) {
    const RestJoint rest = rest_joint(plan, j);
    const Vec3d bone = rest.tip != Vec3d{} ? rest.tip : rest_joint(plan, plan.joints[j].toward).place - rest.place;
    const Vec3d along = normalised(bone), aside = normalised(cross(along, Vec3d{0.2, 0.3, 1})),
                up = cross(along, aside);
    const auto first = static_cast<std::uint32_t>(body.v_template.size() / 3);
    const auto add = [&](Vec3d p, double share) {
      for (const double x : {p.x, p.y, p.z}) body.v_template.push_back(static_cast<float>(x));
      for (const double x : {p.x, p.y, p.z}) body.shapedirs.push_back(static_cast<float>(0.1 * x));
      // Skin fades over from the parent's.
      const float own = j == 0 ? 1.0F : static_cast<float>(std::min(1.0, 0.5 + 2 * share));
      if (own < 1) body.weights.append(static_cast<std::uint32_t>(body.parents[j]), 1 - own);
      body.weights.append(static_cast<std::uint32_t>(j), own);
      body.weights.end_row();
    };
    for (std::uint32_t r = 0; r < rings; ++r)
      for (std::uint32_t a = 0; a < around; ++a) {
        const double angle = 2 * std::numbers::pi * a / around, share = static_cast<double>(r) / (rings - 1);
        const double thick = rest.radius * (r == 0 || r + 1 == rings ? 0.8 : 1);
        add(rest.place + bone * share + aside * (0.7 * thick * std::cos(angle)) + up * (thick * std::sin(angle)),
            share);
      }
    add(rest.place - along * (0.6 * rest.radius), 0);
    add(rest.place + bone + along * (0.6 * rest.radius), 1);
    const std::uint32_t start = first + around * rings, end = start + 1;
    for (std::uint32_t a = 0; a < around; ++a) {
      const std::uint32_t b = (a + 1) % around, last = first + around * (rings - 1);
      for (std::uint32_t r = 0; r + 1 < rings; ++r) {
        const std::uint32_t low = first + around * r, high = low + around;
        body.triangles.push_back({low + a, low + b, high + a});
        body.triangles.push_back({low + b, high + b, high + a});
      }
      body.triangles.push_back({start, first + b, first + a});
      body.triangles.push_back({end, last + a, last + b});
    }
    for (std::uint32_t a = 0; a < around; ++a) body.J_regressor.append(first + a, 1.0F / around);
    body.J_regressor.end_row();
  }
  return body;
}

inline std::vector<float> draw_pose(const npt::BodyPlan& plan, npt::Random& random) {
  std::vector<float> pose;
  for (std::size_t j = 0; j < plan.joint_count(); ++j) {
    const npt::JointKind kind = plan.joints[j].kind;
    const bool leg = plan.side(j) != 0 && (kind == npt::JointKind::bone || kind == npt::JointKind::end);
    const double swing = j == 0 ? 0.1 : leg ? 0.4 : kind == npt::JointKind::spine ? 0.06 : 0.15;
    for (const double share : {1.0, 0.3, 0.3}) pose.push_back(static_cast<float>(share * swing * random.normal()));
  }
  return pose;
}

inline const std::shared_ptr<const npt::BodyKind>& kind() {
  static const std::shared_ptr<const npt::BodyKind> shared = [] {
    const std::string path = NPT_SOURCE_DIR "/examples/sculpt/quadruped.plan";
    auto own = std::make_shared<npt::BodyKind>();
    own->plan = npt::read_body_plan(npt::read_file(path), path);
    own->body = std::make_shared<const npt::BodyModel>(tables_of(own->plan), "four legs");
    npt::Random random(5);
    for (int i = 0; i < 1000; ++i) own->poses.push_back(draw_pose(own->plan, random));
    own->moments = npt::moments_of(own->poses);
    for (const npt::JointPlan& joint : own->plan.joints) own->skeleton_names.push_back(joint.name);
    return own;
  }();
  return shared;
}

struct Posed {
  npt::BodyFit truth;
  std::vector<Vec3d> points;
  npt::SampledSurface surface;
};

inline Posed draw(std::uint64_t seed) {
  npt::Random random(77, seed);
  npt::BodyFit truth;
  truth.axis_angles = draw_pose(kind()->plan, random);
  truth.betas = {static_cast<float>(0.5 * random.normal())};
  simulated::turn(truth.axis_angles, random.uniform(-std::numbers::pi, std::numbers::pi));
  std::vector<Vec3d> points = npt::fitted_points(*kind()->body, truth);
  npt::SampledSurface surface(points, kind()->body->triangles());
  return {std::move(truth), std::move(points), std::move(surface)};
}

/// Right places but for noise of so many metres and a share of wild ones; those of one pair of limbs mirrored, if any.
inline npt::Correspondences read(const Posed& posed, double noise, double wild, std::uint64_t seed,
                                 const npt::LimbPair* mirrored = nullptr) {
  const npt::BodyModel& body = *kind()->body;
  npt::Random random(78, seed);
  const npt::TriangleTree tree(posed.points, body.triangles());
  const std::vector<std::uint32_t> parts = body.tables().weights.heaviest_columns();
  const auto rest = [&body](std::size_t v) {
    const float* p = &body.tables().v_template[3 * v];
    return npt::Vec3f{p[0], p[1], p[2]}.as<double>();
  };
  npt::Correspondences reading;
  for (const npt::SampledSurface::Sample& s : posed.surface.samples().first(1000)) {
    const npt::ClosestPoint at = tree.closest(s.point);
    npt::PointCorrespondence& p = reading.emplace_back();
    p.point = s.point, p.normal = s.normal;
    const npt::Triangle& t = body.triangles()[at.triangle];
    for (std::size_t k = 0; k < 3; ++k) p.place += rest(t[k]) * at.weights[k];
    for (std::size_t side = 0; mirrored != nullptr && side < 2; ++side)
      if (std::ranges::count(mirrored->joints[side], parts[t[0]]) > 0) p.place.x = -p.place.x;
    p.place += Vec3d{random.normal(), random.normal(), random.normal()} * noise;
    if (random.uniform() < wild) p.place = rest(random.below(static_cast<std::uint32_t>(body.vertex_count())));
  }
  return reading;
}

inline double error(const npt::BodyFit& fit, const Posed& posed) {
  return simulated::error(*kind()->body, fit, posed.points);
}

}  // namespace four_legged
