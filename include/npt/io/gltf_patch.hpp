/// A motion put into the file whose joints it moves, GLB, glTF or VRM, with everything else kept byte for byte.
///   Scene scene = read_scene("hero.glb");
///   Motion own = motion_of(scene, nullptr, "hero.glb");      the character's own joints
///   Motion motion = retarget(walk, roles_of_walk, own, roles_of_own);
///   write_with_motion("hero.glb", motion, {.name = "Walk"}, "hero_walk.glb");
/// Joints are told by MotionJoint::node: nodes of a scene that npt read of a glTF file have the file's own numbers.
///   clip        one more animation behind those that are there, with that motion's keys; a curve that stays the same
///               becomes one key, and channels with the same times share them
///   apply       instead: the pose at one time becomes the rest of the nodes. Animations that are there get the old
///               rest, as one key, for each part of a node that was changed and that they don't move: they play as before
///   matrices    a node that is moved and has a matrix gets translation, rotation and scale in its place
/// Kept      the JSON's text but for what is put in (order, numbers as they are spelled, extensions, extras), the bytes
///           of buffers, of which nothing is decoded; VRM's extensions, too
/// Bytes     of the clip go behind those in a GLB, and into a buffer of their own, a data URI, in a glTF or in a GLB
///           whose first buffer is another file
/// Errors    npt::Error: no glTF, a joint without a node or one that the file lacks, a matrix that shears, nothing to
///           put in, names that are no UTF-8, a GLB of 4 GiB
/// Source    glTF 2.0 specification, sections 3.11 and 4; KHR_animation_pointer
#pragma once

#include <npt/config.hpp>
#include <npt/scene/motion.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

struct GltfPatch {
  /// Of the new animation; empty: the motion's own, or "motion" where that has none. A name that the file has already
  /// gets a number, "Walk_2", and `notes` a sentence: files keep their clips, and players find them by name.
  std::string name{};
  bool apply = false;  ///< the pose as the nodes' rest, and no animation
  double time = 0;     ///< apply: of the pose, in seconds of the motion's clip
};

/// The patched file: a GLB for a GLB, JSON text for JSON text. Files that it names are not looked at, and so have to
/// stand beside the new one as they do beside the old. `place` stands in the messages of errors.
std::string with_motion(std::string_view file, const Motion& motion, const GltfPatch& options,
                        const std::filesystem::path& place, std::vector<std::string>* notes = nullptr);

/// Reads `from`, writes `to` completely or not at all; they may be the same file.
/// .gltf to .glb: the files that it names go into the GLB. .gltf to .gltf in another folder: they are copied there.
/// .glb and .vrm keep their container, whatever the name of `to`; .glb to .gltf is an error.
void write_with_motion(const std::filesystem::path& from, const Motion& motion, const GltfPatch& options,
                       const std::filesystem::path& to, std::vector<std::string>* notes = nullptr);

}  // namespace npt::inline NPT_ABI
