/// assimp gives a joint of an FBX file a node for each of its pivots: they become one node again, with one place.
/// Numerics  their curves are sampled at all their keys, and linear between
#pragma once

#include <npt/base/affine.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// A part of a joint that a reader made, not an author.
inline bool is_part_of_joint(const SceneNode& node) { return node.name.find("_$AssimpFbx$_") != std::string::npos; }

inline Affine own_map(const SceneNode& node) { return node.matrix ? *node.matrix : node.place.affine(); }

inline Affine own_map_at(const Scene& scene, std::size_t node, const std::vector<const ClipChannel*>& channels,
                         double time) {
  if (scene.nodes[node].matrix) return *scene.nodes[node].matrix;
  NodePlace place = scene.nodes[node].place;
  for (const ClipChannel* channel : channels)
    if (channel->node == node) set_from(*channel, time, place);
  return place.affine();
}

/// The curves of the node that stands for `parts`, the outermost first. channels: those that move the parts
inline std::array<ClipChannel, 3> joined_curves(const Scene& scene, std::size_t node,
                                                const std::vector<std::size_t>& parts,
                                                const std::vector<const ClipChannel*>& channels) {
  std::vector<float> times;
  for (const ClipChannel* channel : channels) times.insert(times.end(), channel->times.begin(), channel->times.end());
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  ClipChannel shift{node, ChannelPath::translation, Interpolation::linear, 3, times, {}};
  ClipChannel turn{node, ChannelPath::rotation, Interpolation::linear, 4, times, {}};
  ClipChannel size{node, ChannelPath::scale, Interpolation::linear, 3, times, {}};
  for (const float time : times) {
    Affine whole;
    for (const std::size_t part : parts) whole = whole * own_map_at(scene, part, channels, static_cast<double>(time));
    const NodePlace place = place_of(whole);
    const auto add = [](ClipChannel& to, auto... values) { (to.values.push_back(static_cast<float>(values)), ...); };
    add(shift, place.translation.x, place.translation.y, place.translation.z);
    add(turn, place.rotation.x, place.rotation.y, place.rotation.z, place.rotation.w);
    add(size, place.scale.x, place.scale.y, place.scale.z);
  }
  return {std::move(shift), std::move(turn), std::move(size)};
}

class NodeJoiner {
 public:
  explicit NodeJoiner(const Scene& scene)
      : scene_(scene), owner_(scene.nodes.size()), number_(owner_), parts_(owner_.size()) {
    find_parts();
  }

  Scene join() {
    Scene result = scene_;
    result.nodes.clear();
    for (std::size_t n = 0; n < owner_.size(); ++n) {
      if (owner_[n] != n) continue;
      number_[n] = result.nodes.size();
      result.nodes.push_back(joined(n));
    }
    for (SceneNode& node : result.nodes)
      if (node.parent != no_item) node.parent = number_[node.parent];
    for (std::size_t& n : result.shown) n = number_[n];
    for (Skin& skin : result.skins)
      for (std::size_t& joint : skin.joints) joint = number_[joint];
    for (Clip& clip : result.clips) clip = joined(clip);
    return result;
  }

 private:
  /// owner_: of a part that goes, the node that stands for it; of others, themselves.
  void find_parts() {
    const std::size_t count = owner_.size();
    std::vector<std::size_t> children(count);
    for (const SceneNode& node : scene_.nodes)
      if (node.parent != no_item) ++children[node.parent];
    std::vector<bool> stays(count);
    for (const Skin& skin : scene_.skins)
      for (const std::size_t joint : skin.joints) stays[joint] = true;
    for (std::size_t n = 0; n < count; ++n)
      if (!is_part_of_joint(scene_.nodes[n]) || scene_.nodes[n].mesh != no_item || children[n] != 1) stays[n] = true;
    for (std::size_t n = 0; n < count; ++n) {
      if (!stays[n]) continue;
      for (std::size_t part = n;;) {
        owner_[part] = n;
        parts_[n].insert(parts_[n].begin(), part);
        part = scene_.nodes[part].parent;
        if (part == no_item || stays[part]) break;
      }
    }
  }

  SceneNode joined(std::size_t number) const {
    SceneNode node = scene_.nodes[number];
    const std::vector<std::size_t>& parts = parts_[number];
    if (parts.size() < 2) return node;
    Affine whole;
    for (const std::size_t part : parts) whole = whole * own_map(scene_.nodes[part]);
    node.place = place_of(whole);
    node.matrix.reset();
    node.parent = scene_.nodes[parts.front()].parent;
    return node;
  }

  Clip joined(const Clip& clip) const {
    Clip result{clip.name, {}};
    std::vector<std::vector<const ClipChannel*>> of_node(owner_.size());
    for (const ClipChannel& channel : clip.channels) {
      if (channel.path == ChannelPath::weights || parts_[owner_[channel.node]].size() < 2) {
        result.channels.push_back(channel);
        result.channels.back().node = number_[channel.node];
      } else {
        of_node[owner_[channel.node]].push_back(&channel);
      }
    }
    for (std::size_t n = 0; n < of_node.size(); ++n)
      if (!of_node[n].empty())
        for (ClipChannel& curve : joined_curves(scene_, number_[n], parts_[n], of_node[n]))
          result.channels.push_back(std::move(curve));
    return result;
  }

  const Scene& scene_;
  std::vector<std::size_t> owner_, number_;
  std::vector<std::vector<std::size_t>> parts_;  ///< [nodes] the outermost first, and the node itself
};

}  // namespace internal

/// The scene without nodes that are parts of others. A part that holds a mesh, several nodes or a joint of a skin stays.
inline Scene with_joined_nodes(const Scene& scene) { return internal::NodeJoiner(scene).join(); }

}  // namespace npt::inline NPT_ABI
