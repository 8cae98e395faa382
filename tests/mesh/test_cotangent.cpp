#include <doctest/doctest.h>

#include <npt/mesh/cotangent.hpp>

#include <cmath>
#include <vector>

namespace {

using npt::Triangle;
using npt::Vec3d;

const double half_root3 = std::sqrt(3.0) / 2;

}  // namespace

TEST_CASE("two equilateral triangles: half a cotangent of 60 degrees each, thirds of the area") {
  const std::vector<Vec3d> points{{0, 0, 0}, {1, 0, 0}, {0.5, half_root3, 0}, {0.5, -half_root3, 0}};
  const std::vector<Triangle> triangles{{0, 1, 2}, {1, 0, 3}};
  const npt::CotangentWeights w = npt::cotangent_weights(points, triangles);
  CHECK(w.edges == std::vector<npt::Edge>{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}});
  const double one = 0.5 / std::sqrt(3.0);
  CHECK(w.weights[0] == doctest::Approx(2 * one));
  for (std::size_t e = 1; e < 5; ++e) CHECK(w.weights[e] == doctest::Approx(one));
  CHECK(w.total_area == doctest::Approx(half_root3));
  CHECK(w.areas[0] == doctest::Approx(half_root3 / 3));
  CHECK(w.areas[2] == doctest::Approx(half_root3 / 6));
}

TEST_CASE("weights don't depend on size, and the operator gives nothing on linear functions of a flat grid") {
  const std::size_t n = 6;
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
  for (std::size_t y = 0; y < n; ++y)
    for (std::size_t x = 0; x < n; ++x)
      // Sheared, so that no angle is obtuse.
      points.push_back(
          {static_cast<double>(x) - 0.5 * static_cast<double>(y) + 0.05 * std::sin(static_cast<double>(3 * y)),
           half_root3 * static_cast<double>(y) + 0.05 * std::sin(static_cast<double>(5 * x)), 0});
  for (std::uint32_t y = 0; y + 1 < n; ++y)
    for (std::uint32_t x = 0; x + 1 < n; ++x) {
      const auto at = [](std::uint32_t i, std::uint32_t j) { return static_cast<std::uint32_t>(j * n + i); };
      triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  const npt::CotangentWeights w = npt::cotangent_weights(points, triangles);
  std::vector<double> laplace(points.size());
  for (std::size_t e = 0; e < w.edges.size(); ++e) {
    const auto [a, b] = w.edges[e];
    const double d = w.weights[e] * ((3 * points[a].x - 2 * points[a].y) - (3 * points[b].x - 2 * points[b].y));
    laplace[a] += d;
    laplace[b] -= d;
  }
  for (std::size_t y = 1; y + 1 < n; ++y)
    for (std::size_t x = 1; x + 1 < n; ++x) CHECK(std::abs(laplace[y * n + x]) < 1e-12);
  for (Vec3d& p : points) p *= 1e-9;
  const npt::CotangentWeights small = npt::cotangent_weights(points, triangles);
  for (std::size_t e = 0; e < w.edges.size(); ++e) CHECK(small.weights[e] == doctest::Approx(w.weights[e]));
}

TEST_CASE(
    "bad triangles: flat ones hold their edges, repeated points are none, slivers and obtuse angles stay in bounds") {
  const std::vector<Vec3d> points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1e-3, 0}, {5, 5, 5}};
  const npt::CotangentWeights flat = npt::cotangent_weights(points, std::vector<Triangle>{{0, 1, 2}, {3, 3, 4}});
  REQUIRE(flat.edges.size() == 3);
  for (const double weight : flat.weights) CHECK(weight == doctest::Approx(0.5 / std::sqrt(3.0)));
  CHECK(flat.total_area == 0);
  const npt::CotangentWeights thin = npt::cotangent_weights(points, std::vector<Triangle>{{0, 2, 3}});
  CHECK(thin.total_area == doctest::Approx(1e-3));
  for (const double weight : thin.weights) {
    CHECK(weight >= npt::least_weight);
    CHECK(weight <= npt::most_weight);
  }
  CHECK(npt::cotangent_weights(points, {}).edges.empty());
}

TEST_CASE("three triangles at one edge each give their share") {
  const std::vector<Vec3d> points{
      {0, 0, 0}, {1, 0, 0}, {0.5, half_root3, 0}, {0.5, -half_root3, 0}, {0.5, 0, half_root3}};
  const npt::CotangentWeights w =
      npt::cotangent_weights(points, std::vector<Triangle>{{0, 1, 2}, {0, 1, 3}, {0, 1, 4}});
  CHECK(w.edges.size() == 7);
  CHECK(w.weights[0] == doctest::Approx(1.5 / std::sqrt(3.0)));
}
