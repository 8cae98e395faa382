// The sculptor's parts on a sphere: polygons of an implicit figure, remeshing, and the text that holds the result.
#include <doctest/doctest.h>
#include <npt/body/mannequin/surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <sculpt/figure.hpp>
#include <sculpt/half_edges.hpp>
#include <sculpt/header_text.hpp>
#include <sculpt/polygonise.hpp>
#include <sculpt/remesh.hpp>
#include <string>
#include <utility>
#include <vector>

namespace {

using npt::Vec3d;
using npt::anatomy::TriangleSheet;

struct Sphere {
  double radius = 0.3;
  double operator()(Vec3d p) const { return length(p) - radius; }
};

/// Cells of 50 mm everywhere.
constexpr sculpt::GridWarp even_grid{0.05, 10, 11, 1, 0, 0};

TriangleSheet half_sphere() {
  const Sphere sphere;
  return sculpt::Polygoniser(sphere, even_grid)({0, 0, 5});
}

/// How often each directed edge occurs.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed_edges(
    const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  return edges;
}

void check_closed_sphere(const TriangleSheet& half) {
  const npt::anatomy::Surface whole = npt::anatomy::mirrored(half);
  const auto edges = directed_edges(whole.triangles);
  for (const auto& [edge, count] : edges) {
    REQUIRE(count == 1);
    REQUIRE(edges.contains({edge.second, edge.first}));
  }
  CHECK(whole.positions.size() + whole.triangles.size() == edges.size() / 2 + 2);  // Euler's formula
  for (const auto& t : whole.triangles) {
    const Vec3d a = whole.positions[t[0]], b = whole.positions[t[1]], c = whole.positions[t[2]];
    REQUIRE(dot(cross(b - a, c - a), a + b + c) > 0);  // outwards
  }
}

}  // namespace

TEST_CASE("polygons of half a sphere lie on it, and with their mirror image they are closed") {
  const TriangleSheet half = half_sphere();
  for (const Vec3d p : half.positions) {
    CHECK(p.x >= 0);
    CHECK(std::abs(length(p) - 0.3) < 0.005);
  }
  check_closed_sphere(half);
}

TEST_CASE(
    "a remeshed sphere has the wanted number of vertices, edges near the wanted length, and its border in the middle") {
  const Sphere sphere;
  const auto length_at = [](Vec3d) { return 0.05; };
  for (const std::size_t count : {400U, 401U}) {
    const TriangleSheet half = sculpt::Remesher(sphere, length_at, count, half_sphere())();
    CHECK(npt::anatomy::mirrored(half).positions.size() == count);
    check_closed_sphere(half);
    double shortest = 1, longest = 0;
    for (const auto& t : half.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const double n = length(half.positions[t[k]] - half.positions[t[(k + 1) % 3]]);
        shortest = std::min(shortest, n), longest = std::max(longest, n);
      }
    CHECK(shortest > 0.01);
    CHECK(longest < 0.1);
    for (const Vec3d p : half.positions) CHECK(npt::anatomy::rounded(p) == p);
  }
}

TEST_CASE("splits, flips and collapses of edges keep the neighbours") {
  // Two triangles of a square, 0 1 2 and 0 2 3; edge 2 of the first is its diagonal.
  const TriangleSheet square{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{{0, 1, 2}}, {{0, 2, 3}}}};
  sculpt::SheetTopology topology(square);
  CHECK(topology.opposite(2) == 3);
  CHECK(topology.opposite(0) == sculpt::SheetTopology::none);
  std::vector<std::uint32_t> ring;
  topology.neighbours(0, ring);
  CHECK(ring == std::vector<std::uint32_t>{1, 2, 3});
  topology.flip(2);
  topology.neighbours(0, ring);
  CHECK(ring == std::vector<std::uint32_t>{1, 3});
  topology.neighbours(1, ring);
  CHECK(ring == std::vector<std::uint32_t>{2, 3, 0});

  sculpt::SheetTopology split(square);
  split.split(2);
  CHECK(split.triangles().size() == 4);
  split.neighbours(4, ring);
  CHECK(ring.size() == 4);
  CHECK_FALSE(split.on_border(4));
  CHECK(split.on_border(0));
}

TEST_CASE("strokes dent and bulge, on both sides") {
  const sculpt::Stroke strokes[] = {{{0.1, 0, 0}, {0.1, 0.1, 0}, {0.05, 0.05, 0.05}, 0.01}};
  const sculpt::Figure figure(npt::anatomy::BlendedLofts({}), strokes);
  const double far = figure({1, 1, 1});
  CHECK(figure({0.1, 0.05, 0}) == doctest::Approx(far - 0.01));
  CHECK(figure({-0.1, 0.05, 0}) == doctest::Approx(far - 0.01));
  CHECK(figure({0.1, 0.16, 0}) == far);
}

TEST_CASE("numbers are read as they were written") {
  std::string text;
  const std::vector<std::uint32_t> numbers{0, 1, 9, 10, 35, 36, 61, 62, 63, 64, 4095};
  for (const std::uint32_t number : numbers) sculpt::append_number(text, number, 2);
  CHECK(text.starts_with("000109"));
  CHECK(npt::anatomy::numbers_of(text, 2) == numbers);
}
