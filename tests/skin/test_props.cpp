#include <doctest/doctest.h>

#include <npt/skin/props.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "skin/boxes.hpp"

namespace {

using npt::Vec3d;

/// Boxes before a body that is not there: all stand off it but what is said to lie along it.
struct Things {
  std::vector<Vec3d> points;
  std::vector<npt::Triangle> triangles;
  std::vector<double> distances;
  std::array<std::vector<Vec3d>, 2> hands{{{{0.5, 0, 0}}, {{-0.5, 0, 0}}}};

  /// The number of its first point.
  std::uint32_t add(Vec3d centre, Vec3d half, double distance = 0.2) {
    distances.insert(distances.end(), 8, distance);
    return boxes::add(centre, half, points, triangles);
  }
  std::optional<std::size_t> side(std::uint32_t point) const {
    return npt::skeleton::internal::Props(points, triangles, distances, 0.04, hands).side(point);
  }
};

}  // namespace

TEST_CASE("a blade that begins at a hand is held by it, with the guard beside it; what is elsewhere isn't") {
  Things t;
  const std::uint32_t body = t.add({0, 0, -0.5}, {0.3, 0.9, 0.3}, 0.01);
  const std::uint32_t blade = t.add({0.95, 0, 0}, {0.4, 0.02, 0.01}), guard = t.add({0.54, 0, 0}, {0.02, 0.03, 0.02});
  const std::uint32_t left_behind = t.add({0.54, 0.5, 0}, {0.02, 0.03, 0.02});
  const std::uint32_t antenna = t.add({0, 1.4, 0}, {0.01, 0.4, 0.01});
  const std::uint32_t crate = t.add({-0.65, 0, 0}, {0.1, 0.1, 0.1});
  CHECK(t.side(blade) == 0);
  CHECK(t.side(guard) == 0);
  for (const std::uint32_t other : {body, left_behind, antenna, crate}) CHECK_FALSE(t.side(other));
}

TEST_CASE("the other hand's blade; one between both hands, and one that lies along the body, are nobody's") {
  Things t;
  t.add({0, 0, -0.5}, {0.3, 0.9, 0.3}, 0.01);
  const std::uint32_t right = t.add({-0.95, 0, 0}, {0.4, 0.02, 0.01});
  CHECK(t.side(right) == 1);
  t.hands[1] = {{-1.4, 0.05, 0}};
  t.hands[0] = {{-0.5, 0, 0}};
  CHECK_FALSE(t.side(right));
  t.hands[0] = {{0.5, 0, 0}};
  CHECK(t.side(right) == 1);
  for (std::uint32_t p = right; p < right + 8; ++p) t.distances[p] = 0.01;
  CHECK_FALSE(t.side(right));
}
