/// The statements of OBJ: each line is checked before tinyobjloader gets it. tinyobjloader 2.0.0rc10 turns "v abc 0 0"
/// and "v nan 0 0" into 0, accepts "f -4 -2 -1" with three vertices (CVE-2020-28589) and "f 1 2 99", and lets
/// 99999999999 overflow.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace npt::inline NPT_ABI::internal::obj {

/// Statements between faces that a mesh keeps as tags.
inline constexpr std::array<std::string_view, 5> kept_statements = {"o", "g", "usemtl", "s", "mtllib"};

enum class Statement { none, vertex, texcoord, normal, face, kept };

/// A kind of numbered thing that corners refer to.
struct Numbered {
  const char* name;
  std::int64_t count = 0;           ///< in the lines so far
  std::int64_t greatest_index = 0;  ///< from 1, as referred to; may precede the thing itself
  std::size_t greatest_line = 0;
};

/// Checks an OBJ text line by line. What a line holds stays readable until the next is checked.
class StatementCheck {
 public:
  explicit StatementCheck(const std::string& file) : file_(file) {}

  /// Throws npt::Error unless the line is sound. Statements without a place in a mesh are `none`.
  Statement check(std::string_view line, std::size_t number) {
    line_number_ = number;
    std::string_view rest = line;
    const std::string_view keyword = next_word(rest);
    end_ = rest.data();
    if (keyword.empty() || keyword[0] == '#') return Statement::none;
    if (keyword == "v") return check_vertex(rest);
    if (keyword == "vt") return check_row(Statement::texcoord, texcoords_, rest, 1, 3);
    if (keyword == "vn") return check_row(Statement::normal, normals_, rest, 3, 3);
    if (keyword == "f") return check_face(rest);
    if (keyword == "l" || keyword == "p") {
      check_corners(rest);
    } else if (std::ranges::find(kept_statements, keyword) != kept_statements.end()) {
      keyword_ = keyword;
      argument_ = trimmed(rest);
      return Statement::kept;
    } else if (!is_letter(keyword[0])) {
      fail(in_quotes(line), "an OBJ statement, such as v, vt, vn or f");
    }
    return Statement::none;
  }

  /// After the last line: whether what the faces look ahead to has come.
  void check_end() {
    if (vertices_.count == 0)
      throw Error({.file = file_, .found = "no vertices", .expected = "v statements of an OBJ file"});
    for (const Numbered* numbered : {&vertices_, &texcoords_, &normals_}) {
      line_number_ = numbered->greatest_line;
      if (numbered->greatest_index > numbered->count)
        fail(std::string(numbered->name) + ' ' + std::to_string(numbered->greatest_index),
             "at most " + std::to_string(numbered->count) + ", the number in the file");
    }
  }

  /// The numbers of a v, vt or vn.
  std::span<const double> numbers() const { return std::span(numbers_).first(number_count_); }
  /// The corners of an f.
  std::size_t corner_count() const { return corner_count_; }
  /// What a kept statement says.
  std::string_view keyword() const { return keyword_; }
  std::string_view argument() const { return argument_; }
  /// Where the last argument before a comment ends.
  const char* end() const { return end_; }

 private:
  static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

  /// The next word before a comment.
  std::string_view next_argument(std::string_view& rest) {
    const std::string_view word = next_word(rest);
    if (word.empty() || word[0] == '#') return {};
    end_ = rest.data();
    return word;
  }

  /// Reads numbers, whose count must be from `least` to `most`.
  void check_numbers(std::string_view rest, std::size_t least, std::size_t most) {
    std::size_t n = 0;
    for (std::string_view word; !(word = next_argument(rest)).empty(); ++n) {
      const std::optional<double> value = parse_number<double>(word);
      if (!value || !fits_float(*value)) fail(in_quotes(word), "a finite number that fits into 32-bit floating point");
      if (n < numbers_.size()) numbers_[n] = *value;
    }
    if (n < least || n > most)
      fail(std::to_string(n) + (n == 1 ? " number" : " numbers"),
           least == most ? std::to_string(least) : std::to_string(least) + " to " + std::to_string(most));
    number_count_ = n;
  }

  Statement check_row(Statement statement, Numbered& numbered, std::string_view rest, std::size_t least,
                      std::size_t most) {
    check_numbers(rest, least, most);
    ++numbered.count;
    return statement;
  }

  Statement check_vertex(std::string_view rest) {
    check_row(Statement::vertex, vertices_, rest, 3, 6);
    if (number_count_ == 5) fail("5 numbers", "x y z, x y z w or x y z red green blue");
    return Statement::vertex;
  }

  Statement check_face(std::string_view rest) {
    corner_count_ = check_corners(rest);
    if (corner_count_ < 3)
      fail("a face with " + std::to_string(corner_count_) + (corner_count_ == 1 ? " corner" : " corners"),
           "at least 3");
    return Statement::face;
  }

  /// Checks references "v", "v/vt", "v//vn", "v/vt/vn", each also with nothing after a "/"; gives their number.
  std::size_t check_corners(std::string_view rest) {
    std::size_t n = 0;
    for (std::string_view word; !(word = next_argument(rest)).empty(); ++n) {
      std::string_view tail = word;
      check_index(vertices_, tail.substr(0, tail.find('/')), word);
      for (Numbered* numbered : {&texcoords_, &normals_}) {
        const std::size_t slash = tail.find('/');
        if (slash == std::string_view::npos) break;
        tail.remove_prefix(slash + 1);
        const std::string_view index = tail.substr(0, tail.find('/'));
        if (!index.empty()) check_index(*numbered, index, word);
        if (numbered == &normals_ && tail.size() != index.size()) fail(in_quotes(word), "at most v/vt/vn");
      }
    }
    return n;
  }

  void check_index(Numbered& numbered, std::string_view text, std::string_view word) {
    const std::optional<std::int32_t> index = parse_number<std::int32_t>(text);
    if (!index || *index == 0 || *index == std::numeric_limits<std::int32_t>::min())
      fail(in_quotes(word),
           std::string("the number of a ") + numbered.name + ", from 1, or negative to count backwards");
    if (*index < 0 && -std::int64_t{*index} > numbered.count)
      fail(std::string(numbered.name) + ' ' + std::to_string(*index),
           "at least " + std::to_string(-numbered.count) + ", there are only so many before this line");
    if (*index > numbered.greatest_index) {
      numbered.greatest_index = *index;
      numbered.greatest_line = line_number_;
    }
  }

  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({.file = file_,
                 .place = "line " + std::to_string(line_number_),
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

  const std::string& file_;
  std::size_t line_number_ = 0;
  Numbered vertices_{"vertex"}, texcoords_{"texture coordinate"}, normals_{"normal"};
  std::array<double, 6> numbers_{};
  std::size_t number_count_ = 0, corner_count_ = 0;
  std::string_view keyword_, argument_;
  const char* end_ = nullptr;
};

}  // namespace npt::inline NPT_ABI::internal::obj
