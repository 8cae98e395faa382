/// Reads OBJ files; obj.hpp says what is understood. tinyobjloader reads, through its callbacks: those keep faces of
/// more than 255 corners and the order of the statements, and never triangulate. It pulls the text line by line, and
/// each line is checked as it passes; what it then delivers is held against the check.
#pragma once

#include <tiny_obj_loader.h>
#include <npt/config.hpp>
#include <npt/io/obj_statements.hpp>
#include <npt/io/text.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/validate.hpp>

#include <algorithm>
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
class CorrespondenceEstimator : private std::streambuf {
 public:
  CorrespondenceEstimator(std::string_view text, const std::string& file)
      : lines_(text.substr(text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0)),
        check_(file),
        file_(file) {}

  Mesh read() {
    std::istream stream(this);
    stream.exceptions(std::ios::badbit);  // or the stream would swallow what the check throws
    tinyobj::LoadObjWithCallback(stream, callbacks(), this);
    check_.check_end();
    if (!colours_.empty()) colours_.resize(mesh_.positions.size(), white);
    if (!weights_.empty()) weights_.resize(mesh_.positions.size(), 1);
    if (mesh_.texcoords.empty()) mesh_.corner_texcoord.clear();
    if (mesh_.normals.empty()) mesh_.corner_normal.clear();
    add_properties();
    return std::move(mesh_);
  }

 private:
  static constexpr Vec3f white{1, 1, 1};
  static constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";  // some editors put it before UTF-8

  /// The next statement that is tinyobjloader's to read.
  int_type underflow() override {
    expect_delivered();
    for (std::string_view line; lines_.next(line);) {
      const std::size_t number = lines_.number();
      line = join_continued(line);
      statement_ = check_.check(line, number);
      if (statement_ == Statement::none) continue;
      if (statement_ != Statement::kept) return pass_on(line);
      mesh_.tags.push_back({mesh_.face_count(), std::string(check_.keyword()), std::string(check_.argument())});
    }
    statement_ = Statement::none;
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

  /// tinyobjloader knows two kinds of blanks and no comments behind numbers.
  int_type pass_on(std::string_view line) {
    line_.assign(line.data(), check_.end());
    for (char& c : line_)
      if (c == '\v' || c == '\f') c = ' ';
    line_ += '\n';
    setg(line_.data(), line_.data(), line_.data() + line_.size());
    return traits_type::to_int_type(line_[0]);
  }

  static tinyobj::callback_t callbacks() {
    using tinyobj::real_t;
    tinyobj::callback_t result;
    result.vertex_cb = [](void* to, real_t x, real_t y, real_t z, real_t w) {
      static_cast<CorrespondenceEstimator*>(to)->add_vertex({x, y, z}, w);
    };
    result.texcoord_cb = [](void* to, real_t x, real_t y, real_t z) {
      CorrespondenceEstimator& reader = *static_cast<CorrespondenceEstimator*>(to);
      reader.add_row(Statement::texcoord, "texture coordinate", reader.mesh_.texcoords, {x, y, z});
      reader.mesh_.texcoord_size = std::max(reader.mesh_.texcoord_size, reader.check_.numbers().size() == 3 ? 3 : 2);
    };
    result.normal_cb = [](void* to, real_t x, real_t y, real_t z) {
      CorrespondenceEstimator& reader = *static_cast<CorrespondenceEstimator*>(to);
      reader.add_row(Statement::normal, "normal", reader.mesh_.normals, {x, y, z});
    };
    result.index_cb = [](void* to, tinyobj::index_t* indices, int count) {
      static_cast<CorrespondenceEstimator*>(to)->add_face(std::span(indices, static_cast<std::size_t>(count)));
    };
    return result;
  }

  /// Each statement that is passed on comes back by one callback.
  void delivered(Statement statement) {
    if (statement_ != statement) invalid_mesh(file_, {}, "a statement that tinyobjloader read twice", "each once");
    statement_ = Statement::none;
  }
  void expect_delivered() const {
    if (statement_ != Statement::none && statement_ != Statement::kept)
      invalid_mesh(file_, {}, "a statement that tinyobjloader passed over", "each read once");
  }

  /// Puts the last bit of a number that tinyobjloader read right. It adds a decimal's digits up in double and rounds
  /// the sum: close to the middle between two floats it gives the wrong one, and a mesh that is written and read would
  /// not keep its bits. False where the two are further apart: its powers of ten can underflow, and a program that is
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

  void add_row(Statement statement, const char* name, std::vector<Vec3f>& rows, Vec3<tinyobj::real_t> p) {
    delivered(statement);
    const std::span<const double> numbers = check_.numbers();
    const auto number = [&](std::size_t i) { return i < numbers.size() ? numbers[i] : 0; };
    Vec3f row = p.as<float>();
    const bool x = put_right(row.x, number(0)), y = put_right(row.y, number(1)), z = put_right(row.z, number(2));
    if (!x || !y || !z)
      invalid_mesh(file_, numbered(name, rows.size() + 1), to_string(p.as<float>()) + " read by tinyobjloader",
                   to_string(Vec3d{number(0), number(1), number(2)}.as<float>()));
    rows.push_back(row);
  }

  /// The callback has no place for colours: they are the check's numbers.
  void add_vertex(Vec3<tinyobj::real_t> p, tinyobj::real_t w) {
    const std::size_t before = mesh_.positions.size();
    add_row(Statement::vertex, "vertex", mesh_.positions, p);
    const std::span<const double> numbers = check_.numbers();
    if (numbers.size() == 4) {
      auto weight = static_cast<float>(w);
      if (!put_right(weight, numbers[3]))
        invalid_mesh(file_, numbered("vertex", before + 1), "weight " + std::to_string(w) + " read by tinyobjloader",
                     std::to_string(numbers[3]));
      weights_.resize(before, 1);
      weights_.push_back(weight);
    } else if (numbers.size() == 6) {
      colours_.resize(before, white);
      colours_.push_back(Vec3d{numbers[3], numbers[4], numbers[5]}.as<float>());
    }
  }

  /// From 1, or negative to count backwards, or 0 for none.
  static std::uint32_t resolve(int index, std::size_t count) {
    if (index == 0) return no_index;
    return index > 0 ? static_cast<std::uint32_t>(index - 1)
                     : static_cast<std::uint32_t>(static_cast<std::int64_t>(count) + index);
  }

  void add_face(std::span<const tinyobj::index_t> corners) {
    delivered(Statement::face);
    if (corners.size() != check_.corner_count())
      invalid_mesh(file_, numbered("face", mesh_.face_count()),
                   std::to_string(corners.size()) + " corners read by tinyobjloader",
                   std::to_string(check_.corner_count()));
    for (const tinyobj::index_t& corner : corners) {
      mesh_.corners.push_back(resolve(corner.vertex_index, mesh_.positions.size()));
      mesh_.corner_texcoord.push_back(resolve(corner.texcoord_index, mesh_.texcoords.size()));
      mesh_.corner_normal.push_back(resolve(corner.normal_index, mesh_.normals.size()));
    }
    if (mesh_.face_start.empty()) mesh_.face_start.push_back(0);
    mesh_.face_start.push_back(mesh_.corners.size());
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
  Statement statement_ = Statement::none;  ///< passed on and not yet delivered
  std::vector<Vec3f> colours_;             ///< empty, or one for each vertex up to the last that has one
  std::vector<float> weights_;             ///< likewise
  Mesh mesh_;
};

}  // namespace internal::obj

/// A mesh from the text of an OBJ file. `name` stands in the messages of errors.
inline Mesh parse_obj(std::string_view text, const std::string& name) {
  Mesh mesh = internal::obj::CorrespondenceEstimator(text, name).read();
  validate(mesh, name);
  return mesh;
}

}  // namespace npt::inline NPT_ABI
