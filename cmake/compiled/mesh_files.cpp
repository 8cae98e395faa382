#define NPT_COMPILING
#include <npt/io/gltf.hpp>
#include <npt/io/gltf_patch.hpp>
#include <npt/io/mesh_file.hpp>

npt::Scene npt::read_scene(const std::filesystem::path& path, std::vector<std::string>* notes) {
  return internal::read_scene_file(path, notes);
}
npt::Mesh npt::read_gltf(const std::filesystem::path& path, std::vector<std::string>* notes) {
  return internal::read_gltf_mesh(path, notes);
}
void npt::write_scene(const std::filesystem::path& path, const Scene& scene) {
  internal::write_scene_file(path, scene);
}
void npt::write_gltf(const std::filesystem::path& path, const Mesh& mesh) { internal::write_gltf_mesh(path, mesh); }
std::string npt::glb_bytes(const Scene& scene, const std::string& name) { return format_gltf(scene, name); }
npt::Scene npt::scene_of_bytes(std::string_view file, const std::string& name, std::vector<std::string>* notes) {
  return parse_gltf(file, name, std::nullopt, notes);
}

std::string npt::with_motion(std::string_view file, const Motion& motion, const GltfPatch& options,
                             const std::filesystem::path& place, std::vector<std::string>* notes) {
  return internal::gltf_with_motion(file, motion, options, place.string(), notes);
}
void npt::write_with_motion(const std::filesystem::path& from, const Motion& motion, const GltfPatch& options,
                            const std::filesystem::path& to, std::vector<std::string>* notes) {
  internal::write_gltf_with_motion(from, motion, options, to, notes);
}

npt::Mesh npt::read_mesh(const std::filesystem::path& path, std::vector<std::string>* notes) {
  return internal::read_mesh_file(path, notes);
}
void npt::write_mesh(const std::filesystem::path& path, const Mesh& mesh, PlyFormat ply_format) {
  internal::write_mesh_file(path, mesh, ply_format);
}
