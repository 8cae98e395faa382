/// The header of a PLY file: its format, and elements with their properties.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>
#include <npt/mesh/mesh.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };

constexpr const char* to_string(PlyFormat format) noexcept {
  return format == PlyFormat::ascii                  ? "ascii"
         : format == PlyFormat::binary_little_endian ? "binary_little_endian"
                                                     : "binary_big_endian";
}

namespace internal::ply {

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };

struct TypeInfo {
  Type type;
  std::string_view name, alias;
  std::size_t size;
  double low, high;  ///< range of whole numbers; equal for floating point
};
inline constexpr std::array<TypeInfo, 8> types = {{{Type::i8, "char", "int8", 1, -128, 127},
                                                   {Type::u8, "uchar", "uint8", 1, 0, 255},
                                                   {Type::i16, "short", "int16", 2, -32768, 32767},
                                                   {Type::u16, "ushort", "uint16", 2, 0, 65535},
                                                   {Type::i32, "int", "int32", 4, -2147483648.0, 2147483647.0},
                                                   {Type::u32, "uint", "uint32", 4, 0, 4294967295.0},
                                                   {Type::f32, "float", "float32", 4, 0, 0},
                                                   {Type::f64, "double", "float64", 8, 0, 0}}};

constexpr const TypeInfo& info(Type type) { return types[static_cast<std::size_t>(type)]; }
constexpr bool is_whole(Type type) { return info(type).low != info(type).high; }

inline std::optional<Type> find_type(std::string_view name) {
  for (const TypeInfo& t : types)
    if (name == t.name || name == t.alias) return t.type;
  return std::nullopt;
}

struct Property {
  std::string name, type_name;
  Type type = Type::f32;
  std::optional<Type> count_type;  ///< of a list's length; nothing: a scalar
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  const Property* find(std::string_view property) const {
    const auto found = std::ranges::find(properties, property, &Property::name);
    return found == properties.end() ? nullptr : &*found;
  }
};

struct Header {
  PlyFormat format = PlyFormat::ascii;
  std::vector<Element> elements;
  std::vector<MeshTag> comments;
  std::string note;  ///< what was repaired; empty: nothing
  std::size_t bytes = 0, lines = 0;

  const Element* find(std::string_view element) const {
    const auto found = std::ranges::find(elements, element, &Element::name);
    return found == elements.end() ? nullptr : &*found;
  }
};

/// Reads the header line by line.
class HeaderReader {
 public:
  HeaderReader(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  Header read() {
    find_line_end();
    if (next_line() != "ply") fail(in_quotes(line_), "ply");
    bool formatted = false;
    while (next_line() != "end_header") {
      std::string_view rest = line_;
      const std::string_view keyword = next_word(rest);
      if (keyword == "comment" || keyword == "obj_info") {
        header_.comments.push_back({0, std::string(keyword), std::string(trimmed(rest))});
      } else if (keyword == "format" && !formatted) {
        formatted = true;
        read_format(rest);
      } else if (keyword == "element") {
        read_element(rest);
      } else if (keyword == "property") {
        read_property(rest);
      } else {
        pass_over(keyword);
      }
    }
    if (!formatted) fail("a header without format", "format ascii, binary_little_endian or binary_big_endian");
    header_.bytes = position_;
    header_.lines = number_;
    return std::move(header_);
  }

 private:
  /// One kind of line end for the whole header, so that no byte of binary data is taken for a part of one.
  void find_line_end() {
    const std::size_t end = text_.find_first_of("\r\n");
    if (end != std::string_view::npos) line_end_ = text_.substr(end, text_.substr(end, 2) == "\r\n" ? 2 : 1);
  }

  std::string_view next_line() {
    ++number_;
    const std::size_t end = line_end_.empty() ? std::string_view::npos : text_.find(line_end_, position_);
    if (end == std::string_view::npos) {
      line_ = text_.substr(position_);
      fail(number_ == 1 ? in_quotes(line_) : "the end of the file", number_ == 1 ? "ply" : "end_header");
    }
    line_ = trimmed(text_.substr(position_, end - position_));
    position_ = end + line_end_.size();
    return line_;
  }

  /// Some exporters write a remark without "comment" before it, and other programs read that.
  void pass_over(std::string_view keyword) {
    if (keyword == "format") fail(in_quotes(line_), "format once");
    if (!header_.note.empty() || keyword.empty()) return;
    header_.note = file_ + ": line " + std::to_string(number_) + ": passed over " + in_quotes(line_) +
                   ", which is no line of a PLY header";
  }

  void read_format(std::string_view rest) {
    const std::string_view name = next_word(rest), version = next_word(rest);
    bool known = false;
    for (const PlyFormat f : {PlyFormat::ascii, PlyFormat::binary_little_endian, PlyFormat::binary_big_endian})
      if (name == to_string(f)) known = true, header_.format = f;
    if (!known || version != "1.0" || !trimmed(rest).empty())
      fail(in_quotes(line_), "format ascii, binary_little_endian or binary_big_endian, version 1.0");
  }

  void read_element(std::string_view rest) {
    Element element;
    element.name = next_word(rest);
    const std::optional<std::uint64_t> count = parse_number<std::uint64_t>(next_word(rest));
    if (element.name.empty() || !count || !trimmed(rest).empty()) fail(in_quotes(line_), "element NAME COUNT");
    if (!element_names_.insert(element.name).second)
      fail("a second element " + in_quotes(element.name), "each name once");
    property_names_.clear();
    element.count = *count;
    header_.elements.push_back(std::move(element));
  }

  void read_property(std::string_view rest) {
    if (header_.elements.empty()) fail(in_quotes(line_), "an element before its properties");
    Property property;
    std::string_view type = next_word(rest);
    if (type == "list") {
      property.count_type = read_type(next_word(rest));
      if (!is_whole(*property.count_type)) fail(in_quotes(line_), "a whole number as type of a list's length");
      type = next_word(rest);
    }
    property.type = read_type(type);
    property.type_name = type;
    property.name = next_word(rest);
    if (property.name.empty() || !trimmed(rest).empty())
      fail(in_quotes(line_), "property TYPE NAME or property list TYPE TYPE NAME");
    if (!property_names_.insert(property.name).second)
      fail("a second property " + in_quotes(property.name), "each name once");
    header_.elements.back().properties.push_back(std::move(property));
  }

  Type read_type(std::string_view name) const {
    const std::optional<Type> type = find_type(name);
    if (!type) fail("type " + in_quotes(name), "char, uchar, short, ushort, int, uint, float or double");
    return *type;
  }

  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({.file = file_,
                 .place = "line " + std::to_string(number_),
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

  std::string_view text_, line_end_, line_;
  const std::string& file_;
  std::size_t position_ = 0, number_ = 0;
  Header header_;
  std::set<std::string> element_names_, property_names_;  ///< the latter of the last element
};

}  // namespace internal::ply

}  // namespace npt::inline NPT_ABI
