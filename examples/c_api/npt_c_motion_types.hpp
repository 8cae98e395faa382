/// What stands behind npt_c.h's motions: a skeleton with roles, and the character whose joints it moves.
#pragma once

#include "npt_c_types.hpp"

#include <npt/base/error.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/motion/motion_checks.hpp>
#include <npt/transfer/motion/motion_skeleton.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace c_api {

/// A mesh that moves on the skeleton of its estimated body.
struct EstimatedCharacter {
  npt::Mesh mesh;
  npt::SkinnedSkeleton skeleton;
  double unit = 1;  ///< metres in one of the mesh
};

/// What a result is written into: one of these, or a file on disk.
struct MotionCharacter {
  std::filesystem::path path;                   ///< of its file; else empty
  std::string bytes;                            ///< of a glTF file that was given as bytes
  std::optional<npt::Scene> scene;              ///< of a format that npt doesn't write
  std::vector<std::string> lost;                ///< what of its file isn't in this scene
  std::optional<EstimatedCharacter> estimated;  ///< of body estimation
};

}  // namespace c_api

struct npt_motion {
  npt::MotionSkeleton skeleton;
  std::optional<npt::Error> refusal;  ///< why it can't be put on another skeleton, or take a motion
  std::shared_ptr<const c_api::MotionCharacter> character;
  bool result = false;
  bool applies = false;            ///< the pose becomes the rest
  std::vector<std::string> clips;  ///< of its file
  /// [joints] in the caller's order, their numbers in skeleton.motion, where these stand depth first; empty: the same
  std::vector<std::size_t> order;

  // What npt_motion_info points at.
  std::vector<const char*> name_pointers, clip_pointers;
  std::vector<std::int32_t> parents, nodes;

  std::size_t own(std::size_t joint) const { return order.empty() ? joint : order[joint]; }
};

namespace c_api {

using OwnedMotion = std::unique_ptr<npt_motion>;

/// In any case of letters; `extensions` in lower case.
inline bool has_extension(const std::filesystem::path& path, std::initializer_list<std::string_view> extensions) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return std::ranges::find(extensions, extension) != extensions.end();
}

/// What the functions of motions said last: npt_last_notes.
inline thread_local std::string last_notes{};

/// The notes of one call, which are the last ones even where it fails.
class Notes {
 public:
  Notes() { last_notes.clear(); }
  Notes(const Notes&) = delete;
  Notes& operator=(const Notes&) = delete;
  ~Notes() {
    try {
      for (const std::string& line : lines) last_notes += line + '\n';
    } catch (const std::bad_alloc&) {
      last_notes.clear();  // the call's own failure or result is worth more
    }
  }
  std::vector<std::string> lines;
};

/// With its pointers set; joints whose order is the caller's have it in `order` already.
inline npt_motion* given(OwnedMotion motion) {
  const std::vector<npt::MotionJoint>& joints = motion->skeleton.motion.joints;
  std::vector<std::int32_t> number(joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) number[motion->own(j)] = static_cast<std::int32_t>(j);
  const auto signed_of = [](std::size_t item) { return item == npt::no_item ? -1 : static_cast<std::int32_t>(item); };
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const npt::MotionJoint& joint = joints[motion->own(j)];
    motion->name_pointers.push_back(joint.name.c_str());
    motion->parents.push_back(joint.parent == npt::no_item ? -1 : number[joint.parent]);
    motion->nodes.push_back(signed_of(joint.node));
  }
  for (const std::string& clip : motion->clips) motion->clip_pointers.push_back(clip.c_str());
  return motion.release();
}

/// Its roles found, or read from a bone map; what is no person's keeps why, for what needs one.
inline void find_roles(npt_motion& motion, npt::Motion own, const std::string& name, const char* bone_map,
                       const npt::Scene* scene) {
  npt::BoneMapText map;
  if (bone_map != nullptr) map.text = bone_map;
  try {
    motion.skeleton = npt::motion_skeleton(own, name, map, scene);
  } catch (const npt::Error& error) {
    npt::expect_motion(own, name);
    if (bone_map != nullptr) throw;
    motion.refusal = error;
    motion.skeleton = {std::move(own), {}, {}, name};
    motion.skeleton.roles = npt::joint_roles(motion.skeleton.motion);
  }
}

/// Of a file of any format that is known.
OwnedMotion read_skeleton(const npt_file* file, const char* bone_map, Notes& notes);
struct WantedClips {
  std::optional<std::string> name{};  ///< none: all
  bool several = false;               ///< whether all may be more than one
};
/// At least one.
std::vector<OwnedMotion> read_clips(const npt_file* file, const WantedClips& wanted, const char* bone_map,
                                    Notes& notes);

}  // namespace c_api
