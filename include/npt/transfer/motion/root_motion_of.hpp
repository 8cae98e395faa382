/// Which joint carries the way over the ground, and whether there is one: RetargetOptions' in_place and root_motion.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/joint_retargeter.hpp>
#include <npt/transfer/motion/posed_joints.hpp>
#include <npt/transfer/motion/retarget_frames.hpp>
#include <npt/transfer/retarget_options.hpp>

#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// The way is that of the hips since the first frame, along the ground.
inline void move_root(const JointRetargeter& retargeter, PosedJoints& pose, RetargetFrames& frames,
                      const RetargetOptions& options) {
  const Motion& target = retargeter.target().motion;
  const std::size_t hips = retargeter.target().roles.joint(JointRole::hips);
  if (hips == no_item || (!options.in_place && options.root_motion == RootMotion::keep)) return;
  std::size_t root = hips;
  while (target.joints[root].parent != no_item) root = target.joints[root].parent;
  const bool extracts = options.root_motion == RootMotion::extract && root != hips && !options.in_place;
  if (!extracts && !options.in_place) return;
  // What moves by itself beside the hips: feet that a rig moves apart from their legs.
  std::vector<std::size_t> movers{hips};
  for (const auto& [foot, knee] : retargeter.follows()) movers.push_back(foot);
  Vec3d start{};
  for (std::size_t f = 0; f < frames.count(); ++f) {
    pose.set(frames.places[f]);
    const Vec3d place = pose.position(hips);
    if (f == 0) start = place;
    const Vec3d way{place.x - start.x, 0, place.z - start.z};
    std::vector<Vec3d> places;
    for (const std::size_t joint : movers) places.push_back(pose.position(joint) - (options.in_place ? way : Vec3d{}));
    if (extracts) pose.move(root, way);
    for (std::size_t i = 0; i < movers.size(); ++i) pose.place(movers[i], places[i]);
    frames.places[f] = pose.places();
  }
  if (extracts) frames.moving[root][1] = true;
}

}  // namespace internal

}  // namespace npt::inline NPT_ABI
