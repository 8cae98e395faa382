/// Markers: vertices of the source and of the target that a user says belong together.
/// A file of markers has a line `source_vertex target_vertex` for each, vertices numbered from 0 in the mesh files'
/// order; blank lines and what follows a # don't count.
/// Errors    npt::Error that names the file and the line, or the marker
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/file.hpp>
#include <npt/io/text.hpp>
#include <npt/io/words.hpp>

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace npt::inline NPT_ABI {

struct Marker {
  std::uint32_t source = 0, target = 0;
  friend bool operator==(const Marker&, const Marker&) = default;
};

namespace deformation {

inline std::uint32_t marker_vertex(const std::string& word, const std::string& name, const std::string& place) {
  std::uint32_t vertex = 0;
  const auto result = std::from_chars(word.data(), word.data() + word.size(), vertex);
  if (result.ec != std::errc() || result.ptr != word.data() + word.size())
    throw Error({.file = name, .place = place, .found = "'" + word + "'", .expected = "a vertex number, from 0"});
  return vertex;
}

}  // namespace deformation

/// The markers in the text of a file. `name` stands in messages of errors.
inline std::vector<Marker> parse_markers(std::string_view text, const std::string& name) {
  std::vector<Marker> markers;
  TextLines lines(text);
  for (std::string_view line; lines.next(line);) {
    const auto words = list_words(line);
    const std::string place = "line " + std::to_string(lines.number());
    if (words && words->empty()) continue;
    if (!words || words->size() != 2)
      throw Error(
          {.file = name, .place = place, .found = found_words(words), .expected = "source_vertex target_vertex"});
    markers.push_back(
        {deformation::marker_vertex((*words)[0], name, place), deformation::marker_vertex((*words)[1], name, place)});
  }
  if (markers.empty())
    throw Error({.file = name, .found = "no markers", .expected = "lines of: source_vertex target_vertex"});
  return markers;
}

inline std::vector<Marker> read_markers(const std::filesystem::path& path) {
  return parse_markers(read_file(path), path.string());
}

/// Throws npt::Error unless the markers' vertices are below the meshes' vertex counts.
inline void check_markers(std::span<const Marker> markers, std::size_t source_vertices, std::size_t target_vertices) {
  const auto check = [](std::size_t marker, const char* mesh, std::uint32_t vertex, std::size_t count) {
    if (vertex >= count)
      throw Error({.file = "markers",
                   .place = "marker " + std::to_string(marker + 1),
                   .found = "vertex " + std::to_string(vertex) + " of the " + mesh,
                   .expected = "a vertex below " + std::to_string(count)});
  };
  for (std::size_t i = 0; i < markers.size(); ++i) {
    check(i, "source", markers[i].source, source_vertices);
    check(i, "target", markers[i].target, target_vertices);
  }
}

}  // namespace npt::inline NPT_ABI
