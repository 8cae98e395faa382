/// The words of OBJ's lines, checked before tinyobjloader gets them: it says nothing of words that are no numbers.
/// tinyobjloader 2.0.0rc10 turns "v abc 0 0" and "v nan 0 0" into 0 and lets the index 99999999999 overflow.
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

/// `element`: a line or points, whose corners are verified and left out.
enum class Statement { none, vertex, texcoord, normal, face, element, kept };

/// Checks an OBJ text line by line. What a line holds stays readable until the next is checked.
class StatementCheck {
 public:
  explicit StatementCheck(const std::string& file) : file_(file) {}

  /// Throws npt::Error unless the line's words are sound. Statements without a place in a mesh are `none`.
  Statement check(std::string_view line, std::size_t number) {
    line_number_ = number;
    rest_ = line;
    keyword_ = next_word(rest_);
    end_ = rest_.data();
    if (keyword_.empty() || keyword_[0] == '#') return Statement::none;
    if (keyword_ == "v") return check_numbers(Statement::vertex, 3, 6);
    if (keyword_ == "vt") return check_numbers(Statement::texcoord, 1, 3);
    if (keyword_ == "vn") return check_numbers(Statement::normal, 3, 3);
    if (keyword_ == "f") return check_corners(Statement::face, 3);
    if (keyword_ == "l" || keyword_ == "p") return check_corners(Statement::element, 0);
    if (std::ranges::find(kept_statements, keyword_) != kept_statements.end()) return Statement::kept;
    if (!is_letter(keyword_[0])) fail(in_quotes(line), "an OBJ statement, such as v, vt, vn or f");
    return Statement::none;
  }

  /// The numbers of a v, vt or vn.
  std::span<const double> numbers() const { return std::span(numbers_).first(number_count_); }
  /// The line's first word, and what follows it in a kept statement.
  std::string_view keyword() const { return keyword_; }
  std::string_view argument() const { return trimmed(rest_); }
  /// Where the last argument before a comment ends.
  const char* end() const { return end_; }
  std::size_t line_number() const { return line_number_; }

  /// Throws an error at the line that was checked last.
  [[noreturn]] void fail(std::string found, std::string expected) const {
    fail_at(line_number_, std::move(found), std::move(expected));
  }
  [[noreturn]] void fail_at(std::size_t line, std::string found, std::string expected) const {
    throw Error({.file = file_,
                 .place = "line " + std::to_string(line),
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

 private:
  static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

  /// The next word before a comment.
  std::string_view next_argument() {
    const std::string_view word = next_word(rest_);
    if (word.empty() || word[0] == '#') return {};
    end_ = rest_.data();
    return word;
  }

  /// Reads numbers, whose count must be from `least` to `most`.
  Statement check_numbers(Statement statement, std::size_t least, std::size_t most) {
    std::size_t n = 0;
    for (std::string_view word; !(word = next_argument()).empty(); ++n) {
      const std::optional<double> value = parse_number<double>(word);
      if (!value || !fits_float(*value)) fail(in_quotes(word), "a finite number that fits into 32-bit floating point");
      if (n < numbers_.size()) numbers_[n] = *value;
    }
    if (n < least || n > most)
      fail(std::to_string(n) + (n == 1 ? " number" : " numbers"),
           least == most ? std::to_string(least) : std::to_string(least) + " to " + std::to_string(most));
    if (n == 5) fail("5 numbers", "x y z, x y z w or x y z red green blue");
    number_count_ = n;
    return statement;
  }

  /// Checks references "v", "v/vt", "v//vn", "v/vt/vn", each also with nothing after a "/".
  Statement check_corners(Statement statement, std::size_t least) {
    std::size_t n = 0;
    for (std::string_view word; !(word = next_argument()).empty(); ++n) {
      if (std::ranges::count(word, '/') > 2) fail(in_quotes(word), "at most v/vt/vn");
      std::string_view tail = word;
      for (const char* name : {"vertex", "texture coordinate", "normal"}) {
        const std::size_t slash = std::min(tail.find('/'), tail.size());
        if (slash > 0 || tail.data() == word.data()) check_index(tail.substr(0, slash), name, word);
        tail.remove_prefix(slash);
        if (tail.empty()) break;
        tail.remove_prefix(1);
      }
    }
    if (n < least)
      fail("a face with " + std::to_string(n) + (n == 1 ? " corner" : " corners"), "at least " + std::to_string(least));
    return statement;
  }

  void check_index(std::string_view text, const char* name, std::string_view word) const {
    const std::optional<std::int32_t> index = parse_number<std::int32_t>(text);
    if (!index || *index == 0 || *index == std::numeric_limits<std::int32_t>::min())
      fail(in_quotes(word), std::string("the number of a ") + name + ", from 1, or negative to count backwards");
  }

  const std::string& file_;
  std::size_t line_number_ = 0;
  std::array<double, 6> numbers_{};
  std::size_t number_count_ = 0;
  std::string_view keyword_, rest_;
  const char* end_ = nullptr;
};

}  // namespace npt::inline NPT_ABI::internal::obj
