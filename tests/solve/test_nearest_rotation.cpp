#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/solve/nearest_rotation.hpp>

#include <array>
#include <cmath>
#include <limits>

namespace {

using npt::Quaternion;
using npt::Vec3d;
using Columns = std::array<Vec3d, 3>;

constexpr Columns unit{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

Quaternion random_rotation(npt::Random& random) {
  const Vec3d axis = npt::normalised(Vec3d{random.normal(), random.normal(), random.normal()});
  return Quaternion{}.turned(axis * random.uniform(0, 3.14159265358979));
}

/// The largest entry of the difference of two rotations' matrices.
double apart(const Quaternion& a, const Quaternion& b) {
  double worst = 0;
  for (std::size_t c = 0; c < 3; ++c)
    worst = std::max(worst, npt::length(matrix_of(a).columns()[c] - matrix_of(b).columns()[c]));
  return worst;
}

double agreement(const Quaternion& r, const Columns& a) {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += npt::dot(matrix_of(r).columns()[c], a[c]);
  return sum;
}

}  // namespace

TEST_CASE("the nearest rotation of a stretched rotation is that rotation, from any start") {
  npt::Random random(2);
  for (int i = 0; i < 300; ++i) {
    const Quaternion wanted = random_rotation(random), axes = random_rotation(random);
    // wanted * (symmetric with positive eigenvalues)
    const Vec3d stretch{std::exp(random.normal()), std::exp(random.normal()), std::exp(random.normal())};
    Columns a;
    for (std::size_t c = 0; c < 3; ++c) {
      const Columns q = matrix_of(axes).columns();
      const Vec3d e = unit[c];
      const Vec3d symmetric = q[0] * (stretch.x * npt::dot(q[0], e)) + q[1] * (stretch.y * npt::dot(q[1], e)) +
                              q[2] * (stretch.z * npt::dot(q[2], e));
      a[c] = wanted(symmetric) * 1e-6;
    }
    CHECK(apart(npt::nearest_rotation(a), wanted) < 1e-6);
    CHECK(apart(npt::nearest_rotation(a, random_rotation(random)), wanted) < 1e-6);
  }
}

TEST_CASE("half a turn away, the start is left") {
  for (const Vec3d turn : {Vec3d{3.14159265358979, 0, 0}, {0, 3.14159265358979, 0}, {0, 0, 3.14159265358979}}) {
    const Quaternion wanted = Quaternion{}.turned(turn);
    CHECK(apart(npt::nearest_rotation(matrix_of(wanted).columns()), wanted) < 1e-6);
  }
  // The way uphill ended on a saddle for 44 of 50 such matrices of rank 2.
  npt::Random random(4);
  for (int i = 0; i < 300; ++i) {
    const Vec3d axis = npt::normalised(Vec3d{random.normal(), random.normal(), random.normal()});
    const Quaternion wanted = Quaternion{}.turned(axis * 3.14159265358979);
    Columns a{};
    for (int k = 0; k < 5; ++k) {
      const Vec3d p{random.normal(), random.normal(), i % 2 == 0 ? 0 : random.normal()}, q = wanted(p);
      a[0] += q * p.x, a[1] += q * p.y, a[2] += q * p.z;
    }
    CHECK(apart(npt::nearest_rotation(a, {}, 60), wanted) < 1e-6);
  }
}

TEST_CASE("reflections and matrices of low rank have a nearest rotation; nothing that is tried is nearer") {
  npt::Random random(3);
  const Columns mirror{{{-2, 0, 0}, {0, 1, 0}, {0, 0, 1.5}}}, line{{{0, 2, 0}, {}, {}}},
      plane{{{0, 1, 0}, {0, 0, 2}, {}}};
  for (const Columns& a : {mirror, line, plane}) {
    const Quaternion found = npt::nearest_rotation(a);
    for (int i = 0; i < 200; ++i) CHECK(agreement(random_rotation(random), a) < agreement(found, a) + 1e-9);
  }
}

TEST_CASE("zeros leave the start, NaN ends") {
  const Quaternion start = Quaternion{}.turned({0.1, 0.2, 0.3});
  CHECK(apart(npt::nearest_rotation({}, start), start) < 1e-15);
  Columns broken = unit;
  broken[1].y = std::numeric_limits<double>::quiet_NaN();
  (void)npt::nearest_rotation(broken);
}
