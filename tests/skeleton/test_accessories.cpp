#include <doctest/doctest.h>

#include <npt/skeleton/accessories.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace {

using npt::Vec3d;

/// Boxes; of each all points belong to the same place of a body that is not there.
struct Dressed {
  std::vector<Vec3d> points, places;
  std::vector<npt::Triangle> triangles;
  std::vector<double> distances;

  /// The number of its first point.
  std::uint32_t add(Vec3d centre, Vec3d half, Vec3d place, double distance = 0.01) {
    const auto first = static_cast<std::uint32_t>(points.size());
    for (const std::uint32_t i : {0U, 1U, 2U, 3U, 4U, 5U, 6U, 7U}) {
      const auto sign = [i](std::uint32_t bit) { return (i & bit) != 0 ? 1.0 : -1.0; };
      points.push_back(centre + Vec3d{half.x * sign(1), half.y * sign(2), half.z * sign(4)});
      places.push_back(place);
      distances.push_back(distance);
    }
    for (const std::array<std::uint32_t, 4> q : {std::array{0U, 4U, 6U, 2U},
                                                 {1U, 3U, 7U, 5U},
                                                 {0U, 1U, 5U, 4U},
                                                 {2U, 6U, 7U, 3U},
                                                 {0U, 2U, 3U, 1U},
                                                 {4U, 5U, 7U, 6U}}) {
      triangles.push_back({first + q[0], first + q[1], first + q[2]});
      triangles.push_back({first + q[0], first + q[2], first + q[3]});
    }
    return first;
  }
  std::vector<npt::skeleton::internal::Accessory> misplaced() const {
    std::vector<std::uint32_t> own(points.size());
    std::iota(own.begin(), own.end(), 0U);
    return npt::skeleton::internal::Accessories(points, triangles, {places, own, distances, 0.04}).misplaced();
  }
};

constexpr Vec3d hip{0.1, 0, 0}, hand{0.8, 0.4, 0};

}  // namespace

TEST_CASE("a pouch that was taken for a part of a hand belongs with the trousers that it lies on") {
  Dressed d;
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, hip);
  const std::uint32_t pouch = d.add({0.225, 0, 0}, {0.02, 0.03, 0.025}, hand);
  const auto found = d.misplaced();
  REQUIRE(found.size() == 1);
  CHECK(found[0].points.size() == 8);
  CHECK(found[0].points.front() == pouch);
  // Its inner side.
  CHECK(found[0].contacts.size() == 4);
  for (const auto& [triangle, weights] : found[0].contacts) {
    CHECK(weights[0] + weights[1] + weights[2] == doctest::Approx(1));
    for (const std::uint32_t v : triangle) CHECK(v < pouch);
  }
}

TEST_CASE("what belongs where it lies, lies on nothing or is as large as a hand stays") {
  Dressed d;
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, hip);
  d.add({0.225, 0, 0}, {0.02, 0.03, 0.025}, hip);
  d.add({0.27, 0.2, 0}, {0.02, 0.03, 0.025}, hand);
  const std::uint32_t own_hand = d.add({0.24, -0.2, 0}, {0.03, 0.1, 0.05}, hand);
  CHECK(d.misplaced().empty());
  SUBCASE("unless it stands off the body") {
    for (std::uint32_t p = own_hand; p < own_hand + 8; ++p) d.distances[p] = 0.06;
    CHECK(d.misplaced().size() == 1);
  }
}

TEST_CASE("a mesh of one piece, of small pieces only, and of none") {
  Dressed d;
  CHECK(d.misplaced().empty());
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, hip);
  CHECK(d.misplaced().empty());
  Dressed many;
  for (int i = 0; i < 200; ++i) many.add({0.1 * i, 0, 0}, {0.05, 0.05, 0.05}, i % 2 == 0 ? hip : hand);
  CHECK(many.misplaced().empty());
}
