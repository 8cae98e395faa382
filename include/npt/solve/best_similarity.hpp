/// The similarity (rotation, scale, shift) that fits one list of points to another best.
///   minimise sum over i of |scale * rotation * from_i + shift - to_i|^2 / scale, which treats both lists alike
/// Points that leave the rotation open (fewer than three, or all on a line) get none, and points in one place no scale.
/// Source    Umeyama, "Least-squares estimation of transformation parameters between two point patterns", 1991; the
///           symmetric scale is that of Horn, "Closed-form solution of absolute orientation using unit quaternions",
///           1987
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/similarity.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/solve/nearest_rotation.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <span>

namespace npt::inline NPT_ABI {

/// The similarity that takes `from` to `to` best.
/// Requires  as many points in `to` as in `from`, at least one
NPT_INLINE Similarity best_similarity(std::span<const Vec3d> from, std::span<const Vec3d> to) {
  NPT_ASSERT(from.size() == to.size() && !from.empty());
  const auto count = static_cast<double>(from.size());
  Vec3d from_centre, to_centre;
  for (std::size_t i = 0; i < from.size(); ++i) from_centre += from[i], to_centre += to[i];
  from_centre = from_centre / count;
  to_centre = to_centre / count;
  std::array<Vec3d, 3> sums{};  // columns of the sum of to_i from_i^T
  double from_squares = 0, to_squares = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec3d a = from[i] - from_centre, b = to[i] - to_centre;
    sums[0] += b * a.x;
    sums[1] += b * a.y;
    sums[2] += b * a.z;
    from_squares += dot(a, a);
    to_squares += dot(b, b);
  }
  Similarity result;
  const Quaternion rotation = nearest_rotation(sums);
  // Where some turn changes hardly anything, the points leave the rotation open.
  const double size = std::sqrt(from_squares * to_squares);
  if (linear::internal::trace_change(sums, rotation).curvature.is_positive(size, 1e-6))
    result.rotation = matrix_of(rotation);
  if (from_squares > 0 && to_squares > 0) result.scale = std::sqrt(to_squares / from_squares);
  result.shift = to_centre - result.rotation * from_centre * result.scale;
  return result;
}

}  // namespace npt::inline NPT_ABI
