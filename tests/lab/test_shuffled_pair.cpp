#include <doctest/doctest.h>

#include <npt/lab/shuffled_pair.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

TEST_CASE("an order says which vertex stands where, and where each vertex stands") {
  const npt::data::VertexOrder order(50, npt::Random(1));
  REQUIRE(order.rows.size() == 50);
  std::size_t moved = 0;
  for (std::uint32_t i = 0; i < 50; ++i) {
    CHECK(order.places[order.rows[i]] == i);
    if (order.rows[i] != i) ++moved;
  }
  CHECK(moved > 30);
}

TEST_CASE("a shuffled pair's faces and edges name the vertices that they named before") {
  const std::vector<float> pose{0, 0, 0, 1, 0, 0, 2, 0, 0}, identity{3, 0, 0, 4, 0, 0, 5, 0, 0, 6, 0, 0},
      truth{7, 0, 0, 8, 0, 0, 9, 0, 0, 10, 0, 0};
  const std::vector<npt::Triangle> pose_triangles{{0, 1, 2}}, identity_triangles{{0, 1, 2}, {1, 3, 2}};
  const std::vector<npt::Edge> edges{{0, 1}, {2, 3}};
  const npt::EvaluationPair pair =
      npt::data::shuffled_pair({pose, identity, truth, pose_triangles, identity_triangles, edges},
                               npt::data::VertexOrder(3, npt::Random(1)), npt::data::VertexOrder(4, npt::Random(2)));
  for (std::size_t k = 0; k < 3; ++k) CHECK(pair.pose[3 * pair.pose_triangles[0][k]] == pose[3 * pose_triangles[0][k]]);
  for (std::size_t t = 0; t < 2; ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t before = identity_triangles[t][k], now = pair.identity_triangles[t][k];
      CHECK(pair.identity[3 * now] == identity[3 * before]);
      CHECK(pair.truth[3 * now] == truth[3 * before]);
    }
  for (std::size_t e = 0; e < 2; ++e) {
    CHECK(pair.edges[e][0] < pair.edges[e][1]);
    const float sum = pair.identity[3 * pair.edges[e][0]] + pair.identity[3 * pair.edges[e][1]];
    CHECK(sum == identity[3 * edges[e][0]] + identity[3 * edges[e][1]]);
  }
}
