#include <formats/read.hpp>

#include <npt/io/gltf.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/pose.hpp>

#include <algorithm>
#include <iostream>
#include <string>

namespace formats {

namespace {

constexpr std::array<std::string_view, 1> off{".off"};

bool is_one_of(const std::filesystem::path& path, std::span<const std::string_view> extensions) {
  const std::string extension = npt::lower_case(path.extension().string());
  return std::ranges::find(extensions, extension) != extensions.end();
}

/// What `read` makes with a place for its notes: the caller's, or one whose notes are printed.
auto with_notes(std::vector<std::string>* notes, auto read) {
  if (notes != nullptr) return read(notes);
  std::vector<std::string> own;
  auto result = read(&own);
  for (const std::string& note : own) std::cerr << "npt: note: " + note + '\n';
  return result;
}

}  // namespace

bool is_scene(const std::filesystem::path& path) { return is_one_of(path, scenes); }

npt::Mesh read_mesh(const std::filesystem::path& path, std::vector<std::string>* notes) {
  if (is_one_of(path, off)) return read_off(path);
  if (!is_one_of(path, foreign))
    return with_notes(notes, [&](std::vector<std::string>* to) { return npt::read_mesh(path, to); });
  const npt::Scene scene = read_scene(path, notes);
  return npt::ScenePoser(scene, path.string()).mesh();
}

npt::Scene read_scene(const std::filesystem::path& path, std::vector<std::string>* notes) {
  return with_notes(notes, [&](std::vector<std::string>* to) {
    if (!is_one_of(path, foreign)) return npt::read_scene(path, to);
    try_foreign(path);
    return read_foreign(path, nullptr, to);
  });
}

}  // namespace formats
