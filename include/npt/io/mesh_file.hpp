/// Meshes in files, by the name's extension: .obj, .ply, .glb or, for reading, .gltf, in any case.
/// Errors    npt::Error that names the file, and for another extension the ones that are known
/// Programs that link the library's compiled units (NPT_COMPILED, config.hpp) only see the declarations.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/ply_header.hpp>
#include <npt/mesh/mesh.hpp>

#if !defined(NPT_COMPILED) || defined(NPT_COMPILING)
#include <npt/io/gltf.hpp>
#include <npt/io/obj.hpp>
#include <npt/io/ply.hpp>
#endif

#include <filesystem>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

enum class MeshFormat { obj, ply, glb, gltf };

/// The format that a file's name stands for. Call it before long work whose result goes to `path`.
inline MeshFormat mesh_format(const std::filesystem::path& path) {
  const std::string extension = lower_case(path.extension().string());
  if (extension == ".obj") return MeshFormat::obj;
  if (extension == ".ply") return MeshFormat::ply;
  if (extension == ".glb" || extension == ".vrm") return MeshFormat::glb;
  if (extension == ".gltf") return MeshFormat::gltf;
  throw Error({.file = path.string(),
               .found = extension.empty() ? "no extension" : "extension " + in_quotes(extension),
               .expected = "a mesh file, .obj, .ply or .glb"});
}

#if !defined(NPT_COMPILED) || defined(NPT_COMPILING)

namespace internal {

inline Mesh read_mesh_file(const std::filesystem::path& path, std::vector<std::string>* notes) {
  switch (mesh_format(path)) {
    case MeshFormat::obj:
      return read_obj(path, notes);
    case MeshFormat::ply:
      return read_ply(path, notes);
    default:
      return read_gltf(path, notes);
  }
}
inline void write_mesh_file(const std::filesystem::path& path, const Mesh& mesh, PlyFormat ply_format) {
  switch (mesh_format(path)) {
    case MeshFormat::obj:
      return write_obj(path, mesh);
    case MeshFormat::ply:
      return write_ply(path, mesh, ply_format);
    case MeshFormat::glb:
      return write_gltf(path, mesh);
    case MeshFormat::gltf:
      throw Error(
          {.file = path.string(), .found = "extension '.gltf'", .expected = ".glb, glTF in one file, to write"});
  }
}

}  // namespace internal

#endif

#ifdef NPT_COMPILED
Mesh read_mesh(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr);
void write_mesh(const std::filesystem::path& path, const Mesh& mesh,
                PlyFormat ply_format = PlyFormat::binary_little_endian);
#else
/// `notes` gets a sentence for each thing that was repaired: what other programs read is read.
inline Mesh read_mesh(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr) {
  return internal::read_mesh_file(path, notes);
}
/// Writes a mesh completely or not at all. `ply_format` is used for .ply.
inline void write_mesh(const std::filesystem::path& path, const Mesh& mesh,
                       PlyFormat ply_format = PlyFormat::binary_little_endian) {
  internal::write_mesh_file(path, mesh, ply_format);
}
#endif

}  // namespace npt::inline NPT_ABI
