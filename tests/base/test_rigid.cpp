#include <doctest/doctest.h>

#include <npt/base/rigid.hpp>
#include <npt/base/rotation.hpp>

using npt::Rigid;
using npt::Vec3d;

TEST_CASE("rigid motions compose and invert") {
  const Rigid m{npt::rotation_matrix({0.3, -1.1, 0.7}), {4, -5, 6}}, n{npt::rotation_matrix({2, 0, 1}), {1, 0, 2}};
  const Vec3d p{1, 2, 3};
  CHECK(length(inverse(m)(m(p)) - p) < 1e-12);
  CHECK(length((m * n)(p)-m(n(p))) < 1e-12);
  CHECK(Rigid{}(p) == p);
}

TEST_CASE("a rotation about a point leaves the point where it is") {
  const Vec3d point{1, -2, 3}, p{5, 5, 5};
  const Rigid m = Rigid::about(point, npt::rotation_matrix({0, 0.5, 0}));
  CHECK(length(m(point) - point) < 1e-14);
  CHECK(length(m(p) - point) == doctest::Approx(length(p - point)));
}
