#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/mesh/farthest_points.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
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

TEST_CASE("the points are those of the plain loop over all distances") {
  npt::Random random(7);
  std::vector<npt::Vec3d> points;
  // On a grid, so that many are equally far; some far away from the others, and some twice.
  for (int i = 0; i < 700; ++i)
    points.push_back({std::floor(30 * random.uniform()), std::floor(5 * random.uniform()), i % 50 == 0 ? 400.0 : 0.0});
  std::vector<double> distance(points.size(), std::numeric_limits<double>::infinity());
  std::vector<std::uint32_t> expected{0};
  while (expected.size() < 300) {
    const npt::Vec3d last = points[expected.back()];
    distance[expected.back()] = -1;
    for (std::size_t p = 0; p < points.size(); ++p)
      distance[p] = std::min(distance[p], dot(points[p] - last, points[p] - last));
    expected.push_back(
        static_cast<std::uint32_t>(std::max_element(distance.begin(), distance.end()) - distance.begin()));
  }
  CHECK(npt::farthest_points(points, expected.size()) == expected);
}
