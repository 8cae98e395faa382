/// Meshes in files, by the name's extension: .obj or .ply, in any case.
/// Errors    npt::Error that names the file, and for another extension the ones that are known
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/io/obj.hpp>
#include <npt/io/ply.hpp>
#include <npt/mesh/mesh.hpp>

#include <filesystem>
#include <string>

namespace npt::inline NPT_ABI {

enum class MeshFormat { obj, ply };

/// The format that a file's name stands for. Call it before long work whose result goes to `path`.
inline MeshFormat mesh_format(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  if (extension == ".obj") return MeshFormat::obj;
  if (extension == ".ply") return MeshFormat::ply;
  throw Error({.file = path.string(),
               .found = extension.empty() ? "no extension" : "extension " + in_quotes(extension),
               .expected = "a mesh file, .obj or .ply"});
}

inline Mesh read_mesh(const std::filesystem::path& path) {
  return mesh_format(path) == MeshFormat::obj ? read_obj(path) : read_ply(path);
}

/// Writes a mesh completely or not at all. `ply_format` is used for .ply.
inline void write_mesh(const std::filesystem::path& path, const Mesh& mesh,
                       PlyFormat ply_format = PlyFormat::binary_little_endian) {
  if (mesh_format(path) == MeshFormat::obj) {
    write_obj(path, mesh);
  } else {
    write_ply(path, mesh, ply_format);
  }
}

}  // namespace npt::inline NPT_ABI
