/// 3 x 3 matrices of double, row by row: rotations, deformation gradients. Eigen's are not used for them: bodies, which
/// need no Eigen otherwise, would take 1.1 s longer to parse in every unit (0.55 s without), and Eigen's symbols don't
/// carry the instruction set, so that one program could not have units for several.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI {

struct Matrix3 {
  std::array<Vec3d, 3> rows{};

  static constexpr Matrix3 identity() { return {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}}; }
  static constexpr Matrix3 from_columns(Vec3d a, Vec3d b, Vec3d c) {
    return {{{{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.z, b.z, c.z}}}};
  }

  constexpr Matrix3 transposed() const { return from_columns(rows[0], rows[1], rows[2]); }
  constexpr double determinant() const { return dot(rows[0], cross(rows[1], rows[2])); }
  /// The sum of the squares of all entries.
  constexpr double squared_norm() const {
    return dot(rows[0], rows[0]) + dot(rows[1], rows[1]) + dot(rows[2], rows[2]);
  }

  friend constexpr Vec3d operator*(const Matrix3& m, Vec3d v) {
    return {dot(m.rows[0], v), dot(m.rows[1], v), dot(m.rows[2], v)};
  }
  friend constexpr Matrix3 operator*(const Matrix3& a, const Matrix3& b) {
    const Matrix3 columns = b.transposed();
    return from_columns(a * columns.rows[0], a * columns.rows[1], a * columns.rows[2]);
  }
  friend constexpr Matrix3 operator*(const Matrix3& m, double s) {
    return {{{m.rows[0] * s, m.rows[1] * s, m.rows[2] * s}}};
  }
  friend constexpr Matrix3 operator+(const Matrix3& a, const Matrix3& b) {
    return {{{a.rows[0] + b.rows[0], a.rows[1] + b.rows[1], a.rows[2] + b.rows[2]}}};
  }
  friend constexpr Matrix3 operator-(const Matrix3& a, const Matrix3& b) { return a + b * -1.0; }
  constexpr Matrix3& operator+=(const Matrix3& b) { return *this = *this + b; }
  friend constexpr bool operator==(const Matrix3&, const Matrix3&) = default;
};

/// a b^T
constexpr Matrix3 outer(Vec3d a, Vec3d b) { return {{{b * a.x, b * a.y, b * a.z}}}; }

}  // namespace npt::inline NPT_ABI
