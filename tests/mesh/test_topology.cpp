#include <doctest/doctest.h>

#include <mesh/zoo.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>

TEST_CASE("edges are the faces' sides, each once") {
  CHECK(npt::unique_edges(zoo::cube()).size() == 12);
  const std::vector<npt::Edge> edges = npt::unique_edges(zoo::mixed());
  CHECK(edges.size() == 3 + 4 + 5 - 2);
  CHECK(std::is_sorted(edges.begin(), edges.end()));
  for (const npt::Edge& edge : edges) CHECK(edge[0] < edge[1]);
  CHECK(npt::unique_edges(zoo::cloud()).empty());
  CHECK(npt::unique_edges(zoo::mesh({{0, 0, 0}, {1, 0, 0}}, {{0, 0, 1}})) == std::vector<npt::Edge>{{0, 1}});
}

TEST_CASE("edges from elsewhere are sorted, each once") {
  CHECK(npt::unique_edges(std::vector<npt::Edge>{{2, 3}, {0, 1}, {2, 3}, {0, 9}}) ==
        std::vector<npt::Edge>{{0, 1}, {0, 9}, {2, 3}});
}

TEST_CASE("neighbours are those of the edges, both ways, ascending") {
  const npt::Neighbours n = npt::neighbours(zoo::mixed());
  REQUIRE(n.start.size() == 10);
  const auto list = [&](std::size_t v) { return std::vector<std::uint32_t>(n.of(v).begin(), n.of(v).end()); };
  CHECK(list(0) == std::vector<std::uint32_t>{1, 3});
  CHECK(list(2) == std::vector<std::uint32_t>{1, 3, 6, 7});
  CHECK(list(8).empty());
  for (std::uint32_t v = 0; v < 9; ++v)
    for (const std::uint32_t u : n.of(v)) CHECK(std::ranges::find(n.of(u), v) != n.of(u).end());
}
