/// SMPL's hand is a mitten: its one joint, at the knuckles, moves all fingers, and nothing makes a fist of it. This
/// adds the fingers' middle and end joints to the mannequin; the thumb stays with the hand.
///   const npt::BodyModel fingered = npt::with_finger_joints(npt::mannequin());
///   angles = npt::with_fingers(axis_angles, {HandBend{.middle = {1, 1, 1, 1}}, HandBend{}});    [24, 3] -> [40, 3]
/// Shapes    joints: SMPL's 24, then as middle_finger_joint() says
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/hands.hpp>
#include <npt/body/mannequin/anatomy.hpp>
#include <npt/body/mannequin/skin.hpp>
#include <npt/body/mannequin/surface.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// Along a finger from where it leaves the hand, as a share of its length: where the phalanges meet.
inline constexpr double middle_joint = 0.42, end_joint = 0.70;

/// A finger (not the thumb) that a point of the resting hand (x >= 0, anatomy's coordinates) belongs to, and where
/// along it the point lies.
struct FingerPlace {
  std::size_t finger = 0;
  double along = 0;
};
NPT_INLINE FingerPlace finger_place(Vec3d q) {
  FingerPlace best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t d = 0; d + 1 < std::size(anatomy::digits); ++d) {
    const anatomy::Digit& digit = anatomy::digits[d];
    const Vec3d axis = normalised(digit.direction), from = q - digit.root;
    const double t = dot(from, axis);
    const double aside = length(from - axis * t);
    if (aside < least) least = aside, best = {d, t / digit.length};
  }
  return best;
}

/// Direction of the hinge of the left middle joints: through those of index and little finger, and turning fingers
/// towards the palm.
NPT_INLINE Vec3d left_finger_hinge() {
  const auto at = [](const anatomy::Digit& d) { return d.root + normalised(d.direction) * (middle_joint * d.length); };
  Vec3d hinge = at(anatomy::digits[3]) - at(anatomy::digits[0]);
  hinge.y = 0;
  return normalised(hinge);
}

}  // namespace internal

/// Of a hand's finger joints, in the body's coordinates at rest. side: 0 left, 1 right
NPT_INLINE Vec3d finger_hinge(std::size_t side) {
  const Vec3d left = internal::left_finger_hinge();
  return side == 0 ? left : Vec3d{left.x, -left.y, -left.z};
}

/// The mannequin, with whatever shape directions, with 40 joints.
/// Requires  the mannequin's vertices and SMPL's joints
NPT_INLINE BodyModel with_finger_joints(const BodyModel& body) {
  NPT_ASSERT(body.joint_count() == smpl_joint_count);
  BodyTables tables = body.tables();
  const Vec3d origin = anatomy::rounded(anatomy::origin);
  const SparseMatrix skin = std::exchange(tables.weights, {});
  tables.weights.columns = fingered_joint_count;
  // The vertices around each new joint, which say where it is for a shape.
  std::array<std::vector<std::uint32_t>, fingered_joint_count - smpl_joint_count> rings;
  for (std::uint32_t v = 0; v < body.vertex_count(); ++v) {
    const float* rest = &tables.v_template[3 * std::size_t{v}];
    const Vec3d p = Vec3f{rest[0], rest[1], rest[2]}.as<double>() + origin;
    const auto [finger, along] = internal::finger_place({std::abs(p.x), p.y, p.z});
    const std::size_t side = p.x < 0 ? 1 : 0, joint = middle_finger_joint(side, finger);
    float middle = 0, end = 0;
    for (std::size_t i = skin.start[v]; i < skin.start[v + 1]; ++i) {
      float w = skin.value[i];
      if (skin.column[i] == joint_index(SmplJoint::left_hand) + side && w > 0.99F) {
        const double bends = anatomy::ramp(along, internal::middle_joint - 0.1, internal::middle_joint + 0.1);
        const double ends = anatomy::ramp(along, internal::end_joint - 0.08, internal::end_joint + 0.08);
        middle = w * static_cast<float>(bends * (1 - ends)), end = w * static_cast<float>(bends * ends);
        w -= middle + end;
        if (std::abs(along - internal::middle_joint) < 0.1) rings[joint - smpl_joint_count].push_back(v);
        if (std::abs(along - internal::end_joint) < 0.1) rings[joint + 1 - smpl_joint_count].push_back(v);
      }
      if (w > 0) tables.weights.append(skin.column[i], w);
    }
    if (middle > 0) tables.weights.append(static_cast<std::uint32_t>(joint), middle);
    if (end > 0) tables.weights.append(static_cast<std::uint32_t>(joint + 1), end);
    tables.weights.end_row();
  }
  for (std::size_t j = smpl_joint_count; j < fingered_joint_count; ++j) {
    const std::vector<std::uint32_t>& ring = rings[j - smpl_joint_count];
    NPT_ASSERT(!ring.empty());
    for (const std::uint32_t v : ring) tables.J_regressor.append(v, 1.0F / static_cast<float>(ring.size()));
    tables.J_regressor.end_row();
    const std::size_t k = j - smpl_joint_count;
    const std::size_t hand = joint_index(SmplJoint::left_hand) + k / (2 * finger_count);
    tables.parents.push_back(static_cast<int>(k % 2 == 0 ? hand : j - 1));
  }
  tables.joint_names.clear();
  return BodyModel(std::move(tables), "body with finger joints");
}

/// Those of with_finger_joints().
NPT_INLINE const BothHands& people_hands() {
  static const BothHands hands = [] {
    BothHands both;
    for (std::size_t side = 0; side < 2; ++side) {
      both[side] = {.forearm = joint_index(SmplJoint::left_elbow) + side,
                    .wrist = joint_index(SmplJoint::left_wrist) + side,
                    .hand = joint_index(SmplJoint::left_hand) + side,
                    .hinge = finger_hinge(side)};
      for (std::size_t f = 0; f < finger_count; ++f) both[side].middles[f] = middle_finger_joint(side, f);
    }
    return both;
  }();
  return hands;
}

/// The angles of a body with finger joints, for left and right hand. axis_angles: [24, 3]; result: [40, 3]
NPT_INLINE std::vector<float> with_fingers(std::span<const float> axis_angles, const std::array<HandBend, 2>& hands) {
  return with_fingers(axis_angles, hands, people_hands());
}

}  // namespace npt::inline NPT_ABI
