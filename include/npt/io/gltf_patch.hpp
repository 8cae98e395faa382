/// A motion put into the file whose joints it moves, GLB, glTF or VRM, with everything else kept byte for byte.
///   Scene scene = read_scene("hero.glb");
///   Motion own = motion_of(scene, nullptr, "hero.glb");      the character's own joints
///   Motion motion = retarget(walk, roles_of_walk, own, roles_of_own);
///   write_with_motion("hero.glb", motion, {.name = "Walk"}, "hero_walk.glb");
/// Joints are identified by MotionJoint::node: nodes of a scene that npt read of a glTF file have the file's own numbers.
///   clip        one more animation behind those that are there, with the motion's keys; a curve that stays the same
///               becomes one key, and channels with the same times share them. What other animations move of the
///               motion's joints and it doesn't gets its rest as one key: game engines leave that where it was
///   apply       instead: the pose at one time becomes the rest of the nodes. Animations that are there get the old
///               rest, as one key, for each part of a node that was changed and that they don't move: they play as before
///   matrices    a node that is moved and has a matrix gets translation, rotation and scale in its place
/// Kept      the JSON's text but for what is put in (order, numbers as they are spelled, extensions, extras), the bytes
///           of buffers, of which nothing is decoded; VRM's extensions, too
/// Bytes     of the clip go behind those in a GLB, and into a buffer of their own, a data URI, in a glTF or in a GLB
///           whose first buffer is another file
/// Errors    npt::Error: no glTF, a joint without a node or with another name than its node's, a matrix that shears, a
///           clip without curves, keys that aren't finite or descend, names that are no UTF-8, a GLB of 4 GiB
/// Programs that link the library's compiled units (NPT_COMPILED, config.hpp) only see the declarations.
/// Source    glTF 2.0 specification, sections 3.11 and 4; KHR_animation_pointer
#pragma once

#include <npt/config.hpp>
#include <npt/scene/motion.hpp>

#if !defined(NPT_COMPILED) || defined(NPT_COMPILING)
#include <npt/base/error.hpp>
#include <npt/io/file.hpp>
#include <npt/io/glb.hpp>
#include <npt/io/gltf_pack.hpp>
#include <npt/io/gltf_patcher.hpp>
#include <npt/io/gltf_text.hpp>
#include <npt/io/gltf_uri.hpp>
#include <npt/io/text.hpp>
#endif

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

#if !defined(NPT_COMPILED) || defined(NPT_COMPILING)

namespace internal {

inline std::string gltf_with_motion(std::string_view file, const Motion& motion, const GltfPatch& options,
                                    const std::string& name, std::vector<std::string>* notes) {
  GltfPatcher patcher(file, name);
  if (options.apply) {
    patcher.set_rest(motion, options.time);
    if (notes != nullptr && patcher.is_vrm())
      notes->push_back(name + ": programs expect a VRM file's rest to be a T pose, and this one's is another now");
  } else {
    const std::string wanted = options.name.empty() ? motion.clip.name : options.name;
    const std::string given = patcher.add_clip(motion, wanted);
    if (notes != nullptr && !wanted.empty() && given != wanted)
      notes->push_back(name + ": has a clip " + in_quotes(wanted) + ", the new one is " + in_quotes(given));
  }
  return patcher.finish();
}

/// The files that a document names, to where another folder's document looks for them.
inline void copy_named_files(std::string_view document, const std::filesystem::path& from,
                             const std::filesystem::path& to) {
  const std::filesystem::path source = from.parent_path(), target = to.parent_path();
  std::error_code code;
  if (std::filesystem::equivalent(source.empty() ? "." : source, target.empty() ? "." : target, code)) return;
  for (const std::string& uri : named_files(GltfText(document, from.string()))) {
    const std::string bytes = read_uri(uri, source, from.string(), in_quotes(uri)).bytes;
    const std::filesystem::path copy = target / *percent_decoded(uri);
    if (std::filesystem::exists(copy, code)) {
      if (read_file(copy) == bytes) continue;
      throw Error(
          {.file = copy.string(), .found = "another file of this name", .expected = "that of " + from.string()});
    }
    std::filesystem::create_directories(copy.parent_path(), code);
    write_file(copy, bytes);
  }
}

inline void write_gltf_with_motion(const std::filesystem::path& from, const Motion& motion, const GltfPatch& options,
                                   const std::filesystem::path& to, std::vector<std::string>* notes) {
  std::string file = read_file(from);
  const std::string extension = lower_case(to.extension().string());
  if (extension != ".glb" && extension != ".gltf" && extension != ".vrm")
    throw Error({.file = to.string(), .found = "extension " + in_quotes(extension), .expected = ".glb, .gltf or .vrm"});
  if (is_glb(file) && extension == ".gltf")
    throw Error({.file = to.string(), .found = "extension '.gltf'", .expected = ".glb, as " + from.string() + " is"});
  const bool as_text = extension == ".gltf";
  if (!is_glb(file) && !as_text) file = GltfPacker(file, from.string(), from.parent_path()).pack();
  const std::string patched = gltf_with_motion(file, motion, options, from.string(), notes);
  if (as_text) copy_named_files(patched, from, to);
  write_file(to, patched);
}

}  // namespace internal

#endif

#ifdef NPT_COMPILED
std::string with_motion(std::string_view file, const Motion& motion, const GltfPatch& options,
                        const std::filesystem::path& place, std::vector<std::string>* notes = nullptr);
void write_with_motion(const std::filesystem::path& from, const Motion& motion, const GltfPatch& options,
                       const std::filesystem::path& to, std::vector<std::string>* notes = nullptr);
#else
/// The patched file: a GLB for a GLB, JSON text for JSON text. Files that it names are not looked at, and so have to
/// stand beside the new one as they do beside the old. `place` stands in the messages of errors.
inline std::string with_motion(std::string_view file, const Motion& motion, const GltfPatch& options,
                               const std::filesystem::path& place, std::vector<std::string>* notes = nullptr) {
  return internal::gltf_with_motion(file, motion, options, place.string(), notes);
}

/// Reads `from`, writes `to` completely or not at all; they may be the same file.
/// .gltf to .glb: the files that it names go into the GLB. .gltf to .gltf in another folder: they are copied there.
/// .glb and .vrm keep their container, whatever the name of `to`; .glb to .gltf is an error.
inline void write_with_motion(const std::filesystem::path& from, const Motion& motion, const GltfPatch& options,
                              const std::filesystem::path& to, std::vector<std::string>* notes = nullptr) {
  internal::write_gltf_with_motion(from, motion, options, to, notes);
}
#endif

}  // namespace npt::inline NPT_ABI
