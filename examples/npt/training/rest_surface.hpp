/// The surface of a body in the rest pose, with a plan's joints and weights, and what is measured on each of its parts:
/// a rigged character's, and the template's, onto which it is stretched.
/// Shapes    points, normals, areas, weights: [V]; joints, spread: [J]
/// Units     metres
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <training/plan_parts.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

namespace rig::internal {

using JointWeights = std::vector<double>;  ///< [J]

/// Mean and spread of the points of a part.
struct Spread {
  double area = 0;
  Vec3d mean, deviation;
  double girth = 0;  ///< root mean square distance from the bone
};

/// A surface in the rest pose with what is measured on it.
struct RestSurface {
  std::vector<Vec3d> points, normals;
  std::vector<double> areas;  ///< of each vertex
  std::vector<JointWeights> weights;
  std::vector<bool> appendage;  ///< [V] or empty: of an ear or the like for the most part
  std::vector<Vec3d> joints;
  std::vector<Spread> spread;  ///< hands and feet: of wrist and hand, ankle and toes, together

  void measure(const PlanParts& parts, std::span<const Triangle> triangles, const std::vector<bool>& left_out) {
    normals.assign(points.size(), {});
    areas.assign(points.size(), 0);
    for (const Triangle& t : triangles) {
      const Vec3d normal = cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
      for (const std::uint32_t v : t) normals[v] += normal, areas[v] += length(normal) / 6;
    }
    for (Vec3d& n : normals) n = normalised(n);
    spread.assign(parts.count(), {});
    for (std::size_t part = 0; part < parts.count(); ++part) {
      Spread& s = spread[part];
      const Vec3d along = normalised(joints[parts.toward(part)] - joints[part]);
      const auto each = [&](auto&& f) {
        for (std::size_t v = 0; v < points.size(); ++v) {
          const double w = !left_out.empty() && left_out[v] ? 0 : parts.weight(weights[v], part);
          if (w > 0.5) f(points[v], w * areas[v]);
        }
      };
      each([&](Vec3d p, double w) {
        const Vec3d off = p - joints[part];
        s.area += w, s.mean += p * w;
        s.girth += w * dot(off - along * dot(off, along), off - along * dot(off, along));
      });
      if (!(s.area > 0)) continue;
      s.mean = s.mean / s.area, s.girth = std::sqrt(s.girth / s.area);
      each([&](Vec3d p, double w) {
        const Vec3d off = p - s.mean;
        s.deviation += Vec3d{off.x * off.x, off.y * off.y, off.z * off.z} * (w / s.area);
      });
      s.deviation = {std::sqrt(s.deviation.x), std::sqrt(s.deviation.y), std::sqrt(s.deviation.z)};
    }
  }
};

/// Of a template, not measured yet.
inline RestSurface rest_surface(const BodyModel& body) {
  RestSurface s;
  const BodyTables& t = body.tables();
  for (std::size_t v = 0; v < t.vertex_count(); ++v) {
    s.points.push_back(Vec3f{t.v_template[3 * v], t.v_template[3 * v + 1], t.v_template[3 * v + 2]}.as<double>());
    JointWeights& row = s.weights.emplace_back(body.joint_count());
    for (std::size_t i = t.weights.start[v]; i < t.weights.start[v + 1]; ++i)
      row[t.weights.column[i]] += static_cast<double>(t.weights.value[i]);
  }
  s.joints = body.joints({});
  return s;
}

inline double lowest(const RestSurface& s) {
  return std::ranges::min(s.points, {}, [](Vec3d p) { return p.y; }).y;
}

/// The rotation that takes one direction to another by the shortest way. Requires unit vectors.
inline Matrix3 shortest_turn(Vec3d from, Vec3d to) {
  const Vec3d axis = cross(from, to);
  const double sine = length(axis), cosine = dot(from, to);
  if (sine > 1e-9) return rotation_matrix(axis * (std::atan2(sine, cosine) / sine));
  if (cosine > 0) return Matrix3::identity();
  const Vec3d side = std::abs(from.x) < 0.9 ? Vec3d{1, 0, 0} : Vec3d{0, 0, 1};
  return rotation_matrix(normalised(cross(from, side)) * std::numbers::pi);
}

}  // namespace rig::internal

}  // namespace npt::inline NPT_ABI
