#include <doctest/doctest.h>

#include <mesh/shapes.hpp>

#include <npt/base/error.hpp>
#include <npt/baseline/fit/fit_target.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace {

using npt::FitTarget;
using npt::Triangle;
using npt::Vec3d;
using shapes::Surface;

/// A closed figure around `centre`.
Surface figure(Vec3d centre = {}) {
  const npt::Mesh mesh = shapes::starfish(12, 16);
  Surface result{shapes::points_of(mesh.coordinates()), npt::triangulate(mesh)};
  for (Vec3d& p : result.points) p += centre;
  return result;
}

Surface turned_inside_out(Surface surface) {
  for (Triangle& t : surface.triangles) std::swap(t[1], t[2]);
  return surface;
}

FitTarget target_of(const Surface& s, std::size_t samples = 300) { return FitTarget(s.points, s.triangles, samples); }

/// The share of triangles whose normal is known, and of these the share that looks away from `centre`.
std::pair<double, double> oriented(const FitTarget& target, const Surface& s, Vec3d centre) {
  double known = 0, outward = 0;
  for (std::uint32_t t = 0; t < target.triangles().size(); ++t) {
    if (!target.oriented(t)) continue;
    known += 1;
    if (dot(target.normal(t), s.points[target.triangles()[t][0]] - centre) > 0) outward += 1;
  }
  return {known / static_cast<double>(target.triangles().size()), outward / known};
}

}  // namespace

TEST_CASE("normals look outwards, however the faces turn") {
  for (const bool inside_out : {false, true}) {
    const Surface s = inside_out ? turned_inside_out(figure()) : figure();
    const auto [known, outward] = oriented(target_of(s), s, {});
    CHECK(known == 1);
    CHECK(outward > 0.95);  // limbs have sides that look back at the centre
  }
}

TEST_CASE("each piece is turned by itself, and one without an inside has no normals") {
  Surface s = figure();
  s.add(turned_inside_out(figure({5, 0, 0})));
  // A flat patch, and a closed figure whose every second face is turned.
  s.add({{{0, 5, 0}, {1, 5, 0}, {1, 6, 0}, {0, 6, 0}}, {{0, 1, 2}, {0, 2, 3}}});
  Surface mixed = figure({0, 0, 5});
  for (std::size_t t = 0; t < mixed.triangles.size(); t += 2) std::swap(mixed.triangles[t][1], mixed.triangles[t][2]);
  const std::size_t figures = s.triangles.size() - 2;
  s.add(mixed);
  const FitTarget target = target_of(s);
  REQUIRE(target.triangles().size() == s.triangles.size());
  for (std::uint32_t t = 0; t < s.triangles.size(); ++t) CHECK(target.oriented(t) == (t < figures));
  for (std::uint32_t t = static_cast<std::uint32_t>(figures / 2); t < figures; ++t) {
    const Vec3d p = s.points[s.triangles[t][0]] - Vec3d{5, 0, 0};
    if (std::abs(p.x) < 0.3) CHECK(dot(target.normal(t), p) > 0);
  }
}

TEST_CASE("triangles without area and unused vertices count for nothing") {
  const Surface good = figure();
  Surface bad = good;
  bad.points.push_back({100, 100, 100});
  bad.triangles.push_back({0, 0, 5});
  bad.triangles.push_back({3, 3, 3});
  const FitTarget a = target_of(good), b = target_of(bad);
  CHECK(a.triangles().size() == b.triangles().size());
  CHECK(a.area() == b.area());
  CHECK(a.centroid() == b.centroid());
  CHECK(length(a.centroid()) < 0.01);
}

TEST_CASE("a mesh without any area is an error that names it") {
  const std::vector<Vec3d> points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  for (const std::vector<Triangle>& triangles : {std::vector<Triangle>{}, {{0, 1, 2}, {1, 1, 1}}}) {
    try {
      const FitTarget target(points, triangles, 10, "hat.obj");
      FAIL("no error");
    } catch (const npt::Error& error) {
      CHECK(error.parts().file == "hat.obj");
    }
  }
}

TEST_CASE("samples lie on the surface, are spread by area, and the first ones far from each other") {
  const Surface s = figure();
  const FitTarget target = target_of(s, 2000);
  const auto drawn = static_cast<double>(target.samples().size());
  REQUIRE(drawn == doctest::Approx(2000).epsilon(0.005));
  double upper = 0;
  for (const FitTarget::Sample& sample : target.samples()) {
    CHECK(target.tree().closest(sample.point).squared_distance < 1e-20);
    CHECK(std::abs(length(sample.normal) - 1) < 1e-12);
    upper += sample.point.x > 0 ? 1 : 0;
  }
  CHECK(std::abs(upper / drawn - 0.5) < 0.03);  // the figure is symmetric
  const auto nearest = [&](std::size_t first, std::size_t count) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = first; i < first + count; ++i)
      for (std::size_t k = first; k < i; ++k)
        least = std::min(least, length(target.samples()[i].point - target.samples()[k].point));
    return least;
  };
  CHECK(nearest(0, 200) > 5 * nearest(1000, 200));
  // The same again.
  const FitTarget again = target_of(s, 2000);
  REQUIRE(again.samples().size() == target.samples().size());
  for (std::size_t i = 0; i < target.samples().size(); ++i)
    CHECK(again.samples()[i].point == target.samples()[i].point);
}
