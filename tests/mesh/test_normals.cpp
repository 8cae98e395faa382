#include <doctest/doctest.h>

#include <mesh/zoo.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/validate.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace {

constexpr float tolerance = 1e-6F;

bool near(npt::Vec3f a, npt::Vec3f b) { return npt::length(a - b) < tolerance; }

/// A quarter turn about z.
npt::Vec3f turned(npt::Vec3f p) { return {-p.y, p.x, p.z}; }

void turn(npt::Mesh& mesh) {
  for (npt::Vec3f& p : mesh.positions) p = turned(p);
}

}  // namespace

TEST_CASE("a face's area vector is exact for any number of corners, far from the origin too") {
  npt::Mesh mesh = zoo::mixed();
  for (npt::Vec3f& p : mesh.positions) p += {4096, -4096, 0};
  CHECK(npt::face_area_vector(mesh, 0) == npt::Vec3d{0, 0, 1});
  CHECK(npt::face_area_vector(mesh, 1) == npt::Vec3d{0, 0, 2});
  CHECK(npt::face_area_vector(mesh, 2) == npt::Vec3d{0, 0, 3});
}

TEST_CASE("vertex normals weigh faces by area") {
  const std::vector<npt::Vec3f> cube = npt::vertex_normals(zoo::cube());
  const float s = 1 / std::sqrt(3.0F);
  CHECK(near(cube[0], {-s, -s, -s}));
  CHECK(near(cube[7], {s, s, s}));
  // A unit triangle facing up and one three times as large facing x share vertex 0.
  const npt::Mesh two = zoo::mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 3, 0}, {0, 0, 1}}, {{0, 1, 2}, {0, 3, 4}});
  CHECK(near(npt::vertex_normals(two)[0], npt::normalised(npt::Vec3f{3, 0, 1})));
}

TEST_CASE("vertices without a face, and faces without an area, have normal zero") {
  CHECK(npt::vertex_normals(zoo::mixed())[8] == npt::Vec3f{});
  const npt::Mesh line = zoo::mesh({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}});
  for (const npt::Vec3f& n : npt::vertex_normals(line)) CHECK(n == npt::Vec3f{});
}

TEST_CASE("a mesh without normals stays without") {
  npt::Mesh mesh = zoo::cube();
  npt::recompute_normals(mesh);
  CHECK(mesh.normals.empty());
}

TEST_CASE("one normal a vertex turns with the mesh; what no face determines keeps its value") {
  npt::Mesh mesh = zoo::mixed();
  mesh.normals.assign(9, {0, 1, 0});
  npt::recompute_normals(mesh);
  for (std::size_t v = 0; v < 8; ++v) CHECK(near(mesh.normals[v], {0, 0, 1}));
  CHECK(mesh.normals[8] == npt::Vec3f{0, 1, 0});
}

TEST_CASE("vertices that a seam split stay smooth across it, and hard edges stay hard") {
  // Two triangles with a fold between them, the fold's vertices doubled as along a seam of texture.
  npt::Mesh mesh =
      zoo::mesh({{0, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {1, 0, 0}}, {{0, 1, 2}, {4, 3, 5}});
  npt::Mesh hard = mesh;
  mesh.normals.assign(6, {0, 0, 1});
  hard.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0.1F, 0, 1}, {0.1F, 0, 1}, {0.1F, 0, 1}};
  for (npt::Mesh* each : {&mesh, &hard}) {
    each->positions[5] = {0, 0, -1};  // now folded by a right angle
    npt::recompute_normals(*each);
  }
  CHECK(mesh.normals[0] == mesh.normals[3]);
  CHECK(mesh.normals[1] == mesh.normals[4]);
  CHECK(mesh.normals[0].x == doctest::Approx(std::sqrt(0.5)));
  CHECK(mesh.normals[2] != mesh.normals[0]);
  CHECK(dot(hard.normals[0], hard.normals[3]) == doctest::Approx(0));
}

TEST_CASE("hard edges stay hard and the index structure stays as it was") {
  npt::Mesh mesh = zoo::hard_cube();
  const npt::Mesh before = mesh;
  turn(mesh);
  npt::recompute_normals(mesh);
  CHECK(mesh.corner_normal == before.corner_normal);
  REQUIRE(mesh.normals.size() == 6);
  for (std::size_t n = 0; n < 6; ++n) CHECK(near(mesh.normals[n], turned(before.normals[n])));
}

TEST_CASE("corners of a smooth piece share the mean over that piece only") {
  // Two quads that meet in the edge 1-2 at a right angle, smooth across it: one normal at each of its vertices.
  npt::Mesh mesh =
      zoo::mesh({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 0, -1}, {1, 1, -1}}, {{0, 1, 2, 3}, {1, 4, 5, 2}});
  mesh.normals.assign(6, {0, 0, 1});
  mesh.corner_normal = {0, 1, 2, 3, 1, 4, 5, 2};
  npt::recompute_normals(mesh);
  CHECK(near(mesh.normals[1], npt::normalised(npt::Vec3f{1, 0, 1})));
  CHECK(near(mesh.normals[0], {0, 0, 1}));
  CHECK(near(mesh.normals[4], {1, 0, 0}));
}

TEST_CASE("a normal that distant vertices shared by chance is split when they part") {
  // Two triangles, both facing up in the old pose, with one stored normal; then the second one tilts.
  npt::Mesh mesh =
      zoo::mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}}, {{0, 1, 2}, {3, 4, 5}});
  mesh.normals = {{0, 0, 1}, {7, 7, 7}};
  mesh.corner_normal.assign(6, 0);
  mesh.positions[4] = {5, 0, 1};
  npt::recompute_normals(mesh);
  npt::validate(mesh, "split");
  for (std::size_t c = 0; c < 3; ++c) CHECK(near(mesh.normals[mesh.corner_normal[c]], {0, 0, 1}));
  for (std::size_t c = 3; c < 6; ++c) CHECK(near(mesh.normals[mesh.corner_normal[c]], {-1, 0, 0}));
  CHECK(mesh.normals[1] == npt::Vec3f{7, 7, 7});
}

TEST_CASE("corners without a normal stay without, faces without an area keep theirs") {
  npt::Mesh mesh = zoo::mesh({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 1, 3}});
  mesh.normals = {{0, 1, 0}};
  mesh.corner_normal = {0, 0, 0, npt::no_index, npt::no_index, npt::no_index};
  npt::recompute_normals(mesh);
  CHECK(mesh.normals == std::vector<npt::Vec3f>{{0, 1, 0}});
  CHECK(mesh.corner_normal[3] == npt::no_index);
}

TEST_CASE("area vectors of points are sums over their triangles") {
  const std::vector<npt::Vec3d> points{{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 1}, {5, 5, 5}};
  const std::vector<npt::Vec3d> sums = npt::area_vectors(points, std::vector<npt::Triangle>{{0, 1, 2}, {0, 2, 3}});
  CHECK(sums == std::vector<npt::Vec3d>{{3, 0, 6}, {0, 0, 6}, {3, 0, 6}, {3, 0, 0}, {0, 0, 0}});
}

TEST_CASE("area shares of sets stand at their least points, and are none without an area") {
  const std::vector<npt::Vec3d> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {8, 0, 0}, {5, 1, 0}};
  const std::vector<npt::Triangle> triangles{{0, 1, 2}, {3, 4, 5}};
  const std::vector<double> shares = npt::area_shares(points, triangles, std::vector<std::uint32_t>{0, 0, 0, 3, 3, 3});
  CHECK(shares[0] == doctest::Approx(0.25));
  CHECK(shares[3] == doctest::Approx(0.75));
  CHECK(shares[4] == 0);
  CHECK(npt::area_shares(points, {}, std::vector<std::uint32_t>(6)) == std::vector<double>(6));
}
