#include <doctest/doctest.h>

#include <mesh/zoo.hpp>
#include <npt/base/random.hpp>
#include <npt/mesh/permute.hpp>
#include <npt/mesh/validate.hpp>

TEST_CASE("a permuted mesh is the same surface with the same attributes") {
  npt::Mesh mesh = zoo::mixed();
  for (std::size_t v = 0; v < 9; ++v) mesh.normals.push_back({static_cast<float>(v), 0, 1});
  mesh.properties = {{"q", "float", {0, 1, 2, 3, 4, 5, 6, 7, 8}}};
  npt::Random random(2);
  const std::vector<std::uint32_t> order = npt::random_permutation(9, random);
  const npt::Mesh permuted = npt::permute_vertices(mesh, order);
  npt::validate(permuted, "permuted");
  for (std::size_t i = 0; i < 9; ++i) {
    CHECK(permuted.positions[i] == mesh.positions[order[i]]);
    CHECK(permuted.normals[i] == mesh.normals[order[i]]);
    CHECK(permuted.properties[0].values[i] == order[i]);
  }
  CHECK(permuted.face_start == mesh.face_start);
  for (std::size_t c = 0; c < mesh.corners.size(); ++c)
    CHECK(permuted.positions[permuted.corners[c]] == mesh.positions[mesh.corners[c]]);
  const npt::Mesh back = npt::permute_vertices(permuted, npt::inverse_order(order));
  CHECK(back.positions == mesh.positions);
  CHECK(back.corners == mesh.corners);
}

TEST_CASE("normals of corners don't move with the vertices") {
  const npt::Mesh mesh = zoo::hard_cube();
  const npt::Mesh permuted = npt::permute_vertices(mesh, std::vector<std::uint32_t>{7, 6, 5, 4, 3, 2, 1, 0});
  CHECK(permuted.normals == mesh.normals);
  CHECK(permuted.corner_normal == mesh.corner_normal);
  CHECK_THROWS_AS(npt::permute_vertices(mesh, std::vector<std::uint32_t>{0, 1}), npt::Error);
}
