#include <doctest/doctest.h>

#include <npt/skin/attachments.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "skin/boxes.hpp"

namespace {

using npt::Vec3d;

/// Boxes; all points of one go with the same joint.
struct Dressed {
  // A trunk with two limbs of three bones.
  static constexpr std::uint32_t trunk = 0, upper = 1, hand = 3, other_hand = 6;
  std::vector<int> parents{-1, 0, 1, 2, 0, 4, 5};
  std::vector<Vec3d> points;
  std::vector<std::uint32_t> joints;
  std::vector<npt::Triangle> triangles;

  /// The number of its first point.
  std::uint32_t add(Vec3d centre, Vec3d half, std::uint32_t joint) {
    joints.insert(joints.end(), 8, joint);
    return boxes::add(centre, half, points, triangles);
  }
  std::vector<npt::skeleton::internal::Attachment> misplaced() const {
    return npt::skeleton::internal::Attachments(points, triangles, joints, parents).misplaced();
  }
};

}  // namespace

TEST_CASE("a pouch that goes with one limb and lies on the other belongs with that") {
  Dressed d;
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::other_hand);
  const std::uint32_t pouch = d.add({0.225, 0, 0}, {0.02, 0.03, 0.025}, Dressed::hand);
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

TEST_CASE("what goes with near joints or lies on nothing stays") {
  Dressed d;
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::trunk);
  d.add({0.225, 0, 0}, {0.02, 0.03, 0.025}, Dressed::upper);
  d.add({0.27, 0.2, 0}, {0.02, 0.03, 0.025}, Dressed::hand);
  CHECK(d.misplaced().empty());
}

TEST_CASE("a hand on a hip stays a hand; a shoe goes with the foot in it") {
  Dressed d;
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::other_hand);
  d.add({0.235, 0, 0}, {0.03, 0.1, 0.05}, Dressed::hand);
  CHECK(d.misplaced().empty());
  Dressed shod;
  shod.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::trunk);
  shod.add({0.5, -0.4, 0}, {0.05, 0.15, 0.06}, Dressed::other_hand);
  const std::uint32_t shoe = shod.add({0.5, -0.4, 0}, {0.06, 0.03, 0.07}, Dressed::hand);
  const auto found = shod.misplaced();
  REQUIRE(found.size() == 1);
  CHECK(found[0].points.front() == shoe);
}

TEST_CASE("a mesh of one piece, of small pieces only, and of none") {
  Dressed d;
  CHECK(d.misplaced().empty());
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::trunk);
  CHECK(d.misplaced().empty());
  Dressed many;
  for (int i = 0; i < 200; ++i)
    many.add({0.1 * i, 0, 0}, {0.05, 0.05, 0.05}, i % 2 == 0 ? Dressed::hand : Dressed::other_hand);
  CHECK(many.misplaced().empty());
}
