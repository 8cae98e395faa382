/// How the four-legged template's skin follows its bones: each vertex belongs to the part in whose region it lies; the
/// memberships then diffuse over the surface, about a limb's thickness wide, which makes them smooth and local: what is
/// near in space but far along the skin, as a leg and the belly, stays apart.
/// Shapes    weights [V, J], at most 5 entries a row; regressor [J, V]
/// Source    diffusion of weights over the surface: after Baran and Popović, "Automatic rigging and animation of 3D
///           characters", SIGGRAPH 2007, here by explicit steps from regions instead of distances
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/mannequin/skin.hpp>
#include <npt/body/mannequin/surface.hpp>
#include <npt/body/sparse_matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <sculpt/quadruped/anatomy.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace sculpt::quadruped {

inline Vec3d place_of(std::string_view joint) {
  for (const JointPlace& place : joint_places)
    if (place.joint == joint) return place.position;
  throw std::logic_error("no place of joint " + std::string(joint));
}

/// Whether p lies beyond the plane through a joint, across `direction`, moved along it by `by`.
inline bool beyond(Vec3d p, std::string_view joint, Vec3d direction, double by = 0) {
  return dot(p - place_of(joint), npt::normalised(direction)) > by;
}

/// Distance from a segment, seen from the side.
inline double side_distance(Vec3d p, Vec3d a, Vec3d b) {
  p.x = a.x = b.x = 0;
  const Vec3d d = b - a;
  return length(p - a - d * std::clamp(dot(p - a, d) / dot(d, d), 0.0, 1.0));
}

inline std::string_view hindleg_part(Vec3d q) {
  if (!beyond(q, "l_knee", {0, -0.95, -0.2})) return "l_hip";
  if (!beyond(q, "l_hock", {0, -0.90, -0.43})) return "l_knee";
  return beyond(q, "l_hindfoot", {0, -0.75, 0.65}) ? "l_hindfoot" : "l_hock";
}

inline std::string_view foreleg_part(Vec3d q) {
  if (!beyond(q, "l_wrist", {0, -1, 0})) return "l_elbow";
  return beyond(q, "l_forefoot", {0, -0.75, 0.65}) ? "l_forefoot" : "l_wrist";
}

inline std::string_view head_part(Vec3d q) {
  const Vec3d from_ear = q - ear_base, axis = npt::normalised(ear_axis);
  const double along_ear = dot(from_ear, axis);
  if (along_ear > 0.004 && length(from_ear - axis * along_ear) < 0.045) return "l_ear";
  const Vec3d h = q - head_frame.origin;
  const double t = dot(h, head_frame.axis), v = dot(h, head_frame.v);
  // The mouth's line rises a little from its corner to the lips.
  return t > 0.075 && v < -0.036 + 0.06 * (t - 0.10) - 0.4 * std::max(0.11 - t, 0.0) ? "jaw" : "head";
}

/// The part to whose bone a point of the left half belongs most.
inline std::string_view part_of(Vec3d q) {
  // Tail, neck and head stand off the trunk's ends.
  if (beyond(q, "tail1", {0, -0.25, -0.97}, 0.005) && q.x < 0.05 && q.z < -0.44 && q.y > 0.30) {
    for (const std::string_view joint : {"tail5", "tail4", "tail3", "tail2"})
      if (beyond(q, joint, tail_frame.axis)) return joint;
    return "tail1";
  }
  if (q.y > 0.60 && beyond(q, "head", {0, 0.10, 0.99}, -0.035)) return head_part(q);
  for (const std::string_view joint : {"neck3", "neck2", "neck1"})
    if (q.y > 0.52 && beyond(q, joint, neck_frame.axis)) return joint;
  // Hind leg: below the hip, behind the fold of the flank, beside the crotch.
  if (q.z < -0.10 && (q.y < 0.44 || (q.x > 0.035 && q.z < -0.150 && beyond(q, "l_hip", {0, -0.92, 0.39}, -0.01))))
    return hindleg_part(q);
  if (q.z > 0.10) {
    const Vec3d scapula = place_of("l_scapula"), shoulder = place_of("l_shoulder"), elbow = place_of("l_elbow");
    const bool below = beyond(q, "l_elbow", {0, -0.97, -0.2}) && q.x > 0.03;
    if (below && (q.y < 0.385 || side_distance(q, elbow, place_of("l_wrist")) < 0.075)) return foreleg_part(q);
    const double blade = side_distance(q, scapula, shoulder), arm = side_distance(q, shoulder, elbow);
    if (q.x > 0.055 && std::min(blade - 0.070, arm - 0.070) < 0) return blade < arm ? "l_scapula" : "l_shoulder";
  }
  for (const std::string_view joint : {"chest", "spine3", "spine2", "spine1"})
    if (q.z > place_of(joint).z) return joint;
  return "pelvis";
}

/// How widely a part's weights blend into others': a standard deviation, about a third of its thickness.
inline double blend_width(npt::JointKind kind, std::string_view part) {
  if (part.find("ear") != part.npos || part == "jaw") return 0.009;
  if (part == "l_hip") return 0.044;
  if (part == "l_scapula" || part == "l_shoulder") return 0.036;
  switch (kind) {
    case npt::JointKind::root:
    case npt::JointKind::spine:
      return 0.045;
    case npt::JointKind::neck:
      return 0.034;
    case npt::JointKind::head:
      return 0.024;
    case npt::JointKind::tip:
      return 0.013;
    default:
      return 0.020;
  }
}

/// [V, J] dense memberships, diffused.
inline std::vector<double> diffused_memberships(const npt::anatomy::Surface& surface, const npt::BodyPlan& plan) {
  const std::size_t n = surface.positions.size(), joints = plan.joint_count();
  std::vector<std::vector<std::uint32_t>> ring(n);
  for (const auto& t : surface.triangles)
    for (std::size_t k = 0; k < 3; ++k) ring[t[k]].push_back(t[(k + 1) % 3]);
  std::vector<double> w(n * joints, 0.0), width(n);
  for (std::size_t v = 0; v < n; ++v) {
    const Vec3d p = surface.positions[v];
    const std::string part(part_of({std::abs(p.x), p.y, p.z}));
    const std::size_t left = plan.joint(part), j = p.x < 0 ? plan.joints[left].mirrored : left;
    w[v * joints + j] = 1;
    width[v] = blend_width(plan.joints[j].kind, part);
  }
  // The widths themselves must not jump from part to part.
  for (int step = 0; step < 4; ++step) {
    std::vector<double> next = width;
    for (std::size_t v = 0; v < n; ++v) {
      for (const std::uint32_t u : ring[v]) next[v] += width[u];
      next[v] /= static_cast<double>(ring[v].size() + 1);
    }
    width = next;
  }
  // A full step towards the neighbours' mean has half their mean square distance as its variance.
  constexpr int steps = 24;
  std::vector<double> rate(n);
  for (std::size_t v = 0; v < n; ++v) {
    double square = 0;
    for (const std::uint32_t u : ring[v])
      square += dot(surface.positions[u] - surface.positions[v], surface.positions[u] - surface.positions[v]);
    square /= static_cast<double>(ring[v].size());
    rate[v] = std::min(2 * width[v] * width[v] / (square * steps), 0.7);
  }
  std::vector<double> next(w.size());
  for (int step = 0; step < steps; ++step) {
    for (std::size_t v = 0; v < n; ++v) {
      const double x = surface.positions[v].x;
      double sum = 0;
      for (std::size_t j = 0; j < joints; ++j) {
        double mean = 0;
        for (const std::uint32_t u : ring[v]) mean += w[u * joints + j];
        mean /= static_cast<double>(ring[v].size());
        const double now = w[v * joints + j];
        double value = now + rate[v] * (mean - now);
        // What moves one side moves nothing of the other one.
        const int side = plan.side(j);
        if (side * x <= 0 && side != 0) value = 0;
        next[v * joints + j] = value;
        sum += value;
      }
      for (std::size_t j = 0; j < joints; ++j) next[v * joints + j] /= sum;
    }
    w.swap(next);
  }
  return w;
}

/// [V, J], at most `bones` entries a row, and of mirrored vertices the same ones.
inline npt::SparseMatrix skin_weights(const npt::anatomy::Surface& surface, const npt::BodyPlan& plan,
                                      std::size_t bones = 5) {
  const std::vector<double> w = diffused_memberships(surface, plan);
  const std::size_t joints = plan.joint_count();
  npt::SparseMatrix result;
  result.columns = joints;
  for (std::size_t v = 0; v < surface.positions.size(); ++v) {
    const bool right = surface.positions[v].x < 0;
    std::vector<double> row(joints);
    for (std::size_t j = 0; j < joints; ++j)
      row[j] = right ? w[surface.mirror[v] * joints + plan.joints[j].mirrored] : w[v * joints + j];
    // In the middle both sides count alike.
    if (surface.positions[v].x == 0)
      for (std::size_t j = 0; j < joints; ++j)
        row[j] = (w[v * joints + j] + w[v * joints + plan.joints[j].mirrored]) / 2;
    std::vector<double> sorted = row;
    std::ranges::sort(sorted, std::greater<>());
    const double least = std::max(sorted[bones - 1], 4e-3);
    double sum = 0;
    for (const double x : row) sum += x >= least ? x : 0;
    for (std::uint32_t j = 0; j < joints; ++j)
      if (row[j] >= least) result.append(j, static_cast<float>(row[j] / sum));
    result.end_row();
  }
  return result;
}

/// [J, V] Each joint as an average of the skin around it that follows it or its parent.
inline npt::SparseMatrix joint_regressor(const npt::anatomy::Surface& surface, const npt::SparseMatrix& weights,
                                         const npt::BodyPlan& plan) {
  const std::size_t n = surface.positions.size(), joints = plan.joint_count();
  std::vector<float> dense(joints * n, 0.0F);
  for (const JointPlace& place : joint_places) {
    const std::size_t row = plan.joint(place.joint), twin = plan.joints[row].mirrored;
    std::vector<std::uint32_t> ring;
    std::vector<Vec3d> points;
    std::vector<double> prior;
    for (std::uint32_t v = 0; v < n; ++v) {
      const Vec3d d = surface.positions[v] - place.position;
      const double rest = 1.0 - dot(d, d) / (place.reach * place.reach);
      if (rest <= 0.0) continue;
      double follows = 0;
      for (std::size_t i = 0; i < weights.columns_of(v).size(); ++i) {
        const auto j = static_cast<int>(weights.columns_of(v)[i]);
        if (j == static_cast<int>(row) || j == plan.joints[row].parent)
          follows += static_cast<double>(weights.values_of(v)[i]);
      }
      if (follows < 0.05) continue;
      ring.push_back(v);
      points.push_back(surface.positions[v]);
      prior.push_back(rest * follows);
    }
    const std::vector<double> w =
        npt::anatomy::convex_weights(npt::as_span(points), npt::as_span(prior), place.position);
    Vec3d mean{};
    for (std::size_t i = 0; i < ring.size(); ++i) mean += points[i] * w[i];
    if (!(length(mean - place.position) < 1e-6))
      throw std::logic_error("the skin around joint " + std::string(place.joint) + " doesn't enclose it");
    for (std::size_t i = 0; i < ring.size(); ++i) {
      if (twin == row) {  // in the middle: both sides alike
        dense[row * n + ring[i]] += static_cast<float>(w[i] / 2);
        dense[row * n + surface.mirror[ring[i]]] += static_cast<float>(w[i] / 2);
      } else {
        dense[row * n + ring[i]] = static_cast<float>(w[i]);
        dense[twin * n + surface.mirror[ring[i]]] = static_cast<float>(w[i]);
      }
    }
  }
  return npt::SparseMatrix::from_dense(npt::as_span(dense), joints, n);
}

}  // namespace sculpt::quadruped
