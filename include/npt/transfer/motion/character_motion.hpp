/// Clips onto a character without a skeleton of its own: the one that its estimated body gives it takes them.
///   Character hero = transfer.character(mesh, "hero.ply");
///   MotionResult made = transfer.retarget(hero, walk);              a Motion, of any file
///   Scene scene = scene_with_motions(mesh, "hero", *hero.skeleton(), {&made.motion, 1});
/// The skeleton's rest is the body's T pose, in whatever pose the mesh stands: it stands on the mesh's ground.
/// Errors    npt::Error for a character that isn't recognised
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/joint_names.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/from_mesh.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/character.hpp>
#include <npt/transfer/motion/body_shape.hpp>
#include <npt/transfer/motion/motion_skeleton.hpp>
#include <npt/transfer/motion_transfer.hpp>
#include <npt/transfer/named_skeleton.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// The height of the lowest vertex after the joints have moved.
inline double lowest_moved(const SkinnedSkeleton& skeleton, std::span<const float> xyz,
                           const std::vector<Affine>& motions) {
  double low = std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; 3 * v < xyz.size(); ++v) {
    const Vec3d point = point_at(xyz, v);
    double height = 0;
    for (std::size_t k = skeleton.start[v]; k < skeleton.start[v + 1]; ++k)
      height += motions[skeleton.influences[k].joint](point).y * static_cast<double>(skeleton.influences[k].weight);
    low = std::min(low, height);
  }
  return low;
}

/// Each joint before its descendants, and these before any other.
inline std::vector<std::size_t> depth_first(const std::vector<std::size_t>& parents) {
  std::vector<std::size_t> order, open;
  const auto add_children = [&](std::size_t parent) {
    for (std::size_t j = parents.size(); j-- > 0;)
      if (parents[j] == parent) open.push_back(j);
  };
  add_children(SkinnedSkeleton::no_parent);
  while (!open.empty()) {
    order.push_back(open.back());
    open.pop_back();
    add_children(order.back());
  }
  return order;
}

/// [joints of Character::skeleton()] their axes in the mesh's; empty where all are the mesh's.
inline std::vector<Quaternion> frames_of(const Motion& motion) {
  std::vector<Quaternion> worlds, frames(motion.joints.size());
  bool turned = false;
  for (const MotionJoint& joint : motion.joints) {
    worlds.push_back((joint.parent == no_item ? Quaternion{} : worlds[joint.parent]) * joint.rest.rotation);
    frames[joint.node] = worlds.back();
    turned |= joint.rest.rotation != Quaternion{};
  }
  return turned ? frames : std::vector<Quaternion>{};
}

inline BodyShape shape_of(const Character& character, const MotionSkeleton& skeleton) {
  Mesh mesh;
  mesh.positions.resize(character.vertex_count());
  const double unit = metres_a_unit(skeleton.motion);  // joints are bound in metres
  std::transform(character.positions().begin(), character.positions().end(), mesh.coordinates().begin(),
                 [unit](float x) { return static_cast<float>(static_cast<double>(x) * unit); });
  set_faces(mesh, character.triangles());
  MeshScene made = scene_from(mesh);
  SkinnedSkeleton own = *character.skeleton();
  own.frames = frames_of(skeleton.motion);
  for (Vec3d& joint : own.joints) joint = joint * unit;
  const std::size_t first = add_skeleton(made, own);
  Motion motion = skeleton.motion;
  for (MotionJoint& joint : motion.joints) joint.node += first;
  return body_shape(made.scene, motion, skeleton.roles);
}

}  // namespace internal

/// The character's skeleton without a clip: joints where the mesh has them, bound in the body's rest. A joint's node is
/// its number in Character::skeleton(). unit: metres in one of the mesh
inline Motion motion_of(const Character& character, JointNames names = JointNames::vrm, double unit = 1) {
  character.expect_recognised();
  const std::optional<SkinnedSkeleton> skeleton = named_skeleton(character, names);
  if (!skeleton)
    throw Error({.file = "character",
                 .found = "one whose results are refined",
                 .expected = "no refinement: a skeleton can't give it",
                 .code = ErrorCode::needs_recognition});
  std::vector<Affine> rest = character.rest_motions();
  const double ground = bounding_box(character.positions()).low.y;
  const double low = internal::lowest_moved(*skeleton, character.positions(), rest);
  for (Affine& motion : rest) motion.shift.y += ground - low;
  Motion made;
  made.base = {Matrix3::identity() * unit, {}};
  const std::vector<std::size_t> order = internal::depth_first(skeleton->parents);
  std::vector<std::size_t> number(order.size());
  for (std::size_t j = 0; j < order.size(); ++j) number[order[j]] = j;
  for (const std::size_t own : order) {
    const std::size_t parent = skeleton->parents[own];
    const bool root = parent == SkinnedSkeleton::no_parent;
    MotionJoint joint{.name = skeleton->names[own], .parent = root ? no_item : number[parent]};
    joint.rest.translation = root ? skeleton->joints[own] : skeleton->joints[own] - skeleton->joints[parent];
    if (!skeleton->frames.empty()) {
      const Quaternion outer = inverse(skeleton->frame(parent));
      joint.rest.translation = outer(joint.rest.translation), joint.rest.rotation = outer * skeleton->frame(own);
    }
    joint.node = own;
    joint.bind = made.base * rest[own] * skeleton->bind(own);
    made.joints.push_back(std::move(joint));
  }
  return made;
}

/// Its roles are known: the body's.
inline MotionSkeleton motion_skeleton(const Character& character, const std::string& name,
                                      JointNames names = JointNames::vrm, double unit = 1) {
  MotionSkeleton made{motion_of(character, names, unit), {}, {}, name};
  if (character.skeleton()->names.front() != joint_name(0, JointNames::vrm)) {  // no person's: as its plan names joints
    made.roles = joint_roles(made.motion);
    if (made.roles.kind() == SkeletonKind::four_legged) made.roles.confidence = 1;
    return made;
  }
  made.roles.joints.fill(no_item);
  for (std::size_t j = 0; j < made.motion.joints.size(); ++j) {
    const JointRole role = role_named(joint_name(made.motion.joints[j].node, JointNames::vrm));
    if (role == JointRole::none) continue;
    made.roles.joints[index_of(role)] = j;
    made.roles.confidences[index_of(role)] = 1;
  }
  made.roles.confidence = 1;
  made.shape = internal::shape_of(character, made);
  return made;
}

/// A scene in which the mesh moves on the character's skeleton; motions of motion_of(Character). name: of the mesh;
/// unit: metres in one of the mesh
inline Scene scene_with_motions(const Mesh& mesh, const std::string& name, SkinnedSkeleton skeleton,
                                std::span<const Motion> motions, double unit = 1) {
  Mesh in_metres = mesh;
  for (float& x : in_metres.coordinates()) x = unit == 1 ? x : static_cast<float>(static_cast<double>(x) * unit);
  MeshScene made = scene_from(in_metres, name);
  for (Vec3d& joint : skeleton.joints) joint = joint * unit;
  if (!motions.empty()) {
    for (const MotionJoint& joint : motions.front().joints) skeleton.names[joint.node] = joint.name;
    skeleton.frames = internal::frames_of(motions.front());
  }
  const std::size_t first = add_skeleton(made, skeleton);
  for (const Motion& motion : motions) {
    Clip clip = motion.clip;
    for (ClipChannel& channel : clip.channels) {
      channel.node = first + motion.joints[channel.node].node;
      if (channel.path == ChannelPath::translation && unit != 1)
        for (float& x : channel.values) x = static_cast<float>(static_cast<double>(x) * unit);
    }
    made.scene.clips.push_back(std::move(clip));
  }
  return std::move(made.scene);
}

template <class Exec>
template <class Result>
Result BasicPoseTransfer<Exec>::retarget(const Character& character, const Motion& motion) const {
  return retarget<Result>(character, motion, MotionOptions{});
}

template <class Exec>
template <class Result>
Result BasicPoseTransfer<Exec>::retarget(const Character& character, const Motion& motion,
                                         const MotionOptions& options) const {
  expect_own(character.own_, "identity");
  return transfer_motion(motion_skeleton(motion, "motion"), motion_skeleton(character, character.own_.name), options);
}

}  // namespace npt::inline NPT_ABI
