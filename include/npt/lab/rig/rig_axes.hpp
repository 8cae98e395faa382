/// The bind pose's axes in the scene: by which quarter turns a rig's joints are turned on the whole where they stand,
/// and how much its unit is worth.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/lab/rig/rig.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace npt::inline NPT_ABI {

struct RigAxes {
  Matrix3 turn = Matrix3::identity();  ///< from the bind pose's axes to the scene's
  double scale = 1;                    ///< of the bind pose's unit in the scene's
};

namespace rig::internal {

/// Of the 24 rotations that take axes to axes the one most like `m`.
inline Matrix3 quarter_turn_near(const Matrix3& m) {
  const Vec3d axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Matrix3 best = Matrix3::identity();
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b)
      for (int signs = 0; signs < 4 && a != b; ++signs) {
        const Vec3d x = axes[a] * (signs % 2 == 0 ? 1.0 : -1.0), y = axes[b] * (signs < 2 ? 1.0 : -1.0);
        const Matrix3 r{{{x, y, cross(x, y)}}};
        const double like = dot(r.rows[0], m.rows[0]) + dot(r.rows[1], m.rows[1]) + dot(r.rows[2], m.rows[2]);
        if (like > most) most = like, best = r;
      }
  return best;
}

}  // namespace rig::internal

inline RigAxes rig_axes(const Rig& rig) {
  const std::vector<Affine> stands = rig.motions(nullptr, 0);
  Matrix3 sum;
  double volume = 0;
  for (const Affine& a : stands) {
    sum += orthonormal(a.linear);
    volume += std::abs(a.linear.determinant()) / static_cast<double>(stands.size());
  }
  return {rig::internal::quarter_turn_near(sum), std::cbrt(volume)};
}

}  // namespace npt::inline NPT_ABI
