/// The JSON of a glTF document as text in which members and items are put in, and all else stays as it is spelled.
/// Errors    npt::Error that names file and place: no JSON, no glTF 2.0, other kinds of values than are needed
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/json.hpp>
#include <npt/io/json_tree.hpp>
#include <npt/io/text.hpp>
#include <npt/io/text_edits.hpp>

#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

class GltfText {
 public:
  using Kind = JsonValue::Kind;

  /// `text` has to outlive it.
  GltfText(std::string_view text, std::string name)
      : name_(std::move(name)), text_(text), blanks_(text.starts_with("\xEF\xBB\xBF") ? 3U : 0U) {
    root_ = read_json_tree(text_.substr(blanks_), name_);
    const JsonValue* asset = root_.find("asset");
    const JsonValue* version = asset == nullptr ? nullptr : asset->find("version");
    if (version == nullptr || !version->is(Kind::string)) fail("asset", "no version", "a glTF document");
    if (!version->text.starts_with("2.")) fail("asset.version", in_quotes(version->text), "2.0");
  }
  GltfText(const GltfText&) = delete;
  GltfText& operator=(const GltfText&) = delete;
  ~GltfText() = default;

  const std::string& name() const noexcept { return name_; }
  const JsonValue& root() const noexcept { return root_; }
  [[noreturn]] void fail(const std::string& place, const std::string& found, const std::string& expected) const {
    throw Error({.file = name_, .place = place, .found = found, .expected = expected});
  }

  /// The list of that name; nullptr where there is none.
  const JsonValue* list(const JsonValue& object, const char* key, const std::string& place = {}) const {
    const JsonValue* value = object.find(key);
    const std::string where = place.empty() ? key : place + "." + key;
    if (value != nullptr && !value->is(Kind::array)) fail(where, "another kind of value", "a list");
    return value;
  }
  std::size_t count(const JsonValue& object, const char* key, const std::string& place = {}) const {
    const JsonValue* value = list(object, key, place);
    return value == nullptr ? 0 : value->items.size();
  }
  /// A list's item, which has to be an object.
  const JsonValue& item(const char* key, std::size_t number) const {
    const JsonValue& value = list(root_, key)->items[number];
    if (!value.is(Kind::object))
      fail(std::string(key) + "[" + std::to_string(number) + "]", "another kind of value", "an object");
    return value;
  }
  /// A list of so many numbers; nothing where it is missing.
  std::optional<std::vector<double>> reals(const JsonValue& object, const char* key, std::size_t size,
                                           const std::string& place) const {
    const JsonValue* value = list(object, key, place);
    if (value == nullptr) return std::nullopt;
    std::vector<double> result;
    for (const JsonValue& number : value->items) {
      const auto real = number.is(Kind::number) ? parse_number<double>(number.text) : std::nullopt;
      if (!real || !std::isfinite(*real)) fail(place + "." + key, in_quotes(number.text), "finite numbers");
      result.push_back(*real);
    }
    if (result.size() != size)
      fail(place + "." + key, std::to_string(result.size()) + " numbers", std::to_string(size));
    return result;
  }
  /// The text as a JSON string.
  std::string quoted(std::string_view value) const {
    std::string text;
    if (!append_json_string(text, value)) fail(in_quotes(value), "bytes that are no UTF-8", "UTF-8");
    return text;
  }

  /// Puts an item behind those of the object's list of that name, which is made where it is missing.
  void add_item(const JsonValue& object, const char* key, std::string json) {
    items_[&object][key].push_back(std::move(json));
  }
  /// A member's value, or one more member.
  void set_member(const JsonValue& object, const char* key, std::string json) {
    if (const JsonValue* old = object.find(key))
      edits_.replace(blanks_ + old->begin, blanks_ + old->end, std::move(json));
    else
      members_[&object].push_back(quoted(key) + ":" + json);
  }
  /// Other members in the place of one, which has to be there.
  void replace_member(const JsonValue& object, const char* key, std::string members) {
    const JsonValue& old = *object.find(key);
    edits_.replace(blanks_ + old.member, blanks_ + old.end, std::move(members));
  }

  /// Takes a member out, which has to be there, and the comma beside it.
  void remove_member(const JsonValue& object, const char* key) {
    const auto i = static_cast<std::size_t>(object.find(key) - object.items.data());
    const JsonValue& old = object.items[i];
    const bool last = i + 1 == object.items.size();
    const std::size_t begin = i > 0 && last ? object.items[i - 1].end : old.member;
    edits_.replace(blanks_ + begin, blanks_ + (last ? old.end : object.items[i + 1].member), {});
  }

  std::string changed() const {
    TextEdits edits = edits_;
    std::map<const JsonValue*, std::vector<std::string>> members = members_;
    for (const auto& [object, lists] : items_)
      for (const auto& [key, items] : lists) {
        if (const JsonValue* old = list(*object, key.c_str()))
          put_in(edits, *old, items);
        else
          members[object].push_back("\"" + key + "\":[" + joined(items) + "]");
      }
    for (const auto& [object, texts] : members) put_in(edits, *object, texts);
    return edits.applied(text_);
  }

 private:
  static std::string joined(const std::vector<std::string>& texts) {
    std::string result;
    for (const std::string& text : texts) result += (result.empty() ? "" : ",") + text;
    return result;
  }
  /// Behind what an object or a list has.
  void put_in(TextEdits& edits, const JsonValue& holder, const std::vector<std::string>& texts) const {
    if (holder.items.empty())
      edits.insert(blanks_ + holder.begin + 1, joined(texts));
    else
      edits.insert(blanks_ + holder.items.back().end, "," + joined(texts));
  }

  std::string name_;
  std::string_view text_;
  std::size_t blanks_;  ///< a byte order mark before the JSON
  JsonValue root_;
  TextEdits edits_;
  std::map<const JsonValue*, std::vector<std::string>> members_;
  std::map<const JsonValue*, std::map<std::string, std::vector<std::string>>> items_;
};

}  // namespace npt::inline NPT_ABI::internal
