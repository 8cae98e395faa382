/// The clip of a retargeted motion: channels of the joints that move, keys where they are needed.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/key_thinning.hpp>
#include <npt/transfer/motion/retarget_frames.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

class RetargetedClip {
 public:
  /// Keeps references. tolerance: of joints' places at a height of 1.75 m, in metres
  RetargetedClip(const Motion& target, const std::vector<Affine>& bound, const RetargetFrames& frames, double tolerance)
      : target_(target), frames_(frames), reaches_(target.joints.size()), unit_(metres_a_unit(target)) {
    double low = bound.empty() ? 0 : bound.front().shift.y, high = low;
    for (const Affine& world : bound) low = std::min(low, world.shift.y), high = std::max(high, world.shift.y);
    constexpr double usual_height = 1.75;
    find_reaches(bound);
    // Errors of a chain of joints add up, at worst; each joint takes an equal share.
    std::vector<std::size_t> depths(target.joints.size());
    std::size_t deepest = 0;
    for (std::size_t j = 0; j < depths.size(); ++j) {
      const std::size_t parent = target.joints[j].parent;
      depths[j] =
          (parent == no_item ? 0 : depths[parent]) + (frames.moving[j][0] ? 1U : 0U) + (frames.moving[j][1] ? 1U : 0U);
      deepest = std::max(deepest, depths[j]);
    }
    tolerance_ = tolerance * (high - low) / usual_height / static_cast<double>(std::max<std::size_t>(1, deepest));
  }

  Clip clip(std::string name) const {
    Clip made{std::move(name), {}};
    for (std::size_t j = 0; j < target_.joints.size(); ++j) add_channels(made, j);
    return made;
  }

 private:
  /// How far the joints and ends are that a joint moves.
  void find_reaches(const std::vector<Affine>& bound) {
    for (std::size_t j = bound.size(); j-- > 0;) {
      for (std::size_t above = target_.joints[j].parent; above != no_item; above = target_.joints[above].parent)
        reaches_[above] = std::max(reaches_[above], length(bound[j].shift - bound[above].shift));
      // A last joint moves a mesh about as long as its own bone.
      const std::size_t parent = target_.joints[j].parent;
      if (reaches_[j] == 0 && parent != no_item) reaches_[j] = length(bound[j].shift - bound[parent].shift);
    }
  }

  void add_channels(Clip& clip, std::size_t joint) const {
    const std::vector<float>& times = frames_.times;
    const std::vector<std::vector<NodePlace>>& frames = frames_.places;
    const std::vector<std::array<bool, 2>>& moving = frames_.moving;
    const NodePlace& rest = target_.joints[joint].rest;
    ClipChannel turn{joint, ChannelPath::rotation, Interpolation::linear, 4, times, {}};
    ClipChannel shift{joint, ChannelPath::translation, Interpolation::linear, 3, times, {}};
    if (!moving[joint][0]) turn.times.resize(1);
    if (!moving[joint][1]) shift.times.resize(1);
    Quaternion last = frames.front()[joint].rotation;
    for (std::size_t f = 0; f < turn.times.size(); ++f) {
      Quaternion q = frames[f][joint].rotation;
      if (dot(q, last) < 0) q = q * -1.0;
      last = q;
      for (const double c : {q.x, q.y, q.z, q.w}) turn.values.push_back(static_cast<float>(c));
    }
    for (std::size_t f = 0; f < shift.times.size(); ++f) {
      const Vec3d p = frames[f][joint].translation;
      for (const double c : {p.x, p.y, p.z}) shift.values.push_back(static_cast<float>(c));
    }
    if (tolerance_ > 0) {
      thin_keys(turn, tolerance_ / std::max(reaches_[joint], negligible));
      thin_keys(shift, tolerance_ / std::max(unit_, negligible));
    }
    // A joint that stays as it was bound needs a key only where the file stands in another pose.
    const NodePlace& first = frames.front()[joint];
    if (moving[joint][0] || std::abs(dot(first.rotation, rest.rotation)) < 1 - 1e-9)
      clip.channels.push_back(std::move(turn));
    if (moving[joint][1] ||
        length(first.translation - rest.translation) > negligible * (negligible + length(rest.translation)))
      clip.channels.push_back(std::move(shift));
  }

  const Motion& target_;
  const RetargetFrames& frames_;
  std::vector<double> reaches_;  ///< [joints] metres
  double unit_, tolerance_ = 0;
};

}  // namespace internal

}  // namespace npt::inline NPT_ABI
