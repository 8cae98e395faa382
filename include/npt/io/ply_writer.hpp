/// Writing PLY files; ply.hpp says what is kept.
#pragma once

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
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

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
          writer.number(Type::f32, static_cast<double>(mesh.texcoords[t].x));
          writer.number(Type::f32,
                        static_cast<double>(mesh.texcoords_from_top ? 1 - mesh.texcoords[t].y : mesh.texcoords[t].y));
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

}  // namespace npt::inline NPT_ABI
