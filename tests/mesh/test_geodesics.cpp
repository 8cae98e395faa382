#include <doctest/doctest.h>

#include <npt/mesh/geodesics.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace {

// A way of five points along x, a short cut from the second to the fourth, and a point by itself.
const std::array<npt::Vec3d, 6> way_points{{{0, 0, 0}, {1, 0, 0}, {2, 1, 0}, {3, 0, 0}, {4, 0, 0}, {9, 9, 9}}};
const std::array<npt::Edge, 5> way_edges{{{0, 1}, {1, 2}, {1, 3}, {2, 3}, {3, 4}}};
const npt::Neighbours way_around = npt::neighbours(way_edges, way_points.size());

}  // namespace

TEST_CASE("distances are those along the shortest paths") {
  const std::array<std::uint32_t, 1> start{0};
  const npt::Geodesics found = npt::geodesics(way_points, way_around, start);
  const std::array<double, 5> expected{0, 1, 1 + std::sqrt(2.0), 3, 4};
  for (std::size_t p = 0; p < expected.size(); ++p) {
    CHECK(found.distance[p] == doctest::Approx(expected[p]));
    CHECK(found.nearest[p] == 0);
  }
  CHECK(std::isinf(found.distance[5]));
  CHECK(found.nearest[5] == npt::no_index);
}

TEST_CASE("of several starts each point belongs to the nearest") {
  const std::array<std::uint32_t, 2> starts{3, 0};
  const npt::Geodesics found = npt::geodesics(way_points, way_around, starts);
  CHECK(found.nearest == std::vector<std::uint32_t>{1, 1, 0, 0, 0, npt::no_index});
  CHECK(found.distance[4] == doctest::Approx(1));
}

TEST_CASE("no path leads through points that are outside") {
  const std::array<std::uint32_t, 1> start{0};
  const npt::Geodesics found = npt::geodesics(way_points, way_around, start, [](std::uint32_t p) { return p != 3; });
  CHECK(found.distance[2] == doctest::Approx(1 + std::sqrt(2.0)));
  CHECK(std::isinf(found.distance[3]));
  CHECK(std::isinf(found.distance[4]));
}
