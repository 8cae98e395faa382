/// Affine maps and quaternions, as nodes of a scene have them: x -> linear x + shift.
/// Source    glTF 2.0 specification, section 3.5.3 (transformations), appendix C (interpolation)
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <cmath>

namespace npt::inline NPT_ABI {

/// x -> linear x + shift
struct Affine {
  Matrix3 linear = Matrix3::identity();
  Vec3d shift;

  constexpr Vec3d operator()(Vec3d p) const { return linear * p + shift; }
  /// x -> a(b(x))
  friend constexpr Affine operator*(const Affine& a, const Affine& b) { return {a.linear * b.linear, a(b.shift)}; }
  friend constexpr bool operator==(const Affine&, const Affine&) = default;
};

/// What linear algebra calls the cofactors: how normals turn where points move by `m`, up to their length.
constexpr Matrix3 cofactors(const Matrix3& m) {
  return {{{cross(m.rows[1], m.rows[2]), cross(m.rows[2], m.rows[0]), cross(m.rows[0], m.rows[1])}}};
}

/// The map that undoes another. Requires a determinant that isn't 0.
inline Affine inverse(const Affine& a) {
  const Matrix3 linear = cofactors(a.linear).transposed() * (1 / a.linear.determinant());
  return {linear, -(linear * a.shift)};
}

/// x, y, z, w; a rotation where its length is 1.
struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;

  friend constexpr Quaternion operator+(Quaternion a, Quaternion b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w};
  }
  friend constexpr Quaternion operator*(Quaternion a, double s) { return {a.x * s, a.y * s, a.z * s, a.w * s}; }
  friend constexpr bool operator==(Quaternion, Quaternion) = default;
};

constexpr double dot(Quaternion a, Quaternion b) { return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w; }

/// With length 1; no rotation where it has none. One of length 1 stays as it is, to the bit.
inline Quaternion normalised(Quaternion q) {
  const double n = std::sqrt(dot(q, q));
  if (std::abs(n - 1) < 1e-15) return q;
  return n > 0 ? q * (1 / n) : Quaternion{};
}

/// Requires a unit quaternion.
constexpr Matrix3 matrix_of(Quaternion q) {
  return {{{{1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.z * q.w), 2 * (q.x * q.z + q.y * q.w)},
            {2 * (q.x * q.y + q.z * q.w), 1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z - q.x * q.w)},
            {2 * (q.x * q.z - q.y * q.w), 2 * (q.y * q.z + q.x * q.w), 1 - 2 * (q.x * q.x + q.y * q.y)}}}};
}

/// The unit quaternion of a rotation, w not negative (Shepperd 1978: from the largest of the four).
inline Quaternion quaternion_of(const Matrix3& m) {
  const double a = m.rows[0].x, b = m.rows[1].y, c = m.rows[2].z, trace = a + b + c;
  const double yz = m.rows[2].y - m.rows[1].z, zx = m.rows[0].z - m.rows[2].x, xy = m.rows[1].x - m.rows[0].y;
  const double yx = m.rows[1].x + m.rows[0].y, xz = m.rows[0].z + m.rows[2].x, zy = m.rows[2].y + m.rows[1].z;
  Quaternion q;
  if (trace >= a && trace >= b && trace >= c)
    q = {yz, zx, xy, 1 + trace};
  else if (a >= b && a >= c)
    q = {1 + a - b - c, yx, xz, yz};
  else if (b >= c)
    q = {yx, 1 + b - a - c, zy, zx};
  else
    q = {xz, zy, 1 + c - a - b, xy};
  return normalised(q.w < 0 ? q * -1.0 : q);
}

/// From a to b by the shorter way, at constant speed; t from 0 to 1. Requires unit quaternions.
inline Quaternion slerp(Quaternion a, Quaternion b, double t) {
  double cosine = dot(a, b);
  if (cosine < 0) b = b * -1.0, cosine = -cosine;
  if (cosine > 0.999999) return normalised(a * (1 - t) + b * t);  // so close that sin(angle) loses digits
  const double angle = std::acos(cosine);
  return normalised(a * (std::sin((1 - t) * angle) / std::sin(angle)) + b * (std::sin(t * angle) / std::sin(angle)));
}

}  // namespace npt::inline NPT_ABI
