/// Motions of all formats that the program reads: clips and skeletons of scenes, with or without a mesh, and BVH.
/// Errors    npt::Error that names the file
#pragma once

#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <filesystem>
#include <optional>
#include <string>

namespace formats {

/// A motion capture file, which is no scene.
bool is_bvh(const std::filesystem::path& path);
/// In metres with y up, by the skeleton where the file doesn't say.
npt::Motion read_bvh_motion(const std::filesystem::path& path);
/// `clip`: its name; none: the only one, or the skeleton alone where there is none.
npt::Motion read_motion(const std::filesystem::path& path, const std::optional<std::string>& clip = {});

}  // namespace formats
