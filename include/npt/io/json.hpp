/// JSON (RFC 8259) as it stands in headers of files: read strictly, as a series of events, and quoted for writing.
///
/// Events rather than a tree: a tree keeps one of two equal keys in silence, and its depth is the sender's to choose. A
/// reader of events refuses what doesn't fit the place it stands in.
///
/// Why not nlohmann/json, whose SAX parser gives the same events: every host that includes npt.hpp would parse it; npt
/// is headers only and has no compiled part to hide it in. `g++ -fsyntax-only` (12.2, least of ten) takes 1.3 s for
/// <nlohmann/json.hpp> alone, 0.2 s for this header, of which <string> is nearly all, and 1.2 s for npt.hpp with it.
/// Programs, which pay once, use nlohmann/json.
#pragma once

#include <npt/config.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace npt::inline NPT_ABI::internal {

/// Length of the UTF-8 sequence that `text` begins with; 0 where it begins with none: stray and missing bytes, longer
/// forms than needed, surrogates, beyond U+10FFFF.
inline std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const auto follows = [&](std::size_t i) { return byte(i) >= 0x80 && byte(i) <= 0xBF; };
  const unsigned lead = byte(0), second = byte(1);
  if (text.empty()) return 0;
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead <= 0xDF) return follows(1) ? 2 : 0;
  if (lead >= 0xE0 && lead <= 0xEF) {
    const unsigned first = lead == 0xE0 ? 0xA0 : 0x80, last = lead == 0xED ? 0x9F : 0xBF;
    return second >= first && second <= last && follows(2) ? 3 : 0;
  }
  if (lead >= 0xF0 && lead <= 0xF4) {
    const unsigned first = lead == 0xF0 ? 0x90 : 0x80, last = lead == 0xF4 ? 0x8F : 0xBF;
    return second >= first && second <= last && follows(2) && follows(3) ? 4 : 0;
  }
  return 0;
}

inline void append_utf8(std::string& out, std::uint32_t code) {
  const auto put = [&](std::uint32_t byte) { out += static_cast<char>(static_cast<unsigned char>(byte)); };
  const auto put_tail = [&](int shift) { put(0x80U | (code >> shift & 0x3FU)); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xC0U | code >> 6);
    put_tail(0);
  } else if (code < 0x10000) {
    put(0xE0U | code >> 12);
    put_tail(6);
    put_tail(0);
  } else {
    put(0xF0U | code >> 18);
    put_tail(12);
    put_tail(6);
    put_tail(0);
  }
}

/// Reads one JSON value and tells `events` about it, in the order of the text:
///   null()  boolean(bool)  number(string_view as it stands)  string(string)
///   start_object() key(string) ... end_object()   start_array() ... end_array()
///   syntax_error(size_t position)                 [[noreturn]]: throws
/// Whatever an event throws ends the reading. Memory is one byte a level of nesting; nothing recurses.
template <class Events>
class JsonReader {
 public:
  JsonReader(std::string_view text, Events& events) : text_(text), events_(events) {}

  void read() {
    value();
    while (!open_.empty()) {
      if (open_.back() == '{')
        next_member();
      else
        next_element();
    }
    skip_blanks();
    if (at_ != text_.size()) fail();
  }

  /// Where the key or value that an event tells of, or an object or array that begins, begins in the text.
  std::size_t begin() const noexcept { return begin_; }
  /// Where what an event tells of ends.
  std::size_t position() const noexcept { return at_; }

 private:
  [[noreturn]] void fail() { events_.syntax_error(at_); }
  /// The next character, or a zero at the end. A zero in the text itself fits nowhere either.
  char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  bool take(char c) {
    if (at_ == text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  void expect(char c) {
    if (!take(c)) fail();
  }
  void skip_blanks() {
    while (peek() == ' ' || peek() == '\t' || peek() == '\n' || peek() == '\r') ++at_;
  }
  static bool is_digit(char c) { return c >= '0' && c <= '9'; }

  /// A value, or of an object or array only its beginning.
  void value() {
    skip_blanks();
    begin_ = at_;
    const char c = peek();
    if (c == '"') {
      events_.string(string());
    } else if (c == '{' || c == '[') {
      ++at_;
      open_ += c;
      fresh_ = true;
      if (c == '{')
        events_.start_object();
      else
        events_.start_array();
    } else if (c == '-' || is_digit(c)) {
      events_.number(number());
    } else if (word("null")) {
      events_.null();
    } else if (word("true")) {
      events_.boolean(true);
    } else if (word("false")) {
      events_.boolean(false);
    } else {
      fail();
    }
  }

  bool word(std::string_view expected) {
    if (!text_.substr(at_).starts_with(expected)) return false;
    at_ += expected.size();
    return true;
  }

  /// Whether the innermost object or array ends here; else what follows is its first entry, or one after a comma.
  bool closes(char bracket) {
    skip_blanks();
    const bool first = fresh_;
    fresh_ = false;
    if (take(bracket)) {
      open_.pop_back();
      return true;
    }
    if (!first) expect(',');
    return false;
  }

  void next_member() {
    if (closes('}')) {
      events_.end_object();
      return;
    }
    skip_blanks();
    if (peek() != '"') fail();
    begin_ = at_;
    events_.key(string());
    skip_blanks();
    expect(':');
    value();
  }

  void next_element() {
    if (closes(']'))
      events_.end_array();
    else
      value();
  }

  void digits() {
    if (!is_digit(peek())) fail();
    while (is_digit(peek())) ++at_;
  }
  std::string_view number() {
    const std::size_t begin = at_;
    take('-');
    if (!take('0')) digits();
    if (take('.')) digits();
    if (take('e') || take('E')) {
      if (!take('+')) take('-');
      digits();
    }
    return text_.substr(begin, at_ - begin);
  }

  std::string string() {
    expect('"');
    std::string result;
    while (!take('"')) {
      if (take('\\')) {
        escape(result);
        continue;
      }
      const std::size_t length = utf8_length(text_.substr(at_));
      if (length == 0 || static_cast<unsigned char>(text_[at_]) < 0x20) fail();
      result += text_.substr(at_, length);
      at_ += length;
    }
    return result;
  }

  /// What follows a backslash.
  void escape(std::string& out) {
    constexpr std::string_view letters = "\"\\/bfnrt", meaning = "\"\\/\b\f\n\r\t";
    if (take('u')) {
      append_utf8(out, escaped_code());
      return;
    }
    const std::size_t letter = at_ < text_.size() ? letters.find(text_[at_]) : std::string_view::npos;
    if (letter == std::string_view::npos) fail();
    out += meaning[letter];
    ++at_;
  }

  /// The code point behind \u; two of them for one beyond U+FFFF.
  std::uint32_t escaped_code() {
    const std::uint32_t high = hex4();
    if (high < 0xD800 || high > 0xDFFF) return high;
    if (high > 0xDBFF || !word("\\u")) fail();
    const std::uint32_t low = hex4();
    if (low < 0xDC00 || low > 0xDFFF) fail();
    return 0x10000 + ((high - 0xD800) << 10) + (low - 0xDC00);
  }
  std::uint32_t hex4() {
    std::uint32_t code = 0;
    for (int i = 0; i < 4; ++i, ++at_) {
      const char c = peek();
      if (is_digit(c))
        code = code * 16 + static_cast<std::uint32_t>(c - '0');
      else if ((c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F'))
        code = code * 16 + static_cast<std::uint32_t>((c | 0x20) - 'a' + 10);
      else
        fail();
    }
    return code;
  }

  std::string_view text_;
  Events& events_;
  std::size_t at_ = 0, begin_ = 0;
  std::string open_;    ///< the brackets around this place, outermost first
  bool fresh_ = false;  ///< the innermost bracket has just been opened
};

template <class Events>
void read_json(std::string_view text, Events& events) {
  JsonReader<Events>(text, events).read();
}

/// Names of files that don't say how they write letters: what is UTF-8 stays, another byte is taken as Latin-1's letter.
inline std::string utf8_of(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0)
      append_utf8(out, static_cast<unsigned char>(text[0]));
    else
      out += text.substr(0, length);
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return out;
}

/// Appends the text as a JSON string. False, with `out` as it was, when it is no UTF-8.
NPT_INLINE bool append_json_string(std::string& out, std::string_view text) {
  constexpr std::string_view hex = "0123456789abcdef";
  constexpr std::string_view special = "\"\\\b\f\n\r\t", letters = "\"\\bfnrt";
  const std::size_t before = out.size();
  out += '"';
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text.substr(i));
    if (length == 0) {
      out.resize(before);
      return false;
    }
    const auto byte = static_cast<unsigned char>(text[i]);
    if (const std::size_t letter = special.find(text[i]); letter != std::string_view::npos)
      out += {'\\', letters[letter]};
    else if (byte < 0x20)
      out += {'\\', 'u', '0', '0', hex[byte >> 4], hex[byte & 15]};
    else
      out += text.substr(i, length);
    i += length;
  }
  out += '"';
  return true;
}

}  // namespace npt::inline NPT_ABI::internal
