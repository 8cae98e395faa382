/// Reads OBJ files; obj.hpp says what is understood. tinyobjloader reads, through its callbacks: those keep faces of
/// more than 255 corners and the order of the statements, and never triangulate. It pulls the text line by line. Beside
/// it stands what it doesn't do:
///   before it   words that are no numbers (obj_statements.hpp), comments behind numbers, lines that continue
///   after it    indices of what isn't there (CVE-2020-28589), the last bit of numbers (put_right), colours
///   instead     o, g, usemtl, s, mtllib as they stand: it has no callback for s, none for mtllib without opening the
///               files, and takes the blanks out of g
#pragma once

#include <tiny_obj_loader.h>
#include <npt/config.hpp>
#include <npt/io/obj_statements.hpp>
#include <npt/io/text.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/validate.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <istream>
#include <limits>
#include <span>
#include <streambuf>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal::obj {

/// The mesh in the making: tinyobjloader's source of lines, and what takes its callbacks.
class Reader : private std::streambuf {
 public:
  Reader(std::string_view text, const std::string& file)
      : lines_(text.substr(text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0)),
        check_(file),
        file_(file) {}

  Mesh read(std::vector<std::string>* notes) {
    std::istream stream(this);
    stream.exceptions(std::ios::badbit);  // or the stream would swallow what the check throws
    tinyobj::LoadObjWithCallback(stream, callbacks(), this);
    if (mesh_.positions.empty()) invalid_mesh(file_, {}, "no vertices", "v statements of an OBJ file");
    check_ahead(notes);
    if (!colours_.empty()) colours_.resize(mesh_.positions.size(), white);
    if (!weights_.empty()) weights_.resize(mesh_.positions.size(), 1);
    add_properties();
    return std::move(mesh_);
  }

 private:
  static constexpr Vec3f white{1, 1, 1};
  static constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";  // some editors put it before UTF-8

  /// What corners refer to, and the greatest number so far of one, which may stand behind the corner.
  struct Referred {
    const char* name;
    const std::vector<Vec3f>& rows;
    std::size_t greatest = 0, line = 0;
  };

  /// The next statement that is tinyobjloader's to read.
  int_type underflow() override {
    if (waiting_) invalid_mesh(file_, {}, "a statement that tinyobjloader passed over", "each read");
    for (std::string_view line; lines_.next(line);) {
      const std::size_t number = lines_.number();
      line = join_continued(line);
      statement_ = check_.check(line, number);
      if (statement_ == Statement::kept)
        mesh_.tags.push_back({mesh_.face_count(), std::string(check_.keyword()), std::string(check_.argument())});
      else if (statement_ != Statement::none)
        return pass_on();
    }
    return traits_type::eof();
  }

  /// The line, together with those that follow while each ends in "\". A comment never continues: it may end in the "\"
  /// of a path.
  std::string_view join_continued(std::string_view line) {
    if (!line.ends_with('\\') || trimmed(line).starts_with('#')) return line;
    joined_.clear();
    for (bool more = true; more;) {
      more = line.ends_with('\\');
      joined_.append(line.substr(0, line.size() - (more ? 1 : 0)));
      joined_ += ' ';
      more = more && lines_.next(line);
    }
    return joined_;
  }

  /// tinyobjloader knows two kinds of blanks, no comments behind numbers and no callback for lines and points. Of
  /// "1/ 2" it takes the "2" for the number of a texture coordinate.
  int_type pass_on() {
    line_ = statement_ == Statement::element ? "f" : check_.keyword();
    line_.append(check_.keyword().data() + check_.keyword().size(), check_.end());
    // Characters are searched, not looped over: few lines have any, and this is each line of a file.
    for (const char blank : {'\t', '\v', '\f'})
      for (std::size_t i = line_.find(blank); i != std::string::npos; i = line_.find(blank, i + 1)) line_[i] = ' ';
    for (std::size_t i = line_.find('/') == std::string::npos ? 0 : line_.size(); i-- > 0;)
      if (line_[i] == '/' && (i + 1 == line_.size() || line_[i + 1] == ' ')) line_[i] = ' ';
    line_ += '\n';
    setg(line_.data(), line_.data(), line_.data() + line_.size());
    waiting_ = line_.size() > 2;  // "p" alone has no callback
    return traits_type::to_int_type(line_[0]);
  }

  static tinyobj::callback_t callbacks() {
    using tinyobj::real_t;
    tinyobj::callback_t result;
    result.vertex_cb = [](void* to, real_t x, real_t y, real_t z, real_t) {
      static_cast<Reader*>(to)->add_vertex({x, y, z});
    };
    result.texcoord_cb = [](void* to, real_t x, real_t y, real_t z) {
      Reader& reader = *static_cast<Reader*>(to);
      reader.add_row("texture coordinate", reader.mesh_.texcoords, {x, y, z});
      reader.mesh_.texcoord_size = std::max(reader.mesh_.texcoord_size, reader.check_.numbers().size() == 3 ? 3 : 2);
    };
    result.normal_cb = [](void* to, real_t x, real_t y, real_t z) {
      Reader& reader = *static_cast<Reader*>(to);
      reader.add_row("normal", reader.mesh_.normals, {x, y, z});
    };
    result.index_cb = [](void* to, tinyobj::index_t* indices, int count) {
      static_cast<Reader*>(to)->add_corners(std::span(indices, static_cast<std::size_t>(count)));
    };
    return result;
  }

  /// Puts the last bit of a number that tinyobjloader read right. It adds a decimal's digits up in double and rounds
  /// the sum: close to the middle between two floats it gives the wrong one, and a mesh that is written and read would
  /// not keep its bits. So it was for 31 of 50 million floats with any bits, written as short as they can be, and for
  /// 32 % of decimals that are such middles; for none of 50 million floats and 50 million decimals of 6 to 17 digits
  /// between -2 and 2. False where the two are further apart: its powers of ten can underflow, and a program that is
  /// linked with the wrong one of tinyobjloader's two libraries (float, double) hands over numbers that mean nothing.
  static bool put_right(float& read, double checked) {
    constexpr double tolerance = 1e-6;  // 8 units in the last place of a float
    constexpr auto smallest = static_cast<double>(std::numeric_limits<float>::denorm_min());
    const auto right = static_cast<float>(checked);
    if (read == right) return true;
    const bool close = std::abs(static_cast<double>(read) - checked) <= tolerance * std::abs(checked) + smallest;
    read = right;
    return close;
  }

  void add_row(const char* name, std::vector<Vec3f>& rows, Vec3<tinyobj::real_t> p) {
    waiting_ = false;
    std::array<double, 3> right{};
    std::ranges::copy(check_.numbers().first(std::min<std::size_t>(3, check_.numbers().size())), right.begin());
    Vec3f row = p.as<float>();
    const bool x = put_right(row.x, right[0]), y = put_right(row.y, right[1]), z = put_right(row.z, right[2]);
    if (!x || !y || !z)
      invalid_mesh(file_, numbered(name, rows.size() + 1), to_string(p.as<float>()) + " read by tinyobjloader",
                   to_string(row));
    rows.push_back(row);
  }

  /// The callback has no place for colours: they are the check's numbers, and so is a weight.
  void add_vertex(Vec3<tinyobj::real_t> p) {
    const std::size_t before = mesh_.positions.size();
    add_row("vertex", mesh_.positions, p);
    const std::span<const double> numbers = check_.numbers();
    if (numbers.size() == 4) {
      weights_.resize(before, 1);
      weights_.push_back(static_cast<float>(numbers[3]));
    } else if (numbers.size() == 6) {
      colours_.resize(before, white);
      colours_.push_back(Vec3d{numbers[3], numbers[4], numbers[5]}.as<float>());
    }
  }

  /// A face's corners, or a line's or points', which are verified only.
  void add_corners(std::span<const tinyobj::index_t> corners) {
    waiting_ = false;
    const bool face = statement_ == Statement::face;
    for (const tinyobj::index_t& corner : corners) {
      const std::uint32_t vertex = resolve(corner.vertex_index, vertices_);
      const std::uint32_t texcoord = resolve(corner.texcoord_index, texcoords_);
      const std::uint32_t normal = resolve(corner.normal_index, normals_);
      if (!face) continue;
      mesh_.corners.push_back(vertex);
      mesh_.corner_texcoord.push_back(texcoord);
      mesh_.corner_normal.push_back(normal);
    }
    if (!face) return;
    if (mesh_.face_start.empty()) mesh_.face_start.push_back(0);
    mesh_.face_start.push_back(mesh_.corners.size());
  }

  /// From 1, or negative to count backwards, or 0 for none.
  std::uint32_t resolve(int index, Referred& to) const {
    if (index == 0) return no_index;
    const auto count = static_cast<std::int64_t>(to.rows.size());
    if (index < -count)
      check_.fail(std::string(to.name) + ' ' + std::to_string(index),
                  "at least " + std::to_string(-count) + ", there are only so many before this line");
    if (index < 0) return static_cast<std::uint32_t>(count + index);
    if (static_cast<std::size_t>(index) > to.greatest) {
      to.greatest = static_cast<std::size_t>(index);
      to.line = check_.line_number();
    }
    return static_cast<std::uint32_t>(index - 1);
  }

  /// After the last line: whether what the corners look ahead to has come. Texture coordinates and normals of which a
  /// file has none at all are left out: some exporters number them and don't write them, and other programs read that.
  void check_ahead(std::vector<std::string>* notes) {
    for (const Referred* to : {&vertices_, &texcoords_, &normals_}) {
      if (to->greatest <= to->rows.size()) continue;
      if (to == &vertices_ || !to->rows.empty())
        check_.fail_at(to->line, numbered(to->name, to->greatest),
                       "at most " + std::to_string(to->rows.size()) + ", the number in the file");
      if (notes != nullptr)
        notes->push_back(file_ + ": faces refer to " + to->name + "s, and the file has none: read without them");
    }
    if (mesh_.texcoords.empty()) mesh_.corner_texcoord.clear();
    if (mesh_.normals.empty()) mesh_.corner_normal.clear();
  }

  void add_properties() {
    const auto add = [&](const char* name, const auto& rows, auto value_of) {
      if (rows.empty()) return;
      mesh_.properties.push_back({name, "float", {}});
      mesh_.properties.back().values.reserve(rows.size());
      for (const auto& row : rows) mesh_.properties.back().values.push_back(static_cast<double>(value_of(row)));
    };
    add("red", colours_, [](const Vec3f& colour) { return colour.x; });
    add("green", colours_, [](const Vec3f& colour) { return colour.y; });
    add("blue", colours_, [](const Vec3f& colour) { return colour.z; });
    add("w", weights_, [](float weight) { return weight; });
  }

  TextLines lines_;
  StatementCheck check_;
  const std::string& file_;
  std::string joined_, line_;
  Statement statement_ = Statement::none;  ///< of the line that was checked last
  bool waiting_ = false;                   ///< for the callback of what was passed on
  std::vector<Vec3f> colours_;             ///< empty, or one for each vertex up to the last that has one
  std::vector<float> weights_;             ///< likewise
  Mesh mesh_;
  Referred vertices_{"vertex", mesh_.positions}, texcoords_{"texture coordinate", mesh_.texcoords},
      normals_{"normal", mesh_.normals};
};

}  // namespace internal::obj

/// A mesh from the text of an OBJ file. `name` stands in the messages of errors; `notes` gets a sentence for each thing
/// that was repaired.
inline Mesh parse_obj(std::string_view text, const std::string& name, std::vector<std::string>* notes = nullptr) {
  Mesh mesh = internal::obj::Reader(text, name).read(notes);
  validate(mesh, name);
  return mesh;
}

}  // namespace npt::inline NPT_ABI
