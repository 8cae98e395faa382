/// Small meshes for tests: tame ones, and ones that files really contain but code forgets.
#pragma once

#include <npt/mesh/mesh.hpp>

#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

namespace zoo {

using Faces = std::initializer_list<std::initializer_list<std::uint32_t>>;

inline npt::Mesh mesh(std::vector<npt::Vec3f> positions, Faces faces) {
  npt::Mesh m;
  m.positions = std::move(positions);
  if (faces.size() > 0) m.face_start.push_back(0);
  for (const auto& face : faces) {
    m.corners.insert(m.corners.end(), face);
    m.face_start.push_back(m.corners.size());
  }
  return m;
}

/// The unit cube of six quads, outward. Vertex 4z + 2y + x.
inline npt::Mesh cube() {
  return mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}},
              {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}});
}

/// The cube with a normal for each face and texture coordinates, as an OBJ exporter writes it.
inline npt::Mesh hard_cube() {
  npt::Mesh m = cube();
  m.normals = {{0, 0, -1}, {0, 0, 1}, {0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {1, 0, 0}};
  m.texcoords = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  m.texcoord_size = 2;
  for (std::uint32_t f = 0; f < 6; ++f)
    for (std::uint32_t c = 0; c < 4; ++c) {
      m.corner_normal.push_back(f);
      m.corner_texcoord.push_back(c);
    }
  return m;
}

/// A triangle, a quad and a pentagon in the plane z = 0, facing up, that share edges; vertex 8 is in no face.
inline npt::Mesh mixed() {
  return mesh({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {3, 0.5F, 0}, {2, 1, 0}, {0.5F, 2, 0}, {9, 9, 9}},
              {{3, 2, 7}, {0, 1, 2, 3}, {1, 4, 5, 6, 2}});
}

inline npt::Mesh cloud() { return mesh({{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {1, 1, 1}}, {}); }

}  // namespace zoo
