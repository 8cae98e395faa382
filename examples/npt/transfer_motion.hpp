/// Clips onto joints: of a motion without a mesh, or of a clip whose skeleton says which joint is which, onto the
/// character's own joints, or onto those that body estimation gives it.
#pragma once

#include "networks.hpp"
#include "transfer_animation.hpp"
#include "transfer_arguments.hpp"
#include "transfer_batch.hpp"
#include "transfer_jobs.hpp"

#include <view/page.hpp>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace program {

/// Whether a file is a motion without a mesh: BVH, or a scene with a skeleton or clips alone.
bool is_motion(const std::filesystem::path& file);

/// The motions in a folder, in the order of their names; empty where it is a folder of meshes.
std::vector<std::filesystem::path> motions_in(const std::filesystem::path& folder);

class MotionCharacter;

/// The character of the job before: the next one often has the same.
struct LastCharacter {
  std::filesystem::path file{};
  std::shared_ptr<const MotionCharacter> character{};
  std::vector<std::string> notes{};  ///< of it
};

/// A job that moves joints.
/// transfer: opened when it is asked for; page: nullptr or where the result is shown
/// Returns   nothing where the job is one for meshes: a folder of poses, a clip whose joints are unknown, a character
///           without joints of its own that takes a clip with a mesh
/// Errors    npt::Error
std::optional<JobOutcome> transfer_motions(const TransferJob& job, const Animations& all,
                                           const TransferArguments& arguments,
                                           const std::function<const PoseTransfer&()>& transfer, LastCharacter& last,
                                           view::Page* page);

}  // namespace program
