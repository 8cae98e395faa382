/// Thighs kept out of each other: where knees or the middles of thighs come nearer than they are thick, both turn away.
///   clear_thighs(retargeter, shape, clearance, pose, frames);
/// As near as they are where the skin was bound they may always be. Comes before feet are held: these move as little as
/// they can, then.
#pragma once

#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/body_shape.hpp>
#include <npt/transfer/motion/joint_retargeter.hpp>
#include <npt/transfer/motion/posed_joints.hpp>
#include <npt/transfer/motion/retarget_frames.hpp>
#include <npt/transfer/motion/retarget_side.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// The shortest way between points of the lower two thirds of both thighs, from the left one to the right one.
inline Vec3d between_thighs(const std::array<Vec3d, 2>& hips, const std::array<Vec3d, 2>& knees) {
  Vec3d least = knees[1] - knees[0];
  for (std::size_t side = 0; side < 2; ++side)
    for (const double along : {1.0 / 3, 2.0 / 3, 1.0}) {
      const Vec3d p = hips[side] + (knees[side] - hips[side]) * along, a = hips[1 - side], b = knees[1 - side];
      const Vec3d way = a + (b - a) * std::max(closest_on_segment(p, a, b), 1.0 / 3) - p;
      if (length(way) < length(least)) least = side == 0 ? way : -way;
    }
  return least;
}

inline void clear_thighs(const JointRetargeter& retargeter, const BodyShape& shape, double clearance, PosedJoints& pose,
                         RetargetFrames& frames) {
  const RetargetSide& target = retargeter.target();
  std::array<std::size_t, 2> hips{}, knees{};
  for (std::size_t side = 0; side < 2; ++side) {
    hips[side] = target.roles.joint(LimbPart::upper_leg, side);
    knees[side] = target.roles.joint(LimbPart::lower_leg, side);
    if (hips[side] == no_item || knees[side] == no_item || shape.thighs[side] == 0) return;
  }
  const auto at = [&](const std::array<std::size_t, 2>& joints) {
    return std::array<Vec3d, 2>{pose.position(joints[0]), pose.position(joints[1])};
  };
  const double bound = length(between_thighs({target.worlds[hips[0]].shift, target.worlds[hips[1]].shift},
                                             {target.worlds[knees[0]].shift, target.worlds[knees[1]].shift}));
  // Flesh gives way: a tenth of the thickness.
  const double needed = std::min(0.9 * (shape.thighs[0] + shape.thighs[1]), bound);
  std::array<std::vector<Vec3d>, 2> turns;
  bool any = false;
  for (std::size_t f = 0; f < frames.count(); ++f) {
    pose.set(frames.places[f]);
    const Vec3d way = between_thighs(at(hips), at(knees));
    const double lacks = (needed - length(way)) * clearance;
    for (std::size_t side = 0; side < 2; ++side) {
      Vec3d turn{};
      if (lacks > 0) {
        const Vec3d bone = pose.position(knees[side]) - pose.position(hips[side]);
        const Vec3d out = pose.position(hips[side]) - pose.position(hips[1 - side]);
        const Vec3d apart = dot(way, out) * (side == 0 ? -1 : 1) > 0 ? way * (side == 0 ? -1.0 : 1.0) : out;
        turn = normalised(cross(bone, apart)) * std::min(lacks / length(bone), 0.5);
        any = true;
      }
      turns[side].push_back(turn);
    }
  }
  if (!any) return;
  for (std::vector<Vec3d>& own : turns) own = smoothed(own, frames, smoothing_seconds);
  for (std::size_t f = 0; f < frames.count(); ++f) {
    pose.set(frames.places[f]);
    for (std::size_t side = 0; side < 2; ++side)
      if (length(turns[side][f]) > 0) pose.turn(hips[side], Quaternion{}.turned(turns[side][f]));
    frames.places[f] = pose.places();
  }
}

}  // namespace internal

}  // namespace npt::inline NPT_ABI
