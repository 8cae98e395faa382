#include <doctest/doctest.h>

#include <npt/base/matrix3.hpp>

using npt::Matrix3;
using npt::Vec3d;

TEST_CASE("products, transposes and determinants are those of the definition") {
  constexpr Matrix3 a{{{{1, 2, 3}, {4, 5, 6}, {7, 8, 10}}}},
      b = Matrix3::from_columns({1, 0, 2}, {0, 1, -1}, {3, 0, 1});
  static_assert(a * Vec3d{1, 0, -1} == Vec3d{-2, -2, -3});
  static_assert(a * b == Matrix3{{{{7, -1, 6}, {16, -1, 18}, {27, -2, 31}}}});
  static_assert(a.transposed() == Matrix3::from_columns({1, 2, 3}, {4, 5, 6}, {7, 8, 10}));
  static_assert(a.determinant() == -3);
  static_assert(a * Matrix3::identity() == a);
  static_assert(npt::outer({1, 2, 3}, {4, 5, 6}) == Matrix3{{{{4, 5, 6}, {8, 10, 12}, {12, 15, 18}}}});
  static_assert((a - a * 2.0 + a).squared_norm() == 0);
  static_assert(a.squared_norm() == 1 + 4 + 9 + 16 + 25 + 36 + 49 + 64 + 100);
}

TEST_CASE("columns, cofactors and the nearest axes are those of the definition") {
  constexpr Matrix3 a{{{{1, 2, 3}, {4, 5, 6}, {7, 8, 10}}}};
  static_assert(a.columns()[1] == Vec3d{2, 5, 8});
  static_assert(npt::cofactors(a).transposed() * a == Matrix3::identity() * a.determinant());
  static_assert(a.as<float>().rows[2] == npt::Vec3f{7, 8, 10});
  const Matrix3 r = npt::orthonormal({{{{2, 0, 0}, {1, 3, 0}, {5, 5, 5}}}});
  CHECK(r == Matrix3::identity());
}
