/// The PLY format, read and written: ascii, binary little-endian and binary big-endian, scalars of every type.
///   element vertex   x, y, z; nx, ny, nz are the normals; other scalars are kept as properties
///   element face     a list vertex_indices or vertex_index, of any length from 3; a list texcoord of two numbers a
///   corner comment, obj_info in the header are kept as tags; other elements, lists at vertices and other face
///   properties are passed over
/// Numerics  positions are kept as 32-bit floats, other properties as doubles
/// Errors    npt::Error that names the file, and the line (header, ascii) or byte (binary): not this format, unknown
/// types,
///           truncated or too long, counts that don't fit the file (before memory is taken), indices out of range,
///           faces of fewer than three corners, positions, normals or texture coordinates that are not finite
/// Source    Greg Turk, "The PLY Polygon File Format", 1994; texcoord as MeshLab writes it
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/io/file.hpp>
#include <npt/io/text.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/validate.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <span>
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
        fail(in_quotes(line_), "format (once), comment, obj_info, element, property or end_header");
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
    if (header_.find(element.name)) fail("a second element " + in_quotes(element.name), "each name once");
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
    Element& element = header_.elements.back();
    if (element.find(property.name)) fail("a second property " + in_quotes(property.name), "each name once");
    element.properties.push_back(std::move(property));
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
};

/// Gives the numbers of binary data one after another.
class BinarySource {
 public:
  BinarySource(std::string_view bytes, const Header& header, const std::string& file)
      : bytes_(bytes),
        position_(header.bytes),
        swap_((header.format == PlyFormat::binary_big_endian) != (std::endian::native == std::endian::big)),
        file_(file) {}

  std::uint64_t remaining() const { return bytes_.size() - position_; }
  /// The fewest bytes that a property of a row takes.
  static std::uint64_t least_bytes(const Property& p) { return info(p.count_type.value_or(p.type)).size; }
  static std::uint64_t least_bytes(Type type) { return info(type).size; }

  void begin_row() {}
  void end_row() {}

  double number(Type type) {
    start_ = position_;
    switch (type) {
      case Type::i8:
        return take<std::int8_t>();
      case Type::u8:
        return take<std::uint8_t>();
      case Type::i16:
        return take<std::int16_t>();
      case Type::u16:
        return take<std::uint16_t>();
      case Type::i32:
        return take<std::int32_t>();
      case Type::u32:
        return take<std::uint32_t>();
      case Type::f32:
        return take<float>();
      default:
        return take<double>();
    }
  }

  void finish() {
    start_ = position_;
    // A blank line after the data is what some text tools leave.
    if (bytes_.find_first_not_of(" \t\r\n", position_) != std::string_view::npos)
      fail(std::to_string(remaining()) + " bytes after the last element", "the end of the file");
  }

  /// At the last number read.
  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({.file = file_,
                 .place = "byte " + std::to_string(start_),
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

 private:
  template <class T>
  T take() {
    if (remaining() < sizeof(T)) fail("the end of the file", "more data");
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + position_, sizeof(T));
    if (swap_) std::reverse(raw.begin(), raw.end());
    position_ += sizeof(T);
    return std::bit_cast<T>(raw);
  }

  std::string_view bytes_;
  std::size_t position_, start_ = 0;
  bool swap_;
  const std::string& file_;
};

/// The same for text, where each row is a line.
class AsciiSource {
 public:
  AsciiSource(std::string_view text, const Header& header, const std::string& file)
      : lines_(text.substr(header.bytes)), first_line_(header.lines), file_(file) {}

  /// One more than there are: the last row may lack its line end.
  std::uint64_t remaining() const { return lines_.rest().size() + rest_.size() + 1; }
  static std::uint64_t least_bytes(const Property&) { return 2; }
  static std::uint64_t least_bytes(Type) { return 2; }

  void begin_row() {
    do {
      if (!lines_.next(rest_)) fail("the end of the file", "another row of numbers");
    } while (trimmed(rest_).empty());
  }
  void end_row() {
    if (const std::string_view word = next_word(rest_); !word.empty())
      fail(in_quotes(word) + " after the row's last number", "the end of the line");
  }

  double number(Type type) {
    const std::string_view word = next_word(rest_);
    if (word.empty()) fail("the end of the line", std::string("another number, ") + std::string(info(type).name));
    const std::optional<double> value = parse_number<double>(word);
    const TypeInfo& t = info(type);
    const bool whole = value && *value >= t.low && *value <= t.high && *value == std::floor(*value);
    const bool too_large = value && type == Type::f32 && std::isfinite(*value) && !fits_float(*value);
    if (!value || (is_whole(type) && !whole) || too_large)
      fail(in_quotes(word), "a number of type " + std::string(t.name));
    return type == Type::f32 ? double{static_cast<float>(*value)} : *value;
  }

  void finish() {
    while (lines_.next(rest_))
      if (!trimmed(rest_).empty()) fail(in_quotes(rest_) + " after the last element", "the end of the file");
  }

  /// In the current line.
  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({.file = file_,
                 .place = "line " + std::to_string(first_line_ + lines_.number()),
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

 private:
  TextLines lines_;
  std::size_t first_line_;
  std::string_view rest_{};
  const std::string& file_;
};

/// Reads all elements from a source of numbers into a mesh.
template <class Source>
class Reader {
 public:
  Reader(Source& source, const Header& header, const std::string& file)
      : source_(source), header_(header), file_(file) {}

  Mesh read() {
    const Element* vertices = header_.find("vertex");
    if (!vertices || vertices->count == 0) fail_header("no vertices", "element vertex, with a count of at least 1");
    if (vertices->count >= no_index)
      fail_header(std::to_string(vertices->count) + " vertices", "fewer than " + std::to_string(no_index));
    if (!header_.find("face") && header_.find("tristrips")) fail_header("triangle strips", "element face");
    vertex_count_ = vertices->count;
    mesh_.tags = header_.comments;
    for (const Element& element : header_.elements) {
      check_count(element);
      if (element.name == "vertex") {
        read_vertices(element);
      } else if (element.name == "face") {
        read_faces(element);
      } else {
        pass_over(element);
      }
    }
    source_.finish();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail_header(std::string found, std::string expected) const {
    throw Error({.file = file_, .place = "header", .found = std::move(found), .expected = std::move(expected)});
  }

  /// Before any memory is taken: the rest of the file must be long enough for this many rows.
  void check_count(const Element& element) const {
    std::uint64_t row = 0;
    for (const Property& p : element.properties) row += Source::least_bytes(p);
    if (row != 0 && element.count > source_.remaining() / row)
      fail_header("element " + in_quotes(element.name) + " with " + std::to_string(element.count) + " rows",
                  "at most " + std::to_string(source_.remaining() / row) + ", what the file has room for");
  }

  /// The length of a list, for which the file has room.
  std::size_t list_length(const Property& list) {
    const double length = source_.number(*list.count_type);
    const std::uint64_t room = source_.remaining() / Source::least_bytes(list.type);
    if (length < 0 || length > static_cast<double>(room))
      source_.fail("a list of " + std::to_string(static_cast<std::int64_t>(length)) + " numbers",
                   "from 0 to " + std::to_string(room) + ", what the file has room for");
    return static_cast<std::size_t>(length);
  }

  void pass_over(const Property& p) {
    for (std::size_t n = p.count_type ? list_length(p) : 1; n > 0; --n) source_.number(p.type);
  }
  void pass_over(const Element& element) {
    if (element.properties.empty()) return;
    for (std::uint64_t row = 0; row < element.count; ++row) {
      source_.begin_row();
      for (const Property& p : element.properties) pass_over(p);
      source_.end_row();
    }
  }

  float finite_number(const Property& p) {
    const double value = source_.number(p.type);
    if (!fits_float(value))
      source_.fail(std::isnan(value)   ? "NaN"
                   : std::isinf(value) ? "infinity"
                                       : std::to_string(value),
                   "a finite number that fits into 32-bit floating point");
    return static_cast<float>(value);
  }

  /// Where each property of a vertex goes: 0 .. 2 position, 3 .. 5 normal, from 6 further properties, -1 nowhere.
  std::vector<int> vertex_targets(const Element& element) {
    static constexpr std::array<std::string_view, 6> names = {"x", "y", "z", "nx", "ny", "nz"};
    const auto scalar = [&](std::string_view name) {
      const Property* p = element.find(name);
      return p && !p->count_type;
    };
    for (std::size_t k = 0; k < 3; ++k)
      if (!scalar(names[k])) fail_header("vertices without " + std::string(names[k]), "properties x, y and z");
    const bool with_normals = scalar("nx") && scalar("ny") && scalar("nz");
    const auto known = names.begin() + (with_normals ? 6 : 3);
    std::vector<int> targets;
    for (const Property& p : element.properties) {
      const auto found = std::find(names.begin(), known, p.name);
      if (p.count_type) {
        targets.push_back(-1);
      } else if (found != known) {
        targets.push_back(static_cast<int>(found - names.begin()));
      } else {
        targets.push_back(6 + static_cast<int>(mesh_.properties.size()));
        mesh_.properties.push_back({p.name, p.type_name, {}});
      }
    }
    const auto rows = static_cast<std::size_t>(element.count);
    mesh_.positions.resize(rows);
    if (with_normals) mesh_.normals.resize(rows);
    for (VertexProperty& property : mesh_.properties) property.values.resize(rows);
    return targets;
  }

  void read_vertices(const Element& element) {
    const std::vector<int> targets = vertex_targets(element);
    static constexpr std::array<float Vec3f::*, 3> axes = {&Vec3f::x, &Vec3f::y, &Vec3f::z};
    for (std::size_t v = 0; v < mesh_.positions.size(); ++v) {
      source_.begin_row();
      for (std::size_t i = 0; i < targets.size(); ++i) {
        const Property& p = element.properties[i];
        const auto target = static_cast<std::size_t>(targets[i]);
        if (targets[i] < 0) {
          pass_over(p);
        } else if (target < 6) {
          (target < 3 ? mesh_.positions : mesh_.normals)[v].*axes[target % 3] = finite_number(p);
        } else {
          mesh_.properties[target - 6].values[v] = source_.number(p.type);
        }
      }
      source_.end_row();
    }
  }

  const Property& corner_list(const Element& element) const {
    for (const char* name : {"vertex_indices", "vertex_index"})
      if (const Property* p = element.find(name)) {
        if (!p->count_type || !is_whole(p->type)) fail_header(in_quotes(p->name), "a list of whole numbers");
        return *p;
      }
    fail_header("faces without vertices", "property list vertex_indices");
  }

  void read_faces(const Element& element) {
    if (element.count == 0) return;
    const Property& corners = corner_list(element);
    const Property* texcoord = element.find("texcoord");
    if (texcoord && !texcoord->count_type) texcoord = nullptr;
    mesh_.face_start.reserve(static_cast<std::size_t>(element.count) + 1);
    mesh_.face_start.push_back(0);
    for (std::uint64_t f = 0; f < element.count; ++f) {
      source_.begin_row();
      for (const Property& p : element.properties) {
        if (&p == &corners) {
          read_corners(p, f);
        } else if (&p == texcoord) {
          read_texcoords(p);
        } else {
          pass_over(p);
        }
      }
      source_.end_row();
      if (texcoord) place_texcoords(f);
    }
    if (mesh_.texcoords.empty()) mesh_.corner_texcoord.clear();
    mesh_.texcoord_size = mesh_.texcoords.empty() ? 0 : 2;
  }

  void read_corners(const Property& p, std::uint64_t f) {
    const std::size_t n = list_length(p);
    if (n < 3) source_.fail("face " + std::to_string(f) + " with " + std::to_string(n) + " corners", "at least 3");
    for (std::size_t i = 0; i < n; ++i) {
      const double v = source_.number(p.type);
      if (v < 0 || v >= static_cast<double>(vertex_count_))
        source_.fail("vertex " + std::to_string(static_cast<std::int64_t>(v)) + " in face " + std::to_string(f),
                     "a vertex from 0 to " + std::to_string(vertex_count_ - 1));
      mesh_.corners.push_back(static_cast<std::uint32_t>(v));
    }
    mesh_.face_start.push_back(mesh_.corners.size());
  }

  void read_texcoords(const Property& p) {
    row_texcoords_.resize(list_length(p));
    for (float& number : row_texcoords_) number = finite_number(p);
  }

  /// The numbers of the row's texcoord list, two for each corner of the face or none.
  void place_texcoords(std::uint64_t f) {
    const std::size_t n = mesh_.corners.size() - mesh_.corner_texcoord.size();
    if (!row_texcoords_.empty() && row_texcoords_.size() != 2 * n)
      source_.fail(std::to_string(row_texcoords_.size()) + " texture coordinates in face " + std::to_string(f),
                   std::to_string(2 * n) + ", two for each corner, or none");
    for (std::size_t i = 0; i < n; ++i) {
      if (row_texcoords_.empty()) {
        mesh_.corner_texcoord.push_back(no_index);
      } else {
        mesh_.corner_texcoord.push_back(static_cast<std::uint32_t>(mesh_.texcoords.size()));
        mesh_.texcoords.push_back({row_texcoords_[2 * i], row_texcoords_[2 * i + 1], 0});
      }
    }
  }

  Source& source_;
  const Header& header_;
  const std::string& file_;
  std::uint64_t vertex_count_ = 0;
  std::vector<float> row_texcoords_;
  Mesh mesh_;
};

}  // namespace internal::ply

/// A mesh from the bytes of a PLY file. `name` stands in the messages of errors.
inline Mesh parse_ply(std::string_view bytes, const std::string& name) {
  const internal::ply::Header header = internal::ply::HeaderReader(bytes, name).read();
  const auto read = [&](auto source) { return internal::ply::Reader(source, header, name).read(); };
  Mesh mesh = header.format == PlyFormat::ascii ? read(internal::ply::AsciiSource(bytes, header, name))
                                                : read(internal::ply::BinarySource(bytes, header, name));
  validate(mesh, name);
  return mesh;
}

inline Mesh read_ply(const std::filesystem::path& path) { return parse_ply(read_file(path), path.string()); }

namespace internal::ply {

/// Appends rows of numbers as text or bytes.
class Writer {
 public:
  explicit Writer(PlyFormat format)
      : ascii_(format == PlyFormat::ascii),
        swap_((format == PlyFormat::binary_big_endian) != (std::endian::native == std::endian::big)) {}

  std::string text;

  void number(Type type, double value) {
    switch (type) {
      case Type::i8:
        return put(static_cast<std::int8_t>(value));
      case Type::u8:
        return put(static_cast<std::uint8_t>(value));
      case Type::i16:
        return put(static_cast<std::int16_t>(value));
      case Type::u16:
        return put(static_cast<std::uint16_t>(value));
      case Type::i32:
        return put(static_cast<std::int32_t>(value));
      case Type::u32:
        return put(static_cast<std::uint32_t>(value));
      case Type::f32:
        return put(static_cast<float>(value));
      default:
        return put(value);
    }
  }
  void vector(Vec3f p) {
    put(p.x);
    put(p.y);
    put(p.z);
  }
  void end_row() {
    if (ascii_) text.back() = '\n';
  }

 private:
  template <class T>
  void put(T value) {
    if (ascii_) {
      append_number(text, value);
      text += ' ';
      return;
    }
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (swap_) std::reverse(raw.begin(), raw.end());
    text.append(raw.data(), raw.size());
  }

  bool ascii_, swap_;
};

/// PLY's one normal a vertex: as stored, or the mean over the vertex' corners; none where the mesh has none.
inline std::vector<Vec3f> normals_to_write(const Mesh& mesh) {
  if (mesh.corner_normal.empty())
    return mesh.normals.size() == mesh.vertex_count() ? mesh.normals : std::vector<Vec3f>{};
  if (std::ranges::all_of(mesh.corner_normal, [](std::uint32_t n) { return n == no_index; })) return {};
  std::vector<Vec3d> sums(mesh.vertex_count());
  for (std::size_t c = 0; c < mesh.corners.size(); ++c)
    if (mesh.corner_normal[c] != no_index)
      sums[mesh.corners[c]] += normalised(mesh.normals[mesh.corner_normal[c]].as<double>());
  std::vector<Vec3f> normals(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) normals[v] = normalised(sums[v]).as<float>();
  return normals;
}

/// The types of the mesh's further properties. Throws where one can't be written as its type and name say.
inline std::vector<Type> property_types(const Mesh& mesh, bool with_normals, const std::string& file) {
  std::set<std::string> names = {"x", "y", "z"};
  // Without normals to write, a file's lone nx is a property like others.
  if (with_normals) names.insert({"nx", "ny", "nz"});
  std::vector<Type> result;
  for (const VertexProperty& p : mesh.properties) {
    const auto fail = [&](std::string found, std::string expected) {
      invalid_mesh(file, "vertex property " + in_quotes(p.name), std::move(found), std::move(expected));
    };
    if (p.name.empty() || p.name.find_first_of(" \t\r\n\v\f") != std::string::npos || !names.insert(p.name).second)
      fail("this name", "one word that no other property has");
    const std::optional<Type> type = find_type(p.type);
    if (!type) fail("type " + in_quotes(p.type), "char, uchar, short, ushort, int, uint, float or double");
    if (is_whole(*type))
      for (const double value : p.values)
        if (!(value >= info(*type).low && value <= info(*type).high && value == std::floor(value)))
          fail(std::to_string(value), "a number of type " + p.type);
    result.push_back(*type);
  }
  return result;
}

/// What the header announces and the rows then keep to.
struct Layout {
  std::vector<Vec3f> normals;
  std::vector<Type> properties{};
  Type count_type = Type::u8, index_type = Type::i32;
  bool texcoords = false;
};

inline Layout layout_of(const Mesh& mesh, const std::string& file) {
  Layout layout{.normals = normals_to_write(mesh)};
  layout.properties = property_types(mesh, !layout.normals.empty(), file);
  layout.texcoords = !mesh.corner_texcoord.empty();
  std::size_t longest = 0;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) longest = std::max(longest, mesh.face(f).size());
  if (longest * (layout.texcoords ? 2 : 1) > 255) layout.count_type = Type::u32;
  if (mesh.vertex_count() > 0x7FFFFFFF) layout.index_type = Type::u32;
  return layout;
}

inline std::string header_text(const Mesh& mesh, const Layout& layout, PlyFormat format) {
  std::string text = std::string("ply\nformat ") + to_string(format) + " 1.0\n";
  for (const MeshTag& tag : mesh.tags)
    if (tag.keyword == "comment" || tag.keyword == "obj_info") text += tag.keyword + ' ' + tag.value + '\n';
  text += "element vertex " + std::to_string(mesh.vertex_count()) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"})
    if (name[0] != 'n' || !layout.normals.empty()) text += std::string("property float ") + name + '\n';
  for (std::size_t p = 0; p < layout.properties.size(); ++p)
    text += "property " + mesh.properties[p].type + ' ' + mesh.properties[p].name + '\n';
  const std::string list = "property list " + std::string(info(layout.count_type).name) + ' ';
  text += "element face " + std::to_string(mesh.face_count()) + '\n';
  text += list + std::string(info(layout.index_type).name) + " vertex_indices\n";
  if (layout.texcoords) text += list + "float texcoord\n";
  return text + "end_header\n";
}

inline void append_vertices(Writer& writer, const Mesh& mesh, const Layout& layout) {
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    writer.vector(mesh.positions[v]);
    if (!layout.normals.empty()) writer.vector(layout.normals[v]);
    for (std::size_t p = 0; p < layout.properties.size(); ++p)
      writer.number(layout.properties[p], mesh.properties[p].values[v]);
    writer.end_row();
  }
}

inline void append_faces(Writer& writer, const Mesh& mesh, const Layout& layout) {
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const std::span<const std::uint32_t> face = mesh.face(f);
    writer.number(layout.count_type, static_cast<double>(face.size()));
    for (const std::uint32_t v : face) writer.number(layout.index_type, v);
    if (layout.texcoords) {
      const auto uv = std::span(mesh.corner_texcoord).subspan(mesh.face_start[f], face.size());
      const bool complete = std::ranges::find(uv, no_index) == uv.end();
      writer.number(layout.count_type, complete ? 2.0 * static_cast<double>(face.size()) : 0.0);
      if (complete)
        for (const std::uint32_t t : uv) {
          writer.number(Type::f32, mesh.texcoords[t].x);
          writer.number(Type::f32, mesh.texcoords[t].y);
        }
    }
    writer.end_row();
  }
}

}  // namespace internal::ply

/// The bytes of a PLY file. `name` stands in the messages of errors. A mesh that came from OBJ loses what PLY has no
/// place for: groups and materials, the third texture coordinate, hard edges (the normals of a vertex' corners are
/// averaged).
inline std::string format_ply(const Mesh& mesh, const std::string& name,
                              PlyFormat format = PlyFormat::binary_little_endian) {
  validate(mesh, name);
  const internal::ply::Layout layout = internal::ply::layout_of(mesh, name);
  internal::ply::Writer writer(format);
  writer.text = internal::ply::header_text(mesh, layout, format);
  internal::ply::append_vertices(writer, mesh, layout);
  internal::ply::append_faces(writer, mesh, layout);
  return std::move(writer.text);
}

inline void write_ply(const std::filesystem::path& path, const Mesh& mesh,
                      PlyFormat format = PlyFormat::binary_little_endian) {
  write_file(path, format_ply(mesh, path.string(), format));
}

}  // namespace npt::inline NPT_ABI
