/// What a BVH file holds: a tree of joints with offsets, and a row of numbers a frame.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/scene/scene.hpp>

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

enum class BvhChannel { x_position, y_position, z_position, x_rotation, y_rotation, z_rotation };

inline constexpr std::array<std::string_view, 6> bvh_channel_names{"Xposition", "Yposition", "Zposition",
                                                                   "Xrotation", "Yrotation", "Zrotation"};

struct BvhJoint {
  std::string name{};  ///< empty for an End Site
  std::size_t parent = no_item;
  Vec3d offset{};
  std::vector<BvhChannel> channels{};  ///< in the file's order; each once
  bool end = false;                    ///< an End Site: without channels and children

  friend bool operator==(const BvhJoint&, const BvhJoint&) = default;
};

/// Invariants  joint 0 is the only root, parents stand before children, all numbers are finite
struct Bvh {
  std::vector<BvhJoint> joints{};  ///< in the file's order
  double frame_time = 0;           ///< seconds
  std::size_t frames = 0;
  std::vector<double> values{};  ///< [frames, channels] joint by joint; rotations in degrees

  std::size_t channel_count() const {
    std::size_t count = 0;
    for (const BvhJoint& joint : joints) count += joint.channels.size();
    return count;
  }
  friend bool operator==(const Bvh&, const Bvh&) = default;
};

}  // namespace npt::inline NPT_ABI
