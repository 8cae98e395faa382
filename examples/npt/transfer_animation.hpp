/// Sequences that are one file: the pose a clip of a GLB, the result a GLB that moves, or both. And rigs.
#pragma once

#include "transfer_arguments.hpp"

#include <filesystem>
#include <optional>
#include <string>

namespace program {

struct AnimationArguments {
  std::optional<std::string> clip;
  std::optional<double> fps, time;
  std::string names = "vrm";  ///< of the joints in the result
};

inline void add_animation_options(CLI::App& command, AnimationArguments& arguments) {
  command.add_option("--clip", arguments.clip, "Clip of the pose .glb, by its name; npt info lists them");
  command.add_option("--fps", arguments.fps, "Frames a second of a sequence; without: 30")
      ->check(CLI::Range(0.001, 1000.0));
  command
      .add_option("--names", arguments.names, "What the joints of a result that moves are called: vrm, mixamo or smpl")
      ->check(CLI::IsMember({"vrm", "mixamo", "smpl"}))
      ->capture_default_str();
  command.add_option("--time", arguments.time, "Second of the clip, for one pose of it")->check(CLI::Range(0.0, 1e6));
}

struct AnimationJob {
  std::filesystem::path identity, pose, out;
  std::optional<std::string> format;
  std::optional<std::filesystem::path> picture;
  AnimationArguments animation;
};

/// Whether the arguments ask for a clip, or for a folder of poses as one .glb.
bool is_animation(const AnimationArguments& animation, const std::filesystem::path& pose,
                  const std::filesystem::path& out);

/// Transfers every frame and writes the result: one mesh for --time; else a .glb with a skeleton where the identity
/// goes through bodies, with morph targets where it doesn't; or a mesh a frame, in a folder.
/// Errors    npt::Error
void animate(const AnimationJob& job, const TransferArguments& arguments);

/// Writes the job's identity with a skeleton and skin weights, in its own pose.
/// Errors    npt::Error, also where no body can lie in the mesh
void rig(const AnimationJob& job, const TransferArguments& arguments);

}  // namespace program
