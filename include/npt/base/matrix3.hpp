/// 3 x 3 matrices, row by row: rotations, deformation gradients. Eigen's are not used for them: bodies, which
/// need no Eigen otherwise, would take 1.1 s longer to parse in every unit (0.55 s without), and Eigen's symbols don't
/// carry the instruction set, so that one program could not have units for several.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <array>

namespace npt::inline NPT_ABI {

template <class T>
struct BasicMatrix3 {
  std::array<Vec3<T>, 3> rows{};

  static constexpr BasicMatrix3 identity() { return {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}}; }
  static constexpr BasicMatrix3 from_columns(Vec3<T> a, Vec3<T> b, Vec3<T> c) {
    return {{{{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.z, b.z, c.z}}}};
  }

  template <class U>
  constexpr BasicMatrix3<U> as() const {
    return {{{rows[0].template as<U>(), rows[1].template as<U>(), rows[2].template as<U>()}}};
  }
  constexpr std::array<Vec3<T>, 3> columns() const { return transposed().rows; }
  constexpr BasicMatrix3 transposed() const { return from_columns(rows[0], rows[1], rows[2]); }
  constexpr T determinant() const { return dot(rows[0], cross(rows[1], rows[2])); }
  /// The sum of the squares of all entries.
  constexpr T squared_norm() const { return dot(rows[0], rows[0]) + dot(rows[1], rows[1]) + dot(rows[2], rows[2]); }

  friend constexpr Vec3<T> operator*(const BasicMatrix3& m, Vec3<T> v) {
    return {dot(m.rows[0], v), dot(m.rows[1], v), dot(m.rows[2], v)};
  }
  friend constexpr BasicMatrix3 operator*(const BasicMatrix3& a, const BasicMatrix3& b) {
    const BasicMatrix3 columns = b.transposed();
    return from_columns(a * columns.rows[0], a * columns.rows[1], a * columns.rows[2]);
  }
  friend constexpr BasicMatrix3 operator*(const BasicMatrix3& m, T s) {
    return {{{m.rows[0] * s, m.rows[1] * s, m.rows[2] * s}}};
  }
  friend constexpr BasicMatrix3 operator+(const BasicMatrix3& a, const BasicMatrix3& b) {
    return {{{a.rows[0] + b.rows[0], a.rows[1] + b.rows[1], a.rows[2] + b.rows[2]}}};
  }
  friend constexpr BasicMatrix3 operator-(const BasicMatrix3& a, const BasicMatrix3& b) { return a + b * T(-1); }
  constexpr BasicMatrix3& operator+=(const BasicMatrix3& b) { return *this = *this + b; }
  friend constexpr bool operator==(const BasicMatrix3&, const BasicMatrix3&) = default;
};

using Matrix3 = BasicMatrix3<double>;

/// a b^T
constexpr Matrix3 outer(Vec3d a, Vec3d b) { return {{{b * a.x, b * a.y, b * a.z}}}; }

/// What linear algebra calls the cofactors: how normals turn where points move by `m`, up to their length.
constexpr Matrix3 cofactors(const Matrix3& m) {
  return {{{cross(m.rows[1], m.rows[2]), cross(m.rows[2], m.rows[0]), cross(m.rows[0], m.rows[1])}}};
}

/// The rotation that keeps the direction of the first row, and the plane of the first two (Gram and Schmidt).
/// Requires  a positive determinant
NPT_INLINE Matrix3 orthonormal(const Matrix3& m) {
  const Vec3d x = normalised(m.rows[0]), y = normalised(m.rows[1] - x * dot(m.rows[1], x));
  return {{{x, y, cross(x, y)}}};
}

}  // namespace npt::inline NPT_ABI
