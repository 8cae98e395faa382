/// The Wavefront OBJ format, read by tinyobjloader with a check beside it, and written.
///   v         x y z [w | r g b]; colours become the properties red, green, blue (white where a vertex has none), w the
///             property w
///   vt, vn    u [v [w]], x y z
///   f         three corners or more: v, v/vt, v//vn or v/vt/vn; indices from 1 or relative (negative), also to
///             vertices that follow
///   o, g, usemtl, s, mtllib are kept in their places between the faces; material files are not opened
///   l, p      verified and left out: a transfer is about surfaces
///   all other statements are passed over
/// Repaired  where faces refer to texture coordinates or normals and the file has none, they are left out, with a note
/// Lines     every line end, "\" before one, comments also behind numbers, no line end after the last line
/// Numerics  positions are kept as 32-bit floats, correctly rounded
/// Errors    npt::Error that names file and line: a number that is none, is not finite or doesn't fit, too few or too
///           many of them, indices out of range, faces of fewer than three corners; no vertices
/// Source    Wavefront, "Object Files (.obj)", Advanced Visualizer manual, appendix B1
#pragma once

#include <npt/config.hpp>
#include <npt/io/file.hpp>
#include <npt/io/obj_reader.hpp>
#include <npt/io/obj_writer.hpp>
#include <npt/mesh/mesh.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// `notes` gets a sentence for each thing that was repaired.
inline Mesh read_obj(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr) {
  return parse_obj(read_file(path), path.string(), notes);
}

/// Writes a mesh completely or not at all.
inline void write_obj(const std::filesystem::path& path, const Mesh& mesh) {
  write_file(path, format_obj(mesh, path.string()));
}

}  // namespace npt::inline NPT_ABI
