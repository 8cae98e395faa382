// Lofts as implicit surfaces: inside and outside, mirror images, gradients.
#include <doctest/doctest.h>
#include <npt/body/mannequin/loft.hpp>

#include <cmath>
#include <vector>

namespace {

using npt::Vec3d;
using npt::anatomy::BlendedLofts;
using npt::anatomy::Loft;

/// A round bar of radius 0.1 along y around x = 0.5, from y = 0 to 1.
Loft bar(bool paired) {
  const npt::anatomy::Section sections[] = {{0, 0.5, 0, 0.1, 0.1, 0.1, 0.1, 0}, {1, 0.5, 0, 0.1, 0.1, 0.1, 0.1, 0}};
  return {{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}}, sections, 0.1, 0.1, 0.05, paired};
}

}  // namespace

TEST_CASE("a loft is negative inside, positive outside, and its distance to the surface near it") {
  const Loft loft = bar(false);
  CHECK(loft({0.5, 0.5, 0}) < 0);
  CHECK(loft({0.58, 0.5, 0}) == doctest::Approx(-0.02));
  CHECK(loft({0.63, 0.5, 0}) == doctest::Approx(0.03));
  CHECK(loft({0.5, 1.15, 0}) == doctest::Approx(0.05));  // beyond the cap
}

TEST_CASE("box_distance never exceeds the distance") {
  const Loft loft = bar(false);
  for (const Vec3d p : {Vec3d{0.5, 0.5, 0}, Vec3d{0.9, 0.5, 0}, Vec3d{0.5, 2, 0}, Vec3d{0, 0, 1}})
    CHECK(loft.box_distance(p) <= std::max(loft(p), 0.0));
}

TEST_CASE("only a paired loft has a mirror image") {
  CHECK(BlendedLofts({bar(true)})({-0.5, 0.5, 0}) < 0);
  CHECK(BlendedLofts({bar(false)})({-0.5, 0.5, 0}) > 0.5);
}

TEST_CASE("the gradient near a surface is its outward normal") {
  const Vec3d g = npt::anatomy::gradient(bar(false), {0.5, 0.5, 0.11});
  CHECK(length(g - Vec3d{0, 0, 1}) < 1e-3);
}

TEST_CASE("a frame has orthonormal directions") {
  const npt::anatomy::LocalFrame frame = npt::anatomy::make_frame({1, 2, 3}, {0, 0, 2}, {1, 1, 1});
  CHECK(frame.axis == Vec3d{0, 0, 1});
  CHECK(length(frame.u) == doctest::Approx(1));
  CHECK(std::abs(dot(frame.u, frame.axis)) < 1e-15);
  CHECK(length(frame.v - cross(frame.axis, frame.u)) < 1e-15);
}
