/// Rigid motions: x -> rotation x + shift.
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

/// x -> rotation x + shift
struct Rigid {
  Matrix3 rotation = Matrix3::identity();
  Vec3d shift;

  /// A rotation that leaves a point where it is.
  static constexpr Rigid about(Vec3d point, const Matrix3& rotation) { return {rotation, point - rotation * point}; }

  constexpr Vec3d operator()(Vec3d p) const { return rotation * p + shift; }
  /// x -> a(b(x))
  friend constexpr Rigid operator*(const Rigid& a, const Rigid& b) { return {a.rotation * b.rotation, a(b.shift)}; }
  friend constexpr bool operator==(const Rigid&, const Rigid&) = default;
};

/// The motion that undoes another.
constexpr Rigid inverse(const Rigid& r) {
  const Matrix3 back = r.rotation.transposed();
  return {back, -(back * r.shift)};
}

}  // namespace npt::inline NPT_ABI
