#include <doctest/doctest.h>

#include <npt/skin/rigid_pieces.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "skin/boxes.hpp"

namespace {

using npt::Vec3d;

/// Boxes; all points of one follow the same joint.
struct Dressed {
  // A trunk with two limbs of three bones.
  static constexpr std::uint32_t trunk = 0, upper = 1, hand = 3, other_hand = 6;
  std::vector<int> parents{-1, 0, 1, 2, 0, 4, 5};
  std::vector<Vec3d> points;
  std::vector<std::uint32_t> joints;
  std::vector<bool> certain;
  std::vector<npt::Triangle> triangles;

  /// The number of its first point.
  std::uint32_t add(Vec3d centre, Vec3d half, std::uint32_t joint, bool own = true) {
    joints.insert(joints.end(), 8, joint);
    certain.insert(certain.end(), 8, own);
    return boxes::add(centre, half, points, triangles);
  }
  std::vector<float> weights() const {
    std::vector<float> rows(points.size() * parents.size());
    for (std::size_t p = 0; p < points.size(); ++p) rows[p * parents.size() + joints[p]] = 1;
    return rows;
  }
  std::vector<float> moved() const {
    std::vector<float> rows = weights();
    npt::skeleton::internal::RigidPieces(points, triangles, parents, certain).move(rows, parents.size());
    return rows;
  }
  /// The least weight of a joint at a box's points.
  float least(std::uint32_t first, std::uint32_t joint) const {
    const std::vector<float> rows = moved();
    float result = 1;
    for (std::size_t p = first; p < first + 8; ++p) result = std::min(result, rows[p * parents.size() + joint]);
    return result;
  }
};

}  // namespace

TEST_CASE("a pouch that follows one limb and lies on the other follows that, and nothing else changes") {
  Dressed d;
  const std::uint32_t limb = d.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::other_hand);
  const std::uint32_t pouch = d.add({0.225, 0, 0}, {0.02, 0.03, 0.025}, Dressed::hand);
  CHECK(d.least(pouch, Dressed::other_hand) > 0.999F);
  CHECK(d.least(limb, Dressed::other_hand) == 1);
}

TEST_CASE("what follows near joints or lies on nothing keeps its weights") {
  Dressed d;
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::trunk);
  d.add({0.225, 0, 0}, {0.02, 0.03, 0.025}, Dressed::upper);
  d.add({0.27, 0.2, 0}, {0.02, 0.03, 0.025}, Dressed::hand);
  CHECK(d.moved() == d.weights());
}

TEST_CASE("a hand on a hip stays a hand; a shoe follows the foot in it") {
  Dressed d;
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::other_hand);
  d.add({0.235, 0, 0}, {0.03, 0.1, 0.05}, Dressed::hand);
  CHECK(d.moved() == d.weights());
  Dressed shod;
  shod.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::trunk);
  shod.add({0.5, -0.4, 0}, {0.05, 0.15, 0.06}, Dressed::other_hand);
  const std::uint32_t shoe = shod.add({0.5, -0.4, 0}, {0.06, 0.03, 0.07}, Dressed::hand);
  CHECK(shod.least(shoe, Dressed::other_hand) > 0.999F);
}

TEST_CASE("a sword follows the hand that its hilt is in, though its blade passes a thigh") {
  Dressed d;
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::trunk);
  d.add({0.5, 0, 0}, {0.05, 0.1, 0.05}, Dressed::hand);
  d.add({0.3, -0.9, 0}, {0.1, 0.3, 0.1}, Dressed::other_hand);
  const std::uint32_t blade = d.add({0.5, -0.62, 0}, {0.01, 0.48, 0.01}, Dressed::other_hand, false);
  const std::uint32_t guard = d.add({0.5, -0.13, 0}, {0.03, 0.012, 0.03}, Dressed::trunk, false);
  const std::uint32_t hilt = d.add({0.5, -0.05, 0}, {0.045, 0.075, 0.045}, Dressed::trunk, false);
  for (const std::uint32_t part : {blade, guard, hilt}) CHECK(d.least(part, Dressed::hand) > 0.9F);
}

TEST_CASE("a loose piece follows as a whole what is nearest to it, however far that is") {
  Dressed d;
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::trunk);
  d.add({1, 0, 0}, {0.2, 0.5, 0.2}, Dressed::hand);
  const std::uint32_t loose = d.add({0, 0.9, 0}, {0.3, 0.1, 0.1}, Dressed::hand, false);
  CHECK(d.least(loose, Dressed::trunk) > 0.99F);
}

TEST_CASE("a mesh of one piece, of small pieces only, of uncertain ones only, and of none") {
  Dressed d;
  CHECK(d.moved().empty());
  d.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::trunk);
  CHECK(d.moved() == d.weights());
  Dressed many;
  for (int i = 0; i < 200; ++i)
    many.add({0.1 * i, 0, 0}, {0.05, 0.05, 0.05}, i % 2 == 0 ? Dressed::hand : Dressed::other_hand);
  CHECK(many.moved() == many.weights());
  Dressed vague;
  vague.add({0, 0, 0}, {0.2, 0.5, 0.2}, Dressed::trunk, false);
  CHECK(vague.moved() == vague.weights());
}
