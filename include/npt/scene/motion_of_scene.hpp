/// The motion of a scene's clip: the skeleton that it moves, with or without a mesh.
///   skeleton      of several in a scene, the one that the clip moves most; without a clip, that of the skins
///   joints        its nodes, meshes left out that nothing moves. What stands above it and stands still is in `base`
///   split nodes   assimp gives a joint of an FBX file a node for each of its pivots: they become one joint again
/// Numerics  curves are the clip's own; those of split nodes are sampled at all their keys, and linear between
/// Errors    npt::Error for a scene without a skeleton
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/joined_nodes.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

class MotionMaker {
 public:
  MotionMaker(const Scene& scene, const Clip* clip, const std::string& file)
      : scene_(scene), clip_(clip), file_(file), children_(scene.nodes.size()) {
    for (std::size_t n = 0; n < scene.nodes.size(); ++n)
      (scene.nodes[n].parent == no_item ? roots_ : children_[scene.nodes[n].parent]).push_back(n);
    find_moving();
    count_below();
  }

  Motion make() {
    root_ = choose();
    Motion motion;
    motion.base = world_of(scene_.nodes[root_].parent);
    add_joints(motion, root_);
    for (const Skin& skin : scene_.skins) add_binds(motion, skin);
    if (clip_ != nullptr) add_clip(motion);
    motion.rate = key_rate(motion.clip);
    return motion;
  }

 private:
  /// A skeleton has at least so many joints: the legs of one alone don't count as two of them.
  static constexpr std::size_t least_joints = 10;

  void find_moving() {
    moving_.resize(scene_.nodes.size());
    for (const Skin& skin : scene_.skins)
      for (const std::size_t joint : skin.joints) moving_[joint] = true;
    for (const Clip& clip : scene_.clips)
      for (const ClipChannel& channel : clip.channels)
        if (channel.path != ChannelPath::weights) moving_[channel.node] = true;
    if (std::find(moving_.begin(), moving_.end(), true) != moving_.end()) return;
    // A rig alone, which neither a skin nor a clip uses yet: nodes without a mesh are its joints.
    const auto has_no_mesh = [](const SceneNode& node) { return node.mesh == no_item; };
    if (std::count_if(scene_.nodes.begin(), scene_.nodes.end(), has_no_mesh) < std::ptrdiff_t{least_joints}) return;
    std::transform(scene_.nodes.begin(), scene_.nodes.end(), moving_.begin(), has_no_mesh);
  }

  void count_below() {
    bones_.resize(scene_.nodes.size());
    moved_.resize(scene_.nodes.size());
    const std::vector<std::size_t> order = nodes_below(roots_);
    for (auto it = order.rbegin(); it != order.rend(); ++it) {
      const std::size_t n = *it, parent = scene_.nodes[n].parent;
      bones_[n] += scene_.nodes[n].mesh == no_item || moving_[n] ? 1U : 0U;
      moved_[n] += moving_[n] ? 1U : 0U;
      if (parent != no_item) bones_[parent] += bones_[n], moved_[parent] += moved_[n];
    }
  }

  /// Each before its children.
  std::vector<std::size_t> nodes_below(const std::vector<std::size_t>& roots) const {
    std::vector<std::size_t> order, open(roots.rbegin(), roots.rend());
    while (!open.empty()) {
      const std::size_t n = open.back();
      open.pop_back();
      order.push_back(n);
      open.insert(open.end(), children_[n].rbegin(), children_[n].rend());
    }
    return order;
  }

  Affine own_of(std::size_t node) const { return own_map(scene_.nodes[node]); }
  Affine world_of(std::size_t node) const {
    Affine world;
    for (; node != no_item; node = scene_.nodes[node].parent) world = own_of(node) * world;
    return world;
  }

  /// The roots of the scene's skeletons: behind nodes that stand still and only hold one, or several whole ones.
  std::vector<std::size_t> skeletons() const {
    std::vector<std::size_t> found, open;
    for (const std::size_t n : roots_)
      if (moved_[n] > 0) open.push_back(n);
    while (!open.empty()) {
      const std::size_t n = open.back();
      open.pop_back();
      std::vector<std::size_t> parts, whole;
      for (const std::size_t child : children_[n]) {
        if (bones_[child] > 1 || moving_[child]) parts.push_back(child);
        if (bones_[child] >= least_joints && moved_[child] > 0) whole.push_back(child);
      }
      if (!moving_[n] && whole.size() > 1)
        open.insert(open.end(), whole.begin(), whole.end());
      else if (!moving_[n] && parts.size() == 1)
        open.push_back(parts.front());
      else
        found.push_back(n);
    }
    return found;
  }

  std::size_t choose() const {
    const std::vector<std::size_t> roots = skeletons();
    if (roots.empty())
      throw Error({.file = file_, .found = "no skeleton", .expected = "joints that a skin or a clip moves"});
    std::vector<std::size_t> keys(scene_.nodes.size());
    if (clip_ != nullptr)
      for (const ClipChannel& channel : clip_->channels)
        if (channel.path != ChannelPath::weights) keys[channel.node] += channel.is_constant() ? 1U : 1000U;
    std::size_t best = roots.front();
    std::pair<std::size_t, std::size_t> most{};
    for (const std::size_t root : roots) {
      std::pair<std::size_t, std::size_t> score{0, moved_[root]};
      for (const std::size_t n : nodes_below({root})) score.first += keys[n];
      if (score > most) most = score, best = root;
    }
    return best;
  }

  /// A part of a joint that a reader made, not an author.
  bool is_split(std::size_t node) const { return is_part_of_joint(scene_.nodes[node]) && !children_[node].empty(); }
  bool is_joint(std::size_t node) const {
    return scene_.nodes[node].mesh == no_item || moving_[node] || moved_[node] > 0;
  }

  void add_joints(Motion& motion, std::size_t root) {
    joint_of_.assign(scene_.nodes.size(), no_item);
    for (const std::size_t n : nodes_below({root})) {
      if (!is_joint(n) || is_split(n)) continue;
      Affine rest = own_of(n);
      std::size_t parent = n == root ? no_item : scene_.nodes[n].parent;
      for (; parent != no_item && is_split(parent); parent = parent == root ? no_item : scene_.nodes[parent].parent)
        rest = own_of(parent) * rest;
      if (parent != no_item && joint_of_[parent] == no_item) continue;  // below a mesh that nothing moves
      const bool split = n != root && is_split(scene_.nodes[n].parent);
      joint_of_[n] = motion.joints.size();
      const bool tip = children_[n].empty() && !moving_[n];
      MotionJoint joint{.name = scene_.nodes[n].name, .parent = parent == no_item ? no_item : joint_of_[parent]};
      joint.rest = split || scene_.nodes[n].matrix ? place_of(rest) : scene_.nodes[n].place;
      joint.end = tip, joint.node = n, joint.bone = scene_.nodes[n].bone;
      motion.joints.push_back(std::move(joint));
    }
  }

  /// Binding matrices are relative to the mesh, whose node's place doesn't count: the skin's topmost joint is taken to
  /// stand where it was bound.
  void add_binds(Motion& motion, const Skin& skin) const {
    std::vector<std::size_t> number(motion.joints.size(), no_item);
    std::size_t top = no_item;
    for (std::size_t i = skin.joints.size(); i-- > 0;) {
      const std::size_t joint = joint_of_[skin.joints[i]];
      if (joint == no_item || !(std::abs(skin.inverse_binds[i].linear.determinant()) > 0)) continue;
      number[joint] = i;
      top = std::min(top, joint);
    }
    if (top == no_item) return;
    const Affine from_mesh = world_of(motion.joints[top].node) * skin.inverse_binds[number[top]];
    for (std::size_t j = 0; j < number.size(); ++j)
      if (number[j] != no_item && !motion.joints[j].bind) {
        const Affine bind = from_mesh * inverse(skin.inverse_binds[number[j]]);
        if (is_finite(bind.shift)) motion.joints[j].bind = bind;
      }
  }

  /// The nodes that make up a joint, the outermost first.
  std::vector<std::size_t> parts_of(const MotionJoint& joint) const {
    std::vector<std::size_t> parts{joint.node};
    for (std::size_t n = joint.node; n != root_ && is_split(scene_.nodes[n].parent);)
      parts.push_back(n = scene_.nodes[n].parent);
    std::ranges::reverse(parts);
    return parts;
  }

  void add_clip(Motion& motion) {
    motion.clip.name = clip_->name;
    std::vector<std::vector<const ClipChannel*>> of_node(scene_.nodes.size());
    for (const ClipChannel& channel : clip_->channels)
      if (channel.path != ChannelPath::weights) of_node[channel.node].push_back(&channel);
    for (std::size_t j = 0; j < motion.joints.size(); ++j) {
      const std::vector<std::size_t> parts = parts_of(motion.joints[j]);
      std::vector<const ClipChannel*> channels;
      for (const std::size_t part : parts) channels.insert(channels.end(), of_node[part].begin(), of_node[part].end());
      if (channels.empty()) continue;
      if (parts.size() > 1) {
        for (ClipChannel& curve : joined_curves(scene_, j, parts, channels))
          motion.clip.channels.push_back(std::move(curve));
        continue;
      }
      for (const ClipChannel* channel : channels) {
        motion.clip.channels.push_back(*channel);
        motion.clip.channels.back().node = j;
      }
    }
  }

  const Scene& scene_;
  const Clip* clip_;
  const std::string& file_;
  std::vector<std::size_t> roots_;
  std::vector<std::vector<std::size_t>> children_;
  std::vector<bool> moving_;                ///< [nodes] joints of skins, and what a clip moves
  std::vector<std::size_t> bones_, moved_;  ///< [nodes] nodes below that could be joints; that are moving
  std::vector<std::size_t> joint_of_;
  std::size_t root_ = 0;
};

}  // namespace internal

/// `clip`: of the scene; nullptr: the skeleton alone. `file` stands in the messages of errors.
inline Motion motion_of(const Scene& scene, const Clip* clip, const std::string& file) {
  return internal::MotionMaker(scene, clip, file).make();
}

/// Whether something in a scene is moved by joints.
inline bool has_skeleton(const Scene& scene) {
  if (!scene.skins.empty()) return true;
  return std::ranges::any_of(scene.clips, [](const Clip& clip) {
    return std::ranges::any_of(clip.channels, [](const ClipChannel& c) { return c.path != ChannelPath::weights; });
  });
}

}  // namespace npt::inline NPT_ABI
