#include <doctest/doctest.h>

#include <mesh/shapes.hpp>
#include <npt/base/error.hpp>
#include <npt/baseline/skeleton/bone_heat.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

namespace {

using npt::Bone;
using npt::SparseMatrix;
using npt::Triangle;
using npt::Vec3d;
using shapes::Surface;

/// A tube along x from -1 to 1, of radius 0.2, closed by fans.
Surface tube(std::uint32_t rings, std::uint32_t sectors, Vec3d centre = {}) {
  Surface s;
  for (std::uint32_t i = 0; i < rings; ++i)
    for (std::uint32_t k = 0; k < sectors; ++k) {
      const double a = 2 * std::numbers::pi * k / sectors;
      s.points.push_back(centre + Vec3d{-1 + 2.0 * i / (rings - 1), 0.2 * std::cos(a), 0.2 * std::sin(a)});
    }
  for (std::uint32_t i = 0; i + 1 < rings; ++i)
    for (std::uint32_t k = 0; k < sectors; ++k) {
      const std::uint32_t a = i * sectors + k, b = i * sectors + (k + 1) % sectors;
      s.triangles.push_back({a, b, b + sectors});
      s.triangles.push_back({a, b + sectors, a + sectors});
    }
  for (const double end : {-1.0, 1.0}) {
    const auto middle = static_cast<std::uint32_t>(s.points.size());
    s.points.push_back(centre + Vec3d{end, 0, 0});
    const std::uint32_t first = end < 0 ? 0 : (rings - 1) * sectors;
    for (std::uint32_t k = 0; k < sectors; ++k) {
      const std::uint32_t a = first + k, b = first + (k + 1) % sectors;
      s.triangles.push_back(end < 0 ? Triangle{middle, b, a} : Triangle{middle, a, b});
    }
  }
  return s;
}

/// Two bones end to end.
const std::vector<Bone> chain{{{-0.95, 0, 0}, {0, 0, 0}, 0}, {{0, 0, 0}, {0.95, 0, 0}, 1}};

float weight(const SparseMatrix& weights, std::size_t v, std::uint32_t joint) {
  for (std::size_t i = weights.start[v]; i < weights.start[v + 1]; ++i)
    if (weights.column[i] == joint) return weights.value[i];
  return 0;
}

void check_rows(const SparseMatrix& weights, std::size_t vertices, std::size_t joints) {
  REQUIRE(weights.rows == vertices);
  CHECK(weights.columns == joints);
  for (std::size_t v = 0; v < vertices; ++v) {
    CHECK(std::abs(weights.row_sum(v) - 1) < 1e-5);
    for (std::size_t i = weights.start[v]; i < weights.start[v + 1]; ++i) CHECK(weights.value[i] > 0);
  }
}

SparseMatrix weights_of(const Surface& s, const std::vector<Bone>& bones = chain, std::size_t joints = 2) {
  return npt::bone_heat_weights(s.points, s.triangles, bones, joints);
}

}  // namespace

TEST_CASE("weights fall from one bone to the next over about a bone's distance, alike on both sides") {
  const std::uint32_t rings = 41, sectors = 24;
  const Surface s = tube(rings, sectors);
  const SparseMatrix weights = weights_of(s);
  check_rows(weights, s.points.size(), 2);
  const auto along = [&](std::uint32_t ring) { return static_cast<double>(weight(weights, ring * sectors, 1)); };
  for (std::uint32_t i = 0; i + 1 < rings; ++i) CHECK(along(i + 1) >= along(i) - 1e-6);
  for (std::uint32_t i = 0; i < rings; ++i) CHECK(std::abs(along(i) + along(rings - 1 - i) - 1) < 1e-3);
  CHECK(along(0) < 0.01);
  // -w'' + (w - p) / d^2 = 0 along a tube: w = exp(x / d) / 2 on the side of the other bone, d = 0.2.
  for (std::uint32_t i = 5; i < rings / 2; ++i) {
    const double x = -1 + 2.0 * i / (rings - 1);
    CHECK(std::abs(along(i) - 0.5 * std::exp(x / 0.2)) < 0.02);
  }
}

TEST_CASE("a finer mesh gives the same weights") {
  const Surface coarse = tube(21, 12), fine = tube(81, 48);
  const SparseMatrix a = weights_of(coarse), b = weights_of(fine);
  for (std::uint32_t i = 0; i < 21; ++i) CHECK(std::abs(weight(a, i * 12, 1) - weight(b, 4 * i * 48, 1)) < 0.02F);
}

TEST_CASE("a bone that is hidden by the surface warms nothing, though it is the nearest") {
  // Two tubes side by side. The second one's bone lies at its near wall: nearer to the first tube's side than its own
  // bone.
  Surface s = tube(21, 12);
  const std::size_t own = s.points.size();
  s.add(tube(21, 12, {0, 0.45, 0}));
  const std::vector<Bone> bones{{{-0.9, -0.1, 0}, {0.9, -0.1, 0}, 0}, {{-0.9, 0.3, 0}, {0.9, 0.3, 0}, 1}};
  const SparseMatrix weights = weights_of(s, bones);
  for (std::size_t v = 0; v < own; ++v) CHECK(weight(weights, v, 0) > 0.999F);
  for (std::size_t v = own; v < s.points.size(); ++v) CHECK(weight(weights, v, 1) > 0.999F);
}

TEST_CASE("a piece that sees no bone takes the nearest") {
  Surface s = tube(21, 12);
  const std::size_t own = s.points.size();
  // A patch outside, all of whose view of the bones the tube's wall blocks.
  s.add({{{0.5, 0.3, 0}, {0.6, 0.3, 0}, {0.5, 0.3, 0.05}}, {{0, 1, 2}}});
  const SparseMatrix weights = weights_of(s);
  check_rows(weights, s.points.size(), 2);
  for (std::size_t v = own; v < s.points.size(); ++v) CHECK(weight(weights, v, 1) > 0.99F);
}

TEST_CASE("seams, holes, fins, slivers and unused vertices") {
  Surface s = tube(21, 12);
  const SparseMatrix whole = weights_of(s);
  // Every triangle of ring 10 gets vertices of its own, in the same places.
  const std::size_t before = s.points.size();
  std::vector<std::uint32_t> original;
  for (std::size_t t = 10 * 24; t < 11 * 24; ++t)
    for (std::uint32_t& corner : s.triangles[t]) {
      original.push_back(corner);
      s.points.push_back(s.points[corner]);
      corner = static_cast<std::uint32_t>(s.points.size() - 1);
    }
  const SparseMatrix split = weights_of(s);
  check_rows(split, s.points.size(), 2);
  for (std::size_t i = 0; i < original.size(); ++i) {
    CHECK(split.row_sum(before + i) == split.row_sum(original[i]));
    CHECK(weight(split, before + i, 0) == weight(split, original[i], 0));
    CHECK(std::abs(weight(split, original[i], 0) - weight(whole, original[i], 0)) < 1e-5F);
  }
  s.triangles.erase(s.triangles.begin() + 100, s.triangles.begin() + 110);  // a hole
  s.points.push_back({0, 0.6, 0.1});
  s.triangles.push_back({0, 1, static_cast<std::uint32_t>(s.points.size() - 1)});  // a third face at an edge
  s.triangles.push_back({5, 5, 9});
  s.triangles.push_back({7, 7, 7});
  s.points.push_back({-0.5, 3, 0});  // in no face
  const SparseMatrix weights = weights_of(s);
  check_rows(weights, s.points.size(), 2);
  CHECK(weight(weights, s.points.size() - 1, 0) > 0.99F);
}

TEST_CASE("a bone that touches the skin, bones of length zero, and none") {
  const Surface s = tube(21, 12);
  check_rows(weights_of(s, {{s.points[40], s.points[40], 0}, {{0, 0, 0}, {1, 0, 0}, 1}}), s.points.size(), 2);
  CHECK_THROWS_AS(weights_of(s, {}), npt::Error);
}
