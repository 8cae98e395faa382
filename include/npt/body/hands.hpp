/// Hands with fingers, which a kind of body may have: joints behind those of its plan, and how they close.
/// Shapes    axis angles [J, 3] of the plan's joints become [J + 4 finger_count, 3]
/// Units     radians
/// Source    Rijpkema and Girard, "Computer animation of knowledge-based human grasping", SIGGRAPH 1991: the end joint
///           bends by two thirds of the middle one
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// How far a hand is closed beyond what the plan's joints say, in radians; positive towards the palm.
struct HandBend {
  double knuckles = 0;                        ///< about the hand's joint
  std::array<double, finger_count> middle{};  ///< about the middle joints; index finger first

  friend bool operator==(const HandBend&, const HandBend&) = default;
};

/// The joints of one hand.
struct HandJoints {
  std::size_t forearm = 0, wrist = 0, hand = 0;     ///< of the plan
  std::array<std::size_t, finger_count> middles{};  ///< of the fingers; the end joint is the next one
  Vec3d hinge;                                      ///< of the finger joints, in the body's coordinates at rest, unit

  bool has_finger(std::size_t joint) const {
    for (const std::size_t middle : middles)
      if (joint == middle || joint == middle + 1) return true;
    return false;
  }
};

/// Left and right.
using BothHands = std::array<HandJoints, 2>;

/// The angles of a body with finger joints.
NPT_INLINE std::vector<float> with_fingers(std::span<const float> axis_angles, const std::array<HandBend, 2>& bends,
                                           const BothHands& hands) {
  std::vector<float> result(axis_angles.begin(), axis_angles.end());
  result.resize(axis_angles.size() + 3 * 4 * finger_count);
  for (std::size_t side = 0; side < 2; ++side) {
    const HandJoints& joints = hands[side];
    const HandBend& bend = bends[side];
    if (bend.knuckles != 0)
      set_joint_rotation(as_span(result), joints.hand,
                         joint_rotation(axis_angles, joints.hand) * rotation_matrix(joints.hinge * bend.knuckles));
    for (std::size_t f = 0; f < finger_count; ++f) {
      const std::size_t middle = joints.middles[f];
      set_joint_rotation(as_span(result), middle, rotation_matrix(joints.hinge * bend.middle[f]));
      set_joint_rotation(as_span(result), middle + 1, rotation_matrix(joints.hinge * (bend.middle[f] * 2 / 3)));
    }
  }
  return result;
}

}  // namespace npt::inline NPT_ABI
