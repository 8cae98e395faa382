/// A motion on another skeleton: rotations from joint to joint by their roles, in the target's own frames.
///   Motion on_mine = retarget(clip, joint_roles(clip), mine, joint_roles(mine));
///   rotations   of each role's joint, relative to the pose that its skeleton was bound or stands in; arms, legs and
///               fingers point where the source's point, whether their rests are T or A poses. On one rig
///               (motion/shared_rig.hpp) joints turn in their parents as the source's do
///   spine       turns by its place between hips and shoulders, whatever the number of its joints
///   animals     keep how their species stands: joints turn from the rest of the one as from that of the other; neck
///               and tail as the spine, ears and hooves where both have joints of these names; feet and bodies aren't
///               looked at
///   hips        move as the source's above the ground, by the ratio of leg lengths; the middle between the thighs
///               counts, so that a root on the floor does, too
///   others      keep their place in their parent; feet that a rig moves apart from their legs follow these
///   feet        that stand in the source are held, and none sinks below the ground
///   bodies      arms are kept out of a trunk that is wider than the source's; hands touch what they touch there
/// RetargetOptions says which of it is done. Bones keep their lengths. Keys stand at the source's times, and where these are no frames, at 30 a second as well.
/// A source without a skin whose rest runs or sits is stood up first (straight_stance.hpp).
/// Limits    any other rest or bind pose is taken for one of a body that stands straight: a spine that is bowed there
///           bends the target's by as much
#pragma once

#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/transfer/motion/arm_clearance.hpp>
#include <npt/transfer/motion/body_shape.hpp>
#include <npt/transfer/motion/foot_lock.hpp>
#include <npt/transfer/motion/joint_retargeter.hpp>
#include <npt/transfer/motion/posed_joints.hpp>
#include <npt/transfer/motion/retarget_frames.hpp>
#include <npt/transfer/motion/retargeted_clip.hpp>
#include <npt/transfer/motion/root_motion_of.hpp>
#include <npt/transfer/motion/thigh_clearance.hpp>
#include <npt/transfer/motion/twist_joints.hpp>
#include <npt/transfer/retarget_options.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// The source's times, and where its keys are no frames those of 30 a second as well.
inline std::vector<float> retarget_times(const Motion& source) {
  std::vector<float> times;
  for (const ClipChannel& channel : source.clip.channels)
    times.insert(times.end(), channel.times.begin(), channel.times.end());
  if (source.rate == 0)
    for (const double time : frame_times(source.clip, 30)) times.push_back(static_cast<float>(time));
  if (times.empty()) times.push_back(0);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

}  // namespace internal

/// Requires  roles of the two motions; joints of roles that only one of them has stay as they are
inline Motion retarget(const Motion& source, const JointRoles& from, const Motion& target, const JointRoles& to,
                       const RetargetOptions& options = {}, const RetargetShapes& shapes = {}) {
  internal::JointRetargeter retargeter(source, from, target, to);
  internal::RetargetFrames frames;
  frames.times = internal::retarget_times(source);
  for (std::size_t f = 0; f < frames.count(); ++f) {
    frames.sources.push_back(joint_worlds(source, frames.time(f)));
    frames.places.push_back(retargeter.frame(frames.sources.back()));
  }
  frames.moving = retargeter.moving();
  internal::PosedJoints pose(target, retargeter.follows(), retargeter.target().worlds);
  const bool person = to.kind() == SkeletonKind::person && from.kind() == to.kind();
  if (person) internal::ArmClearance(retargeter, shapes, options, pose, frames).apply();
  if (person && options.clearance > 0)
    internal::clear_thighs(retargeter, shapes.target, options.clearance, pose, frames);
  if (person && options.foot_lock) internal::FootLock(retargeter, pose, frames).apply();
  if (person && options.twist) internal::share_twist(internal::TwistJoints(retargeter.target()), pose, frames);
  internal::move_root(retargeter, pose, frames, options);
  frames.find_moving();
  const internal::RetargetedClip clip(target, retargeter.target().worlds, frames, options.key_tolerance);
  return {target.joints, clip.clip(source.clip.name), target.base, source.rate};
}

}  // namespace npt::inline NPT_ABI
