#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/winding_number.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "mesh/shapes.hpp"

namespace {

using npt::Vec3d;

/// The sum over all triangles.
double exact(const std::vector<Vec3d>& points, const std::vector<npt::Triangle>& triangles, Vec3d p) {
  double sum = 0;
  for (const npt::Triangle& t : triangles) {
    const Vec3d a = points[t[0]] - p, b = points[t[1]] - p, c = points[t[2]] - p;
    const double la = length(a), lb = length(b), lc = length(c);
    sum += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

}  // namespace

TEST_CASE("a closed surface encloses what is inside once, its own points by half, and nothing outside") {
  auto [points, triangles] = shapes::sphere(40, 60);
  npt::WindingTree tree(points, triangles);
  CHECK(tree.winding({0.1, 0.2, 0}) == doctest::Approx(1).epsilon(0.02));
  CHECK(std::abs(tree.winding({1.5, 0, 0})) < 0.02);
  for (std::uint32_t t = 0; t < triangles.size(); t += 97) {
    const Vec3d p = (points[triangles[t][0]] + points[triangles[t][1]] + points[triangles[t][2]]) / 3.0;
    CHECK(tree.winding(p, t) == doctest::Approx(0.5).epsilon(0.1));
  }
  for (Vec3d& p : points) p += Vec3d{1.5, 0, 0};
  tree.move(points, triangles);
  CHECK(tree.winding({1.5, 0, 0}) == doctest::Approx(1).epsilon(0.02));
  CHECK(std::abs(tree.winding({-0.5, 0, 0})) < 0.02);
}

TEST_CASE("two overlapping parts enclose what is in both twice") {
  const npt::Mesh one = shapes::starfish(24, 36);
  const npt::Mesh both = shapes::joined(one, shapes::moved(one, {0.2F, 0, 0}));
  const auto triangles = npt::triangulate(both);
  const npt::WindingTree tree(npt::points_of(both.coordinates()), triangles);
  CHECK(tree.winding({0.1, 0, 0}) == doctest::Approx(2).epsilon(0.05));
  CHECK(tree.winding({1.6, 0, 0}) == doctest::Approx(1).epsilon(0.1));
}

TEST_CASE("the tree's sum is that over all triangles, also of a surface with holes and faults") {
  npt::Random random(5);
  for (const npt::Mesh& mesh : {shapes::starfish(32, 48), shapes::bad_mesh()}) {
    const auto triangles = npt::triangulate(mesh);
    const std::vector<Vec3d> points = npt::points_of(mesh.coordinates());
    const npt::WindingTree tree(points, triangles);
    double worst = 0;
    for (int i = 0; i < 200; ++i) {
      const Vec3d p{3 * random.uniform() - 1.5, 3 * random.uniform() - 1.5, random.uniform() - 0.5};
      worst = std::max(worst, std::abs(tree.winding(p) - exact(points, triangles, p)));
    }
    CHECK(worst < 0.11);
  }
  CHECK(npt::WindingTree({}, {}).winding({1, 2, 3}) == 0);
}
