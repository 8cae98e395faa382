#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/union_find.hpp>

#include <algorithm>
#include <cstdint>
#include <vector>

TEST_CASE("sets are those of a slow search, and are named by their least number") {
  constexpr std::uint32_t n = 200;
  npt::Random random(5);
  npt::UnionFind sets(n);
  std::vector<std::uint32_t> slow(n);
  for (std::uint32_t i = 0; i < n; ++i) slow[i] = i;
  for (int k = 0; k < 150; ++k) {
    const auto a = random.below(n), b = random.below(n);
    const std::uint32_t low = std::min(slow[a], slow[b]), high = std::max(slow[a], slow[b]);
    CHECK(sets.unite(a, b) == (low != high));
    std::ranges::replace(slow, high, low);
    CHECK(sets.find(a) == low);
  }
  CHECK(sets.sets() == slow);
  CHECK(npt::UnionFind(0).sets().empty());
}

TEST_CASE("what triangles join is one component, whatever their order") {
  const std::vector<npt::Triangle> triangles{{6, 5, 4}, {1, 2, 7}, {4, 6, 3}, {0, 0, 0}};
  const std::vector<std::uint32_t> expected{0, 1, 1, 3, 3, 3, 3, 1, 8};
  CHECK(npt::connected_components(triangles, 9) == expected);
}
