/// The root trajectory of a character that was posed in one place: that of the pose, in proportion to its own legs.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/joint_pose.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// How far each frame of a sequence is to be moved, whose frames all have their root joint in one place: as the pose's
/// root went, in proportion to the legs; the sequence's lowest point comes to `ground`, so that who walks walks on it,
/// and who only sits sits on it. [frames], empty where the legs have no length.
/// leg        of the character
/// poses      [frames] as they were read
/// lowest     [frames] the least y of each frame
NPT_INLINE std::vector<Vec3d> root_trajectory(double leg, std::span<const JointPose> poses,
                                              std::span<const double> lowest, double ground) {
  double legs = 0;
  for (const JointPose& pose : poses) legs += pose.leg / static_cast<double>(poses.size());
  if (!(leg > 0 && legs > 0)) return {};
  std::vector<Vec3d> trajectory;
  double deepest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    trajectory.push_back((poses[i].root - poses[0].root) * (leg / legs));
    deepest = std::min(deepest, lowest[i] + trajectory[i].y);
  }
  for (Vec3d& step : trajectory) step.y += ground - deepest;
  return trajectory;
}

}  // namespace npt::inline NPT_ABI
