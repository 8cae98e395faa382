#include <training/warp.hpp>

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>

#include <doctest/doctest.h>

#include <cstddef>

namespace {

using npt::Random;
using npt::Vec3f;
using npt::data::Warp;

/// Anywhere in a box of a person's size.
Vec3f point_in_box(Random& random) {
  return {static_cast<float>(random.uniform(-0.8, 0.8)), static_cast<float>(random.uniform(-0.9, 0.8)),
          static_cast<float>(random.uniform(-0.2, 0.2))};
}

TEST_CASE("a warp of no region leaves points and edges as they are") {
  const Warp nothing;
  CHECK_FALSE(nothing.any());
  CHECK(nothing({1, 2, 3}) == Vec3f{1, 2, 3});
  CHECK(nothing.carried({1, 2, 3}, {0, 1, 0}) == Vec3f{0, 1, 0});
}

TEST_CASE("edges go where the points at their ends go") {
  Random random(1);
  constexpr float step = 1e-3F;
  for (int k = 0; k < 100; ++k) {
    const Warp warp(random, point_in_box);
    REQUIRE(warp.any());
    const Vec3f p = point_in_box(random), edge = point_in_box(random) * step;
    const Vec3f expected = warp(p + edge * 0.5F) - warp(p - edge * 0.5F);
    CHECK(length(warp.carried(p, edge) - expected) < 0.01F * length(edge) + 1e-6F);
  }
}

TEST_CASE("most warps are alike on both sides, and few points lie where they fold") {
  Random random(2);
  std::size_t alike = 0, folded = 0;
  for (int k = 0; k < 200; ++k) {
    const Warp warp(random, point_in_box);
    bool same = true;
    for (int i = 0; i < 50; ++i) {
      const Vec3f p = point_in_box(random), other = warp({-p.x, p.y, p.z});
      same = same && length(warp(p) - Vec3f{-other.x, other.y, other.z}) < 1e-4F;
      const Vec3f x = warp.carried(p, {1, 0, 0}), y = warp.carried(p, {0, 1, 0}), z = warp.carried(p, {0, 0, 1});
      folded += dot(x, cross(y, z)) <= 0;
    }
    alike += same;
  }
  CHECK(alike > 140);
  CHECK(alike < 190);
  CHECK(folded < 10);  // of 10,000
}

}  // namespace
