// Displacement fields of the shape directions at single places; test_mannequin.cpp has what they do to the body.
#include <doctest/doctest.h>
#include <npt/body/mannequin/shape.hpp>

#include <vector>

using npt::Vec3d;
namespace anatomy = npt::anatomy;

TEST_CASE("between two marks a value runs smoothly, beyond them it stays") {
  const anatomy::Mark marks[] = {{1, 10}, {2, 20}, {3, 0}};
  CHECK(anatomy::between_marks(marks, 0) == 10);
  CHECK(anatomy::between_marks(marks, 1.5) == 15);
  CHECK(anatomy::between_marks(marks, 2) == 20);
  CHECK(anatomy::between_marks(marks, 9) == 0);
}

TEST_CASE("bulges add up and end at their rim") {
  const anatomy::Bulge bulges[] = {{{0, 0, 0}, {1, 2, 1}, 0.5}, {{0, 0, 0}, {1, 1, 1}, 0.25}};
  CHECK(anatomy::total(bulges, {0, 0, 0}) == 0.75);
  CHECK(anatomy::total(bulges, {0, 2, 0}) == 0);
}

TEST_CASE("stature moves away from the pelvis, weight along the normal") {
  const Vec3d n{0, 0, 1}, head{0, 1.7, 0}, belly{0, 1.0, 0.1};
  CHECK(anatomy::shape_displacements(head, n)[0].y > 0.02);
  CHECK(anatomy::shape_displacements(belly, n)[1].z > 0.005);
  CHECK(anatomy::shape_displacements(belly, n)[1].x == 0);
}
