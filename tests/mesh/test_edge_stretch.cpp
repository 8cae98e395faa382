#include <doctest/doctest.h>

#include <npt/mesh/edge_stretch.hpp>
#include <npt/mesh/topology.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace {

/// A grid of n x n points, 1 apart, with edges along both axes.
struct Grid {
  std::vector<float> xyz;
  std::vector<npt::Edge> edges;
  std::uint32_t n;

  explicit Grid(std::uint32_t points) : n(points) {
    for (std::uint32_t y = 0; y < n; ++y)
      for (std::uint32_t x = 0; x < n; ++x) {
        xyz.insert(xyz.end(), {static_cast<float>(x), static_cast<float>(y), 0.0F});
        if (x + 1 < n) edges.push_back({y * n + x, y * n + x + 1});
        if (y + 1 < n) edges.push_back({y * n + x, (y + 1) * n + x});
      }
  }
};

}  // namespace

TEST_CASE("a mesh that only moved isn't stretched, and one twice as large is by 2 everywhere") {
  const Grid grid(20);
  std::vector<float> moved = grid.xyz, larger = grid.xyz;
  for (float& x : moved) x += 3;
  for (float& x : larger) x *= 2;
  CHECK(npt::edge_stretch(grid.edges, grid.xyz, moved).common == doctest::Approx(1));
  CHECK(npt::edge_stretch(grid.edges, grid.xyz, moved).largest == doctest::Approx(1));
  CHECK(npt::edge_stretch(grid.edges, grid.xyz, larger).common == doctest::Approx(2));
  CHECK(npt::edge_stretch(grid.edges, grid.xyz, larger).largest == doctest::Approx(2));
}

TEST_CASE("one vertex that was pulled out is the largest stretch, and not the common one") {
  const Grid grid(60);
  std::vector<float> torn = grid.xyz;
  const std::uint32_t vertex = 30 * grid.n + 30;
  torn[3 * vertex + 2] = 10;
  const npt::EdgeStretch stretch = npt::edge_stretch(grid.edges, grid.xyz, torn);
  CHECK(stretch.common == doctest::Approx(1));
  CHECK(stretch.largest == doctest::Approx(std::sqrt(101.0)));
  // One of the edges at the vertex, by the end with the lesser number.
  CHECK((stretch.vertex == vertex || stretch.vertex == vertex - 1 || stretch.vertex == vertex - grid.n));
  // A tenth of all columns at five times their width, which is a twentieth of the length.
  std::vector<float> wide = grid.xyz;
  for (std::size_t v = 0; v < wide.size() / 3; ++v)
    if (wide[3 * v] > 30) wide[3 * v] += 4;
  CHECK(npt::edge_stretch(grid.edges, grid.xyz, wide).common == doctest::Approx(5));
}

TEST_CASE("degenerate edges don't count") {
  Grid grid(20);
  // A point beside point 5, and one on it.
  for (const float step : {1e-5F, 0.0F}) {
    grid.edges.push_back({5, static_cast<std::uint32_t>(grid.xyz.size() / 3)});
    grid.xyz.insert(grid.xyz.end(), {5 + step, 0.0F, 0.0F});
  }
  std::vector<float> result = grid.xyz;
  result[result.size() - 4] = 0.01F, result[result.size() - 1] = 0.02F;
  npt::EdgeStretch stretch = npt::edge_stretch(grid.edges, grid.xyz, result);
  CHECK(stretch.common == doctest::Approx(1));
  CHECK(stretch.largest == doctest::Approx(1));
  result[result.size() - 1] = 7;  // but a tear does
  stretch = npt::edge_stretch(grid.edges, grid.xyz, result);
  CHECK(stretch.largest == doctest::Approx(7).epsilon(0.01));
  CHECK(stretch.vertex == 5);
}

TEST_CASE("coordinates that aren't finite give NaN, no edges the ratio 1") {
  const Grid grid(4);
  std::vector<float> broken = grid.xyz;
  broken[7] = std::numeric_limits<float>::quiet_NaN();
  CHECK(std::isnan(npt::edge_stretch(grid.edges, grid.xyz, broken).common));
  CHECK(std::isnan(npt::edge_stretch(grid.edges, grid.xyz, broken).largest));
  CHECK(npt::edge_stretch({}, grid.xyz, grid.xyz).common == 1);
}
