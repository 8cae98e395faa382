/// What must hold of a motion before it is put on another skeleton: files and programs hand over all kinds.
/// Errors    npt::Error that names the file, the joint, what was found and what was expected
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

namespace npt::inline NPT_ABI {

namespace internal {

class MotionChecker {
 public:
  MotionChecker(const Motion& motion, const std::string& file) : motion_(motion), file_(file) {}

  void check_joints() const {
    if (motion_.joints.empty()) fail({}, "no joints", "a skeleton");
    for (std::size_t j = 0; j < motion_.joints.size(); ++j) {
      const MotionJoint& joint = motion_.joints[j];
      if (joint.parent != no_item && joint.parent >= motion_.joints.size())
        fail(place(j), "a parent that isn't there", "one of the skeleton's joints");
      if (is_in_ring(j)) fail(place(j), "joints that form a ring", "a tree of joints");
      if (joint.parent != no_item && joint.parent >= j) fail(place(j), "a joint before its parent", "parents first");
      const NodePlace& rest = joint.rest;
      const bool finite = is_finite(rest.translation) && is_finite(rest.scale) &&
                          is_finite(Vec3d{rest.rotation.x, rest.rotation.y, rest.rotation.z}) &&
                          std::isfinite(rest.rotation.w);
      if (!finite) fail(place(j), "a place that is no number", "finite numbers");
    }
    if (!(metres_a_unit(motion_) > 0)) fail({}, "a skeleton without size", "a scale above 0");
  }

  void check_keys() const {
    for (const ClipChannel& channel : motion_.clip.channels) {
      if (channel.node >= motion_.joints.size())
        fail({}, "keys of joint " + std::to_string(channel.node), "one of the skeleton's joints");
      const bool weights = channel.path == ChannelPath::weights;
      const std::size_t parts = channel.interpolation == Interpolation::cubic ? 3 : 1;
      const std::size_t width = channel.path == ChannelPath::rotation ? 4 : 3;
      if (weights || channel.width != width || channel.times.empty() ||
          channel.values.size() != channel.times.size() * width * parts)
        fail(place(channel.node), "keys that aren't whole", "a value for each time");
      for (std::size_t k = 0; k < channel.times.size(); ++k) {
        if (!std::isfinite(channel.times[k]) || channel.times[k] < (k == 0 ? 0 : channel.times[k - 1]))
          fail(place(channel.node), key(k) + " at " + text_of(channel.times[k]) + " s", "times from 0 on that ascend");
        for (std::size_t i = k * width * parts; i < (k + 1) * width * parts; ++i)
          if (!std::isfinite(channel.values[i]))
            fail(place(channel.node),
                 text_of(channel.values[i]) + " in " + key(k) + " (" + path_name(channel.path) + ", " +
                     text_of(channel.times[k]) + " s)",
                 "finite numbers");
      }
    }
  }

 private:
  [[noreturn]] void fail(std::string place, std::string found, std::string expected) const {
    throw Error({.file = file_, .place = std::move(place), .found = std::move(found), .expected = std::move(expected)});
  }
  std::string place(std::size_t joint) const { return "joint " + in_quotes(motion_.joints[joint].name); }
  static std::string text_of(float number) {
    if (std::isnan(number)) return "NaN";
    std::string text;
    append_number(text, number);
    return text;
  }
  static std::string key(std::size_t k) { return "key " + std::to_string(k); }
  static std::string path_name(ChannelPath path) {
    return path == ChannelPath::rotation ? "rotation" : path == ChannelPath::scale ? "scale" : "translation";
  }
  bool is_in_ring(std::size_t joint) const {
    std::size_t steps = 0;
    for (std::size_t at = motion_.joints[joint].parent; at < motion_.joints.size(); at = motion_.joints[at].parent)
      if (at == joint || ++steps > motion_.joints.size()) return true;
    return false;
  }

  const Motion& motion_;
  const std::string& file_;
};

}  // namespace internal

/// `file` stands in the messages of errors.
inline void expect_motion(const Motion& motion, const std::string& file) {
  const internal::MotionChecker checker(motion, file);
  checker.check_joints();
  checker.check_keys();
}

/// That the clip lasts: a skeleton without one, and a single pose, move nothing.
inline void expect_clip(const Motion& motion, const std::string& file) {
  if (motion.clip.channels.empty())
    throw Error({.file = file, .found = "a skeleton without a clip", .expected = "curves that move its joints"});
  if (!(motion.clip.length() > 0))
    throw Error({.file = file,
                 .place = "clip " + in_quotes(motion.clip.name),
                 .found = "a length of 0 s",
                 .expected = "keys at two times, or one pose to be asked for by its time"});
}

}  // namespace npt::inline NPT_ABI
