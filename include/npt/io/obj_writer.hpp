/// Writing OBJ files; obj.hpp says what is kept.
#pragma once

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
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

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
  for (Vec3f p : mesh.texcoords) {
    if (mesh.texcoords_from_top) p.y = 1 - p.y;
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

}  // namespace npt::inline NPT_ABI
