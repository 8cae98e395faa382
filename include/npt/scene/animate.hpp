/// What makes a mesh move: a skeleton with skin weights and its motions, or the mesh itself frame by frame. Both are
/// added to a scene that from_mesh.hpp made, and become a clip of it.
/// Shapes    motions: [J]; frames: [V, 3]
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/from_mesh.hpp>
#include <npt/scene/largest_influences.hpp>
#include <npt/scene/scene.hpp>
#include <npt/scene/skinned_skeleton.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Adds the skeleton and the skin weights. Returns the node of joint 0; the others follow it.
inline std::size_t add_skeleton(MeshScene& made, const SkinnedSkeleton& skeleton) {
  Scene& scene = made.scene;
  const std::size_t first = scene.nodes.size();
  Skin skin{.name = "skeleton", .joints = {}, .inverse_binds = {}};
  for (std::size_t j = 0; j < skeleton.joint_count(); ++j) {
    const std::size_t parent = skeleton.parents[j];
    SceneNode node{.name = skeleton.names[j], .parent = parent == no_item ? no_item : first + parent};
    const Vec3d from_parent = parent == no_item ? skeleton.joints[j] : skeleton.joints[j] - skeleton.joints[parent];
    node.place.translation = from_parent;
    if (!skeleton.frames.empty()) {
      const Quaternion outer = inverse(skeleton.frame(parent));
      node.place.translation = outer(from_parent), node.place.rotation = outer * skeleton.frame(j);
    }
    scene.nodes.push_back(std::move(node));
    skin.joints.push_back(first + j);
    skin.inverse_binds.push_back(skeleton.frames.empty() ? Affine{Matrix3::identity(), -skeleton.joints[j]}
                                                         : inverse(skeleton.bind(j)));
  }
  scene.skins.push_back(std::move(skin));
  for (std::size_t m = 0; m < made.vertex_of.size(); ++m) {
    VertexBlock& block = scene.meshes[m].blocks.front();
    block.influences = skin_influences;
    for (const std::uint32_t v : made.vertex_of[m])
      for (const auto& influence : largest_influences(
               std::span(skeleton.influences).subspan(skeleton.start[v], skeleton.start[v + 1] - skeleton.start[v]))) {
        block.joints.push_back(influence.joint);
        block.weights.push_back(influence.weight);
      }
    scene.nodes[m].skin = scene.skins.size() - 1;
  }
  return first;
}

namespace internal {

inline std::vector<float> key_times(std::span<const double> times) {
  std::vector<float> keys;
  for (const double t : times) keys.push_back(static_cast<float>(t));
  return keys;
}

}  // namespace internal

/// Adds a clip in which joints move rigidly: frames[t][j] takes joint j's skin from the mesh's pose to frame t.
/// `first`: what add_skeleton returned.
inline void add_skeleton_clip(MeshScene& made, const SkinnedSkeleton& skeleton, std::size_t first, std::string name,
                              std::span<const double> times, std::span<const std::vector<Affine>> frames) {
  Clip clip{std::move(name), {}};
  const std::vector<float> keys = internal::key_times(times);
  for (std::size_t j = 0; j < skeleton.joint_count(); ++j) {
    const std::size_t parent = skeleton.parents[j];
    ClipChannel turn{first + j, ChannelPath::rotation, Interpolation::linear, 4, keys, {}};
    ClipChannel shift{first + j, ChannelPath::translation, Interpolation::linear, 3, keys, {}};
    Quaternion last;
    for (const std::vector<Affine>& motions : frames) {
      const Matrix3 own = motions[j].linear;
      Quaternion q = quaternion_of(parent == no_item ? own : motions[parent].linear.transposed() * own);
      if (!skeleton.frames.empty()) q = inverse(skeleton.frame(parent)) * q * skeleton.frame(j);
      if (dot(q, last) < 0) q = q * -1.0;  // neighbours on one side, for players that don't look for the shorter way
      last = q;
      for (const double c : {q.x, q.y, q.z, q.w}) turn.values.push_back(static_cast<float>(c));
      const Vec3d place = motions[j](skeleton.joints[j]);
      for (const double c : {place.x, place.y, place.z}) shift.values.push_back(static_cast<float>(c));
    }
    clip.channels.push_back(std::move(turn));
    if (parent == no_item) clip.channels.push_back(std::move(shift));
  }
  made.scene.clips.push_back(std::move(clip));
}

/// Adds a clip that goes through the frames, each a morph target, with normals where the scene has them. frames: [V, 3]
/// positions of the mesh's vertices.
inline void add_morph_clip(MeshScene& made, const Mesh& mesh, std::string name, std::span<const double> times,
                           std::span<const std::vector<float>> frames) {
  Clip clip{std::move(name), {}};
  const std::vector<float> keys = internal::key_times(times);
  for (std::size_t m = 0; m < made.vertex_of.size(); ++m) {
    SceneMesh& shown = made.scene.meshes[m];
    VertexBlock& block = shown.blocks.front();
    shown.weights.assign(frames.size(), 0.0);
    block.targets.resize(frames.size());
    ClipChannel channel{m, ChannelPath::weights, Interpolation::linear, frames.size(), keys, {}};
    channel.values.assign(frames.size() * frames.size(), 0.0F);
    for (std::size_t t = 0; t < frames.size(); ++t) channel.values[t * frames.size() + t] = 1;
    clip.channels.push_back(std::move(channel));
  }
  Mesh moved = mesh;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    std::ranges::copy(frames[t], moved.coordinates().begin());
    moved.normals = mesh.normals, moved.corner_normal = mesh.corner_normal;
    recompute_normals(moved);
    const std::vector<Vec3f> of_vertices = vertex_normals(moved);
    for (std::size_t m = 0; m < made.vertex_of.size(); ++m) {
      VertexBlock& block = made.scene.meshes[m].blocks.front();
      MorphTarget& target = block.targets[t];
      for (std::size_t v = 0; v < block.positions.size(); ++v)
        target.positions.push_back(moved.positions[made.vertex_of[m][v]] - block.positions[v]);
      if (block.normals.empty()) continue;
      target.normals = part_normals(made, m, moved, of_vertices);
      for (std::size_t v = 0; v < block.normals.size(); ++v) target.normals[v] = target.normals[v] - block.normals[v];
    }
  }
  made.scene.clips.push_back(std::move(clip));
}

}  // namespace npt::inline NPT_ABI
