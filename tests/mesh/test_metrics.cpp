#include <doctest/doctest.h>

#include <npt/mesh/metrics.hpp>

#include <array>
#include <cmath>
#include <vector>

namespace {
const std::array<float, 6> points_here = {0, 0, 0, 1, 1, 1};
const std::array<float, 6> points_there = {0, 3, 4, 1, 1, 1};
}  // namespace

TEST_CASE("PMD is the mean over vertices of the squared distance") {
  CHECK(npt::pmd(points_here, points_there) == 12.5);
  CHECK(npt::pmd(points_there, points_here) == 12.5);
  CHECK(npt::pmd(points_here, points_here) == 0);
  CHECK(npt::pmd_per_coordinate(points_here, points_there) == 12.5 / 3);
  CHECK(npt::vertex_distances(points_here, points_there) == std::vector<double>{5, 0});
  CHECK(npt::root_pmd_mm(0.0025) == 50);
}

TEST_CASE("a million small errors are summed without loss") {
  const std::vector<float> zero(3000000, 0.0F), small(3000000, 0x1p-12F);
  CHECK(npt::pmd(zero, small) == 3 * 0x1p-24);
}

TEST_CASE("different counts, half vertices and none are errors") {
  const std::vector<float> none, half(4);
  CHECK_THROWS_WITH(npt::pmd(points_here, std::array<float, 3>{}),
                    "truth to compare with: found 1 vertices, expected 2, as many as the result has");
  CHECK_THROWS_AS(npt::vertex_distances(points_here, half), npt::Error);
  CHECK_THROWS_AS(npt::pmd(none, none), npt::Error);
}

TEST_CASE("a NaN in a result is a NaN in its score") {
  CHECK(std::isnan(npt::pmd(points_here, std::array<float, 6>{0, 0, 0, NAN, 1, 1})));
}
