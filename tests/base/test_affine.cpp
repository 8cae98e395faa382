#include <doctest/doctest.h>

#include <npt/base/affine.hpp>
#include <npt/base/rotation.hpp>

using npt::Affine;
using npt::Vec3d;

TEST_CASE("affine maps compose and invert") {
  const Affine a{{{{{1, 2, 0}, {0, 3, 1}, {2, 0, 1}}}}, {1, 2, 3}},
      b{{{{{0, 1, 0}, {1, 0, 0}, {0, 0, -2}}}}, {0, 5, 0}};
  const Vec3d p{1, -2, 3};
  CHECK(a(p) == Vec3d{-2, -1, 8});
  CHECK((a * b)(p) == a(b(p)));
  CHECK(length(inverse(a)(a(p)) - p) < 1e-12);
  CHECK(length(inverse(b)(b(p)) - p) < 1e-12);
}

TEST_CASE("rigid motions and similarities are affine maps") {
  const npt::Rigid rigid{npt::rotation_matrix({0.3, -1.1, 0.7}), {4, -5, 6}};
  const npt::Similarity similarity{rigid.rotation, 3, {1, 0, 2}};
  const Vec3d p{1, 2, 3};
  CHECK(affine_of(rigid)(p) == rigid(p));
  CHECK(length(affine_of(similarity)(p) - similarity(p)) < 1e-13);
}

TEST_CASE("an affine map in float is the rounded one") {
  const Affine a{npt::rotation_matrix({0.3, -1.1, 0.7}), {4, -5, 6}};
  const npt::BasicAffine<float> rounded = a.as<float>();
  CHECK(rounded.linear.rows[1].x == static_cast<float>(a.linear.rows[1].x));
  CHECK(length(rounded({1, 2, 3}).as<double>() - a({1, 2, 3})) < 1e-5);
}
