#include <doctest/doctest.h>

#include <mesh/zoo.hpp>
#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/mesh/permute.hpp>
#include <npt/mesh/resample.hpp>

#include <algorithm>
#include <cmath>

TEST_CASE("as many points as vertices: the vertices, unchanged") {
  const npt::Mesh mesh = zoo::mixed();
  CHECK(npt::resample(mesh, 9, 1) == mesh.positions);
  CHECK(npt::resample(zoo::cloud(), 5, 1) == zoo::cloud().positions);
}

TEST_CASE("points lie on the surface and are spread by area") {
  npt::Mesh mesh = zoo::cube();
  for (npt::Vec3f& p : mesh.positions) p.z *= 3;  // four sides of area 3, two of area 1
  const std::vector<npt::Vec3f> points = npt::resample(mesh, 14000, 7);
  REQUIRE(points.size() == 14000);
  int ends = 0, low = 0;
  for (const npt::Vec3f& p : points) {
    // Compilers contract products and sums as they like: off by a rounding.
    const auto is = [](float x, float y) { return std::abs(x - y) < 1e-6F; };
    CHECK((p.x > -1e-6F && p.x < 1.000001F && p.y > -1e-6F && p.y < 1.000001F && p.z > -1e-6F && p.z < 3.000001F));
    const bool at_end = is(p.z, 0) || is(p.z, 3);
    const bool on_side = is(p.x, 0) || is(p.x, 1) || is(p.y, 0) || is(p.y, 1);
    CHECK((at_end || on_side));
    ends += at_end ? 1 : 0;
    low += p.z > 0 && p.z < 1 ? 1 : 0;
  }
  // Expected 2000 and 4000; five standard deviations.
  CHECK(std::abs(ends - 2000) < 5 * std::sqrt(14000 * (1.0 / 7) * (6.0 / 7)));
  CHECK(std::abs(low - 4000) < 5 * std::sqrt(14000 * (2.0 / 7) * (5.0 / 7)));
}

TEST_CASE("points are uniform within a triangle") {
  const npt::Mesh mesh = zoo::mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  npt::Vec3d mean;
  int inner = 0;
  for (const npt::Vec3f& p : npt::resample(mesh, 20000, 3)) {
    mean += p.as<double>() / 20000;
    inner += p.x + p.y < 0.5F ? 1 : 0;  // a quarter of the area
  }
  CHECK(std::abs(mean.x - 1.0 / 3) < 0.01);
  CHECK(std::abs(mean.y - 1.0 / 3) < 0.01);
  CHECK(std::abs(inner - 5000) < 5 * std::sqrt(20000 * 0.25 * 0.75));
}

TEST_CASE("the seed decides, and nothing else") {
  const npt::Mesh mesh = zoo::cube();
  CHECK(npt::resample(mesh, 100, 1) == npt::resample(mesh, 100, 1));
  CHECK(npt::resample(mesh, 100, 1) != npt::resample(mesh, 100, 2));
}

TEST_CASE("the points of a surface don't depend on the vertex order") {
  const npt::Mesh mesh = zoo::mixed();
  npt::Random random(5);
  for (int trial = 0; trial < 5; ++trial) {
    const npt::Mesh other = npt::permute_vertices(mesh, npt::random_permutation(9, random));
    CHECK(npt::resample(other, 200, 11) == npt::resample(mesh, 200, 11));
  }
}

TEST_CASE("few points of a cloud are different vertices, many are all and repeats") {
  npt::Mesh cloud;
  for (int i = 0; i < 50; ++i) cloud.positions.push_back({static_cast<float>(i), 0, 0});
  const auto distinct = [](std::vector<npt::Vec3f> points) {
    std::ranges::sort(points, {}, &npt::Vec3f::x);
    return std::unique(points.begin(), points.end()) - points.begin();
  };
  CHECK(distinct(npt::resample(cloud, 20, 1)) == 20);
  CHECK(distinct(npt::resample(cloud, 49, 2)) == 49);
  const std::vector<npt::Vec3f> more = npt::resample(cloud, 80, 3);
  CHECK(more.size() == 80);
  CHECK(distinct(more) == 50);
  CHECK(std::equal(cloud.positions.begin(), cloud.positions.end(), more.begin()));
}

TEST_CASE("a surface without area falls back to its vertices") {
  const npt::Mesh line = zoo::mesh({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}});
  const std::vector<npt::Vec3f> points = npt::resample(line, 2, 1);
  CHECK(points.size() == 2);
  for (const npt::Vec3f& p : points) CHECK(std::ranges::find(line.positions, p) != line.positions.end());
}

TEST_CASE("triangles without area are never drawn from") {
  const npt::Mesh mesh = zoo::mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {9, 9, 9}}, {{3, 3, 3}, {0, 1, 2}, {3, 3, 3}});
  for (const npt::Vec3f& p : npt::resample(mesh, 1000, 1)) CHECK(p.z == 0);
}

TEST_CASE("no vertices is an error, no points is an empty answer") {
  CHECK_THROWS_AS(npt::resample(npt::Mesh{}, 10, 1), npt::Error);
  CHECK(npt::resample(zoo::cube(), 0, 1).empty());
}
