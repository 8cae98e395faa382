#include <formats/read.hpp>

#include <npt/io/gltf.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/scene/pose.hpp>

#include <algorithm>
#include <string>

namespace formats {

namespace {

constexpr std::array<std::string_view, 1> off{".off"};

bool is_one_of(const std::filesystem::path& path, std::span<const std::string_view> extensions) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return std::ranges::find(extensions, extension) != extensions.end();
}

}  // namespace

bool is_scene(const std::filesystem::path& path) { return is_one_of(path, scenes); }

npt::Mesh read_mesh(const std::filesystem::path& path) {
  if (is_one_of(path, off)) return read_off(path);
  if (!is_one_of(path, foreign)) return npt::read_mesh(path);
  const npt::Scene scene = read_foreign(path);
  return npt::ScenePoser(scene, path.string()).mesh();
}

npt::Scene read_scene(const std::filesystem::path& path) {
  return is_one_of(path, foreign) ? read_foreign(path) : npt::read_scene(path);
}

}  // namespace formats
