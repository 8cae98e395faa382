/// Places that every body in SMPL's layout has, as vertices: the markers of the paper's comparison, 5 or 13 of them.
/// Point i of one body belongs to point i of any other, and for one body model the vertices are the same whatever shape
/// and pose.
///   5   crown, hands, feet
///   13  and shoulders, elbows, hips, knees
/// A point is the vertex of the template that lies farthest from a joint in a direction, four times its distance from
/// the line in that direction counting against it: a finger tip, the front of a knee.
/// Errors    npt::Error for a body without the 24 joints, and for another number of points
/// Source    Wang et al., CVPR 2020, section 4.2, names the numbers 5 and 13 but not the points
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/deformation/markers.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/mesh/points.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

struct ControlPoint {
  std::string_view name;
  SmplJoint joint{};
  Vec3d direction;  ///< in the rest pose: x to the body's left, y up, z to the front
};

/// The first five are the smaller set.
inline constexpr std::array<ControlPoint, 13> body_control_points{
    {{"crown", SmplJoint::head, {0, 1, 0}},
     {"left hand", SmplJoint::left_hand, {1, 0, 0}},
     {"right hand", SmplJoint::right_hand, {-1, 0, 0}},
     {"left foot", SmplJoint::left_foot, {0, 0, 1}},
     {"right foot", SmplJoint::right_foot, {0, 0, 1}},
     {"left shoulder", SmplJoint::left_shoulder, {0, 1, 0}},
     {"right shoulder", SmplJoint::right_shoulder, {0, 1, 0}},
     {"left elbow", SmplJoint::left_elbow, {0, 0, -1}},
     {"right elbow", SmplJoint::right_elbow, {0, 0, -1}},
     {"left hip", SmplJoint::left_hip, {1, 0, 0}},
     {"right hip", SmplJoint::right_hip, {-1, 0, 0}},
     {"left knee", SmplJoint::left_knee, {0, 0, 1}},
     {"right knee", SmplJoint::right_knee, {0, 0, 1}}}};

/// The body's vertices at the first `count` control points, 5 or 13.
inline std::vector<std::uint32_t> control_vertices(const BodyModel& body, std::size_t count) {
  if (count != 5 && count != 13)
    throw Error({.file = "control points", .found = std::to_string(count), .expected = "5 or 13"});
  if (body.joint_count() != smpl_joint_count)
    throw Error({.file = "body",
                 .found = std::to_string(body.joint_count()) + " joints",
                 .expected = std::to_string(smpl_joint_count) + ", where control points are known"});
  const std::span<const float> xyz = body.tables().v_template;
  const std::vector<Vec3d> joints = body.joints({});
  std::vector<std::uint32_t> vertices;
  for (const ControlPoint& point : std::span(body_control_points).first(count)) {
    std::uint32_t best = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (std::uint32_t v = 0; v < body.vertex_count(); ++v) {
      const Vec3d from_joint = point_at(xyz, v) - joints[joint_index(point.joint)];
      const double along = dot(from_joint, point.direction);
      const double merit = along - 4 * length(from_joint - point.direction * along);
      if (merit > most) most = merit, best = v;
    }
    vertices.push_back(best);
  }
  return vertices;
}

/// Markers between two bodies' own vertices.
inline std::vector<Marker> control_markers(const BodyModel& source, const BodyModel& target, std::size_t count) {
  const std::vector<std::uint32_t> from = control_vertices(source, count), to = control_vertices(target, count);
  std::vector<Marker> markers;
  for (std::size_t i = 0; i < count; ++i) markers.push_back({from[i], to[i]});
  return markers;
}

}  // namespace npt::inline NPT_ABI
