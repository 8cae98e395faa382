/// Pairs to evaluate on from mesh files: a text file with lines of `identity pose truth`, names relative to its folder.
/// Quotes stand around names with blanks, # begins a comment. Vertices stay in the files' order.
/// Errors    npt::Error that names the list and the line, or the mesh: no list, no pairs, a line of another form, a
///           file that is missing, a truth of another vertex count than its identity
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/data/evaluation.hpp>
#include <npt/io/file.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/io/text.hpp>
#include <npt/io/words.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/topology.hpp>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace data {

struct PairFiles {
  std::filesystem::path identity, pose, truth;
};

inline std::vector<PairFiles> read_pair_list(const std::filesystem::path& list) {
  const std::string text = read_file(list);
  std::vector<PairFiles> pairs;
  TextLines lines(text);
  for (std::string_view line; lines.next(line);) {
    const auto fail = [&](std::string found) {
      throw Error({.file = list.string(),
                   .place = "line " + std::to_string(lines.number()),
                   .found = std::move(found),
                   .expected = "identity pose truth (quotes around names with blanks)"});
    };
    const auto words = list_words(line);
    if (!words) fail("a quotation mark that is not closed");
    if (words->empty()) continue;
    if (words->size() != 3) fail(std::to_string(words->size()) + (words->size() == 1 ? " name" : " names"));
    const std::filesystem::path folder = list.parent_path();
    const PairFiles pair{folder / (*words)[0], folder / (*words)[1], folder / (*words)[2]};
    for (const auto& path : {pair.identity, pair.pose, pair.truth}) {
      (void)mesh_format(path);
      std::error_code code;
      if (!std::filesystem::is_regular_file(path, code)) fail("no file '" + path.string() + "'");
    }
    pairs.push_back(pair);
  }
  if (pairs.empty())
    throw Error({.file = list.string(), .found = "no pairs", .expected = "lines of: identity pose truth"});
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
