/// Families of species (family.hpp) as folders. A species is either
///   NAME.safetensors  poses [P, V, 3], f [F, 3] and the metadata `labels`, P words; or
///   NAME/             meshes LABEL.obj or LABEL.ply with equal vertex counts and faces
/// Species and labels come in the order of their names; files of other kinds are passed over.
/// Errors    npt::Error that names the file at fault
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/text.hpp>
#include <npt/lab/family.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace data {

/// The entries of a folder, by name.
inline std::vector<std::filesystem::path> entries_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> entries;
  std::error_code code;
  std::filesystem::directory_iterator it(folder, code);
  if (code) throw Error({.file = folder.string(), .found = code.message(), .expected = "a folder that can be read"});
  for (const auto& entry : it) entries.push_back(entry.path());
  std::ranges::sort(entries);
  return entries;
}

inline bool is_mesh_file(const std::filesystem::path& path) {
  const std::string extension = lower_case(path.extension().string());
  return extension == ".obj" || extension == ".ply";
}

inline Species species_of_tensors(const std::filesystem::path& path) {
  const auto file = SafetensorsFile::read(path);
  const auto fail = [&](const char* place, std::string found, std::string expected) {
    throw Error({.file = file.name(), .place = place, .found = std::move(found), .expected = std::move(expected)});
  };
  Species species;
  species.name = path.stem().string();
  const FileTensor &poses = file.at("poses"), &faces = file.at("f");
  if (poses.shape.size() != 3 || poses.shape[2] != 3 || poses.count() == 0)
    fail("tensor 'poses'", "shape " + to_string(poses.shape), "[poses, vertices, 3]");
  if (faces.shape.size() != 2 || faces.shape[1] != 3)
    fail("tensor 'f'", "shape " + to_string(faces.shape), "[faces, 3]");
  const std::string* labels = file.find_metadata("labels");
  if (labels == nullptr) fail("metadata labels", "nothing", "a word for each pose");
  std::string_view rest = *labels;
  for (std::string_view word; !(word = next_word(rest)).empty();) species.labels.emplace_back(word);
  const auto count = static_cast<std::size_t>(poses.shape[0]);
  if (species.labels.size() != count)
    fail("metadata labels", std::to_string(species.labels.size()) + " labels",
         std::to_string(count) + ", one for each pose");
  const std::vector<float> all = to_float(poses);
  const std::size_t size = all.size() / count;
  for (std::size_t i = 0; i < count; ++i) {
    const std::span<const float> one = std::span(all).subspan(i * size, size);
    species.meshes.emplace_back(one.begin(), one.end());
  }
  const std::vector<std::int64_t> corners = to_int64(faces);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i] < 0 || corners[i] >= static_cast<std::int64_t>(size / 3))
      fail("tensor 'f'", "vertex " + std::to_string(corners[i]), "vertices from 0 below " + std::to_string(size / 3));
    if (i % 3 == 0) species.triangles.emplace_back();
    species.triangles.back()[i % 3] = static_cast<std::uint32_t>(corners[i]);
  }
  species.edges = edges_of_triangles(species.triangles);
  return species;
}

/// Nothing in it where the folder holds no mesh.
inline Species species_of_folder(const std::filesystem::path& folder) {
  Species species;
  species.name = folder.filename().string();
  for (const std::filesystem::path& path : entries_of(folder)) {
    if (!is_mesh_file(path)) continue;
    const Mesh mesh = read_mesh(path);
    std::vector<Triangle> triangles = triangulate(mesh);
    const auto differs = [&](std::string found, std::string expected) {
      throw Error({.file = path.string(),
                   .found = std::move(found),
                   .expected = std::move(expected) + " as '" + species.labels.front() + "' has"});
    };
    if (species.meshes.empty()) {
      species.triangles = std::move(triangles);
      species.edges = unique_edges(mesh);
    } else if (mesh.vertex_count() != species.vertex_count()) {
      differs(std::to_string(mesh.vertex_count()) + " vertices", std::to_string(species.vertex_count()) + ",");
    } else if (triangles != species.triangles) {
      differs("other faces", "the same faces");
    }
    species.labels.push_back(path.stem().string());
    species.meshes.emplace_back(mesh.coordinates().begin(), mesh.coordinates().end());
  }
  return species;
}

}  // namespace data

/// The family in a folder, checked.
inline Family load_family(const std::filesystem::path& folder) {
  Family family{.name = folder.string(), .species = {}};
  for (const std::filesystem::path& path : data::entries_of(folder)) {
    std::error_code code;
    if (std::filesystem::is_directory(path, code)) {
      Species species = data::species_of_folder(path);
      if (!species.meshes.empty()) family.species.push_back(std::move(species));
    } else if (lower_case(path.extension().string()) == ".safetensors") {
      family.species.push_back(data::species_of_tensors(path));
    }
  }
  if (family.species.empty())
    throw Error({.file = family.name,
                 .found = "no species",
                 .expected = "files NAME.safetensors with poses, or folders of .obj or .ply meshes"});
  for (const Species& species : family.species) data::check_species(species, family.name);
  return family;
}

}  // namespace npt::inline NPT_ABI
