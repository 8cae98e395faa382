/// JSON as a tree, for documents whose parts refer to each other (glTF). Read strictly, as json.hpp reads; written back
/// with the numbers' own digits.
/// Errors    npt::Error that names the byte: no JSON, a key twice in one object, deeper than 64 levels, more than 8
///           million values (the tree takes some 100 bytes for each)
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/json.hpp>
#include <npt/io/text.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

struct JsonValue {
  enum class Kind : std::uint8_t { null, boolean, number, string, array, object };

  Kind kind = Kind::null;
  std::string text;                ///< a string's characters, a number's digits, "true" or "false"
  std::vector<JsonValue> items;    ///< of arrays and objects
  std::vector<std::string> keys;   ///< of objects, one for each item
  std::size_t begin = 0, end = 0;  ///< in the text
  std::size_t member = 0;          ///< where its key begins, of an object's

  bool is(Kind other) const noexcept { return kind == other; }
  /// The member of that name; nullptr where there is none, or no object.
  const JsonValue* find(std::string_view key) const {
    const auto found = std::ranges::find(keys, key);
    return found == keys.end() ? nullptr : &items[static_cast<std::size_t>(found - keys.begin())];
  }
  /// Not negative; nothing for other values. "3.0" is 3 to JSON, and some writers put it so.
  std::optional<std::uint64_t> whole() const {
    if (!is(Kind::number)) return std::nullopt;
    if (const auto number = parse_number<std::uint64_t>(text)) return number;
    const auto real = parse_number<double>(text);
    if (!real || !(*real >= 0 && *real < 9e15) || *real != std::floor(*real)) return std::nullopt;
    return static_cast<std::uint64_t>(*real);
  }
};

/// The events of JsonReader as a tree.
class JsonTree {
 public:
  static constexpr std::size_t most_levels = 64, most_values = 8'000'000;

  JsonTree(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  JsonValue read() {
    JsonReader<JsonTree> reader(text_, *this);
    reader_ = &reader;
    reader.read();
    reader_ = nullptr;
    return std::move(root_);
  }

  void null() { add({}); }
  void boolean(bool value) { add({JsonValue::Kind::boolean, value ? "true" : "false", {}, {}}); }
  void number(std::string_view digits) { add({JsonValue::Kind::number, std::string(digits), {}, {}}); }
  void string(std::string text) { add({JsonValue::Kind::string, std::move(text), {}, {}}); }
  void start_object() { open(JsonValue::Kind::object); }
  void start_array() { open(JsonValue::Kind::array); }
  void key(std::string name) {
    open_.back().keys.push_back(std::move(name));
    member_ = reader_->begin();
  }
  void end_array() { close(); }
  void end_object() {
    std::vector<std::string_view> keys(open_.back().keys.begin(), open_.back().keys.end());
    std::ranges::sort(keys);
    const auto twice = std::ranges::adjacent_find(keys);
    if (twice != keys.end()) fail("the key \"" + std::string(*twice).substr(0, 80) + "\" twice", "each once");
    close();
  }
  [[noreturn]] void syntax_error(std::size_t at) const {
    throw Error({.file = file_, .place = "JSON, byte " + std::to_string(at), .found = "no JSON", .expected = "JSON"});
  }

 private:
  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({.file = file_, .place = "JSON", .found = std::move(found), .expected = std::move(expected)});
  }
  void open(JsonValue::Kind kind) {
    if (open_.size() == most_levels) fail("more than 64 levels", "fewer");
    count();
    JsonValue& value = open_.emplace_back();
    value.kind = kind, value.begin = reader_->begin(), value.member = member_;
  }
  void close() {
    JsonValue value = std::move(open_.back());
    open_.pop_back();
    value.end = reader_->position();
    put(std::move(value));
  }
  void add(JsonValue value) {
    count();
    value.begin = reader_->begin(), value.end = reader_->position(), value.member = member_;
    put(std::move(value));
  }
  void count() {
    if (++values_ > most_values) fail("more than " + std::to_string(most_values) + " values", "fewer");
  }
  void put(JsonValue value) {
    open_.empty() ? root_ = std::move(value) : open_.back().items.emplace_back(std::move(value));
  }

  std::string_view text_;
  const std::string& file_;
  const JsonReader<JsonTree>* reader_ = nullptr;
  JsonValue root_;
  std::vector<JsonValue> open_;  ///< outermost first
  std::size_t values_ = 0, member_ = 0;
};

/// `file` stands in the messages of errors.
inline JsonValue read_json_tree(std::string_view text, const std::string& file) { return JsonTree(text, file).read(); }

/// Appends a value as text without blanks.
inline void append_json(std::string& out, const JsonValue& value) {
  using Kind = JsonValue::Kind;
  if (value.is(Kind::null)) out += "null";
  if (value.is(Kind::boolean) || value.is(Kind::number)) out += value.text;
  if (value.is(Kind::string)) append_json_string(out, value.text);
  if (!value.is(Kind::array) && !value.is(Kind::object)) return;
  const bool object = value.is(Kind::object);
  out += object ? '{' : '[';
  for (std::size_t i = 0; i < value.items.size(); ++i) {
    if (i > 0) out += ',';
    if (object) {
      append_json_string(out, value.keys[i]);
      out += ':';
    }
    append_json(out, value.items[i]);
  }
  out += object ? '}' : ']';
}

}  // namespace npt::inline NPT_ABI::internal
