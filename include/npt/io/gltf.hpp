/// glTF 2.0: .glb, and .gltf with the files beside it, in; .glb out. In metres, y up, as everything in glTF.
///   read as a Scene     nodes, meshes, skins, morph targets, clips; materials with their textures, as they came
///   read as a Mesh      all primitives as the scene stands; pose.hpp gives its clips' frames
///   accessors           all kinds, interleaved, sparse, normalised and quantised (KHR_mesh_quantization)
///   meshopt             EXT_meshopt_compression, always
///   Draco               where built with libdraco (NPT_WITH_DRACO), else refused
///   attributes          those of other programs ("_NAME") and further colours are kept
///   left out            lines, and points beside surfaces; cameras, lights, tangents, extras
/// Repaired  inverse bind matrices whose last row is 0 0 0 0 are taken with 0 0 0 1, with a note
/// Images are never decoded. Numerics  positions are 32-bit floats
/// Errors    npt::Error: whatever the specification forbids and matters here; files that leave the document's folder; a
///           document that would make 64 times as many numbers as it has bytes
/// Programs that link the library's compiled units (NPT_COMPILED, config.hpp) only see the declarations.
/// Source    Khronos, glTF 2.0 specification (ISO/IEC 12113:2022)
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/scene/scene.hpp>

#if !defined(NPT_COMPILED) || defined(NPT_COMPILING)
#include <npt/io/file.hpp>
#include <npt/io/gltf_reader.hpp>
#include <npt/io/gltf_writer.hpp>
#include <npt/scene/from_mesh.hpp>
#include <npt/scene/pose.hpp>
#endif

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

#if !defined(NPT_COMPILED) || defined(NPT_COMPILING)

namespace internal {

template <bool Draco = with_draco>
Scene read_scene_file(const std::filesystem::path& path, std::vector<std::string>* notes) {
  return parse_gltf<Draco>(read_file(path), path.string(), path.parent_path(), notes);
}
template <bool Draco = with_draco>
Mesh read_gltf_mesh(const std::filesystem::path& path, std::vector<std::string>* notes) {
  const Scene scene = read_scene_file<Draco>(path, notes);
  return ScenePoser(scene, path.string()).mesh();
}
inline void write_scene_file(const std::filesystem::path& path, const Scene& scene) {
  write_file(path, format_gltf(scene, path.string()));
}
inline void write_gltf_mesh(const std::filesystem::path& path, const Mesh& mesh) {
  validate(mesh, path.string());
  write_scene_file(path, scene_from(mesh, path.stem().string()).scene);
}

}  // namespace internal

#endif

#ifdef NPT_COMPILED
Scene read_scene(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr);
Mesh read_gltf(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr);
void write_scene(const std::filesystem::path& path, const Scene& scene);
void write_gltf(const std::filesystem::path& path, const Mesh& mesh);
std::string glb_bytes(const Scene& scene, const std::string& name);
Scene scene_of_bytes(std::string_view file, const std::string& name, std::vector<std::string>* notes = nullptr);
#else
/// `notes` gets a sentence for each thing that was repaired.
inline Scene read_scene(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr) {
  return internal::read_scene_file(path, notes);
}
/// The scene as it stands, as one mesh.
inline Mesh read_gltf(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr) {
  return internal::read_gltf_mesh(path, notes);
}

/// Writes a GLB completely or not at all.
inline void write_scene(const std::filesystem::path& path, const Scene& scene) {
  internal::write_scene_file(path, scene);
}
/// Writes a mesh as a GLB completely or not at all.
inline void write_gltf(const std::filesystem::path& path, const Mesh& mesh) { internal::write_gltf_mesh(path, mesh); }
/// What write_scene writes. `name` stands in the messages of errors.
inline std::string glb_bytes(const Scene& scene, const std::string& name) { return format_gltf(scene, name); }
/// What read_scene reads, of the bytes of a GLB or of a document that names no files. `name` stands in the messages.
inline Scene scene_of_bytes(std::string_view file, const std::string& name, std::vector<std::string>* notes = nullptr) {
  return parse_gltf(file, name, std::nullopt, notes);
}
#endif

}  // namespace npt::inline NPT_ABI
