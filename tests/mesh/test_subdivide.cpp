#include <doctest/doctest.h>

#include <npt/base/vec3.hpp>
#include <npt/mesh/subdivide.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/triangles.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace {

npt::Mesh tetrahedron() {
  npt::Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  npt::set_faces(mesh, std::vector<npt::Triangle>{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}});
  return mesh;
}

/// Six times the volume that the triangles enclose.
double volume(const npt::Mesh& mesh) {
  double sum = 0;
  for (const npt::Triangle& t : npt::triangulate(mesh))
    sum += dot(mesh.positions[t[0]].as<double>(),
               cross(mesh.positions[t[1]].as<double>(), mesh.positions[t[2]].as<double>()));
  return sum;
}

}  // namespace

TEST_CASE("four triangles for one, a vertex an edge, the same surface in the same orientation") {
  npt::Mesh mesh = tetrahedron();
  for (int step = 0; step < 3; ++step) {
    const std::size_t edges = npt::unique_edges(mesh).size();
    const npt::Mesh finer = npt::subdivide(mesh);
    CHECK(finer.vertex_count() == mesh.vertex_count() + edges);
    CHECK(finer.face_count() == 4 * mesh.face_count());
    CHECK(volume(finer) == doctest::Approx(volume(mesh)));
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) CHECK(finer.positions[v] == mesh.positions[v]);
    // Closed: Euler's formula.
    CHECK(finer.vertex_count() + finer.face_count() == npt::unique_edges(finer).size() + 2);
    mesh = finer;
  }
}

TEST_CASE("quadrilaterals are cut first, and degenerate triangles make no vertices of their own") {
  npt::Mesh square;
  square.positions = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
  square.face_start = {0, 4};
  square.corners = {0, 1, 2, 3};
  CHECK(npt::subdivide(square).vertex_count() == 9);
  npt::Mesh thin;
  thin.positions = {{0, 0, 0}, {2, 0, 0}};
  npt::set_faces(thin, std::vector<npt::Triangle>{{0, 1, 1}});
  const npt::Mesh finer = npt::subdivide(thin);
  REQUIRE(finer.vertex_count() == 3);
  CHECK(finer.positions[2].x == 1);
}
