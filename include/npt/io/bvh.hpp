/// BVH, Biovision's format for motions: a skeleton and a row of numbers a frame, in and out.
///   read           any order of channels, positions at any joint, End Sites, tabs, each kind of line end, keywords in
///                  any case, names with blanks, braces on the line of their joint
///   as a Motion    joints at rest without rotation, curves linear between frames; bvh_motion.hpp
///   refused        several roots, channels twice, frames that are missing or too many, numbers that are no numbers or
///                  beyond 1e9
/// The format knows no unit and no up axis: body/roles/placed_motion.hpp infers both from the skeleton.
/// Errors    npt::Error that names file, line, what was found and what was expected
/// Source    Meredith and Maddock, "Motion Capture File Formats Explained", University of Sheffield, 2001
#pragma once

#include <npt/config.hpp>
#include <npt/io/bvh_file.hpp>
#include <npt/io/bvh_motion.hpp>
#include <npt/io/bvh_reader.hpp>
#include <npt/io/bvh_writer.hpp>
#include <npt/io/file.hpp>
#include <npt/scene/motion.hpp>

#include <filesystem>

namespace npt::inline NPT_ABI {

inline Bvh read_bvh(const std::filesystem::path& path) { return parse_bvh(read_file(path), path.string()); }
/// Writes a file completely or not at all.
inline void write_bvh(const std::filesystem::path& path, const Bvh& bvh) { write_file(path, format_bvh(bvh)); }

}  // namespace npt::inline NPT_ABI
