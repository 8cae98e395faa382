/// Reading and writing numbers, words and lines of text files. Independent of the locale: 1.5 is 1.5 also where a comma
/// is the decimal sign. words.hpp splits lines with quotation marks and comments.
#pragma once

#include <npt/base/number_text.hpp>
#include <npt/config.hpp>

#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace npt::inline NPT_ABI {

/// The lines of a text, whichever of "\n", "\r\n" and "\r" ends them; the last may have no end.
class TextLines {
 public:
  explicit TextLines(std::string_view text) : rest_(text) {}

  /// Moves to the next line; false at the end of the text.
  bool next(std::string_view& line) {
    if (rest_.empty()) return false;
    std::size_t end = 0;  // std::string_view::find_first_of took an eighth of the time of reading an OBJ file
    while (end < rest_.size() && rest_[end] != '\n' && rest_[end] != '\r') ++end;
    line = rest_.substr(0, end);
    ++number_;
    rest_.remove_prefix(end == rest_.size() ? end : end + (rest_.substr(end, 2) == "\r\n" ? 2 : 1));
    return true;
  }
  /// Number of the line that next() gave last, from 1.
  std::size_t number() const { return number_; }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

/// Takes the next word off the front of `line`; empty when there is none.
inline std::string_view next_word(std::string_view& line) {
  const auto blank = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
  std::size_t first = 0;
  while (first < line.size() && blank(line[first])) ++first;
  std::size_t end = first;
  while (end < line.size() && !blank(line[end])) ++end;
  const std::string_view word = line.substr(first, end - first);
  line.remove_prefix(end);
  return word;
}

/// `text` without blanks at both ends.
inline std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r\v\f";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// With 'a' to 'z' for 'A' to 'Z'; other letters stay.
inline std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

/// The number that `word` is, all of it. Nothing for other text, and for numbers that the type can't hold. A
/// floating-point number too small for the type is 0.
template <class Number>
std::optional<Number> parse_number(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  Number value{};
  const auto [end, error] = number_from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size()) return std::nullopt;
  if (error == std::errc{}) return value;
  const std::size_t exponent = word.find_first_of("eE");
  const bool tiny = std::floating_point<Number> && exponent != std::string_view::npos && word[exponent + 1] == '-';
  return error == std::errc::result_out_of_range && tiny ? std::optional(Number{}) : std::nullopt;
}

/// Whether a number, rounded to the nearest float, is finite. The bound is the middle between the largest float and the
/// next power of two: the shortest decimal form of the largest float, 3.4028235e38, lies above that float.
inline bool fits_float(double x) { return std::abs(x) < 0x1.ffffffp127; }

/// Appends a number in its shortest form that reads back to the same bits.
template <class Number>
requires std::integral<Number> || std::floating_point<Number>
void append_number(std::string& text, Number value) {
  std::array<char, 32> digits;
  const auto result = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), result.ptr);
}

/// Text of a file as it stands in a message: in quotes, bytes that can't be printed as `\xNN`, cut when long.
NPT_INLINE std::string in_quotes(std::string_view text) {
  constexpr std::size_t longest = 60;
  constexpr std::string_view hex = "0123456789abcdef";
  std::string result = "'";
  for (const char c : text.substr(0, longest)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7F) {
      result += c;
    } else {
      result += {'\\', 'x', hex[byte >> 4], hex[byte & 15]};
    }
  }
  return result + (text.size() > longest ? "...'" : "'");
}

}  // namespace npt::inline NPT_ABI
