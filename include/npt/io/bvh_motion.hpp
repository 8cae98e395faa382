/// A BVH file as a motion, and a motion as a BVH file.
/// A joint's rotation is the product of its rotation channels in their order, the last one applied first. Positions
/// stand for the offset, as in Blender and MotionBuilder, where a file gives them.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/io/bvh_file.hpp>
#include <npt/io/json.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal::bvh {

inline bool is_rotation(BvhChannel channel) { return channel >= BvhChannel::x_rotation; }

/// Of one joint in one frame.
inline NodePlace place_of_channels(const BvhJoint& joint, std::span<const double> values) {
  NodePlace place{.translation = joint.offset};
  for (std::size_t c = 0; c < joint.channels.size(); ++c) {
    const auto kind = static_cast<std::size_t>(joint.channels[c]);
    if (is_rotation(joint.channels[c])) {
      const double half = values[c] * std::numbers::pi / 360;
      std::array<double, 3> axis{};
      axis[kind - 3] = std::sin(half);
      place.rotation = place.rotation * Quaternion{axis[0], axis[1], axis[2], std::cos(half)};
    } else {
      (kind == 0 ? place.translation.x : kind == 1 ? place.translation.y : place.translation.z) = values[c];
    }
  }
  place.rotation = normalised(place.rotation);
  return place;
}

/// Degrees about z, then x, then y, each about the axis that the ones before left: BVH's usual order.
inline Vec3d zxy_degrees(const Matrix3& m) {
  const double x = std::asin(std::clamp(m.rows[2].y, -1.0, 1.0));
  const bool locked = std::abs(m.rows[2].y) > 1 - 1e-12;  // z and y turn about one axis: all of it is z's
  const double z = locked ? std::atan2(m.rows[1].x, m.rows[0].x) : std::atan2(-m.rows[0].y, m.rows[1].y);
  const double y = locked ? 0 : std::atan2(-m.rows[2].x, m.rows[2].z);
  return Vec3d{x, y, z} * (180 / std::numbers::pi);
}

/// The angle that is the same turn and nearest to another one: curves that people edit don't jump.
inline double near(double degrees, double last) { return degrees + 360 * std::round((last - degrees) / 360); }

}  // namespace internal::bvh

/// Joints without rotation at rest; `base` is left the identity. Names become UTF-8, which other formats ask for.
inline Motion motion_of(const Bvh& bvh, const std::string& name) {
  Motion motion;
  motion.clip.name = internal::utf8_of(name);
  motion.rate = bvh.frames > 1 ? 1 / bvh.frame_time : 0;
  if (std::abs(motion.rate - std::round(motion.rate)) < 0.002 * motion.rate) motion.rate = std::round(motion.rate);
  std::vector<float> times;
  for (std::size_t f = 0; f < bvh.frames; ++f)
    times.push_back(static_cast<float>(static_cast<double>(f) * bvh.frame_time));
  std::size_t first = 0;
  const std::size_t width = bvh.channel_count();
  for (std::size_t j = 0; j < bvh.joints.size(); ++j) {
    const BvhJoint& joint = bvh.joints[j];
    const std::string& own = bvh.joints[joint.end ? joint.parent : j].name;
    MotionJoint made{.name = internal::utf8_of(own), .parent = joint.parent, .end = joint.end};
    made.rest.translation = joint.offset;
    if (joint.end) made.name += "_end";
    motion.joints.push_back(std::move(made));
    ClipChannel turn{j, ChannelPath::rotation, Interpolation::linear, 4, times, {}};
    ClipChannel shift{j, ChannelPath::translation, Interpolation::linear, 3, times, {}};
    for (std::size_t f = 0; f < bvh.frames; ++f) {
      const NodePlace place = internal::bvh::place_of_channels(
          joint, std::span(bvh.values).subspan(f * width + first, joint.channels.size()));
      for (const double c : {place.rotation.x, place.rotation.y, place.rotation.z, place.rotation.w})
        turn.values.push_back(static_cast<float>(c));
      for (const double c : {place.translation.x, place.translation.y, place.translation.z})
        shift.values.push_back(static_cast<float>(c));
    }
    first += joint.channels.size();
    if (std::ranges::any_of(joint.channels, internal::bvh::is_rotation))
      motion.clip.channels.push_back(std::move(turn));
    if (!std::ranges::all_of(joint.channels, internal::bvh::is_rotation))
      motion.clip.channels.push_back(std::move(shift));
  }
  return motion;
}

/// A motion as frames at a rate, y up, in `unit` metres. Roots keep their places; other joints have rotations about
/// their offsets at rest, so that lengths stay what they are at rest. What shears or scales over time is lost.
/// Requires  at least one joint, and one root
inline Bvh bvh_of(const Motion& motion, double rate, double unit = 0.01) {
  using enum BvhChannel;
  const std::vector<Affine> rest = joint_worlds(motion, std::nullopt);
  std::vector<Quaternion> at_rest;
  at_rest.reserve(rest.size());
  for (const Affine& world : rest) at_rest.push_back(place_of(world).rotation);
  Bvh bvh{.frame_time = 1 / rate};
  for (std::size_t j = 0; j < motion.joints.size(); ++j) {
    const MotionJoint& from = motion.joints[j];
    BvhJoint joint{.name = from.end ? "" : from.name, .parent = from.parent, .end = from.end};
    joint.offset = (from.parent == no_item ? rest[j].shift : rest[j].shift - rest[from.parent].shift) / unit;
    if (from.parent == no_item) joint.channels = {x_position, y_position, z_position};
    if (!from.end) joint.channels.insert(joint.channels.end(), {z_rotation, x_rotation, y_rotation});
    bvh.joints.push_back(std::move(joint));
  }
  std::vector<Vec3d> last(motion.joints.size());
  for (const double time : frame_times(motion.clip, rate)) {
    const std::vector<Affine> worlds = joint_worlds(motion, time);
    std::vector<Quaternion> turns(worlds.size());
    ++bvh.frames;
    for (std::size_t j = 0; j < worlds.size(); ++j) {
      const std::size_t parent = motion.joints[j].parent;
      turns[j] = normalised(place_of(worlds[j]).rotation * inverse(at_rest[j]));
      if (parent == no_item)
        for (const double c : {worlds[j].shift.x, worlds[j].shift.y, worlds[j].shift.z}) bvh.values.push_back(c / unit);
      if (bvh.joints[j].end) continue;
      const Vec3d angles =
          internal::bvh::zxy_degrees(matrix_of(parent == no_item ? turns[j] : inverse(turns[parent]) * turns[j]));
      last[j] = {internal::bvh::near(angles.x, last[j].x), internal::bvh::near(angles.y, last[j].y),
                 internal::bvh::near(angles.z, last[j].z)};
      for (const double c : {last[j].z, last[j].x, last[j].y}) bvh.values.push_back(c);
    }
  }
  return bvh;
}

}  // namespace npt::inline NPT_ABI
