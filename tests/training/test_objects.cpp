#include <doctest/doctest.h>
#include <training/objects.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using npt::ObjectPart;
using npt::Vec3d;

struct Drawn {
  std::vector<npt::Vec3f> points, normals;
};

Drawn draw(const std::vector<ObjectPart>& parts, std::size_t n) {
  Drawn d;
  npt::Random random(3);
  npt::draw_object_points(parts, random, n, d.points, d.normals);
  return d;
}

Vec3d mean(const std::vector<npt::Vec3f>& points) {
  Vec3d sum;
  for (const npt::Vec3f& p : points) sum += p.as<double>();
  return sum / static_cast<double>(points.size());
}

}  // namespace

TEST_CASE("a box's points lie on its faces, by area, with the faces' normals") {
  const Drawn d = draw({{ObjectPart::Kind::box, {5, 0, 0}, {Vec3d{1, 0, 0}, {0, 2, 0}, {0, 0, 3}}, 1}}, 4000);
  REQUIRE(d.points.size() == 4000);
  REQUIRE(d.normals.size() == 4000);
  std::size_t ends = 0;  // faces of normal x: 48 of 88
  for (std::size_t i = 0; i < d.points.size(); ++i) {
    const Vec3d p = d.points[i].as<double>() - Vec3d{5, 0, 0}, n = d.normals[i].as<double>();
    const Vec3d size{1, 2, 3};
    CHECK(dot(p, n) == doctest::Approx(dot(size, Vec3d{std::abs(n.x), std::abs(n.y), std::abs(n.z)})));
    CHECK(std::abs(n.x) + std::abs(n.y) + std::abs(n.z) == doctest::Approx(1));
    ends += std::abs(n.x) > 0.5 ? 1U : 0U;
  }
  CHECK(static_cast<double>(ends) / 4000 == doctest::Approx(48.0 / 88).epsilon(0.06));
}

TEST_CASE("a cone's points lie on it, by area, with normals that lean as its side does") {
  const ObjectPart cone{ObjectPart::Kind::cone, {0, 1, 0}, {Vec3d{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 0};
  const Drawn d = draw({cone}, 4000);
  Vec3d side_sum;
  std::size_t side = 0;
  for (std::size_t i = 0; i < d.points.size(); ++i) {
    const Vec3d p = d.points[i].as<double>(), n = d.normals[i].as<double>();
    if (p.y < 1e-6) {
      CHECK(n.y == doctest::Approx(-1));
      continue;
    }
    ++side, side_sum += p;
    CHECK(std::hypot(p.x, p.z) == doctest::Approx(1 - p.y / 2).epsilon(1e-4));
    CHECK(n.y == doctest::Approx(1 / std::sqrt(5.0)));  // radius 1, height 2
    CHECK(n.x * p.x + n.z * p.z > -1e-6);
  }
  // The side's area is sqrt(5) pi, the floor's pi; a side's centroid lies at a third of the height.
  CHECK(static_cast<double>(side) / 4000 == doctest::Approx(std::sqrt(5.0) / (1 + std::sqrt(5.0))).epsilon(0.05));
  CHECK(side_sum.y / static_cast<double>(side) == doctest::Approx(2.0 / 3).epsilon(0.05));
}

TEST_CASE("an ellipsoid's points lie on it, by area, with its gradient as normals") {
  const Drawn d = draw({{ObjectPart::Kind::ellipsoid, {0, 0, 0}, {Vec3d{1, 0, 0}, {0, 3, 0}, {0, 0, 1}}, 1}}, 4000);
  std::size_t middle = 0;
  for (std::size_t i = 0; i < d.points.size(); ++i) {
    const Vec3d p = d.points[i].as<double>(), gradient = normalised(Vec3d{p.x, p.y / 9, p.z});
    CHECK(p.x * p.x + p.y * p.y / 9 + p.z * p.z == doctest::Approx(1).epsilon(1e-4));
    CHECK(dot(gradient, d.normals[i].as<double>()) == doctest::Approx(1).epsilon(1e-4));
    middle += std::abs(p.y) < 1.5 ? 1U : 0U;
  }
  // A prolate spheroid's area: 2 pi integral sqrt(1 - e^2 y^2 / 9) dy with e^2 = 8 / 9; from -1.5 to 1.5, and whole.
  const auto area = [](double y) {
    double sum = 0;
    for (int i = 0; i < 10000; ++i) {
      const double at = y * (i + 0.5) / 10000;
      sum += std::sqrt(1 - 8.0 / 81 * at * at);
    }
    return sum * y;
  };
  CHECK(static_cast<double>(middle) / 4000 == doctest::Approx(area(1.5) / area(3)).epsilon(0.05));
  CHECK(length(mean(d.points)) < 0.1);
}

TEST_CASE("objects are drawn anew each time, and the same of the same seed; their points are finite, normals units") {
  double highest = 0, lowest = 1e9;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    CAPTURE(seed);
    npt::Random random(seed), again(seed);
    Drawn a, b;
    npt::draw_object_surface(random, 100, a.points, a.normals);
    npt::draw_object_surface(again, 100, b.points, b.normals);
    CHECK(a.points == b.points);
    CHECK(a.normals == b.normals);
    REQUIRE(a.points.size() == 100);
    double high = 0;
    for (std::size_t i = 0; i < 100; ++i) {
      CHECK(is_finite(a.points[i]));
      CHECK(length(a.normals[i].as<double>()) == doctest::Approx(1).epsilon(1e-5));
      high = std::max(high, std::abs(static_cast<double>(a.points[i].y)));
    }
    highest = std::max(highest, high), lowest = std::min(lowest, high);
  }
  CHECK(highest > 1.5);
  CHECK(highest < 8);
  CHECK(lowest < 0.5);
}
