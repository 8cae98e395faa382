/// The Wavefront OBJ format, read by tinyobjloader and verified before and after, and written.
///   v x y z [w | r g b], vt u [v [w]], vn x y z; f of any length from 3, with v, v/vt, v//vn or v/vt/vn, indices from
///   1 or relative (negative), also to vertices that follow o, g, usemtl, s, mtllib are kept in their places between
///   the faces; material files are not opened colours become the properties red, green, blue (white where a vertex has
///   none), w the property w l and p are verified and left out: a transfer is about surfaces. All other statements are
///   passed over. Every line end, "\" before one, comments also after a statement's numbers, no line end after the last
///   line
/// Numerics  positions are kept as 32-bit floats, correctly rounded
/// Errors    npt::Error that names file and line: a number that is none, is not finite or doesn't fit, too few or too
/// many of
///           them, indices out of range, faces of fewer than three corners; no vertices
/// Source    Wavefront, "Object Files (.obj)", Advanced Visualizer manual, appendix B1
///
/// Why verify: tinyobjloader 2.0.0rc10 turns "v abc 0 0" and "v nan 0 0" into 0, accepts "f -4 -2 -1" with three
/// vertices (CVE-2020-28589) and "f 1 2 99", and lets 99999999999 overflow. So each line is checked first, and
/// tinyobjloader is given what passed. It is used through its callbacks: those keep faces of more than 255 corners and
/// the order of the statements, and never triangulate. The result is then held against the numbers of the check.
#pragma once

#include <tiny_obj_loader.h>
#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/io/file.hpp>
#include <npt/io/text.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/validate.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal::obj {

inline constexpr std::array<std::string_view, 5> kept_statements = {"o", "g", "usemtl", "s", "mtllib"};

/// A kind of numbered thing that corners refer to.
struct Table {
  const char* name;
  std::vector<Vec3d> rows{};
  std::int64_t greatest_index = 0;  ///< from 1, as referred to; may precede the row itself
  std::size_t greatest_line = 0;
};

/// What the check of the text leaves.
struct Checked {
  std::string polygons;  ///< the v, vt, vn and f statements alone, one a line, for tinyobjloader
  Table vertices{"vertex"}, texcoords{"texture coordinate"}, normals{"normal"};
  int texcoord_size = 0;
  std::size_t faces = 0, corners = 0;
  std::vector<MeshTag> tags;
  std::vector<Vec3d> colours;   ///< empty, or one a vertex
  std::vector<double> weights;  ///< empty, or one a vertex
};

/// Checks an OBJ text line by line.
class Checker {
 public:
  Checker(std::string_view text, const std::string& file)
      : lines_(text.substr(text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0)), file_(file) {}

  Checked check() {
    result_.polygons.reserve(lines_.rest().size());
    for (std::string_view line; lines_.next(line);) {
      line_number_ = lines_.number();
      check_statement(join_continued(line));
    }
    if (result_.vertices.rows.empty())
      throw Error({.file = file_, .found = "no vertices", .expected = "v statements of an OBJ file"});
    for (const Table* table : {&result_.vertices, &result_.texcoords, &result_.normals}) {
      line_number_ = table->greatest_line;
      if (table->greatest_index > static_cast<std::int64_t>(table->rows.size()))
        fail(numbered(table->name, static_cast<std::size_t>(table->greatest_index)),
             "at most " + std::to_string(table->rows.size()) + ", the number in the file");
    }
    if (!result_.colours.empty()) result_.colours.resize(result_.vertices.rows.size(), white);
    if (!result_.weights.empty()) result_.weights.resize(result_.vertices.rows.size(), 1);
    return std::move(result_);
  }

 private:
  static constexpr Vec3d white{1, 1, 1};
  static constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";  // some editors put it before UTF-8

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

  void check_statement(std::string_view line) {
    std::string_view rest = line;
    const std::string_view keyword = next_word(rest);
    if (keyword.empty() || keyword[0] == '#') return;
    if (keyword == "v") {
      check_vertex(rest);
    } else if (keyword == "vt") {
      const std::size_t n = check_numbers(result_.texcoords, "vt", rest, 1, 3);
      result_.texcoord_size = std::max(result_.texcoord_size, n == 3 ? 3 : 2);
    } else if (keyword == "vn") {
      check_numbers(result_.normals, "vn", rest, 3, 3);
    } else if (keyword == "f") {
      check_face(rest);
    } else if (keyword == "l" || keyword == "p") {
      const std::size_t kept = result_.polygons.size();
      check_corners(rest);
      result_.polygons.resize(kept);
    } else if (std::ranges::find(kept_statements, keyword) != kept_statements.end()) {
      result_.tags.push_back({result_.faces, std::string(keyword), std::string(trimmed(rest))});
    } else if (!is_letter(keyword[0])) {
      fail(in_quotes(line), "an OBJ statement, such as v, vt, vn or f");
    }
  }

  static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

  /// The next word before a comment.
  static std::string_view next_argument(std::string_view& rest) {
    const std::string_view word = next_word(rest);
    if (word.starts_with('#')) rest = {};
    return word.starts_with('#') ? std::string_view{} : word;
  }

  /// Reads numbers into numbers_ and gives their count, which must be from `least` to `most`.
  std::size_t read_numbers(std::string_view rest, std::size_t least, std::size_t most) {
    std::size_t n = 0;
    for (std::string_view word; !(word = next_argument(rest)).empty(); ++n) {
      const std::optional<double> value = parse_number<double>(word);
      if (!value || !fits_float(*value)) fail(in_quotes(word), "a finite number that fits into 32-bit floating point");
      if (n < numbers_.size()) numbers_[n] = *value, words_[n] = word;
    }
    if (n < least || n > most)
      fail(std::to_string(n) + (n == 1 ? " number" : " numbers"),
           least == most ? std::to_string(least) : std::to_string(least) + " to " + std::to_string(most));
    return n;
  }

  /// One row of a table: to the table, and to tinyobjloader's text.
  std::size_t check_numbers(Table& table, const char* keyword, std::string_view rest, std::size_t least,
                            std::size_t most) {
    const std::size_t n = read_numbers(rest, least, most);
    const auto number = [&](std::size_t i) { return i < n ? numbers_[i] : 0; };
    table.rows.push_back({number(0), number(1), number(2)});
    result_.polygons += keyword;
    for (std::size_t i = 0; i < std::min<std::size_t>(n, 3); ++i) (result_.polygons += ' ') += words_[i];
    result_.polygons += '\n';
    return n;
  }

  void check_vertex(std::string_view rest) {
    const std::size_t before = result_.vertices.rows.size();
    const std::size_t n = check_numbers(result_.vertices, "v", rest, 3, 6);
    if (n == 5) fail("5 numbers", "x y z, x y z w or x y z red green blue");
    if (n == 4) {
      result_.weights.resize(before, 1);
      result_.weights.push_back(numbers_[3]);
    } else if (n == 6) {
      result_.colours.resize(before, white);
      result_.colours.push_back({numbers_[3], numbers_[4], numbers_[5]});
    }
  }

  void check_face(std::string_view rest) {
    result_.polygons += 'f';
    const std::size_t n = check_corners(rest);
    if (n < 3) fail("a face with " + std::to_string(n) + (n == 1 ? " corner" : " corners"), "at least 3");
    result_.polygons += '\n';
    ++result_.faces;
    result_.corners += n;
  }

  /// Checks references "v", "v/vt", "v//vn", "v/vt/vn", each also with nothing after a "/"; gives their number.
  std::size_t check_corners(std::string_view rest) {
    std::size_t n = 0;
    for (std::string_view word; !(word = next_argument(rest)).empty(); ++n) {
      std::string_view part = word;
      check_index(result_.vertices, part.substr(0, part.find('/')), word);
      for (Table* table : {&result_.texcoords, &result_.normals}) {
        const std::size_t slash = part.find('/');
        if (slash == std::string_view::npos) break;
        part.remove_prefix(slash + 1);
        const std::string_view index = part.substr(0, part.find('/'));
        if (!index.empty()) check_index(*table, index, word);
        if (table == &result_.normals && part.size() != index.size()) fail(in_quotes(word), "at most v/vt/vn");
      }
      (result_.polygons += ' ') += word;
    }
    return n;
  }

  void check_index(Table& table, std::string_view text, std::string_view word) {
    const auto count = static_cast<std::int64_t>(table.rows.size());
    const std::optional<std::int32_t> index = parse_number<std::int32_t>(text);
    if (!index || *index == 0 || *index == std::numeric_limits<std::int32_t>::min())
      fail(in_quotes(word), std::string("the number of a ") + table.name + ", from 1, or negative to count backwards");
    if (*index < 0 && -std::int64_t{*index} > count)
      fail(std::string(table.name) + ' ' + std::to_string(*index),
           "at least " + std::to_string(-count) + ", there are only so many before this line");
    if (*index > table.greatest_index) {
      table.greatest_index = *index;
      table.greatest_line = line_number_;
    }
  }

  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({.file = file_,
                 .place = "line " + std::to_string(line_number_),
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

  TextLines lines_;
  const std::string& file_;
  std::size_t line_number_ = 0;
  std::string joined_;
  std::array<double, 6> numbers_{};
  std::array<std::string_view, 6> words_{};
  Checked result_;
};

/// What tinyobjloader's callbacks deliver.
struct Loaded {
  std::vector<Vec3d> vertices, texcoords, normals;
  Mesh mesh;

  /// From 1, or negative to count backwards, or 0 for none.
  static std::uint32_t resolve(int index, std::size_t count) {
    if (index == 0) return no_index;
    return index > 0 ? static_cast<std::uint32_t>(index - 1)
                     : static_cast<std::uint32_t>(static_cast<std::int64_t>(count) + index);
  }

  void add_face(const tinyobj::index_t* indices, int count) {
    for (const tinyobj::index_t& corner : std::span(indices, static_cast<std::size_t>(count))) {
      mesh.corners.push_back(resolve(corner.vertex_index, vertices.size()));
      mesh.corner_texcoord.push_back(resolve(corner.texcoord_index, texcoords.size()));
      mesh.corner_normal.push_back(resolve(corner.normal_index, normals.size()));
    }
    if (mesh.face_start.empty()) mesh.face_start.push_back(0);
    mesh.face_start.push_back(mesh.corners.size());
  }
};

inline Loaded load(std::string polygons) {
  using tinyobj::real_t;
  tinyobj::callback_t callback;
  callback.vertex_cb = [](void* to, real_t x, real_t y, real_t z, real_t) {
    static_cast<Loaded*>(to)->vertices.push_back(Vec3<real_t>{x, y, z}.as<double>());
  };
  callback.texcoord_cb = [](void* to, real_t x, real_t y, real_t z) {
    static_cast<Loaded*>(to)->texcoords.push_back(Vec3<real_t>{x, y, z}.as<double>());
  };
  callback.normal_cb = [](void* to, real_t x, real_t y, real_t z) {
    static_cast<Loaded*>(to)->normals.push_back(Vec3<real_t>{x, y, z}.as<double>());
  };
  callback.index_cb = [](void* to, tinyobj::index_t* indices, int count) {
    static_cast<Loaded*>(to)->add_face(indices, count);
  };
  Loaded loaded;
  std::istringstream stream(std::move(polygons));
  tinyobj::LoadObjWithCallback(stream, callback, &loaded);
  return loaded;
}

/// The loaded numbers as floats, after a comparison with the checked ones. tinyobjloader adds a decimal's digits up in
/// double and rounds the sum: close to the middle between two floats it gives the wrong one. Where the two agree, the
/// correctly rounded one is kept, so that writing and reading a mesh gives back its bits. A program linked with the
/// wrong one of tinyobjloader's two libraries (float, double) ends here with an error and not with a wrong mesh.
inline std::vector<Vec3f> agreed(const Table& checked, const std::vector<Vec3d>& loaded, const std::string& file) {
  constexpr double tolerance = 1e-6;  // 8 units in the last place of a float
  constexpr double smallest = std::numeric_limits<float>::denorm_min();
  const auto close = [&](double a, double b) { return std::abs(a - b) <= tolerance * std::abs(a) + smallest; };
  if (loaded.size() != checked.rows.size())
    invalid_mesh(file, checked.name, std::to_string(loaded.size()) + " read by tinyobjloader",
                 std::to_string(checked.rows.size()));
  std::vector<Vec3f> result(loaded.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    const Vec3d a = checked.rows[i], b = loaded[i];
    if (!close(a.x, b.x) || !close(a.y, b.y) || !close(a.z, b.z))
      invalid_mesh(file, numbered(checked.name, i + 1), to_text(b.as<float>()) + " read by tinyobjloader",
                   to_text(a.as<float>()));
    result[i] = a.as<float>();
  }
  return result;
}

inline void add_properties(Mesh& mesh, const Checked& checked) {
  static constexpr std::array<std::pair<const char*, double Vec3d::*>, 3> channels = {
      {{"red", &Vec3d::x}, {"green", &Vec3d::y}, {"blue", &Vec3d::z}}};
  if (!checked.colours.empty())
    for (const auto& [name, channel] : channels) {
      mesh.properties.push_back({name, "float", {}});
      for (const Vec3d& colour : checked.colours)
        mesh.properties.back().values.push_back(static_cast<float>(colour.*channel));
    }
  if (checked.weights.empty()) return;
  mesh.properties.push_back({"w", "float", {}});
  for (const double weight : checked.weights) mesh.properties.back().values.push_back(static_cast<float>(weight));
}

}  // namespace internal::obj

/// A mesh from the text of an OBJ file. `name` stands in the messages of errors.
inline Mesh parse_obj(std::string_view text, const std::string& name) {
  internal::obj::Checked checked = internal::obj::Checker(text, name).check();
  internal::obj::Loaded loaded = internal::obj::load(std::move(checked.polygons));
  Mesh& mesh = loaded.mesh;
  mesh.positions = internal::obj::agreed(checked.vertices, loaded.vertices, name);
  mesh.texcoords = internal::obj::agreed(checked.texcoords, loaded.texcoords, name);
  mesh.normals = internal::obj::agreed(checked.normals, loaded.normals, name);
  if (mesh.face_count() != checked.faces || mesh.corners.size() != checked.corners)
    internal::invalid_mesh(name, {}, std::to_string(mesh.face_count()) + " faces read by tinyobjloader",
                           std::to_string(checked.faces));
  if (mesh.texcoords.empty()) mesh.corner_texcoord.clear();
  if (mesh.normals.empty()) mesh.corner_normal.clear();
  mesh.texcoord_size = checked.texcoord_size;
  mesh.tags = std::move(checked.tags);
  internal::obj::add_properties(mesh, checked);
  validate(mesh, name);
  return std::move(mesh);
}

inline Mesh read_obj(const std::filesystem::path& path) { return parse_obj(read_file(path), path.string()); }

namespace internal::obj {

inline void append_row(std::string& text, const char* keyword, Vec3f p, int count) {
  text += keyword;
  for (const float number : std::array{p.x, p.y, p.z}) {
    if (count-- <= 0) break;
    append_number(text += ' ', number);
  }
}

/// The properties that the format has a place for: red, green, blue, or else w.
inline std::vector<const VertexProperty*> properties_to_write(const Mesh& mesh) {
  const auto find = [&](const char* name) -> const VertexProperty* {
    const auto found = std::ranges::find(mesh.properties, name, &VertexProperty::name);
    return found == mesh.properties.end() ? nullptr : &*found;
  };
  const VertexProperty *red = find("red"), *green = find("green"), *blue = find("blue"), *w = find("w");
  if (red && green && blue) return {red, green, blue};
  return w ? std::vector{w} : std::vector<const VertexProperty*>{};
}

inline void append_vertices(std::string& text, const Mesh& mesh) {
  const std::vector<const VertexProperty*> properties = properties_to_write(mesh);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    append_row(text, "v", mesh.positions[v], 3);
    for (const VertexProperty* p : properties) {
      // PLY's colours are bytes, OBJ's run from 0 to 1.
      const bool bytes = p->name != "w" && (p->type == "uchar" || p->type == "uint8");
      const auto value = static_cast<float>(bytes ? p->values[v] / 255 : p->values[v]);
      append_number(text += ' ', std::isfinite(value) ? value : 0.0F);
    }
    text += '\n';
  }
}

/// "v", "v/vt", "v//vn" or "v/vt/vn", from 1.
inline void append_corner(std::string& text, const Mesh& mesh, std::size_t c) {
  const auto at = [c](const std::vector<std::uint32_t>& indices) { return indices.empty() ? no_index : indices[c]; };
  const std::uint32_t v = mesh.corners[c], vt = at(mesh.corner_texcoord);
  const bool normal_a_vertex = mesh.corner_normal.empty() && !mesh.normals.empty();
  const std::uint32_t vn = normal_a_vertex ? v : at(mesh.corner_normal);
  append_number(text += ' ', std::uint64_t{v} + 1);
  if (vt == no_index && vn == no_index) return;
  text += '/';
  if (vt != no_index) append_number(text, std::uint64_t{vt} + 1);
  if (vn != no_index) append_number(text += '/', std::uint64_t{vn} + 1);
}

/// The tags that stand before face f; `next` is the first tag not yet written.
inline void append_tags(std::string& text, const Mesh& mesh, std::size_t f, std::size_t& next) {
  for (; next < mesh.tags.size() && mesh.tags[next].face <= f; ++next) {
    const MeshTag& tag = mesh.tags[next];
    if (std::ranges::find(kept_statements, tag.keyword) == kept_statements.end()) continue;
    text += tag.keyword;
    if (!tag.value.empty()) (text += ' ') += tag.value;
    if (tag.value.ends_with('\\')) text += ' ';  // or the line would go on
    text += '\n';
  }
}

}  // namespace internal::obj

/// The text of an OBJ file. `name` stands in the messages of errors. A mesh that came from PLY loses the properties
/// that OBJ has no place for, and its comments.
inline std::string format_obj(const Mesh& mesh, const std::string& name) {
  validate(mesh, name);
  std::string text;
  text.reserve(40 * (mesh.vertex_count() + mesh.texcoords.size() + mesh.normals.size()) + 8 * mesh.corners.size());
  internal::obj::append_vertices(text, mesh);
  for (const Vec3f& p : mesh.texcoords) {
    internal::obj::append_row(text, "vt", p, mesh.texcoord_size);
    text += '\n';
  }
  for (const Vec3f& p : mesh.normals) {
    internal::obj::append_row(text, "vn", p, 3);
    text += '\n';
  }
  std::size_t tag = 0;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    internal::obj::append_tags(text, mesh, f, tag);
    text += 'f';
    for (std::size_t c = mesh.face_start[f]; c < mesh.face_start[f + 1]; ++c)
      internal::obj::append_corner(text, mesh, c);
    text += '\n';
  }
  internal::obj::append_tags(text, mesh, mesh.face_count(), tag);
  return text;
}

inline void write_obj(const std::filesystem::path& path, const Mesh& mesh) {
  write_file(path, format_obj(mesh, path.string()));
}

}  // namespace npt::inline NPT_ABI
