/// Text files that list other files, some on a line: "identity pose output". Names are relative to the list, so that a
/// folder with its list can be moved. Quotes around names with blanks; # begins a comment; empty lines count for
/// nothing.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/file.hpp>
#include <npt/io/text.hpp>
#include <npt/io/words.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// One line of a list.
struct ListedFiles {
  std::vector<std::filesystem::path> files;  ///< as many as the list has on a line
  std::string place;                         ///< "line 3", for messages
};

/// All lines of a list. `names`: what stands on each, in one word apiece: "identity pose output".
/// Errors    npt::Error that names the list and the line
inline std::vector<ListedFiles> read_list_file(const std::filesystem::path& list, const std::string& names) {
  const std::string text = read_file(list);
  const auto count = static_cast<std::size_t>(std::count(names.begin(), names.end(), ' ')) + 1;
  std::vector<ListedFiles> lines;
  TextLines reader(text);
  for (std::string_view line; reader.next(line);) {
    const auto words = list_words(line);
    const std::string place = "line " + std::to_string(reader.number());
    if (words && words->empty()) continue;
    if (!words || words->size() != count)
      throw Error({.file = list.string(),
                   .place = place,
                   .found = found_words(words, "name"),
                   .expected = names + " (quotes around names with blanks)"});
    ListedFiles listed{.files = {}, .place = place};
    for (const auto& word : *words) listed.files.push_back(list.parent_path() / word);
    lines.push_back(std::move(listed));
  }
  if (lines.empty()) throw Error({.file = list.string(), .found = "no pairs", .expected = "lines of: " + names});
  return lines;
}

}  // namespace npt::inline NPT_ABI
