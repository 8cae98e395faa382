/// Quaternions, and rotations as quaternions of length 1.
/// Source    glTF 2.0 specification, section 3.5.3 (transformations), appendix C (interpolation)
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace npt::inline NPT_ABI {

/// x, y, z, w; a rotation where its length is 1.
struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;

  /// The rotation of a point. Requires length 1.
  constexpr Vec3d operator()(Vec3d p) const {
    const Vec3d axis{x, y, z}, t = cross(axis, p) * 2.0;
    return p + t * w + cross(axis, t);
  }
  /// This rotation, and then a turn by the vector `turn`: its axis times its angle in radians. Has length 1.
  Quaternion turned(Vec3d turn) const {
    const double angle = length(turn);
    if (angle == 0) return *this;
    const Vec3d t = turn * (std::sin(angle / 2) / angle);
    const Quaternion r = Quaternion{t.x, t.y, t.z, std::cos(angle / 2)} * *this;
    const double n = std::sqrt(r.w * r.w + r.x * r.x + r.y * r.y + r.z * r.z);
    return {r.x / n, r.y / n, r.z / n, r.w / n};
  }

  /// As rotations: b, and then a. Sums of products with some signs turned, instead of differences: where sums and
  /// differences take turns, g++ 12 rounds once for both, in spite of -ffp-contract=off (vfmsubadd).
  friend constexpr Quaternion operator*(Quaternion a, Quaternion b) {
    const Vec3d n{-a.x, -a.y, -a.z};
    return {a.w * b.x + a.x * b.w + a.y * b.z + n.z * b.y, a.w * b.y + n.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y + n.y * b.x + a.z * b.w, a.w * b.w + n.x * b.x + n.y * b.y + n.z * b.z};
  }
  friend constexpr Quaternion operator+(Quaternion a, Quaternion b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w};
  }
  friend constexpr Quaternion operator*(Quaternion a, double s) { return {a.x * s, a.y * s, a.z * s, a.w * s}; }
  friend constexpr bool operator==(Quaternion, Quaternion) = default;
};

/// The rotation that undoes another.
constexpr Quaternion inverse(Quaternion q) { return {-q.x, -q.y, -q.z, q.w}; }

constexpr double dot(Quaternion a, Quaternion b) { return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w; }

/// With length 1; no rotation where it has none. One of length 1 stays as it is, to the bit.
inline Quaternion normalised(Quaternion q) {
  const double n = std::sqrt(dot(q, q));
  if (std::abs(n - 1) < 1e-15) return q;
  return n > 0 ? q * (1 / n) : Quaternion{};
}

/// [x, y, z, w] of a rotation, none beyond 1: rounding lifts some by 2e-15, which glTF's validator calls an error.
constexpr std::array<double, 4> components(Quaternion rotation) {
  const auto bounded = [](double v) { return std::clamp(v, -1.0, 1.0); };
  return {bounded(rotation.x), bounded(rotation.y), bounded(rotation.z), bounded(rotation.w)};
}

/// The shortest turn from one direction to another; none for the same.
inline Quaternion turn_between(Vec3d from, Vec3d to) {
  const Vec3d a = normalised(from), b = normalised(to), axis = cross(a, b);
  const double cosine = dot(a, b);
  if (length(axis) < 1e-12) return {};
  return normalised(Quaternion{axis.x, axis.y, axis.z, 1 + cosine});
}

/// Requires a unit quaternion.
constexpr Matrix3 matrix_of(Quaternion q) {
  return {{{{1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.z * q.w), 2 * (q.x * q.z + q.y * q.w)},
            {2 * (q.x * q.y + q.z * q.w), 1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z - q.x * q.w)},
            {2 * (q.x * q.z - q.y * q.w), 2 * (q.y * q.z + q.x * q.w), 1 - 2 * (q.x * q.x + q.y * q.y)}}}};
}

/// The axis times the angle of a rotation, of at most half a turn. Requires a unit quaternion.
NPT_INLINE Vec3d axis_angle(Quaternion q) {
  if (q.w < 0) q = q * -1.0;
  const Vec3d axis{q.x, q.y, q.z};
  const double sine = length(axis);
  return axis * (sine < 1e-12 ? 2.0 : 2 * std::atan2(sine, q.w) / sine);
}

/// The unit quaternion of a rotation, w not negative (Shepperd 1978: from the largest of the four).
NPT_INLINE Quaternion quaternion_of(const Matrix3& m) {
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
NPT_INLINE Quaternion slerp(Quaternion a, Quaternion b, double t) {
  double cosine = dot(a, b);
  if (cosine < 0) b = b * -1.0, cosine = -cosine;
  if (cosine > 0.999999) return normalised(a * (1 - t) + b * t);  // so close that sin(angle) loses digits
  const double angle = std::acos(cosine);
  return normalised(a * (std::sin((1 - t) * angle) / std::sin(angle)) + b * (std::sin(t * angle) / std::sin(angle)));
}

}  // namespace npt::inline NPT_ABI
