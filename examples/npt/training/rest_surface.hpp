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
  using enum SmplJoint;
  static constexpr std::array<SmplJoint, smpl_joint_count> ends{
      spine1,     left_knee,   right_knee, spine2,      left_ankle, right_ankle,   spine3,         left_foot,
      right_foot, neck,        left_foot,  right_foot,  head,       left_shoulder, right_shoulder, head,
      left_elbow, right_elbow, left_wrist, right_wrist, left_hand,  right_hand,    left_hand,      right_hand};
  return joint_index(ends[joint]);
}

inline bool is_trunk(std::size_t j) {
  return is_joint(j, SmplJoint::pelvis, SmplJoint::spine1, SmplJoint::spine2, SmplJoint::spine3);
}
inline bool is_collar(std::size_t j) { return is_joint(j, SmplJoint::left_collar, SmplJoint::right_collar); }
inline bool is_left_hand(std::size_t j) { return is_joint(j, SmplJoint::left_wrist, SmplJoint::left_hand); }
inline bool is_right_hand(std::size_t j) { return is_joint(j, SmplJoint::right_wrist, SmplJoint::right_hand); }
inline bool is_hand(std::size_t j) { return is_left_hand(j) || is_right_hand(j); }
inline bool is_left_foot(std::size_t j) { return is_joint(j, SmplJoint::left_ankle, SmplJoint::left_foot); }
inline bool is_right_foot(std::size_t j) { return is_joint(j, SmplJoint::right_ankle, SmplJoint::right_foot); }
inline bool is_foot(std::size_t j) { return is_left_foot(j) || is_right_foot(j); }

/// A row's weight of a part; of a hand or a foot with what it ends in.
inline double part_weight(const JointWeights& row, std::size_t part) {
  using enum SmplJoint;
  const auto both = [&row](SmplJoint a, SmplJoint b) { return row[joint_index(a)] + row[joint_index(b)]; };
  if (is_left_hand(part)) return both(left_wrist, left_hand);
  if (is_right_hand(part)) return both(right_wrist, right_hand);
  if (is_left_foot(part)) return both(left_ankle, left_foot);
  if (is_right_foot(part)) return both(right_ankle, right_foot);
  return row[part];
}

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
          const double w = !left_out.empty() && left_out[v] ? 0 : part_weight(weights[v], part);
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
