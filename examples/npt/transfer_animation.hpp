/// Sequences that are one file: the pose a clip of a GLB, the result a GLB that moves, or both. And rigs.
#pragma once

#include "transfer_arguments.hpp"
#include "transfer_jobs.hpp"

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
};

inline void add_animation_options(CLI::App& command, AnimationArguments& arguments) {
  command
      .add_option("--clip", arguments.clip,
                  "Take the pose from this clip of the .glb or .fbx, by its name: npt info lists clips")
      ->type_name("NAME");
  command
      .add_option("--fps", arguments.fps,
                  "Take this many frames a second from a clip, or show this many of a folder (default: 30)")
      ->check(CLI::Range(0.001, 1000.0));
  command.add_option("--names", arguments.names, "Name the joints of an animated result as VRM, Mixamo or SMPL does")
      ->check(CLI::IsMember({"vrm", "mixamo", "smpl"}))
      ->capture_default_str();
  command.add_flag("--in-place", arguments.in_place,
                   "Keep the root joint of an animated result where the identity has it, instead of moving it as the "
                   "pose source's moves, in proportion to the legs");
  command.add_option("--time", arguments.time, "Take one pose from the clip, at this second")
      ->check(CLI::Range(0.0, 1e6));
}

/// Sequences, each from an identity and a clip or a folder of poses to a file or a folder.
struct Animations {
  std::vector<TransferJob> jobs;
  std::optional<std::string> format;
  std::optional<std::filesystem::path> picture, page, report;
  bool keep_going = false, skip_existing = false;
  AnimationArguments animation;
};

/// Whether the arguments ask for a clip, or for a folder of poses as one .glb.
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
