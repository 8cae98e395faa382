#include <doctest/doctest.h>

#include <npt/classic/closest_point.hpp>
#include <npt/core/random.hpp>

#include <cstddef>
#include <cstdint>
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

Soup soup(std::uint32_t count, std::uint64_t seed) {
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

}  // namespace

TEST_CASE("a moved tree answers as a new one") {
  const Soup before = soup(200, 1), after = soup(200, 2);
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
  const Soup s = soup(200, 4);
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
  const Soup s = soup(300, 6);
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
