/// A polygon mesh as files hold it: positions, faces of any size, and what rides along.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/appearance.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// Marks a corner without texture coordinate or normal.
inline constexpr std::uint32_t no_index = 0xFFFFFFFFU;

/// A statement of a mesh file that stands before face number `face` and must be written back there: "g", "o", "usemtl",
/// "s" or "mtllib" (OBJ), "comment" or "obj_info" (PLY, before face 0), and the rest of its line. Each format writes
/// its own and leaves out the other's.
struct MeshTag {
  std::size_t face = 0;
  std::string keyword;
  std::string value;
};

/// A named scalar per vertex that the format can carry (PLY: red, quality, ...), with its PLY type name.
struct VertexProperty {
  std::string name;
  std::string type;
  std::vector<double> values;  ///< [V]
};

/// A mesh with V vertices, F faces and N corners (the faces' vertices, one after another).
/// Invariants (checked by validate(), established by every reader): face_start has F + 1 ascending entries from 0 to N
/// or is empty; corner indices are below V; per-corner arrays have N entries or none; all positions are finite.
struct Mesh {
  std::vector<Vec3f> positions;         ///< [V], in the file's units and order
  std::vector<std::size_t> face_start;  ///< [F + 1] or empty: face f has corners face_start[f] .. face_start[f + 1] - 1
  std::vector<std::uint32_t> corners;   ///< [N] vertex of each corner
  std::vector<Vec3f> normals;           ///< normals as stored: any number (OBJ), or one a vertex (PLY)
  std::vector<std::uint32_t> corner_normal;      ///< [N] index into normals or no_index; empty: none, or one a vertex
  std::vector<Vec3f> texcoords;                  ///< (u, v, w) as stored
  int texcoord_size = 0;                         ///< 0, 2 or 3 components in the file
  std::vector<std::uint32_t> corner_texcoord;    ///< [N] index into texcoords or no_index; empty: none
  bool texcoords_from_top = false;               ///< whether v counts from an image's top (glTF) or bottom (OBJ, PLY)
  std::vector<MeshTag> tags;                     ///< groups, objects, materials, smoothing, in file order
  std::vector<VertexProperty> properties;        ///< further per-vertex scalars
  std::shared_ptr<const Appearance> appearance;  ///< materials that the tags "usemtl" name (glTF), or nullptr

  std::size_t vertex_count() const noexcept { return positions.size(); }
  std::size_t face_count() const noexcept { return face_start.empty() ? 0 : face_start.size() - 1; }
  std::span<const std::uint32_t> face(std::size_t f) const {
    return {corners.data() + face_start[f], face_start[f + 1] - face_start[f]};
  }
  /// The positions as [V, 3] floats, row major, without a copy.
  std::span<const float> coordinates() const noexcept {
    static_assert(sizeof(Vec3f) == 3 * sizeof(float));
    return {positions.empty() ? nullptr : &positions.front().x, 3 * positions.size()};
  }
  std::span<float> coordinates() noexcept {
    return {positions.empty() ? nullptr : &positions.front().x, 3 * positions.size()};
  }
};

}  // namespace npt::inline NPT_ABI
