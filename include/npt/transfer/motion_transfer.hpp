/// A clip onto a character's own joints: names and shape of both skeletons say which joint is which; the mesh of
/// neither is looked at.
///   MotionSkeleton hero = motion_skeleton(read_scene("hero.glb"), "hero.glb");
///   MotionSkeleton walk = motion_skeleton(motion_of(clips, &clip, "walk.glb"), "walk.glb");   or of BVH
///   MotionResult made = transfer_motion(walk, hero);
///   write_with_motion("hero.glb", made.motion, {}, "hero_walk.glb");                          io/gltf_patch.hpp
/// Threads   any number
/// Errors    npt::Error: a clip of no length, a time behind its end, an animal's motion on a person or a person's on an
///           animal (domains_differ)
#pragma once

#include <npt/base/error.hpp>
#include <npt/body/roles/feet_apart.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/motion_checks.hpp>
#include <npt/transfer/motion/motion_skeleton.hpp>
#include <npt/transfer/motion/motion_warning.hpp>
#include <npt/transfer/retarget.hpp>
#include <npt/transfer/retarget_options.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct MotionOptions {
  std::string clip_name{};       ///< of the result; empty: as the source's clip
  std::optional<double> time{};  ///< the pose at this second, as a clip of one key
  std::optional<double> rate{};  ///< keys at so many frames a second; none: as the source has them
  /// Also from people to animals and back, by upright_stance.hpp: an experiment.
  bool across = false;
  RetargetOptions retarget{};
};

struct MotionResult {
  Motion motion{};  ///< on the target's joints, whose nodes are the target's
  std::vector<MotionWarning> warnings{};
  double confidence = 0;  ///< that both are skeletons of their kind, the smaller one: 0 to 1
};

/// The clip with linear keys at these times. Requires times that ascend
inline Motion sampled_motion(Motion motion, std::span<const double> times) {
  for (ClipChannel& channel : motion.clip.channels) {
    ClipChannel made{channel.node, channel.path, Interpolation::linear, channel.width, {}, {}};
    std::array<double, 4> value{};
    for (const double time : times) {
      channel.sample(time, value);
      made.times.push_back(static_cast<float>(time));
      for (std::size_t c = 0; c < channel.width; ++c) made.values.push_back(static_cast<float>(value[c]));
    }
    channel = std::move(made);
  }
  return motion;
}

/// The pose at a time, as a clip with one key, at 0.
inline Motion pose_of_motion(Motion motion, double time) {
  motion = sampled_motion(std::move(motion), std::span(&time, 1));
  for (ClipChannel& channel : motion.clip.channels) channel.times.front() = 0;
  motion.rate = 0;
  return motion;
}

namespace internal {

inline void expect_time(const Motion& motion, double time, const std::string& file) {
  const double length = motion.clip.channels.empty() ? 0 : motion.clip.length();
  if (!(time >= 0 && time <= length + 1e-3))
    throw Error({.file = file,
                 .found = "a time of " + std::to_string(time) + " s",
                 .expected = "at most " + std::to_string(length) + " s, the clip's length"});
}

/// Counted before any frame is made: a clip of two keys may claim to be a year long.
inline void expect_frames(const Motion& motion, double rate, const std::string& file) {
  constexpr double most_frames = 100'000;
  if (motion.clip.length() * rate > most_frames)
    throw Error({.file = file,
                 .place = "clip " + in_quotes(motion.clip.name),
                 .found = std::to_string(motion.clip.length()) + " s",
                 .expected = "at most " + std::to_string(static_cast<int>(most_frames)) + " frames"});
}

inline void expect_one_kind(const MotionSkeleton& source, const MotionSkeleton& target) {
  const SkeletonKind from = source.roles.kind(), to = target.roles.kind();
  if (from == to) return;
  throw Error({.file = source.name,
               .found = "a " + std::string(to_string(from)) + "'s motion on a " + std::string(to_string(to)) + " (" +
                        target.name + ")",
               .expected = "a " + std::string(to_string(to)) + "'s motion",
               .code = ErrorCode::domains_differ});
}

/// An animal's clip without a skin has only a rest, which may be a frame of a clip. One of the target's own skeleton
/// was bound as this is: joints of its names, as far from their parents, where a limb isn't moved in parts.
inline void bind_as(const MotionSkeleton& target, MotionSkeleton& source) {
  const auto is_bound = [](const MotionJoint& joint) { return joint.bind.has_value(); };
  if (target.roles.kind() == SkeletonKind::person || std::ranges::any_of(source.motion.joints, is_bound)) return;
  const std::vector<FootApart> apart = feet_apart(target.motion, target.roles);
  std::vector<std::size_t> same(target.motion.joints.size(), no_item);
  const double unit = metres_a_unit(target.motion) / metres_a_unit(source.motion);
  for (std::size_t j = 0; j < same.size(); ++j) {
    const MotionJoint& own = target.motion.joints[j];
    const auto found = std::ranges::find(source.motion.joints, own.name, &MotionJoint::name);
    const JointRole role = target.roles.role_of(j);
    if (found != source.motion.joints.end()) same[j] = static_cast<std::size_t>(found - source.motion.joints.begin());
    if (role == JointRole::none) continue;
    if (same[j] == no_item || source.roles.role_of(same[j]) != role) return;
    const double bone = length(own.rest.translation) * unit, other = length(found->rest.translation);
    const bool moves = role == JointRole::hips || std::ranges::find(apart, j, &FootApart::foot) != apart.end();
    if (!moves && 1000 * std::abs(bone - other) > bone) return;  // but for rounding
  }
  for (std::size_t j = 0; j < same.size(); ++j)
    if (same[j] != no_item) source.motion.joints[same[j]].bind = target.motion.joints[j].bind;
}

}  // namespace internal

inline MotionResult transfer_motion(const MotionSkeleton& from, const MotionSkeleton& target,
                                    const MotionOptions& options = {}) {
  if (!options.across) internal::expect_one_kind(from, target);
  MotionSkeleton source = from;
  internal::bind_as(target, source);
  Motion clip = source.motion;
  if (options.time)
    internal::expect_time(clip, *options.time, source.name);
  else
    expect_clip(clip, source.name);
  if (!clip.clip.channels.empty())
    internal::expect_frames(clip, options.rate.value_or(sampling_rate(clip)), source.name);
  if (options.rate && !options.time) {
    clip = sampled_motion(std::move(clip), frame_times(source.motion.clip, *options.rate));
    clip.rate = *options.rate;
  }
  MotionResult result;
  result.motion =
      retarget(clip, source.roles, target.motion, target.roles, options.retarget, {source.shape, target.shape});
  // Feet, hands and the ground depend on what comes before and after: the pose is that of the whole clip at the time.
  if (options.time) result.motion = pose_of_motion(std::move(result.motion), *options.time);
  if (!options.clip_name.empty()) result.motion.clip.name = options.clip_name;
  result.warnings = motion_warnings(source.roles, target.roles);
  result.confidence = std::min(source.roles.confidence, target.roles.confidence);
  return result;
}

}  // namespace npt::inline NPT_ABI
