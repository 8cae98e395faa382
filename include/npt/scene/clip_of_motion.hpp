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

/// Curves that stay at a place: of translation, rotation and scale.
inline std::vector<ClipChannel> constant_curves(std::size_t node, const NodePlace& place) {
  const Vec3d t = place.translation, s = place.scale;
  const Quaternion r = place.rotation;
  return {constant_curve(node, ChannelPath::translation, {t.x, t.y, t.z}),
          constant_curve(node, ChannelPath::rotation, {r.x, r.y, r.z, r.w}),
          constant_curve(node, ChannelPath::scale, {s.x, s.y, s.z})};
}

/// Curves that stay at `old`, for what of it isn't as in `now`.
inline std::vector<ClipChannel> changed_parts(std::size_t node, const NodePlace& old, const NodePlace& now) {
  std::vector<ClipChannel> parts = constant_curves(node, old);
  std::erase_if(parts, [&](const ClipChannel& part) {
    return part.path == ChannelPath::rotation ? is_same_rotation(old.rotation, now.rotation)
           : part.path == ChannelPath::scale  ? is_same_place(old.scale, now.scale)
                                              : is_same_place(old.translation, now.translation);
  });
  return parts;
}

inline bool moves_part(const Clip& clip, const ClipChannel& part) {
  return std::any_of(clip.channels.begin(), clip.channels.end(),
                     [&](const ClipChannel& c) { return c.node == part.node && c.path == part.path; });
}

}  // namespace internal

/// One more clip; its name, which is another where the scene has a clip of that one. name: empty: the motion's own
/// What other clips move of its joints and it doesn't gets the rest: players leave that where the clip before left it.
inline std::string add_clip(Scene& scene, const Motion& motion, const std::string& name) {
  std::vector<std::string> names;
  for (const Clip& clip : scene.clips) names.push_back(clip.name);
  const std::string wanted = !name.empty() ? name : !motion.clip.name.empty() ? motion.clip.name : "motion";
  Clip clip{free_clip_name(names, wanted), motion.clip.channels};
  for (ClipChannel& channel : clip.channels) {
    channel.node = motion.joints[channel.node].node;
    internal::give_place(scene.nodes[channel.node]);
  }
  for (const MotionJoint& joint : motion.joints) {
    if (joint.node == no_item) continue;
    for (ClipChannel& part : internal::constant_curves(joint.node, scene.nodes[joint.node].place))
      if (!internal::moves_part(clip, part) && std::any_of(scene.clips.begin(), scene.clips.end(), [&](const Clip& c) {
            return internal::moves_part(c, part);
          }))
        clip.channels.push_back(std::move(part));
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
  for (Clip& clip : scene.clips)
    for (const ClipChannel& part : old)
      if (!internal::moves_part(clip, part)) clip.channels.push_back(part);
}

}  // namespace npt::inline NPT_ABI
