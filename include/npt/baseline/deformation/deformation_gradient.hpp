/// How a triangle was deformed: the affine map of its corners and of a fourth vertex above it.
///   v4 = v1 + n / sqrt(|n|),  n = (v2 - v1) x (v3 - v1)
///   V  = [v2 - v1, v3 - v1, v4 - v1],  Q = V' V^-1
/// Q has no translation. Its part within the triangle's plane follows from the corners; perpendicular to it, it
/// stretches by the root of the change of area.
/// Shapes    points of the triangle as three Vec3d, in order; any unit
/// Numerics  double. A triangle whose height is less than 1e-4 of its longest side is_flat and has no gradient:
///           coordinates are floats, and what is a micrometre high in a body of two metres has a gradient of rounding
///           errors
/// Source    Sumner and Popovic, "Deformation Transfer for Triangle Meshes", SIGGRAPH 2004, section 3
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace npt::inline NPT_ABI {

/// Whether a triangle has no area that floats could tell from none (a NaN has one).
inline bool is_flat(Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d n = cross(b - a, c - a);
  const double longest = std::max({dot(b - a, b - a), dot(c - a, c - a), dot(c - b, c - b)});
  return dot(n, n) <= 1e-8 * longest * longest;
}

/// The rest shape of a triangle, in the form that gradients are linear in the deformed vertices:
///   Q = sum over k of v'_k slopes[k]^T,  k = the corners and the fourth vertex
/// slopes[0..2] lie in the triangle's plane and are the gradients of its barycentric coordinates, but for
/// slopes[0], which also takes away what slopes[3] adds: they sum to 0.
struct RestTriangle {
  std::array<Vec3d, 4> slopes{};

  RestTriangle() = default;
  /// Requires  a triangle that is not flat
  RestTriangle(Vec3d a, Vec3d b, Vec3d c) {
    const Vec3d e1 = b - a, e2 = c - a, n = cross(e1, e2);
    const double squared = dot(n, n);
    slopes[1] = cross(e2, n) / squared;
    slopes[2] = cross(n, e1) / squared;
    slopes[3] = n / std::pow(squared, 0.75);  // the inverse of n / sqrt(|n|)
    slopes[0] = -(slopes[1] + slopes[2] + slopes[3]);
  }

  /// slopes[0] without the fourth vertex' share.
  Vec3d plane_slope(std::size_t corner) const { return corner == 0 ? -(slopes[1] + slopes[2]) : slopes[corner]; }

  Matrix3 gradient(Vec3d a, Vec3d b, Vec3d c, Vec3d fourth) const {
    return outer(b - a, slopes[1]) + outer(c - a, slopes[2]) + outer(fourth - a, slopes[3]);
  }
  /// Q of the deformed triangle abc. One that became flat keeps no direction perpendicular to it: 0 there.
  Matrix3 gradient(Vec3d a, Vec3d b, Vec3d c) const {
    const Vec3d n = cross(b - a, c - a);
    const double root = std::sqrt(length(n));
    return gradient(a, b, c, root == 0 ? a : a + n / root);
  }
};

}  // namespace npt::inline NPT_ABI
