/// The PLY format, read and written: ascii, binary little-endian and binary big-endian, scalars of every type.
///   element vertex     x, y, z; nx, ny, nz are the normals; other scalars are kept as properties
///   element face       a list vertex_indices or vertex_index, from three corners on; a list texcoord with two
///                      numbers a corner
///   comment, obj_info  kept as tags
///   other elements, lists at vertices and other face properties are passed over
/// Repaired  lines of the header that aren't PLY's are passed over, with a note
/// Numerics  positions are kept as 32-bit floats, other properties as doubles
/// Errors    npt::Error that names the file, and the line (header, ascii) or byte (binary): not this format, unknown
///           types, truncated or too long, counts that don't fit the file (before memory is taken), indices out of
///           range, faces of fewer than three corners, positions, normals or texture coordinates that are not finite
/// Source    Greg Turk, "The PLY Polygon File Format", 1994; texcoord as MeshLab writes it
#pragma once

#include <npt/config.hpp>
#include <npt/io/file.hpp>
#include <npt/io/ply_header.hpp>
#include <npt/io/ply_reader.hpp>
#include <npt/io/ply_writer.hpp>
#include <npt/mesh/mesh.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// `notes` gets a sentence for each thing that was repaired.
inline Mesh read_ply(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr) {
  return parse_ply(read_file(path), path.string(), notes);
}

/// Writes a mesh completely or not at all.
inline void write_ply(const std::filesystem::path& path, const Mesh& mesh,
                      PlyFormat format = PlyFormat::binary_little_endian) {
  write_file(path, format_ply(mesh, path.string(), format));
}

}  // namespace npt::inline NPT_ABI
