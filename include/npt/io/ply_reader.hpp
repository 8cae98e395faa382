/// Reads PLY files; ply.hpp says what is understood.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/ply_header.hpp>
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
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal::ply {

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
        return static_cast<double>(take<float>());
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

/// Gives the numbers of text one after another; each row is a line.
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
    return type == Type::f32 ? static_cast<double>(static_cast<float>(*value)) : *value;
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
                  "at most " + std::to_string(source_.remaining() / row) + ", what the file has space for");
  }

  /// The length of a list, for which the file has space.
  std::size_t list_length(const Property& list) {
    const double length = source_.number(*list.count_type);
    const std::uint64_t space = source_.remaining() / Source::least_bytes(list.type);
    if (length < 0 || length > static_cast<double>(space))
      source_.fail("a list of " + std::to_string(static_cast<std::int64_t>(length)) + " numbers",
                   "from 0 to " + std::to_string(space) + ", what the file has space for");
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

/// A mesh from the bytes of a PLY file. `name` stands in the messages of errors; `notes` gets a sentence for what was
/// repaired.
inline Mesh parse_ply(std::string_view bytes, const std::string& name, std::vector<std::string>* notes = nullptr) {
  const internal::ply::Header header = internal::ply::HeaderReader(bytes, name).read();
  const auto read = [&](auto source) { return internal::ply::Reader(source, header, name).read(); };
  Mesh mesh = header.format == PlyFormat::ascii ? read(internal::ply::AsciiSource(bytes, header, name))
                                                : read(internal::ply::BinarySource(bytes, header, name));
  validate(mesh, name);
  if (notes != nullptr && !header.note.empty()) notes->push_back(header.note);
  return mesh;
}

}  // namespace npt::inline NPT_ABI
