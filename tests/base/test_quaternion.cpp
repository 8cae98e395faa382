#include <doctest/doctest.h>

#include <npt/base/quaternion.hpp>
#include <npt/base/random.hpp>
#include <npt/base/rotation.hpp>

#include <array>
#include <cmath>
#include <numbers>

namespace {

using npt::Matrix3;
using npt::Quaternion;
using npt::Vec3d;

Quaternion about_z(double angle) { return {0, 0, std::sin(angle / 2), std::cos(angle / 2)}; }

Vec3d random_vector(npt::Random& random) { return {random.normal(), random.normal(), random.normal()}; }

}  // namespace

TEST_CASE("a quaternion becomes its matrix and comes back") {
  for (const Quaternion q : {Quaternion{}, Quaternion{1, 0, 0, 0}, Quaternion{0, 1, 0, 0}, Quaternion{0, 0, 1, 0},
                             Quaternion{0.5, -0.5, 0.5, 0.5}, npt::normalised(Quaternion{0.3, -0.2, 0.1, 0.05})}) {
    const Matrix3 m = npt::matrix_of(q);
    CHECK(std::abs(m.determinant() - 1) < 1e-12);
    const Quaternion back = npt::quaternion_of(m);
    CHECK(std::abs(std::abs(dot(back, q)) - 1) < 1e-12);
    CHECK(back.w >= 0);
  }
  CHECK(length(npt::matrix_of(about_z(std::numbers::pi / 2)) * Vec3d{1, 0, 0} - Vec3d{0, 1, 0}) < 1e-12);
  CHECK(npt::normalised(Quaternion{0, 0, 0, 0}) == Quaternion{});
}

TEST_CASE("components of a rotation stay within 1, whatever rounding did") {
  CHECK(npt::components({0, 0.6, 0, 0.8}) == std::array{0.0, 0.6, 0.0, 0.8});
  CHECK(npt::components({-1.0000000000000002, 0, 0, 1.0000000000000018}) == std::array{-1.0, 0.0, 0.0, 1.0});
}

TEST_CASE("products and inverses of quaternions are those of their matrices") {
  npt::Random random(1);
  for (int i = 0; i < 20; ++i) {
    const Quaternion a = Quaternion{}.turned(random_vector(random)), b = Quaternion{}.turned(random_vector(random));
    const Vec3d p = random_vector(random);
    CHECK((npt::matrix_of(a * b) - npt::matrix_of(a) * npt::matrix_of(b)).squared_norm() < 1e-26);
    CHECK(length((a * b)(p)-a(b(p))) < 1e-13);
    CHECK(length(inverse(a)(a(p)) - p) < 1e-13);
  }
}

TEST_CASE("a quaternion turns points as its matrix does, and turns add up") {
  const Quaternion quarter = Quaternion{}.turned({0, 0, std::numbers::pi / 2});
  CHECK(length(quarter({1, 0, 0}) - Vec3d{0, 1, 0}) < 1e-15);
  CHECK(length(quarter.turned({std::numbers::pi / 2, 0, 0})({1, 0, 0}) - Vec3d{0, 0, 1}) < 1e-15);
  CHECK(quarter.turned({}) == quarter);
  npt::Random random(2);
  for (int i = 0; i < 20; ++i) {
    const Vec3d turn = random_vector(random), p = random_vector(random);
    const Quaternion q = Quaternion{}.turned(turn);
    CHECK(length(q(p) - npt::matrix_of(q) * p) < 1e-13);
    CHECK((npt::matrix_of(q) - npt::rotation_matrix(turn)).squared_norm() < 1e-26);
  }
}

TEST_CASE("a quaternion's axis angle is the turn, of at most half a turn") {
  npt::Random random(3);
  for (const double angle : {0.0, 1e-13, 1e-8, 0.5, 3.0}) {
    const Vec3d turn = npt::normalised(random_vector(random)) * angle;
    const Quaternion q = Quaternion{}.turned(turn);
    CHECK(length(npt::axis_angle(q) - turn) < 1e-12);
    CHECK(length(npt::axis_angle(q * -1.0) - turn) < 1e-12);
  }
  CHECK(length(npt::axis_angle(about_z(1.5 * std::numbers::pi)) - Vec3d{0, 0, -0.5 * std::numbers::pi}) < 1e-12);
}

TEST_CASE("slerp takes the shorter way at constant speed") {
  const Quaternion a = about_z(0), b = about_z(1);
  for (const Quaternion to : {b, b * -1.0}) CHECK(std::abs(dot(npt::slerp(a, to, 0.25), about_z(0.25)) - 1) < 1e-12);
  CHECK(npt::slerp(a, a, 0.5) == a);
}
