/// The surface of a person in the rest pose, with SMPL's joints and weights, and what is measured on each of its parts:
/// a rigged character's, and the mannequin's, onto which it is stretched.
/// Units     metres
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

namespace rig::internal {

using JointWeights = std::array<double, smpl_joint_count>;

/// The part's child bone along which it points; itself for what has none.
inline std::size_t bone_end(std::size_t joint) {
  static constexpr std::array<std::size_t, smpl_joint_count> ends{3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 10, 11,
                                                                  15, 16, 17, 15, 18, 19, 20, 21, 22, 23, 22, 23};
  return ends[joint];
}

inline bool is_trunk(std::size_t j) { return j == 0 || j == 3 || j == 6 || j == 9; }
inline bool is_collar(std::size_t j) { return j == 13 || j == 14; }
inline bool is_hand(std::size_t j) { return j >= 20; }
inline bool is_foot(std::size_t j) { return j == 7 || j == 8 || j == 10 || j == 11; }

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
  std::array<Vec3d, smpl_joint_count> joints;
  std::array<Spread, smpl_joint_count> spread;  ///< hands and feet: of wrist and hand, ankle and toes, together

  void measure(std::span<const Triangle> triangles, const std::vector<bool>& left_out) {
    normals.assign(points.size(), {});
    areas.assign(points.size(), 0);
    for (const Triangle& t : triangles) {
      const Vec3d normal = cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
      for (const std::uint32_t v : t) normals[v] += normal, areas[v] += length(normal) / 6;
    }
    for (Vec3d& n : normals) n = normalised(n);
    for (std::size_t part = 0; part < smpl_joint_count; ++part) {
      Spread& s = spread[part];
      const Vec3d along = normalised(joints[bone_end(part)] - joints[part]);
      const auto each = [&](auto&& f) {
        for (std::size_t v = 0; v < points.size(); ++v) {
          double w = weights[v][part];
          if (is_hand(part)) w = weights[v][20 + part % 2] + weights[v][22 + part % 2];
          if (is_foot(part)) w = weights[v][part % 3 == 1 ? 7 : 8] + weights[v][part % 3 == 1 ? 10 : 11];
          if (!left_out.empty() && left_out[v]) w = 0;
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

inline RestSurface measured_mannequin() {
  RestSurface s;
  const BodyTables& t = mannequin().tables();
  for (std::size_t v = 0; v < t.vertex_count(); ++v) {
    s.points.push_back(Vec3f{t.v_template[3 * v], t.v_template[3 * v + 1], t.v_template[3 * v + 2]}.as<double>());
    JointWeights& row = s.weights.emplace_back();
    for (std::size_t i = t.weights.start[v]; i < t.weights.start[v + 1]; ++i)
      row[t.weights.column[i]] += static_cast<double>(t.weights.value[i]);
  }
  const std::vector<Vec3d> joints = mannequin().joints({});
  std::ranges::copy(joints, s.joints.begin());
  s.measure(t.triangles, {});
  return s;
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
