#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/base/rotation.hpp>

#include <cmath>
#include <numbers>

using npt::Matrix3;
using npt::Vec3d;

TEST_CASE("Rodrigues' formula turns about the axis by the angle") {
  CHECK(npt::rotation_matrix({}) == Matrix3::identity());
  const Vec3d axis = normalised(Vec3d{0.3, -1.1, 0.7});
  const Matrix3 r = npt::rotation_matrix(axis * 0.8);
  CHECK((r * r.transposed() - Matrix3::identity()).squared_norm() < 1e-28);
  CHECK(std::abs(r.determinant() - 1) < 1e-14);
  CHECK(length(r * axis - axis) < 1e-14);
  const Vec3d across = normalised(cross(axis, {1, 0, 0}));
  CHECK(std::abs(dot(r * across, across) - std::cos(0.8)) < 1e-14);
  CHECK(std::abs(dot(r * across, cross(axis, across)) - std::sin(0.8)) < 1e-14);
}

TEST_CASE("the axis angle of a rotation gives the rotation back, half turns too") {
  npt::Random random(1);
  for (const double angle : {0.0, 1e-8, 0.5, 3.0, 3.14159, std::numbers::pi}) {
    const Vec3d a = npt::normalised(Vec3d{random.normal(), random.normal(), random.normal()}) * angle;
    const Matrix3 r = npt::rotation_matrix(a);
    const Matrix3 again = npt::rotation_matrix(npt::axis_angle(r));
    CHECK((r - again).squared_norm() < 1e-10);
  }
}

TEST_CASE("a mirrored axis angle turns the mirror image") {
  const Vec3d turn{0.4, -1.2, 0.7}, p{0.3, 0.8, -0.5};
  const Vec3d there = npt::rotation_matrix(turn) * p;
  CHECK(length(npt::rotation_matrix(npt::mirrored(turn)) * Vec3d{-p.x, p.y, p.z} - Vec3d{-there.x, there.y, there.z}) <
        1e-14);
}
