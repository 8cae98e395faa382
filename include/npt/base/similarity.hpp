/// Similarities: x -> scale rotation x + shift.
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

/// x -> scale rotation x + shift
struct Similarity {
  Matrix3 rotation = Matrix3::identity();
  double scale = 1;
  Vec3d shift;

  constexpr Vec3d operator()(Vec3d p) const { return rotation * p * scale + shift; }
  /// x -> a(b(x))
  friend constexpr Similarity operator*(const Similarity& a, const Similarity& b) {
    return {a.rotation * b.rotation, a.scale * b.scale, a(b.shift)};
  }
  friend constexpr bool operator==(const Similarity&, const Similarity&) = default;
};

/// The similarity that undoes another. Requires a scale that isn't 0.
constexpr Similarity inverse(const Similarity& s) {
  const Matrix3 back = s.rotation.transposed();
  return {back, 1 / s.scale, -(back * s.shift) / s.scale};
}

}  // namespace npt::inline NPT_ABI
