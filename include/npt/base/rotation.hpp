/// Rotations as axis angles: the axis times the angle in radians, and the matrix.
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace npt::inline NPT_ABI {

/// Rodrigues' formula. The result is exactly the identity for the zero vector.
NPT_INLINE Matrix3 rotation_matrix(Vec3d axis_angle) {
  const double angle = length(axis_angle);
  if (angle == 0.0) return Matrix3::identity();
  const Vec3d a = axis_angle / angle;
  const double s = std::sin(angle), c = std::cos(angle), k = 1.0 - c;
  return {{{{c + a.x * a.x * k, a.x * a.y * k - a.z * s, a.x * a.z * k + a.y * s},
            {a.y * a.x * k + a.z * s, c + a.y * a.y * k, a.y * a.z * k - a.x * s},
            {a.z * a.x * k - a.y * s, a.z * a.y * k + a.x * s, c + a.z * a.z * k}}}};
}

/// The mirror image at x of an axis angle: of a turn by which left and right are exchanged.
constexpr Vec3d mirrored(Vec3d axis_angle) { return {axis_angle.x, -axis_angle.y, -axis_angle.z}; }

/// The axis angle of a rotation, of at most half a turn.
NPT_INLINE Vec3d axis_angle(const Matrix3& r) {
  const Vec3d skew{r.rows[2].y - r.rows[1].z, r.rows[0].z - r.rows[2].x, r.rows[1].x - r.rows[0].y};
  const double sine = length(skew) / 2, cosine = (r.rows[0].x + r.rows[1].y + r.rows[2].z - 1) / 2;
  const double angle = std::atan2(sine, cosine);
  if (sine > 1e-6) return skew * (angle / (2 * sine));
  if (cosine > 0) return skew * 0.5;
  // Half a turn: r + I = 2 a a^T.
  const std::array<double, 3> d{r.rows[0].x, r.rows[1].y, r.rows[2].z};
  const std::size_t k = static_cast<std::size_t>(std::max_element(d.begin(), d.end()) - d.begin());
  const Vec3d e{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
  return normalised(r.transposed() * e + e) * std::numbers::pi;
}

}  // namespace npt::inline NPT_ABI
