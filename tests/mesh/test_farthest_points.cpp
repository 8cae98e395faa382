#include <doctest/doctest.h>

#include <npt/mesh/farthest_points.hpp>

#include <array>
#include <cstdint>
#include <vector>

TEST_CASE("each point is the farthest from those before it, of equally far ones the first") {
  const std::array<npt::Vec3d, 6> points{{{0, 0, 0}, {1, 0, 0}, {10, 0, 0}, {5, 0, 0}, {10, 0, 0}, {8, 0, 0}}};
  CHECK(npt::farthest_points(points, 1) == std::vector<std::uint32_t>{0});
  CHECK(npt::farthest_points(points, 4) == std::vector<std::uint32_t>{0, 2, 3, 5});
}

TEST_CASE("no point is chosen twice, not even where all are in one place") {
  const std::array<npt::Vec3d, 3> points{};
  CHECK(npt::farthest_points(points, 3) == std::vector<std::uint32_t>{0, 1, 2});
}
