/// Where a skeleton's front is, and so which side is left: a person's toes point forwards, knees bend forwards, elbows
/// backwards, at rest and in the clip; an animal's forelegs stand before its hind legs.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/named_roles.hpp>
#include <npt/body/roles/skeleton_shape.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

/// Axes of a body, of length 1 and at right angles.
struct BodyAxes {
  Vec3d left{1, 0, 0}, up{0, 1, 0}, forward{0, 0, 1};

  /// Whether a body stands, be it bent.
  bool stands() const { return up.y > 0.7; }
  /// The same direction with y up.
  BodyAxes upright() const {
    const Vec3d level = normalised(Vec3d{left.x, 0, left.z});
    return {level, {0, 1, 0}, cross(level, {0, 1, 0})};
  }
};

namespace internal {

inline std::size_t joint_of(const RoleTable& joints, LimbPart part, std::size_t side) {
  return joints[index_of(limb_role(part, side))];
}

/// Left minus right, of all parts that both sides have.
inline Vec3d across(const RoleTable& joints, const std::vector<Vec3d>& positions) {
  Vec3d sum{};
  for (const LimbPart part : {LimbPart::upper_arm, LimbPart::upper_leg, LimbPart::lower_leg, LimbPart::lower_arm}) {
    const std::size_t left = joint_of(joints, part, 0), right = joint_of(joints, part, 1);
    if (left != no_item && right != no_item) sum += normalised(positions[left] - positions[right]);
  }
  return sum;
}

/// From the ends of a four-legged animal's legs to where they begin; forwards: from the hind legs to the forelegs.
inline BodyAxes animal_axes(const RoleTable& joints, const std::vector<Vec3d>& positions) {
  std::array<Vec3d, 2> roots{};
  std::array<double, 2> counts{};
  BodyAxes axes{.up = {}};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::vector<JointRole> roles = limb_roles(joints.kind, i < 2, i % 2);
    const auto has = [&](JointRole role) { return joints[index_of(role)] != no_item; };
    const auto first = std::find_if(roles.begin() + (i < 2 ? 1 : 0), roles.end(), has);
    const auto last = std::find_if(roles.rbegin(), roles.rend(), has);
    if (first == roles.end()) continue;
    const Vec3d root = positions[joints[index_of(*first)]];
    axes.up += root - positions[joints[index_of(*last)]];
    roots[i / 2] += root, ++counts[i / 2];
  }
  const bool whole = counts[0] > 0 && counts[1] > 0;
  axes.forward = whole ? roots[0] / counts[0] - roots[1] / counts[1] : Vec3d{0, 0, 1};
  axes.up = normalised(axes.up);
  axes.forward = normalised(axes.forward - axes.up * dot(axes.forward, axes.up));
  axes.left = cross(axes.up, axes.forward);
  return whole && length(axes.left) > 0 ? axes : BodyAxes{};
}

/// From the legs to the arms, or to the head.
inline Vec3d upwards(const RoleTable& joints, const std::vector<Vec3d>& positions) {
  if (joints.kind == SkeletonKind::four_legged) return animal_axes(joints, positions).up;
  const auto middle = [&](LimbPart part, Vec3d& place) {
    const std::size_t left = joint_of(joints, part, 0), right = joint_of(joints, part, 1);
    if (left != no_item && right != no_item) place = (positions[left] + positions[right]) * 0.5;
    return left != no_item && right != no_item;
  };
  Vec3d low{}, high{};
  const std::size_t hips = joints[index_of(JointRole::hips)], head = joints[index_of(JointRole::head)];
  if (!middle(LimbPart::upper_leg, low)) {
    if (hips == no_item) return {0, 1, 0};
    low = positions[hips];
  }
  if (head != no_item) return positions[head] - low;
  if (!middle(LimbPart::upper_arm, high)) return {0, 1, 0};
  return high - low;
}

/// How far a middle joint stands off the line between two others, in lengths of the two bones.
inline Vec3d bend(const std::vector<Vec3d>& positions, std::size_t a, std::size_t b, std::size_t c) {
  const Vec3d line = positions[c] - positions[a], to = positions[b] - positions[a];
  const double size = length(to) + length(positions[c] - positions[b]);
  if (dot(line, line) == 0 || size == 0) return {};
  return (to - line * (dot(to, line) / dot(line, line))) / size;
}

}  // namespace internal

/// The axes where the table's left is left.
inline BodyAxes body_axes(const RoleTable& joints, const std::vector<Vec3d>& positions) {
  if (joints.kind == SkeletonKind::four_legged) return internal::animal_axes(joints, positions);
  BodyAxes axes;
  axes.up = normalised(internal::upwards(joints, positions));
  const Vec3d left = internal::across(joints, positions);
  axes.left = normalised(left - axes.up * dot(left, axes.up));
  if (length(axes.left) == 0 || length(axes.up) == 0) return {};
  axes.forward = cross(axes.left, axes.up);
  return axes;
}

/// Whether the table's left is left: positive where toes, knees and elbows say so, negative where its sides are
/// swapped; 1 is certain.
inline double left_is_left(const Motion& motion, const SkeletonShape& shape, const RoleTable& joints) {
  using enum LimbPart;
  const BodyAxes rest = body_axes(joints, shape.positions);
  if (joints.kind == SkeletonKind::four_legged)
    return dot(normalised(internal::across(joints, shape.positions)), rest.left);
  double score = 0.02 * rest.forward.z;  // glTF's scenes look along +z
  const auto add_bends = [&](const std::vector<Vec3d>& positions, Vec3d forward, double weight) {
    constexpr std::array<std::array<LimbPart, 3>, 2> limbs{
        {{upper_leg, lower_leg, foot}, {upper_arm, lower_arm, hand}}};
    for (std::size_t limb = 0; limb < 2; ++limb)
      for (std::size_t side = 0; side < 2; ++side) {
        std::array<std::size_t, 3> own{};
        for (std::size_t i = 0; i < 3; ++i) own[i] = internal::joint_of(joints, limbs[limb][i], side);
        if (std::ranges::find(own, no_item) != own.end()) continue;
        // An arm turns about its own axis, so that its elbow may point anywhere: it counts less.
        const double sign = limb == 0 ? 1 : -0.25;
        score += weight * sign * dot(internal::bend(positions, own[0], own[1], own[2]), forward);
      }
  };
  for (std::size_t side = 0; side < 2; ++side) {
    const std::size_t ankle = internal::joint_of(joints, foot, side),
                      knee = internal::joint_of(joints, lower_leg, side);
    if (ankle == no_item || knee == no_item) continue;
    const Vec3d toe = shape.positions[shape.longest_path(ankle).back()] - shape.positions[ankle];
    const double shin = shape.distance(ankle, knee);
    if (shin > 0) score += std::clamp(dot(toe, rest.forward) / shin, -0.5, 0.5);
  }
  add_bends(shape.positions, rest.forward, 1);
  constexpr int samples = 16;
  const double end = motion.clip.channels.empty() ? 0 : motion.clip.length();
  for (int i = 0; i < samples && end > 0; ++i) {
    const std::vector<Vec3d> positions = joint_positions(motion, end * i / samples);
    add_bends(positions, body_axes(joints, positions).forward, 4.0 / samples);
  }
  return std::clamp(3 * score, -1.0, 1.0);
}

/// The table with left and right exchanged.
inline RoleTable swapped_sides(const RoleTable& joints) {
  RoleTable swapped = joints;
  for (std::size_t r = 0; r < joint_role_count; ++r) swapped[index_of(mirrored(static_cast<JointRole>(r)))] = joints[r];
  return swapped;
}

}  // namespace npt::inline NPT_ABI
