/// `npt evaluate --results FOLDER`: the results of another method, as meshes that are called by the pairs' numbers.
///   0000_result.ply, 0001_result.obj ...    in the order and with the numbers of the meshes that --write writes
/// The vertices are the identity's, in its order, unit and place.
#pragma once

#include "arguments.hpp"

#include <formats/read.hpp>

#include <npt/base/error.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace program {

/// "0007": how the files of a pair begin.
inline std::string pair_number(std::size_t number) {
  char text[24];
  std::snprintf(text, sizeof text, "%04zu", number);
  return text;
}

/// One mesh for each pair of some sets, found before any is read.
/// Threads   read() by several at a time
class ResultFiles {
 public:
  /// `count`: pairs of all sets.
  /// Errors    npt::Error for a folder that isn't there; for a pair without a result, or with two; for a mesh of
  ///           another name
  ResultFiles(std::filesystem::path folder, std::size_t count) : folder_(std::move(folder)), files_(count) {
    std::error_code code;
    if (!std::filesystem::is_directory(folder_, code))
      throw npt::Error({.file = folder_.string(), .found = "no such folder", .expected = expected()});
    std::vector<std::filesystem::path> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) names.push_back(entry.path());
    std::ranges::sort(names);
    for (const std::filesystem::path& name : names)
      if (std::ranges::find(formats::all, extension_of(name)) != formats::all.end()) take(name);
    expect_all();
  }

  /// The coordinates of pair `number`'s result, into `result`, [V, 3].
  /// Errors    npt::Error that names the file: unreadable, or another vertex count than the identity
  void read(std::size_t number, const npt::EvaluationPair& pair, std::span<float> result) const {
    const npt::Mesh mesh = formats::read_mesh(files_[number]);
    const std::size_t expected = pair.identity.size() / 3;
    if (mesh.vertex_count() != expected)
      throw npt::Error(
          {.file = files_[number].string(),
           .found = std::to_string(mesh.vertex_count()) + " vertices",
           .expected = std::to_string(expected) + ", those of the identity in its order (" + pair.name + ")"});
    std::ranges::copy(mesh.coordinates(), result.begin());
    const std::vector<npt::Edge> edges = npt::unique_edges(mesh), expected_edges = npt::unique_edges(pair.edges);
    const double size = npt::bounding_box(result).longest_side() / npt::bounding_box(pair.truth).longest_side();
    const std::lock_guard lock(mutex_);
    if (!edges.empty() && !std::ranges::includes(edges, expected_edges)) other_edges_.add(number);
    if (size < 1 / other_size || size > other_size) other_sizes_.add(number);
  }

  /// What is probably wrong with results that were read, in sentences.
  std::vector<std::string> notes() const {
    std::vector<std::string> notes;
    const auto add = [&](const Doubtful& doubtful, const std::string& what) {
      if (doubtful.count > 0)
        notes.push_back(std::to_string(doubtful.count) + (doubtful.count == 1 ? " result" : " results") + ", first " +
                        files_[doubtful.first].string() + ", " + what);
    };
    add(other_edges_, "with other edges than the identity: vertices must be in the identity's order");
    add(other_sizes_, "of quite another size than the ground truth: results must be in the identity's unit");
    return notes;
  }

 private:
  /// A pose changes a body's largest extent by less; inches and metres, or a network's own coordinates, by more.
  static constexpr double other_size = 1.8;

  struct Doubtful {
    std::size_t count = 0, first = 0;
    void add(std::size_t number) { first = count++ == 0 ? number : std::min(first, number); }
  };

  std::string expected() const {
    const std::string first = pair_number(0) + "_result.ply", last = pair_number(files_.size() - 1) + "_result.ply";
    return files_.size() == 1
               ? first + ", a mesh for the pair"
               : first + " to " + last + ", a mesh for each of the " + std::to_string(files_.size()) + " pairs";
  }

  /// Meshes that --write wrote may lie beside the results.
  void take(const std::filesystem::path& name) {
    const std::string stem = name.stem().string();
    const std::size_t end = std::min(stem.find('_'), stem.size());
    const std::string_view part = std::string_view(stem).substr(end);
    constexpr std::array<std::string_view, 3> others{"_identity", "_pose", "_truth"};
    if (std::ranges::find(others, part) != others.end()) return;
    std::size_t number = files_.size();
    const bool is_number = std::from_chars(stem.data(), stem.data() + end, number).ec == std::errc();
    if (part != "_result" || !is_number || number >= files_.size() || stem != pair_number(number) + "_result")
      throw npt::Error({.file = name.string(), .found = "a mesh of no pair", .expected = expected()});
    if (!files_[number].empty())
      throw npt::Error({.file = name.string(),
                        .found = "a second result beside " + files_[number].filename().string(),
                        .expected = "one for each pair"});
    files_[number] = name;
  }

  void expect_all() const {
    const auto missing = std::ranges::count(files_, std::filesystem::path());
    if (missing == 0) return;
    const auto first = static_cast<std::size_t>(std::ranges::find(files_, std::filesystem::path()) - files_.begin());
    throw npt::Error({.file = folder_.string(),
                      .found = "no " + pair_number(first) + "_result" +
                               (missing == 1 ? "" : " (" + std::to_string(missing) + " results are missing)"),
                      .expected = expected()});
  }

  std::filesystem::path folder_;
  std::vector<std::filesystem::path> files_;
  mutable std::mutex mutex_;
  mutable Doubtful other_edges_, other_sizes_;
};

}  // namespace program
