/// The similarity (rotation, scale, shift) that fits one list of points to another best.
///   minimise sum over i of |scale * rotation * from_i + shift - to_i|^2 / scale, which treats both lists alike
/// Points that leave the rotation open (fewer than three, or all on a line) get none; points in one place no scale either.
/// Source    Horn, "Closed-form solution of absolute orientation using unit quaternions", 1987
#pragma once

#include <npt/config.hpp>
#include <npt/core/matrix3.hpp>
#include <npt/core/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

namespace npt::inline NPT_ABI {

struct Similarity {
  Matrix3 rotation = Matrix3::identity();
  double scale = 1;
  Vec3d shift;

  Vec3d operator()(Vec3d p) const { return rotation * p * scale + shift; }
};

namespace linear::internal {

using Matrix4 = std::array<std::array<double, 4>, 4>;

/// Eigenvalues and eigenvectors of a symmetric matrix by Jacobi's rotations; vectors[i] belongs to values[i].
struct Eigen4 {
  std::array<double, 4> values{};
  Matrix4 vectors{};
};

inline Eigen4 eigen_of(Matrix4 a) {
  Matrix4 v{};
  for (std::size_t i = 0; i < 4; ++i) v[i][i] = 1;
  for (int sweep = 0; sweep < 30; ++sweep) {  // converges quadratically: some six are enough
    for (std::size_t p = 0; p < 4; ++p)
      for (std::size_t q = p + 1; q < 4; ++q) {
        if (a[p][q] == 0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (std::size_t k = 0; k < 4; ++k) {
          const double x = a[k][p], y = a[k][q];
          a[k][p] = c * x - s * y;
          a[k][q] = s * x + c * y;
        }
        for (std::size_t k = 0; k < 4; ++k) {
          const double x = a[p][k], y = a[q][k];
          a[p][k] = c * x - s * y;
          a[q][k] = s * x + c * y;
        }
        for (std::size_t k = 0; k < 4; ++k) {
          const double x = v[p][k], y = v[q][k];
          v[p][k] = c * x - s * y;
          v[q][k] = s * x + c * y;
        }
      }
  }
  Eigen4 result;
  for (std::size_t i = 0; i < 4; ++i) result.values[i] = a[i][i];
  result.vectors = v;
  return result;
}

}  // namespace linear::internal

/// Requires  as many points in `to` as in `from`, at least one
inline Similarity best_similarity(std::span<const Vec3d> from, std::span<const Vec3d> to) {
  NPT_ASSERT(from.size() == to.size() && !from.empty());
  const auto count = static_cast<double>(from.size());
  Vec3d from_centre, to_centre;
  for (std::size_t i = 0; i < from.size(); ++i) from_centre += from[i], to_centre += to[i];
  from_centre = from_centre / count;
  to_centre = to_centre / count;
  Matrix3 m;  // sum of from_i to_i^T
  double from_squares = 0, to_squares = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec3d a = from[i] - from_centre, b = to[i] - to_centre;
    m += outer(a, b);
    from_squares += dot(a, a);
    to_squares += dot(b, b);
  }
  Similarity result;
  const auto& [x, y, z] = m.rows;
  const linear::internal::Eigen4 eigen =
      linear::internal::eigen_of({{{x.x + y.y + z.z, y.z - z.y, z.x - x.z, x.y - y.x},
                                   {y.z - z.y, x.x - y.y - z.z, x.y + y.x, z.x + x.z},
                                   {z.x - x.z, x.y + y.x, y.y - x.x - z.z, y.z + z.y},
                                   {x.y - y.x, z.x + x.z, y.z + z.y, z.z - x.x - y.y}}});
  std::array<std::size_t, 4> order{0, 1, 2, 3};
  std::ranges::sort(order, [&](std::size_t i, std::size_t k) { return eigen.values[i] > eigen.values[k]; });
  // Where the best quaternion is not the only one, the points leave the rotation open.
  if (eigen.values[order[0]] - eigen.values[order[1]] > 1e-6 * std::sqrt(from_squares * to_squares)) {
    const auto& [w, i, j, k] = eigen.vectors[order[0]];
    result.rotation = {{{{w * w + i * i - j * j - k * k, 2 * (i * j - w * k), 2 * (i * k + w * j)},
                         {2 * (i * j + w * k), w * w - i * i + j * j - k * k, 2 * (j * k - w * i)},
                         {2 * (i * k - w * j), 2 * (j * k + w * i), w * w - i * i - j * j + k * k}}}};
  }
  if (from_squares > 0 && to_squares > 0) result.scale = std::sqrt(to_squares / from_squares);
  result.shift = to_centre - result.rotation * from_centre * result.scale;
  return result;
}

}  // namespace npt::inline NPT_ABI
