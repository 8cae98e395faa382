/// Whether a clip goes somewhere, and which joint takes the body there.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace npt::inline NPT_ABI {

struct RootPath {
  std::size_t joint = no_item;  ///< the topmost whose curve moves the hips' place; no_item: in place
  Vec3d way{};                  ///< of the hips from the first to the last frame, in metres
};

/// Of a joint that nothing but its own translation counts for.
inline double translation_range(const Motion& motion, std::size_t joint) {
  double range = 0;
  for (const ClipChannel& channel : motion.clip.channels)
    if (channel.node == joint && channel.path == ChannelPath::translation)
      for (std::size_t i = 0; i < channel.values.size(); ++i)
        range = std::max(range, std::abs(static_cast<double>(channel.values[i] - channel.values[i % 3])));
  return range;
}

inline RootPath root_motion_of(const Motion& motion, const JointRoles& roles) {
  RootPath found;
  const std::size_t hips = roles.joint(JointRole::hips) != no_item ? roles.joint(JointRole::hips) : 0;
  if (motion.joints.empty() || motion.clip.channels.empty()) return found;
  for (std::size_t joint = hips; joint != no_item; joint = motion.joints[joint].parent)
    if (translation_range(motion, joint) * metres_a_unit(motion) > 1e-3) found.joint = joint;
  found.way = joint_positions(motion, motion.clip.length())[hips] - joint_positions(motion, 0.0)[hips];
  return found;
}

}  // namespace npt::inline NPT_ABI
