#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/mesh/closest_point.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace {

using npt::Vec3d;

Vec3d some_point(npt::Random& random) {
  return {random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5};
}

struct Soup {
  std::vector<Vec3d> points;
  std::vector<npt::Triangle> triangles;
};

/// Triangles of all sizes at random, every eighth a segment, every ninth a point.
Soup soup(std::uint32_t count, std::uint64_t seed) {
  npt::Random random(seed);
  Soup result;
  for (std::uint32_t t = 0; t < count; ++t) {
    const Vec3d centre = some_point(random);
    const double size = std::pow(10.0, -2 * random.uniform());
    for (int i = 0; i < 3; ++i) result.points.push_back(centre + size * some_point(random));
    result.triangles.push_back({3 * t, 3 * t + 1, t % 8 == 7 ? 3 * t : 3 * t + 2});
    if (t % 9 == 8) result.triangles.back() = {3 * t, 3 * t, 3 * t};
  }
  return result;
}

/// Triangles of about one size.
Soup small_triangles(std::uint32_t count, std::uint64_t seed) {
  npt::Random random(seed);
  Soup result;
  for (std::uint32_t t = 0; t < count; ++t) {
    const Vec3d centre = some_point(random);
    for (int i = 0; i < 3; ++i) result.points.push_back(centre + 0.1 * some_point(random));
    result.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return result;
}

/// Whether segment ab passes through triangle t, by the point at which it meets the plane.
bool passes(const Soup& s, std::size_t t, Vec3d a, Vec3d b) {
  const auto [i, j, k] = s.triangles[t];
  const Vec3d p = s.points[i], u = s.points[j] - p, v = s.points[k] - p, n = cross(u, v);
  const double from = dot(n, a - p), to = dot(n, b - p);
  if (from * to >= 0) return false;
  const Vec3d q = a + (b - a) * (from / (from - to)) - p;
  const double beta = dot(cross(q, v), n) / dot(n, n), gamma = dot(cross(u, q), n) / dot(n, n);
  return beta >= 0 && gamma >= 0 && beta + gamma <= 1;
}

/// Slow and certain: the least distance over a fine net of weights.
double sampled_distance(Vec3d p, const Soup& soup, std::size_t t) {
  double least = std::numeric_limits<double>::infinity();
  constexpr int n = 60;
  for (int i = 0; i <= n; ++i)
    for (int k = 0; i + k <= n; ++k) {
      const double a = double(i) / n, b = double(k) / n;
      const auto [x, y, z] = soup.triangles[t];
      least = std::min(least, length(soup.points[x] * a + soup.points[y] * b + soup.points[z] * (1 - a - b) - p));
    }
  return least;
}

}  // namespace

TEST_CASE("the tree finds what a look at every triangle finds") {
  const Soup s = soup(300, 1);
  const npt::TriangleTree tree(s.points, s.triangles);
  npt::Random random(2);
  for (int i = 0; i < 400; ++i) {
    const Vec3d p = 2.0 * some_point(random);
    const auto odd = [](std::uint32_t t) { return t % 2 == 1; };
    npt::ClosestPoint all, odd_only;
    for (std::uint32_t t = 0; t < s.triangles.size(); ++t) {
      const auto [a, b, c] = s.triangles[t];
      const auto w = npt::closest_on_triangle(p, s.points[a], s.points[b], s.points[c]);
      REQUIRE(std::abs(w[0] + w[1] + w[2] - 1) < 1e-12);
      const Vec3d q = s.points[a] * w[0] + s.points[b] * w[1] + s.points[c] * w[2];
      const double squared = dot(q - p, q - p);
      if (squared < all.squared_distance) all = {t, w, q, squared};
      if (odd(t) && squared < odd_only.squared_distance) odd_only = {t, w, q, squared};
    }
    CHECK(tree.closest(p).triangle == all.triangle);
    // Two copies of the arithmetic: the compiler may contract them differently.
    CHECK(std::abs(tree.closest(p).squared_distance - all.squared_distance) < 1e-15);
    CHECK(tree.closest(p, odd).triangle == odd_only.triangle);
  }
}

TEST_CASE("no point of a triangle is closer than its closest") {
  const Soup s = soup(60, 3);
  npt::Random random(4);
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const auto [a, b, c] = s.triangles[t];
    const Vec3d p = some_point(random);
    const npt::ClosestPoint found = npt::TriangleTree(s.points, std::vector{s.triangles[t]}).closest(p);
    const double sampled = sampled_distance(p, s, t),
                 size = length(s.points[a] - s.points[b]) + length(s.points[a] - s.points[c]);
    CHECK(std::sqrt(found.squared_distance) <= sampled + 1e-12);
    CHECK(std::sqrt(found.squared_distance) >= sampled - size / 60);
  }
}

TEST_CASE("ties go to the least number; nothing accepted is no triangle") {
  // Eight triangles around the origin, all of which touch it.
  std::vector<Vec3d> points{{0, 0, 0}};
  std::vector<npt::Triangle> triangles;
  for (std::uint32_t i = 0; i < 8; ++i) {
    points.push_back({std::cos(i * 0.785), std::sin(i * 0.785), 0});
    triangles.push_back({0, 1 + i, 1 + (i + 1) % 8});
  }
  const npt::TriangleTree tree(points, triangles);
  CHECK(tree.closest({0, 0, 2}).triangle == 0);
  CHECK(tree.closest({0, 0, 2}, [](std::uint32_t t) { return t > 4; }).triangle == 5);
  CHECK(tree.closest({0, 0, 2}, [](std::uint32_t) { return false; }).triangle == npt::no_index);
  CHECK(npt::TriangleTree({}, {}).closest({0, 0, 0}).triangle == npt::no_index);
}

TEST_CASE("a thousand triangles in one place are no trap") {
  const std::vector<Vec3d> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<npt::Triangle> triangles(1000, npt::Triangle{0, 1, 2});
  CHECK(npt::TriangleTree(points, triangles).closest({0.2, 0.2, 1}).triangle == 0);
}

TEST_CASE("a moved tree answers as a new one") {
  const Soup before = small_triangles(200, 1), after = small_triangles(200, 2);
  npt::TriangleTree tree(before.points, before.triangles);
  tree.move(after.points, after.triangles);
  const npt::TriangleTree fresh(after.points, after.triangles);
  npt::Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Vec3d p = 2.0 * some_point(random);
    const npt::ClosestPoint a = tree.closest(p), b = fresh.closest(p);
    CHECK(a.triangle == b.triangle);
    CHECK(a.point == b.point);
  }
}

TEST_CASE("a hint changes no answer, be it good, bad or nonsense") {
  const Soup s = small_triangles(200, 4);
  const npt::TriangleTree tree(s.points, s.triangles);
  const auto even = [](std::uint32_t t) { return t % 2 == 0; };
  npt::Random random(5);
  for (int i = 0; i < 200; ++i) {
    const Vec3d p = 2.0 * some_point(random);
    const npt::ClosestPoint wanted = tree.closest(p, even);
    for (const std::uint32_t hint : {wanted.triangle, random.below(200), 200U, npt::no_index})
      CHECK(tree.closest(p, even, hint).triangle == wanted.triangle);
  }
}

TEST_CASE("segments cross what a look at every triangle finds") {
  const Soup s = small_triangles(300, 6);
  const npt::TriangleTree tree(s.points, s.triangles);
  npt::Random random(7);
  std::size_t crossings = 0;
  for (int i = 0; i < 400; ++i) {
    const Vec3d a = some_point(random), b = some_point(random);
    const std::uint32_t excepted = random.below(300);
    bool any = false, other = false;
    for (std::size_t t = 0; t < s.triangles.size(); ++t) {
      const bool hit = passes(s, t, a, b);
      any = any || hit;
      other = other || (hit && t != excepted);
    }
    CHECK(tree.crosses(a, b, [](std::uint32_t) { return true; }) == any);
    CHECK(tree.crosses(a, b, [&](std::uint32_t t) { return t != excepted; }) == other);
    crossings += any ? 1 : 0;
  }
  CHECK(crossings > 30);
  CHECK(!npt::TriangleTree({}, {}).crosses({0, 0, 0}, {1, 1, 1}, [](std::uint32_t) { return true; }));
}

TEST_CASE("a tree of points finds what a tree of triangles without extent finds") {
  npt::Random random(11);
  std::vector<npt::Vec3d> points(300);
  std::vector<npt::Triangle> triangles;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    points[i] = i % 7 == 6 ? points[i - 1] : npt::Vec3d{random.normal(), random.normal(), random.normal()};
    triangles.push_back({i, i, i});
  }
  const npt::PointTree tree(points);
  const npt::TriangleTree of_triangles(points, triangles);
  for (int i = 0; i < 200; ++i) {
    const npt::Vec3d p{random.normal(), random.normal(), random.normal()};
    const auto even = [](std::uint32_t k) { return k % 2 == 0; };
    const npt::ClosestPoint a = tree.closest(p, even), b = of_triangles.closest(p, even);
    CHECK(a.triangle == b.triangle);
    CHECK(a.point == points[a.triangle]);
    CHECK(a.squared_distance == doctest::Approx(b.squared_distance).epsilon(1e-12));
    CHECK(tree.closest(p, even, npt::no_index, 0.5 * a.squared_distance).triangle == npt::no_index);
  }
  CHECK(npt::PointTree(std::span<const npt::Vec3d>()).closest({0, 0, 0}).triangle == npt::no_index);
}
