/// A motion on a scene's own joints as one more of its clips, or one of its poses as its rest: for scenes of files that
/// aren't glTF (io/gltf_patch.hpp puts both into those that are).
///   Scene hero = with_joined_nodes(read);                     scene/joined_nodes.hpp
///   add_clip(hero, retarget(walk, roles_of_walk, motion_of(hero, nullptr, "hero.fbx"), roles_of_hero), "Walk");
/// Requires  MotionJoint::node: nodes of the scene
#pragma once

#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Whether a rest that was another is the same now, but for rounding.
inline bool is_same_place(Vec3d a, Vec3d b) { return length(a - b) <= 1e-6 * length(a); }
inline bool is_same_rotation(Quaternion a, Quaternion b) { return 1 - std::abs(dot(a, b)) <= 1e-12; }

/// A name that no clip has: the one that is wanted, or with "_2", "_3", ... behind it.
inline std::string free_clip_name(const std::vector<std::string>& names, const std::string& wanted) {
  std::string name = wanted;
  for (std::size_t n = 2; std::find(names.begin(), names.end(), name) != names.end(); ++n)
    name = wanted + "_" + std::to_string(n);
  return name;
}

namespace internal {

/// What a clip moves has a place instead of a matrix.
inline void give_place(SceneNode& node) {
  if (!node.matrix) return;
  node.place = place_of(*node.matrix);
  node.matrix.reset();
}

inline ClipChannel constant_curve(std::size_t node, ChannelPath path, const std::vector<double>& values) {
  ClipChannel c{.node = node, .path = path, .width = values.size(), .times = {0}};
  for (const double value : values) c.values.push_back(static_cast<float>(value));
  return c;
}

/// Curves that stay at `old`, for what of it isn't as in `now`.
inline std::vector<ClipChannel> changed_parts(std::size_t node, const NodePlace& old, const NodePlace& now) {
  std::vector<ClipChannel> parts;
  const Vec3d t = old.translation, s = old.scale;
  const Quaternion r = old.rotation;
  if (!is_same_place(t, now.translation))
    parts.push_back(constant_curve(node, ChannelPath::translation, {t.x, t.y, t.z}));
  if (!is_same_rotation(r, now.rotation))
    parts.push_back(constant_curve(node, ChannelPath::rotation, {r.x, r.y, r.z, r.w}));
  if (!is_same_place(s, now.scale)) parts.push_back(constant_curve(node, ChannelPath::scale, {s.x, s.y, s.z}));
  return parts;
}

}  // namespace internal

/// One more clip; its name, which is another where the scene has a clip of that one. name: empty: the motion's own
inline std::string add_clip(Scene& scene, const Motion& motion, const std::string& name) {
  std::vector<std::string> names;
  for (const Clip& clip : scene.clips) names.push_back(clip.name);
  const std::string wanted = !name.empty() ? name : !motion.clip.name.empty() ? motion.clip.name : "motion";
  Clip clip{free_clip_name(names, wanted), motion.clip.channels};
  for (ClipChannel& channel : clip.channels) {
    channel.node = motion.joints[channel.node].node;
    internal::give_place(scene.nodes[channel.node]);
  }
  scene.clips.push_back(std::move(clip));
  return scene.clips.back().name;
}

/// The pose at a time as the nodes' rest. Clips get the old rest of what they don't move, and so play as before.
inline void set_rest(Scene& scene, const Motion& motion, double time) {
  const std::vector<NodePlace> places = local_places(motion, time);
  std::vector<ClipChannel> old;
  for (std::size_t j = 0; j < places.size(); ++j) {
    if (motion.joints[j].node == no_item) continue;
    SceneNode& node = scene.nodes[motion.joints[j].node];
    const NodePlace own = node.matrix ? place_of(*node.matrix) : node.place;
    std::vector<ClipChannel> parts = internal::changed_parts(motion.joints[j].node, own, places[j]);
    if (parts.empty()) continue;
    node.matrix.reset();
    node.place = places[j];
    for (ClipChannel& part : parts) old.push_back(std::move(part));
  }
  for (Clip& clip : scene.clips) {
    const auto moves = [&own = clip.channels](const ClipChannel& part) {
      return std::any_of(own.begin(), own.end(),
                         [&](const ClipChannel& c) { return c.node == part.node && c.path == part.path; });
    };
    for (const ClipChannel& part : old)
      if (!moves(part)) clip.channels.push_back(part);
  }
}

}  // namespace npt::inline NPT_ABI
