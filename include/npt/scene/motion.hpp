/// A motion as people hold it: a skeleton and the curves that move its joints, with or without a mesh.
///   Motion motion = motion_of(scene, clip, "walk.glb");       scene/motion_of_scene.hpp; io/bvh.hpp has BVH's
///   std::vector<Affine> worlds = joint_worlds(motion, 0.5);   half a second into it, in metres with y up
/// Joints keep the file's own coordinates; `base` takes them to metres with y up, so that a writer gives back the
/// numbers that it was given.
/// Numerics  transforms in double; keys are the clip's floats
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

struct MotionJoint {
  std::string name{};
  std::size_t parent = no_item;
  NodePlace rest{};
  bool end = false;            ///< only marks where its parent ends, as BVH's End Sites
  std::size_t node = no_item;  ///< of the scene that it was made of; of a glTF file's, the file's own number
  /// In metres with y up, as its skin was bound: files may stand in another pose at rest.
  std::optional<Affine> bind{};
  std::string bone{};  ///< which one it is, as a VRM file says it: "leftUpperArm"
};

/// Invariants  a joint stands before its descendants, and these before any other joint; channels of `clip` name joints,
///             and none has weights
struct Motion {
  std::vector<MotionJoint> joints{};
  Clip clip{};
  Affine base{};    ///< from the coordinates of joints without parent to metres, y up
  double rate = 0;  ///< frames a second at which the curves were sampled; 0: keys of their own, or none
};

/// The place that a map has where it shears nothing: axes keep their directions and lengths.
inline NodePlace place_of(const Affine& map) {
  std::array<Vec3d, 3> columns = map.linear.columns();
  Vec3d size{length(columns[0]), length(columns[1]), length(columns[2])};
  if (map.linear.determinant() < 0) size.x = -size.x;
  const auto unit = [](Vec3d axis, double scale) { return scale != 0 ? axis / scale : Vec3d{}; };
  const Matrix3 turn =
      Matrix3::from_columns(unit(columns[0], size.x), unit(columns[1], size.y), unit(columns[2], size.z));
  const bool flat = size.x == 0 || size.y == 0 || size.z == 0;
  return {map.shift, flat ? Quaternion{} : quaternion_of(turn), size};
}

/// Sets what a channel moves, which isn't weights, to its value at a time.
inline void set_from(const ClipChannel& channel, double time, NodePlace& place) {
  std::array<double, 4> value{};
  channel.sample(time, value);
  if (channel.path == ChannelPath::rotation)
    place.rotation = {value[0], value[1], value[2], value[3]};
  else
    (channel.path == ChannelPath::scale ? place.scale : place.translation) = {value[0], value[1], value[2]};
}

/// Where each joint stands in its parent at a time; nothing: at rest.
inline std::vector<NodePlace> local_places(const Motion& motion, std::optional<double> time) {
  std::vector<NodePlace> places;
  places.reserve(motion.joints.size());
  for (const MotionJoint& joint : motion.joints) places.push_back(joint.rest);
  if (!time) return places;
  for (const ClipChannel& channel : motion.clip.channels) set_from(channel, *time, places[channel.node]);
  return places;
}

/// From each joint's own coordinates to metres with y up.
inline std::vector<Affine> joint_worlds(const Motion& motion, std::optional<double> time) {
  const std::vector<NodePlace> places = local_places(motion, time);
  std::vector<Affine> worlds(places.size());
  for (std::size_t j = 0; j < places.size(); ++j) {
    const std::size_t parent = motion.joints[j].parent;
    worlds[j] = (parent == no_item ? motion.base : worlds[parent]) * places[j].affine();
  }
  return worlds;
}

/// How far a joint is from its parent, in metres. Above scales that differ along axes, as files of many makers have them
/// (by 5e-5 in thighs), rotations alone change what lies between two joints. This is what an even scale of the same
/// volume gives, and so changes only where a motion moves the joint in its parent, or scales.
/// Requires  a joint with a parent, whose scale isn't 0
inline double bone_length(const Motion& motion, const std::vector<Affine>& worlds, std::size_t joint) {
  const Affine& parent = worlds[motion.joints[joint].parent];
  return length(inverse(parent)(worlds[joint].shift)) * std::cbrt(std::abs(parent.linear.determinant()));
}

inline std::vector<Vec3d> joint_positions(const Motion& motion, std::optional<double> time) {
  std::vector<Vec3d> positions;
  for (const Affine& world : joint_worlds(motion, time)) positions.push_back(world.shift);
  return positions;
}

/// From each joint's own coordinates to metres with y up where its skin was bound to it; what isn't bound stands with
/// its parent, or as at rest.
inline std::vector<Affine> bound_worlds(const Motion& motion) {
  std::vector<Affine> worlds(motion.joints.size());
  for (std::size_t j = 0; j < worlds.size(); ++j) {
    const MotionJoint& joint = motion.joints[j];
    worlds[j] =
        joint.bind ? *joint.bind : (joint.parent == no_item ? motion.base : worlds[joint.parent]) * joint.rest.affine();
  }
  return worlds;
}

/// Frames a second of a clip whose keys lie on frames, also where some were left out; 0 for keys of any other kind.
inline double key_rate(const Clip& clip) {
  const auto most = std::ranges::max_element(clip.channels, {}, [](const ClipChannel& c) { return c.times.size(); });
  if (most == clip.channels.end() || most->times.size() < 2) return 0;
  double least = 0;
  const auto step = [&](std::size_t k) {
    return static_cast<double>(most->times[k]) - static_cast<double>(most->times[k - 1]);
  };
  for (std::size_t k = 1; k < most->times.size(); ++k)
    if (step(k) > 1e-4 && (least == 0 || step(k) < least)) least = step(k);
  if (least == 0) return 0;
  double frames = 0;
  for (std::size_t k = 1; k < most->times.size(); ++k) {
    const double steps = step(k) / least;
    if (std::abs(steps - std::round(steps)) > 0.02 * std::max(1.0, std::round(steps))) return 0;
    frames += std::round(steps);
  }
  // Times are floats: a rate near a whole number is that number.
  const double rate = frames / (static_cast<double>(most->times.back()) - static_cast<double>(most->times.front()));
  return std::abs(rate - std::round(rate)) < 0.002 * rate ? std::round(rate) : rate;
}

/// Frames a second at which its frames are its keys, to the last; `otherwise`, where these don't lie on frames. A file
/// that writes 1/30 s as 0.0333 has a rate of 30, but the last of 300 frames lies before 299 / 30 s.
inline double sampling_rate(const Motion& motion, double otherwise = 30) {
  const double length = motion.clip.length(), frames = std::round(length * motion.rate);
  if (motion.rate == 0 || frames == 0) return motion.rate > 0 ? motion.rate : otherwise;
  return std::abs(length * motion.rate - frames) < 0.1 ? frames / length : motion.rate;
}

/// Metres in one unit of the joints' own numbers.
inline double metres_a_unit(const Motion& motion) { return std::cbrt(std::abs(motion.base.linear.determinant())); }

/// The axis of the joints' own numbers that points up: "y", "-z", ...
inline std::string_view up_axis(const Motion& motion) {
  const Vec3d up = motion.base.linear.rows[1];  // how much each axis rises
  const std::array<double, 3> rise{up.x, up.y, up.z};
  const auto axis =
      static_cast<std::size_t>(std::ranges::max_element(rise, {}, [](double v) { return std::abs(v); }) - rise.begin());
  constexpr std::array<std::string_view, 6> names{"x", "-x", "y", "-y", "z", "-z"};
  return names[2 * axis + (rise[axis] < 0 ? 1 : 0)];
}

}  // namespace npt::inline NPT_ABI
