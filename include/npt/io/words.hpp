/// The words of a line of a list file (pairs, markers, jobs).
#pragma once

#include <npt/config.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

/// The words of a line: separated by blanks, "..." or '...' around a name with blanks, # begins a comment. Nothing
/// where a quotation mark is not closed.
inline std::optional<std::vector<std::string>> list_words(std::string_view line) {
  std::vector<std::string> words;
  std::size_t i = 0;
  const auto blank = [&line](std::size_t k) { return line[k] == ' ' || (line[k] >= '\t' && line[k] <= '\r'); };
  while (true) {
    while (i < line.size() && blank(i)) ++i;
    if (i == line.size() || line[i] == '#') return words;
    words.emplace_back();
    while (i < line.size() && !blank(i)) {
      if (line[i] != '"' && line[i] != '\'') {
        words.back() += line[i++];
        continue;
      }
      const std::size_t close = line.find(line[i], i + 1);
      if (close == std::string_view::npos) return std::nullopt;
      words.back() += line.substr(i + 1, close - i - 1);
      i = close + 1;
    }
  }
}

/// What an error says was found where list_words() gave another number of words than was asked for, or nothing.
inline std::string found_words(const std::optional<std::vector<std::string>>& words, const std::string& noun = "word") {
  if (!words) return "a quotation mark that is not closed";
  return std::to_string(words->size()) + " " + noun + (words->size() == 1 ? "" : "s");
}

}  // namespace npt::inline NPT_ABI
