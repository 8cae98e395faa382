/// Poses that people take and that training has few of: handstands, push-ups, sitting cross-legged, bows, crouching,
/// lying, cartwheels. Each is written by the directions of its limbs, in the trunk's own axes: x to the body's left, y
/// to its head, z to its front.
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/skeleton.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

namespace poses {

struct UnusualPose {
  std::string name;
  std::array<float, 3 * npt::smpl_joint_count> angles{};
};

/// Builds the angles of a pose from the T pose.
class PoseBuilder {
 public:
  explicit PoseBuilder(std::string name) { pose_.name = std::move(name); }

  /// Axis angle.
  PoseBuilder& turn(npt::SmplJoint joint, npt::Vec3d angle) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double parts[3] = {angle.x, angle.y, angle.z};
      pose_.angles[3 * npt::joint_index(joint) + k] = static_cast<float>(parts[k]);
    }
    return *this;
  }
  /// Bends the back forwards, a third at each joint of it.
  PoseBuilder& back(double bend) {
    for (const auto joint : {npt::SmplJoint::spine1, npt::SmplJoint::spine2, npt::SmplJoint::spine3})
      turn(joint, {bend / 3, 0, 0});
    return *this;
  }
  /// Which way thighs and shins point; side: 1 left, -1 right.
  PoseBuilder& leg(int side, npt::Vec3d thigh, npt::Vec3d shin) {
    using enum npt::SmplJoint;
    return limb(side > 0 ? left_hip : right_hip, side > 0 ? left_knee : right_knee, {0, -1, 0}, {1, 0, 0}, thigh, shin);
  }
  PoseBuilder& legs(npt::Vec3d thigh, npt::Vec3d shin) {
    return leg(1, thigh, shin).leg(-1, {-thigh.x, thigh.y, thigh.z}, {-shin.x, shin.y, shin.z});
  }
  PoseBuilder& legs(npt::Vec3d both) { return legs(both, both); }
  PoseBuilder& arm(int side, npt::Vec3d upper, npt::Vec3d lower) {
    using enum npt::SmplJoint;
    const double s = side;
    return limb(side > 0 ? left_shoulder : right_shoulder, side > 0 ? left_elbow : right_elbow, {s, 0, 0}, {0, -s, 0},
                upper, lower);
  }
  PoseBuilder& arms(npt::Vec3d upper, npt::Vec3d lower) {
    return arm(1, upper, lower).arm(-1, {-upper.x, upper.y, upper.z}, {-lower.x, lower.y, lower.z});
  }
  PoseBuilder& arms(npt::Vec3d both) { return arms(both, both); }

  operator UnusualPose() const { return pose_; }

 private:
  /// rest: the direction of the limb in the T pose; hinge: the axis about which its middle joint bends.
  PoseBuilder& limb(npt::SmplJoint root, npt::SmplJoint middle, npt::Vec3d rest, npt::Vec3d hinge, npt::Vec3d upper,
                    npt::Vec3d lower) {
    upper = npt::normalised(upper), lower = npt::normalised(lower);
    const npt::Vec3d across = cross(upper, lower);
    npt::Matrix3 turned;
    if (npt::length(across) < 1e-6) {
      const npt::Vec3d axis = cross(rest, upper);
      const double sine = npt::length(axis);
      turned = npt::rotation_matrix(sine < 1e-9 ? npt::Vec3d{} : axis * (std::atan2(sine, dot(rest, upper)) / sine));
    } else {
      const npt::Vec3d h = npt::normalised(across);
      const auto from = npt::Matrix3::from_columns(rest, hinge, cross(rest, hinge));
      const auto to = npt::Matrix3::from_columns(upper, h, cross(upper, h));
      turned = to * from.transposed();
    }
    turn(root, npt::axis_angle(turned));
    return turn(middle, hinge * std::atan2(npt::length(across), dot(upper, lower)));
  }

  UnusualPose pose_;
};

inline std::vector<UnusualPose> unusual_poses() {
  using npt::SmplJoint;
  using npt::Vec3d;
  constexpr double half = std::numbers::pi, quarter = half / 2;
  const auto pose = [](std::string name, Vec3d root) {
    return PoseBuilder(std::move(name)).turn(SmplJoint::pelvis, root);
  };
  const Vec3d down{0.06, -1, 0}, up{0.05, 1, 0}, side{0.15, -1, 0};
  const auto feet = [](PoseBuilder builder, double bend) {
    return builder.turn(SmplJoint::left_ankle, {bend, 0, 0}).turn(SmplJoint::right_ankle, {bend, 0, 0});
  };
  return {
      feet(pose("handstand", {half, 0, 0}).legs(down).arms(up), 0.7),
      pose("handstand, from the front", {0, 0, half}).legs(down).arms(up),
      pose("handstand, legs split", {half, 0, 0})
          .leg(1, {0.1, -0.6, 0.8}, {0.1, -0.6, 0.8})
          .leg(-1, {-0.1, -0.8, -0.6}, {-0.1, -0.8, -0.6})
          .arms(up),
      pose("handstand, knees bent", {half, 0, 0}).legs({0.1, -0.7, 0.7}, {0, -0.6, -0.8}).arms(up),
      pose("handstand, knees to the chest", {half, 0, 0}).back(0.4).legs({0.1, 0.1, 1}, {0, -1, -0.2}).arms(up),
      pose("handstand, feet over the head", {half, 0, 0}).back(-0.6).legs({0.1, -0.8, -0.6}, {0, 0.1, -1}).arms(up),
      pose("headstand", {half, 0, 0}).legs(down).arms({0.45, 0.75, 0.5}, {-0.5, 0.5, -0.2}),
      feet(pose("push-up, high", {quarter - 0.3, 0, 0}).legs(down).arms({0.1, 0.3, 0.95}), -0.4),
      feet(pose("push-up, low", {quarter - 0.08, 0, 0}).legs(down).arms({0.85, -0.5, -0.1}, {-0.1, 0.1, 1}), -0.5),
      pose("cross-legged", {0, 0, 0})
          .legs({0.75, -0.15, 0.65}, {-0.9, -0.2, 0.2})
          .arms({0.35, -0.85, 0.3}, {0.25, -0.3, 0.9}),
      pose("cross-legged, hands together", {0, 0, 0})
          .legs({0.75, -0.15, 0.65}, {-0.9, -0.2, 0.2})
          .arms({0.25, -0.9, 0.25}, {-0.65, -0.2, 0.75}),
      pose("lotus", {0, 0, 0}).legs({0.7, -0.15, 0.7}, {-0.9, 0.15, 0.3}).arms({0.35, -0.85, 0.3}, {0.25, -0.3, 0.9}),
      pose("sitting on the heels", {0, 0, 0})
          .legs({0.1, -0.15, 1}, {0, -0.15, -1})
          .arms({0.2, -0.9, 0.3}, {-0.2, -0.4, 0.9}),
      pose("sitting, legs straight", {-0.1, 0, 0}).legs({0.15, -0.05, 1}).arms({0.3, -0.95, -0.2}),
      pose("sitting, arms around the knees", {0, 0, 0})
          .back(0.7)
          .legs({0.1, 0.35, 0.9}, {0, -0.9, 0.3})
          .arms({0.1, -0.4, 0.9}, {-0.9, -0.1, 0.3}),
      pose("bow", {1.2, 0, 0}).back(0.5).legs({0.04, -0.36, 0.93}).arms({0.1, -0.3, 0.95}),
      pose("bow, arms at the sides", {1.0, 0, 0}).back(0.5).legs({0.04, -0.54, 0.84}).arms(side),
      pose("bow, hands at the toes", {1.5, 0, 0}).back(0.9).legs({0.04, -0.07, 1}).arms({0.05, 0.75, 0.65}),
      pose("bow, kneeling", {1.4, 0, 0}).back(0.4).legs({0.1, 0.75, 0.6}, {0, -1, -0.07}).arms({0.1, 0.95, 0.3}),
      feet(pose("crouch", {0.5, 0, 0})
               .back(0.5)
               .legs({0.25, 0.1, 0.95}, {0, -0.85, -0.55})
               .arms({0.2, -0.4, 0.9}, {-0.2, 0, 1}),
           -0.4),
      feet(pose("crouch, hands on the ground", {1.0, 0, 0})
               .back(0.6)
               .legs({0.25, 0.35, 0.95}, {0, -1, 0})
               .arms({0.1, -0.35, 0.9}),
           -0.4),
      pose("on the left side", {0, 0, -quarter})
          .legs({0.05, -0.9, 0.45}, {0, -0.85, -0.4})
          .arms({0.1, -0.4, 0.9}, {0, 0.3, 0.95}),
      pose("on the right side, curled up", {0, 0, quarter})
          .back(0.8)
          .legs({0.08, 0.1, 1}, {0, -0.9, -0.4})
          .arms({0.15, -0.5, 0.85}, {-0.1, 0.7, 0.7}),
      pose("on the back", {-quarter, 0, 0}).legs(down).arms({0.5, -0.85, 0}),
      pose("face down", {quarter, 0, 0}).legs(down).arms(side),
      pose("bridge", {-quarter, 0, 0}).back(-1).legs({0.12, -0.95, 0.2}, {0, -0.1, -1}).arms({0.15, 0.6, -0.8}),
      pose("split to the front", {0, 0, 0})
          .leg(1, {0.05, -0.15, 1}, {0.05, -0.15, 1})
          .leg(-1, {-0.05, -0.3, -1}, {-0.05, -0.3, -1})
          .arms({1, -0.1, 0}),
      pose("cartwheel, 60 degrees", {0, 0, half / 3}).legs({0.5, -0.85, 0}).arms({0.5, 0.85, 0}),
      pose("cartwheel, 120 degrees", {0, 0, 2 * half / 3}).legs({0.6, -0.8, 0}).arms({0.4, 0.9, 0}),
      pose("cartwheel, 180 degrees", {0, 0, half}).legs({0.7, -0.7, 0}).arms({0.4, 0.9, 0}),
      pose("cartwheel, 240 degrees", {0, 0, -2 * half / 3}).legs({0.6, -0.8, 0}).arms({0.4, 0.9, 0}),
  };
}

}  // namespace poses
