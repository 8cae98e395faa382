/// Sequences that are one file: the pose a clip of a GLB, the result a GLB that moves, or both. And rigs.
#pragma once

#include "transfer_arguments.hpp"
#include "transfer_jobs.hpp"

#include <npt/body/joint_names.hpp>
#include <npt/transfer/retarget_options.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace program {

struct AnimationArguments {
  std::optional<std::string> clip;
  std::optional<double> fps, time;
  std::string names = "vrm";  ///< of the joints in the result
  bool in_place = false;      ///< the root joint stays where the identity has it
  // Of clips that go from joints to joints.
  std::optional<std::filesystem::path> bone_map, source_bone_map;
  std::optional<std::string> clip_name;
  std::string skeleton = "auto";  ///< own, npt, or own where the character has one
  bool apply = false, bake = false, no_foot_lock = false, root_motion = false;
  bool across = false;  ///< also from people to animals and back
  double clearance = 1;

  npt::RetargetOptions retarget() const {
    npt::RetargetOptions options;
    options.in_place = in_place;
    options.foot_lock = !no_foot_lock;
    options.clearance = clearance;
    if (root_motion) options.root_motion = npt::RootMotion::extract;
    return options;
  }
};

inline npt::JointNames joint_names(const std::string& names) {
  return names == "mixamo" ? npt::JointNames::mixamo : names == "smpl" ? npt::JointNames::smpl : npt::JointNames::vrm;
}

inline void add_animation_options(CLI::App& command, AnimationArguments& arguments) {
  command
      .add_option(
          "--clip", arguments.clip,
          "Take the pose from this clip of the .glb or .fbx, by its name: npt info lists clips. Without --pose, "
          "this file or folder")
      ->type_name("NAME");
  command
      .add_option("--fps", arguments.fps,
                  "Take this many frames a second from a clip, or show this many of a folder (default: 30)")
      ->check(CLI::Range(0.001, 1000.0));
  command
      .add_option("--names", arguments.names,
                  "Name a person's joints in an animated result as VRM, Mixamo or SMPL does")
      ->check(CLI::IsMember({"vrm", "mixamo", "smpl"}))
      ->capture_default_str();
  command.add_flag("--in-place", arguments.in_place,
                   "Keep the root joint of an animated result where the identity has it, instead of moving it as the "
                   "pose source's moves, in proportion to the legs");
  command.add_option("--time", arguments.time, "Take one pose from the clip, at this second")
      ->check(CLI::Range(0.0, 1e6));
}

/// What transfers of clips onto a character's own joints understand beside the others.
inline void add_motion_options(CLI::App& command, AnimationArguments& arguments) {
  command
      .add_option("--skeleton", arguments.skeleton,
                  "Put clips onto the character's own joints (own), onto those of its estimated body (npt), or onto "
                  "its own where it has some that are a person's or an animal's (auto)")
      ->check(CLI::IsMember({"auto", "own", "npt"}))
      ->capture_default_str();
  command.add_option("--clip-name", arguments.clip_name, "Name the clip in the result (default: as in the source)")
      ->type_name("NAME");
  command.add_flag("--bake", arguments.bake,
                   "Write the moved mesh, a morph target for each frame, instead of joints that move");
  command.add_flag("--apply", arguments.apply,
                   "Make the pose of --time the rest of the character's joints, instead of a clip");
  command
      .add_option("--bone-map", arguments.bone_map,
                  "Read which joint of the character is which: npt info --bones prints what is found")
      ->check(CLI::ExistingFile);
  command
      .add_option("--source-bone-map", arguments.source_bone_map, "Read which joint of the clip's skeleton is which")
      ->check(CLI::ExistingFile);
  command.add_flag("--root-motion", arguments.root_motion,
                   "Let the joint without parent carry the way over the ground, instead of the hips");
  command.add_flag("--no-foot-lock", arguments.no_foot_lock, "Let feet slide that stand still in the clip");
  command.add_flag("--across", arguments.across,
                   "An experiment: put an animal's clip or pose on a person, or a person's on an animal, with forelegs "
                   "as arms");
  command
      .add_option("--clearance", arguments.clearance,
                  "Keep arms and thighs this far out of the body: 0 not at all, 1 wholly")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
}

/// Sequences, each from an identity and a clip or a folder of poses to a file or a folder.
struct Animations {
  std::vector<TransferJob> jobs;
  std::optional<std::string> format;
  std::optional<std::filesystem::path> picture, page, report;
  bool keep_going = false, skip_existing = false;
  AnimationArguments animation;
};

/// Whether the arguments ask for a clip, for a folder of poses as one .glb, or name a motion without a mesh.
bool is_animation(const AnimationArguments& animation, const std::filesystem::path& pose,
                  const std::filesystem::path& out);

/// Transfers every frame and writes the results: one mesh for --time; else a .glb with a skeleton where bodies
/// are estimated, with morph targets where they aren't; or a mesh a frame, in a folder.
/// Errors    npt::Error
void animate(const Animations& animations, const TransferArguments& arguments);

/// Writes a mesh with a skeleton and skin weights, in its own pose.
/// Errors    npt::Error, also where no body can lie in the mesh
void rig(const std::filesystem::path& mesh, const std::filesystem::path& out, const AnimationArguments& animation,
         const TransferArguments& arguments);

}  // namespace program
