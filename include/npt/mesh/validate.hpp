/// Checks that a mesh keeps the invariants of <npt/mesh/mesh.hpp>. Every reader ends with it; call it on meshes made by
/// hand. Linear in the mesh's size.
/// Errors    npt::Error that names the mesh and the vertex, face or array at fault. Numbers count from 0.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Throws what validate() throws about a mesh: `name` is the mesh, `place` the array, vertex or face at fault.
[[noreturn]] inline void invalid_mesh(const std::string& name, std::string place, std::string found,
                                      std::string expected) {
  throw Error({.file = name, .place = std::move(place), .found = std::move(found), .expected = std::move(expected)});
}

/// "(1.000000, 2.000000, 3.000000)"
NPT_INLINE std::string to_string(Vec3f p) {
  return std::string("(") + std::to_string(p.x) + ", " + std::to_string(p.y) + ", " + std::to_string(p.z) + ")";
}

/// "vertex 12"
NPT_INLINE std::string numbered(const char* kind, std::size_t i) { return std::string(kind) + ' ' + std::to_string(i); }

namespace internal {

NPT_INLINE void validate_finite(const std::vector<Vec3f>& points, const char* kind, const std::string& name) {
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!is_finite(points[i])) invalid_mesh(name, numbered(kind, i), to_string(points[i]), "finite numbers");
}

NPT_INLINE void validate_faces(const Mesh& mesh, const std::string& name) {
  const std::size_t corners = mesh.corners.size();
  if (mesh.face_start.empty()) {
    if (corners != 0) invalid_mesh(name, "corners", std::to_string(corners), "none in a mesh without faces");
    return;
  }
  if (mesh.face_start.front() != 0 || mesh.face_start.back() != corners)
    invalid_mesh(name, "face_start",
                 std::to_string(mesh.face_start.front()) + " to " + std::to_string(mesh.face_start.back()),
                 "0 to " + std::to_string(corners) + ", the number of corners");
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const std::size_t first = mesh.face_start[f], last = mesh.face_start[f + 1];
    if (last < first || last > corners)
      invalid_mesh(name, numbered("face", f), "corners " + std::to_string(first) + " to " + std::to_string(last),
                   "ascending numbers of at most " + std::to_string(corners));
    if (last - first < 3)
      invalid_mesh(name, numbered("face", f), std::to_string(last - first) + " corners", "at least 3");
    for (std::size_t c = first; c < last; ++c)
      if (mesh.corners[c] >= mesh.vertex_count())
        invalid_mesh(name, numbered("face", f), "vertex " + std::to_string(mesh.corners[c]),
                     "a vertex below " + std::to_string(mesh.vertex_count()));
  }
}

NPT_INLINE void validate_corner_indices(const Mesh& mesh, const std::vector<std::uint32_t>& indices, std::size_t count,
                                        const char* kind, const std::string& name) {
  if (indices.empty()) return;
  if (indices.size() != mesh.corners.size())
    invalid_mesh(name, std::string("corners' ") + kind + "s", std::to_string(indices.size()),
                 std::to_string(mesh.corners.size()) + ", one for each corner");
  for (std::size_t f = 0; f < mesh.face_count(); ++f)
    for (std::size_t c = mesh.face_start[f]; c < mesh.face_start[f + 1]; ++c)
      if (indices[c] != no_index && indices[c] >= count)
        invalid_mesh(name, numbered("face", f), numbered(kind, indices[c]), "a number below " + std::to_string(count));
}

NPT_INLINE void validate_attributes(const Mesh& mesh, const std::string& name) {
  const std::string vertices = std::to_string(mesh.vertex_count());
  if (mesh.corner_normal.empty() && !mesh.corners.empty() && !mesh.normals.empty() &&
      mesh.normals.size() != mesh.vertex_count())
    invalid_mesh(name, "normals", std::to_string(mesh.normals.size()),
                 vertices + ", one for each vertex, or an index at each corner");
  const int size = mesh.texcoord_size;
  if (mesh.texcoords.empty() ? size != 0 : size != 2 && size != 3)
    invalid_mesh(name, "texture coordinates", std::to_string(size) + " components",
                 mesh.texcoords.empty() ? "0, since there are none" : "2 or 3");
  for (const VertexProperty& property : mesh.properties)
    if (property.values.size() != mesh.vertex_count())
      invalid_mesh(name, "vertex property '" + property.name + "'", std::to_string(property.values.size()) + " values",
                   vertices + ", one for each vertex");
}

NPT_INLINE void validate_tags(const Mesh& mesh, const std::string& name) {
  std::size_t previous = 0;
  for (const MeshTag& tag : mesh.tags) {
    const std::string place = "tag '" + tag.keyword + "'";
    if (tag.face < previous || tag.face > mesh.face_count())
      invalid_mesh(name, place, "face " + std::to_string(tag.face),
                   "ascending numbers of at most " + std::to_string(mesh.face_count()));
    if (tag.keyword.empty() || tag.keyword.find_first_of(" \t\r\n") != std::string::npos ||
        tag.value.find_first_of("\r\n") != std::string::npos)
      invalid_mesh(name, place, "a blank or a line end in it", "one word, and a value of one line");
    previous = tag.face;
  }
}

}  // namespace internal

/// Throws npt::Error unless `mesh` keeps all invariants and has at least one vertex. `name` stands in the message.
NPT_INLINE void validate(const Mesh& mesh, const std::string& name) {
  if (mesh.positions.empty()) invalid_mesh(name, {}, "no vertices", "at least one vertex");
  if (mesh.positions.size() >= no_index)
    invalid_mesh(name, {}, std::to_string(mesh.positions.size()) + " vertices",
                 "fewer than " + std::to_string(no_index));
  internal::validate_finite(mesh.positions, "vertex", name);
  internal::validate_finite(mesh.normals, "normal", name);
  internal::validate_finite(mesh.texcoords, "texture coordinate", name);
  internal::validate_faces(mesh, name);
  internal::validate_attributes(mesh, name);
  internal::validate_corner_indices(mesh, mesh.corner_normal, mesh.normals.size(), "normal", name);
  internal::validate_corner_indices(mesh, mesh.corner_texcoord, mesh.texcoords.size(), "texture coordinate", name);
  internal::validate_tags(mesh, name);
}

}  // namespace npt::inline NPT_ABI
