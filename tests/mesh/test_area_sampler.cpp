#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/mesh/area_sampler.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

// A unit square of two triangles, and one triangle without area.
const std::array<npt::Vec3d, 4> square_points{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
const std::array<npt::Triangle, 3> square_triangles{{{0, 1, 2}, {1, 1, 2}, {0, 2, 3}}};

npt::WeightedChoice square_areas() {
  return npt::weigh_by_area(square_triangles, [](std::uint32_t v) { return square_points[v]; });
}

npt::Vec3d square_position(const npt::TrianglePoint& p) {
  const auto& [a, b, c] = square_triangles[p.triangle];
  return square_points[a] * p.weights[0] + square_points[b] * p.weights[1] + square_points[c] * p.weights[2];
}

}  // namespace

TEST_CASE("a triangle's weight is twice its area") {
  CHECK(square_areas().total() == 2);
  CHECK(square_areas().at(0.5) == 0);
  CHECK(square_areas().at(1) == 2);
}

TEST_CASE("spread points have equally many on equal areas, in random order") {
  const std::vector<npt::TrianglePoint> drawn = npt::spread_points(square_areas(), 1000, 1);
  CHECK(drawn.size() >= 999);
  CHECK(drawn.size() <= 1001);
  std::array<std::size_t, 3> count{};
  npt::Vec3d mean, mean_of_first;
  std::size_t descents = 0;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const npt::TrianglePoint& p = drawn[i];
    ++count[p.triangle];
    for (const double w : p.weights) CHECK(w >= 0);
    CHECK(p.weights[0] + p.weights[1] + p.weights[2] == doctest::Approx(1));
    mean += square_position(p) / static_cast<double>(drawn.size());
    if (i < 100) mean_of_first += square_position(p) / 100.0;
    if (i > 0 && p.triangle < drawn[i - 1].triangle) ++descents;
  }
  CHECK(count[0] >= 500);
  CHECK(count[0] <= 501);
  CHECK(count[1] == 0);
  CHECK(count[2] >= 500);
  CHECK(count[2] <= 501);
  CHECK(length(mean - npt::Vec3d{0.5, 0.5, 0}) < 0.03);
  CHECK(length(mean_of_first - npt::Vec3d{0.5, 0.5, 0}) < 0.1);
  CHECK(descents > 100);
}

TEST_CASE("of many triangles that share few points, each stretch of them has its share") {
  npt::WeightedChoice areas;
  for (int t = 0; t < 20000; ++t) areas.add(t < 10000 ? 1 : 3);
  const std::vector<npt::TrianglePoint> drawn = npt::spread_points(areas, 1000, 5);
  CHECK(static_cast<double>(drawn.size()) == doctest::Approx(1000).epsilon(0.01));
  std::array<int, 20> of_stretch{};
  for (const npt::TrianglePoint& p : drawn) ++of_stretch[p.triangle / 1000];
  for (std::size_t i = 0; i < of_stretch.size(); ++i) {
    CHECK(of_stretch[i] >= (i < 10 ? 23 : 73));
    CHECK(of_stretch[i] <= (i < 10 ? 27 : 77));
  }
}

TEST_CASE("rounding of areas moves no point") {
  npt::WeightedChoice exact, rounded;
  npt::Random random(3);
  for (int t = 0; t < 14000; ++t) {
    const double area = random.uniform(0.5, 1.5);
    exact.add(area);
    rounded.add(area * (1 + 1e-9 * random.normal()));
  }
  const std::vector<npt::TrianglePoint> one = npt::spread_points(exact, 5000, 7),
                                        other = npt::spread_points(rounded, 5000, 7);
  REQUIRE(one.size() == other.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    CHECK(one[i].triangle == other[i].triangle);
    CHECK(one[i].weights == other[i].weights);
  }
}

TEST_CASE("points are uniform within a triangle") {
  // Nearer to the first corner than half of the way: a quarter of the area.
  std::size_t near = 0;
  for (const npt::TrianglePoint& p : npt::spread_points(square_areas(), 4000, 2))
    if (p.weights[0] > 0.5) ++near;
  CHECK(static_cast<double>(near) == doctest::Approx(1000).epsilon(0.1));
}
