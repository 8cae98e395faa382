/// What several subcommands understand: lists of texts and numbers, and checks of outputs before long work.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/number_text.hpp>
#include <npt/io/file.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace program {

/// "a,b,c" to a, b, c. "\," is a comma within a text, "\n" a new line, "\\" a backslash.
inline std::vector<std::string> split_list(std::string_view text) {
  std::vector<std::string> parts(1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == ',') {
      parts.emplace_back();
    } else if (text[i] == '\\' && i + 1 < text.size()) {
      ++i;
      parts.back() += text[i] == 'n' ? '\n' : text[i];
    } else {
      parts.back() += text[i];
    }
  }
  return parts;
}

/// "a, b, c" of a, b, c.
inline std::string joined(std::span<const std::string> parts, std::string_view separator) {
  std::string text;
  for (const std::string& part : parts) text += (&part == parts.data() ? std::string() : std::string(separator)) + part;
  return text;
}

/// Numbers separated by commas, blanks or line ends.
/// Errors    npt::Error that names `argument` and the word that is no finite number.
inline std::vector<float> parse_numbers(std::string_view text, const std::string& argument) {
  std::vector<float> numbers;
  const auto separates = [](char c) { return c == ',' || std::isspace(static_cast<unsigned char>(c)) != 0; };
  for (std::size_t i = 0; i < text.size();) {
    if (separates(text[i])) {
      ++i;
      continue;
    }
    const auto end = static_cast<std::size_t>(
        std::find_if(text.begin() + static_cast<std::ptrdiff_t>(i), text.end(), separates) - text.begin());
    const std::string_view word = text.substr(i, end - i);
    float value = 0;
    const auto result = npt::number_from_chars(word.data(), word.data() + word.size(), value);
    if (result.ec != std::errc() || result.ptr != word.data() + word.size() || !std::isfinite(value))
      throw npt::Error(
          {argument, "number " + std::to_string(numbers.size() + 1), "'" + std::string(word) + "'", "a number"});
    numbers.push_back(value);
    i = end;
  }
  return numbers;
}

/// Lower case, with its dot: ".ply".
inline std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

/// Throws npt::Error unless `path` ends with one of the extensions.
inline void expect_extension(const std::filesystem::path& path, std::span<const std::string_view> extensions) {
  const std::string extension = extension_of(path);
  if (std::ranges::find(extensions, extension) != extensions.end()) return;
  std::string expected;
  for (std::string_view e : extensions) expected += (expected.empty() ? "" : " or ") + std::string(e);
  throw npt::Error(
      {path.string(), {}, extension.empty() ? "a name without extension" : "extension " + extension, expected});
}

/// The absolute path without links, dots and detours, also of a file that is not there yet.
inline std::filesystem::path resolved(const std::filesystem::path& path) {
  std::error_code code;
  const std::filesystem::path absolute = std::filesystem::absolute(path, code);
  const std::filesystem::path plain = std::filesystem::weakly_canonical(absolute, code);
  return code ? absolute.lexically_normal() : plain;
}

/// True where both names lead to one file.
inline bool same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code code;
  return std::filesystem::equivalent(a, b, code) || resolved(a) == resolved(b);
}

/// Throws npt::Error unless a file could be written at `path`, and refuses an output that is one of the inputs. Nothing
/// stays behind. Call it before long work.
inline void check_output(const std::filesystem::path& path, std::span<const std::filesystem::path> inputs) {
  for (const std::filesystem::path& input : inputs)
    if (same_file(path, input))
      throw npt::Error({path.string(), {}, "an output that is also an input", "another name for the output"});
  npt::AtomicFile attempt(path);
}

/// A name that ends as a file's can't become a folder by mistake; one that is there may have any name.
/// Errors    npt::Error that says what is `expected`
inline void expect_folder_name(const std::filesystem::path& folder, const std::string& expected) {
  std::error_code code;
  const std::string extension = extension_of(folder);
  const bool has_letter = std::ranges::any_of(extension, [](char c) { return c >= 'a' && c <= 'z'; });
  if (has_letter && !std::filesystem::is_directory(folder, code))
    throw npt::Error({folder.string(), {}, "extension " + extension, expected});
}

/// A folder for outputs that is made when it is missing, and taken away again when nothing came into it.
class OutputFolder {
 public:
  explicit OutputFolder(std::filesystem::path folder) : folder_(std::move(folder)) {
    std::error_code code;
    if (std::filesystem::is_directory(folder_, code)) return;
    made_ = std::filesystem::create_directory(folder_, code);
    if (!made_ && !std::filesystem::is_directory(folder_, code))  // another process may have been faster
      throw npt::Error({folder_.string(), {}, code ? code.message() : "no folder", "a folder that can be written"});
  }
  ~OutputFolder() {
    std::error_code ignored;
    if (made_) std::filesystem::remove(folder_, ignored);  // fails where a file is in it
  }
  /// Leaves the folder where it is, whatever came into it.
  void keep() { made_ = false; }
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

 private:
  std::filesystem::path folder_;
  bool made_ = false;
};

}  // namespace program
