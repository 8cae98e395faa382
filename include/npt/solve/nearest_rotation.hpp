/// The rotation nearest to a 3 x 3 matrix A: the R with the largest trace of R^T A, without a singular value
/// decomposition. Newton's method on the rotation's own three coordinates, with B = A R^T, and half turns where that
/// would not climb:
///   R <- exp(w) R,  w = (tr(B) I - (B + B^T) / 2)^-1 (sum over columns of R_c x A_c)
/// Numerics  double. Reflections and matrices of rank 1 or 2 give a rotation, too; where several are equally near (a
///           matrix of zeros), the start or any of them. NaN in, NaN out
/// Source    the iteration of Mueller et al., "A robust method to extract the rotational part of deformations", 2016,
///           with the second derivative in place of its bound
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

namespace npt::inline NPT_ABI {

namespace linear::internal {

/// A symmetric matrix. Eigen's LLT of a Matrix3d in its place makes nearest_rotation() three times slower: 1.8 us
/// instead of 0.58 near the start; its JacobiSVD in place of all of this takes 2.1 us (one core of an AMD EPYC with
/// AVX-512). A refinement asks at each vertex in each iteration.
struct Symmetric3 {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;

  constexpr double determinant() const {
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  }
  /// Whether all eigenvalues are above -slack, roughly: all principal minors are, for entries of about `size`.
  constexpr bool is_positive(double size, double slack) const {
    const double one = slack * size, two = one * size;
    return xx > one && yy > one && zz > one && xx * yy - xy * xy > two && xx * zz - xz * xz > two &&
           yy * zz - yz * yz > two && determinant() > two * size;
  }
  /// The least eigenvalue and its vector, of length 1: of several, any.
  /// Source    Smith, "Eigenvalues of a symmetric 3 x 3 matrix", 1961; the vector is orthogonal to the rows of A - e I
  std::pair<double, Vec3d> least_eigenvalue() const {
    const double mean = (xx + yy + zz) / 3;
    const Symmetric3 centred{xx - mean, yy - mean, zz - mean, xy, xz, yz};
    const double squares =
        centred.xx * centred.xx + centred.yy * centred.yy + centred.zz * centred.zz + 2 * (xy * xy + xz * xz + yz * yz);
    const double radius = std::sqrt(squares / 6);
    if (!(radius > 0)) return {mean, {1, 0, 0}};
    const double cosine = std::clamp(centred.determinant() / (2 * radius * radius * radius), -1.0, 1.0);
    const double least = mean + 2 * radius * std::cos((std::acos(cosine) + 2 * std::numbers::pi) / 3);
    const std::array<Vec3d, 3> rows{{{xx - least, xy, xz}, {xy, yy - least, yz}, {xz, yz, zz - least}}};
    Vec3d axis;
    for (std::size_t i = 0; i < 3; ++i)
      if (const Vec3d other = cross(rows[i], rows[(i + 1) % 3]); length(other) > length(axis)) axis = other;
    // Two equal least eigenvalues leave one direction among the rows: whatever is orthogonal to it will do.
    if (length(axis) < 1e-10 * squares) {
      Vec3d row = rows[0];
      for (const Vec3d other : rows)
        if (length(other) > length(row)) row = other;
      axis = std::abs(row.x) > std::abs(row.y) ? Vec3d{-row.z, 0, row.x} : Vec3d{0, row.z, -row.y};
    }
    return {least, axis / length(axis)};
  }
  /// The solution of M x = b, by Cramer's rule. Requires determinant() != 0.
  constexpr Vec3d solve(Vec3d b) const {
    const double d = 1 / determinant();
    return Vec3d{(yy * zz - yz * yz) * b.x + (xz * yz - xy * zz) * b.y + (xy * yz - xz * yy) * b.z,
                 (xz * yz - xy * zz) * b.x + (xx * zz - xz * xz) * b.y + (xy * xz - xx * yz) * b.z,
                 (xy * yz - xz * yy) * b.x + (xy * xz - xx * yz) * b.y + (xx * yy - xy * xy) * b.z} *
           d;
  }
};

/// How the trace of R^T A, columns of A given, changes where R turns by a small vector w: slope . w - w . curvature w /
/// 2.
struct TraceChange {
  Vec3d slope;
  Symmetric3 curvature;
};

NPT_INLINE TraceChange trace_change(const std::array<Vec3d, 3>& columns, const Quaternion& rotation) {
  const std::array<Vec3d, 3> own = matrix_of(rotation).columns();
  Vec3d slope;
  Symmetric3 s;  // the symmetric part of A R^T
  for (std::size_t c = 0; c < 3; ++c) {
    const Vec3d a = columns[c], r = own[c];
    slope += cross(r, a);
    s.xx += a.x * r.x, s.yy += a.y * r.y, s.zz += a.z * r.z;
    s.xy += (a.x * r.y + a.y * r.x) / 2, s.xz += (a.x * r.z + a.z * r.x) / 2, s.yz += (a.y * r.z + a.z * r.y) / 2;
  }
  return {slope, {s.yy + s.zz, s.xx + s.zz, s.xx + s.yy, -s.xy, -s.xz, -s.yz}};
}

}  // namespace linear::internal

/// The rotation nearest to the matrix with these columns, sought from `start` in at most `steps` steps. From a start
/// that is near, two or three give 1e-6; from anywhere, nine at most (20,000 random matrices of rank 2 and 3).
NPT_INLINE Quaternion nearest_rotation(const std::array<Vec3d, 3>& columns, Quaternion start = {}, int steps = 100) {
  const double size = length(columns[0]) + length(columns[1]) + length(columns[2]);
  if (!(size > 0)) return start;
  for (int i = 0; i < steps; ++i) {
    const auto [slope, curvature] = linear::internal::trace_change(columns, start);
    const bool at_rest = length(slope) < 1e-12 * size;
    if (at_rest && curvature.is_positive(size, -1e-9)) break;
    // Newton's step where the trace is curved downwards all around. Where it is curved upwards about some axis, half a
    // turn about that makes it larger by twice the curvature; going uphill could end on a saddle. Where it is flat,
    // uphill.
    Vec3d turn = slope * (2 / size);
    if (curvature.is_positive(size, 1e-9)) {
      turn = curvature.solve(slope);
    } else if (const auto [least, axis] = curvature.least_eigenvalue(); least < (at_rest ? -1e-9 : -1e-3) * size) {
      start = start.turned(axis * std::numbers::pi);
      continue;
    }
    const double angle = length(turn);
    start = start.turned(angle > 1 ? turn * (1 / angle) : turn);
    if (angle < 1e-8) break;
  }
  return start;
}

}  // namespace npt::inline NPT_ABI
