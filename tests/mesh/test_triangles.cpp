#include <doctest/doctest.h>

#include <mesh/zoo.hpp>
#include <npt/mesh/triangles.hpp>

TEST_CASE("faces become fans around their first corner, in face order") {
  CHECK(npt::triangulate(zoo::mixed()) ==
        std::vector<npt::Triangle>{{3, 2, 7}, {0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 6}, {1, 6, 2}});
  CHECK(npt::triangulate(zoo::cloud()).empty());
}

TEST_CASE("triangles don't depend on the positions") {
  npt::Mesh mesh = zoo::mixed();
  const auto before = npt::triangulate(mesh);
  for (npt::Vec3f& p : mesh.positions) p = {-p.y * 3, p.x, p.x * p.y};
  CHECK(npt::triangulate(mesh) == before);
}

TEST_CASE("triangles become faces, and back") {
  const std::vector<npt::Triangle> triangles{{0, 1, 2}, {2, 1, 3}};
  npt::Mesh mesh;
  mesh.positions.resize(4);
  npt::set_faces(mesh, triangles);
  CHECK(mesh.face_start == std::vector<std::size_t>{0, 3, 6});
  CHECK(npt::triangulate(mesh) == triangles);
}
