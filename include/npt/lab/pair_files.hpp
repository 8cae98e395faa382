/// Pairs to evaluate on from mesh files: a text file with lines of `identity pose truth`, names relative to its folder.
/// Vertices stay in the files' order.
/// Errors    npt::Error that names the list and the line, or the mesh: no list, no pairs, a line of another form, a
///           file that is missing, a truth of another vertex count than its identity
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/list_file.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/topology.hpp>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace data {

struct PairFiles {
  std::filesystem::path identity, pose, truth;
};

inline std::vector<PairFiles> read_pair_list(const std::filesystem::path& list) {
  std::vector<PairFiles> pairs;
  for (const ListedFiles& line : read_list_file(list, "identity pose truth")) {
    for (const auto& path : line.files) {
      (void)mesh_format(path);
      std::error_code code;
      if (!std::filesystem::is_regular_file(path, code))
        throw Error({.file = list.string(),
                     .place = line.place,
                     .found = "no file '" + path.string() + "'",
                     .expected = "identity pose truth"});
    }
    pairs.push_back({line.files[0], line.files[1], line.files[2]});
  }
  return pairs;
}

inline EvaluationPair load_pair(const PairFiles& files) {
  const Mesh identity = read_mesh(files.identity), pose = read_mesh(files.pose), truth = read_mesh(files.truth);
  if (truth.vertex_count() != identity.vertex_count())
    throw Error(
        {.file = files.truth.string(),
         .found = std::to_string(truth.vertex_count()) + " vertices",
         .expected = std::to_string(identity.vertex_count()) + ", as many as " + files.identity.string() + " has"});
  const auto copy = [](const Mesh& mesh) {
    const auto xyz = mesh.coordinates();
    return std::vector<float>(xyz.begin(), xyz.end());
  };
  return {.name = files.identity.filename().string() + " as " + files.pose.filename().string(),
          .pose = copy(pose),
          .identity = copy(identity),
          .truth = copy(truth),
          .pose_triangles = triangulate(pose),
          .edges = unique_edges(identity),
          .identity_triangles = triangulate(identity)};
}

}  // namespace data

/// The pairs that a list names. Meshes are read when they are asked for.
inline EvaluationSet file_pairs(const std::filesystem::path& list) {
  auto files = std::make_shared<const std::vector<data::PairFiles>>(data::read_pair_list(list));
  const std::size_t count = files->size();
  return {.name = list.filename().string(), .count = count, .pair = [files = std::move(files)](std::size_t i) {
            return data::load_pair((*files)[i]);
          }};
}

}  // namespace npt::inline NPT_ABI
