/// Which samples triangles and discs cover.
#include <doctest/doctest.h>

#include <render/rasteriser.hpp>

#include <npt/base/random.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

using npt::Vec3f;

TEST_CASE("triangles that share edges cover each sample of their union, also where edges cross samples") {
  constexpr int size = 40;
  npt::Random random(3);
  // A fan around a point inside the square; its corners lie outside of the picture.
  for (int round = 0; round < 50; ++round) {
    const Vec3f centre{static_cast<float>(random.uniform(5, 35)), static_cast<float>(random.uniform(5, 35)), 0};
    const std::vector<Vec3f> ring{{-9.5F, -7, 0}, {21, -13, 0}, {50, -9, 0}, {52, 20, 0}, {49, 51, 0}, {-11, 47, 0}};
    std::vector<int> hits(size * size);
    for (std::size_t i = 0; i < ring.size(); ++i)
      render::raster_triangle(centre, ring[i], ring[(i + 1) % ring.size()], size, size,
                              [&](int x, int y, float) { ++hits[static_cast<std::size_t>(y * size + x)]; });
    for (int h : hits) REQUIRE(h >= 1);
  }
}

TEST_CASE("a triangle covers its area, whichever way it winds, and interpolates its third coordinate") {
  constexpr int size = 200;
  const Vec3f a{10, 20, 1}, b{190, 30, 2}, c{60, 180, 4};
  const double area = 0.5 * static_cast<double>(cross(b - a, c - a).z);
  for (const bool turned : {false, true}) {
    int count = 0;
    double worst = 0;
    render::raster_triangle(a, turned ? c : b, turned ? b : c, size, size, [&](int x, int y, float z) {
      ++count;
      const Vec3f p{static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, 0};
      const auto part = [&](Vec3f u, Vec3f v) {
        return ((u.x - p.x) * (v.y - p.y) - (u.y - p.y) * (v.x - p.x)) / static_cast<float>(2 * area);
      };
      const float expected = part(b, c) * a.z + part(c, a) * b.z + part(a, b) * c.z;
      worst = std::max(worst, static_cast<double>(std::abs(z - expected)));
    });
    CHECK(std::abs(count - area) < 0.01 * area);
    CHECK(worst < 1e-3);
  }
}

TEST_CASE("what lies outside of the picture or has no area covers nothing, however far away") {
  int count = 0;
  const auto hit = [&](int, int, float) { ++count; };
  render::raster_triangle({-50, 5, 0}, {-20, 9, 0}, {-30, 40, 0}, 20, 20, hit);
  render::raster_triangle({1, 1, 0}, {9, 9, 0}, {5, 5, 0}, 20, 20, hit);
  render::raster_triangle({1e30F, -1e30F, 0}, {2e30F, 5, 0}, {1e30F, 1e30F, 0}, 20, 20, hit);
  render::raster_disc(-30, 4, 5, 20, 20, [&](int, int, float, float) { ++count; });
  CHECK(count == 0);
  render::raster_triangle({-1e30F, -1e30F, 0}, {1e30F, -1e30F, 0}, {0, 1e30F, 0}, 20, 20, hit);
  CHECK(count == 400);
}

TEST_CASE("a disc covers its area and at least one sample") {
  int count = 0;
  const auto hit = [&](int, int, float u, float v) { count += u * u + v * v <= 1 ? 1 : 0; };
  render::raster_disc(50, 50, 20, 100, 100, hit);
  CHECK(std::abs(count - 400 * 3.14159265) < 13);
  count = 0;
  render::raster_disc(50.1F, 50.9F, 0, 100, 100, hit);
  CHECK(count >= 1);
}
