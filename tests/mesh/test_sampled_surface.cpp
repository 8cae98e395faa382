#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/mesh/sampled_surface.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace {

using npt::Vec3d;

/// A unit square of two triangles, and one of an area nine times as large beside it.
const std::vector<Vec3d> points{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {5, 0, 0}, {8, 0, 0}, {8, 3, 0}, {5, 3, 0}};
const std::vector<npt::Triangle> triangles{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}, {0, 0, 1}};

}  // namespace

TEST_CASE("samples lie on the surface, are spread by area, and have its triangles' normals") {
  const npt::SampledSurface surface(points, triangles, 1000);
  REQUIRE(surface.samples().size() == 1000);
  CHECK(surface.area() == doctest::Approx(10));
  std::size_t small = 0, small_of_first = 0;
  for (std::size_t i = 0; i < 1000; ++i) {
    const auto& s = surface.samples()[i];
    CHECK(s.point.z == 0);
    CHECK(s.normal.z == doctest::Approx(1));
    small += s.point.x <= 1;
    if (i < 200) small_of_first += s.point.x <= 1;
  }
  CHECK(small == 100);
  CHECK(small_of_first > 5);
  CHECK(small_of_first < 40);
  const npt::ClosestPoint c = surface.tree().closest(surface.samples()[17].point);
  CHECK(c.triangle == 17);
}

TEST_CASE("the same mesh gives the same samples") {
  const npt::SampledSurface a(points, triangles, 500), b(points, triangles, 500);
  for (std::size_t i = 0; i < 500; ++i) {
    CHECK(a.samples()[i].point == b.samples()[i].point);
    CHECK(a.samples()[i].normal == b.samples()[i].normal);
  }
}

TEST_CASE("samples move with the surface") {
  const npt::SampledSurface before(points, triangles, 100);
  std::vector<Vec3d> turned;
  for (const Vec3d p : points) turned.push_back(Vec3d{-p.y, p.x, 2} * 3.0);
  const npt::SampledSurface after = before.moved(turned, triangles);
  for (std::size_t i = 0; i < 100; ++i) {
    const Vec3d p = before.samples()[i].point;
    CHECK(length(after.samples()[i].point - Vec3d{-p.y, p.x, 2} * 3.0) < 1e-12);
    CHECK(after.tree().closest(after.samples()[i].point).triangle == i);
  }
}

TEST_CASE("a mesh without area or with a coordinate that is no number is an error that names it") {
  const auto expect_error = [](const std::vector<Vec3d>& p, const std::vector<npt::Triangle>& t) {
    try {
      npt::SampledSurface(p, t, 10, "hat.ply");
      FAIL("no error");
    } catch (const npt::Error& error) {
      CHECK(error.parts().file == "hat.ply");
    }
  };
  expect_error(points, {});
  expect_error(points, {{0, 0, 1}});
  std::vector<Vec3d> broken = points;
  broken[2].y = std::numeric_limits<double>::quiet_NaN();
  expect_error(broken, triangles);
}
