/// A skeleton as a tree of bones with lengths, as its skin was bound or else at rest: what its shape says before any
/// name is looked at. Where a file's rest has no extent, as in clips that lost their bind pose, the clip's first frame
/// stands in.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

class SkeletonShape {
 public:
  explicit SkeletonShape(const Motion& motion)
      : positions(positions_of(bound_worlds(motion))),
        children(motion.joints.size()),
        reach(motion.joints.size()),
        parents(motion.joints.size(), no_item),
        turns(motion.joints.size()),
        ends(motion.joints.size()) {
    for (std::size_t j = 0; j < motion.joints.size(); ++j) {
      ends[j] = motion.joints[j].end;
      parents[j] = motion.joints[j].parent;
      if (parents[j] != no_item) children[parents[j]].push_back(j);
    }
    for (const ClipChannel& channel : motion.clip.channels)
      if (channel.path == ChannelPath::rotation && varies(channel)) turns[channel.node] = true;
    measure();
    if (size > 0) return;
    positions = positions_of(joint_worlds(motion, 0.0));
    measure();
  }

  std::size_t count() const noexcept { return positions.size(); }
  /// From its parent; 0 for a root.
  double bone(std::size_t joint) const {
    return parents[joint] == no_item ? 0 : length(positions[joint] - positions[parents[joint]]);
  }
  double distance(std::size_t a, std::size_t b) const { return length(positions[a] - positions[b]); }
  bool is_below(std::size_t joint, std::size_t above) const {
    while (joint != no_item && joint != above) joint = parents[joint];
    return joint == above;
  }
  /// The lowest joint that both are, or hang below; no_item: none.
  std::size_t common(std::size_t a, std::size_t b) const {
    while (a != no_item && !is_below(b, a)) a = parents[a];
    return a;
  }
  /// From a joint down to the end that is farthest along the bones.
  std::vector<std::size_t> longest_path(std::size_t joint) const {
    std::vector<std::size_t> path{joint};
    while (!children[joint].empty()) {
      joint = *std::ranges::max_element(children[joint], {}, [&](std::size_t c) { return bone(c) + reach[c]; });
      path.push_back(joint);
    }
    return path;
  }

  std::vector<Vec3d> positions;  ///< metres, y up
  std::vector<std::vector<std::size_t>> children;
  std::vector<double> reach;  ///< length of the longest way down
  std::vector<std::size_t> parents;
  std::vector<bool> turns;  ///< its rotation changes in the clip
  std::vector<bool> ends;   ///< only marks its parent's end
  double size = 0;          ///< the longest way down from a root

 private:
  static std::vector<Vec3d> positions_of(const std::vector<Affine>& worlds) {
    std::vector<Vec3d> places;
    places.reserve(worlds.size());
    for (const Affine& world : worlds) places.push_back(world.shift);
    return places;
  }
  static bool varies(const ClipChannel& channel) {
    for (std::size_t i = channel.width; i < channel.values.size(); ++i)
      if (channel.values[i] != channel.values[i % channel.width]) return true;
    return false;
  }
  void measure() {
    std::ranges::fill(reach, 0.0);
    size = 0;
    for (std::size_t j = count(); j-- > 0;) {
      if (parents[j] == no_item)
        size = std::max(size, reach[j]);
      else
        reach[parents[j]] = std::max(reach[parents[j]], reach[j] + bone(j));
    }
  }
};

}  // namespace npt::inline NPT_ABI
