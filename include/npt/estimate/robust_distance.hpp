/// What counts between a point of a mesh and one of a body: normals that face alike, and of their squared distance the
/// less, the greater it is, at most the square of a kernel's scale.
///   rho(d^2) = d^2 s^2 / (d^2 + s^2)
/// Source    Geman and McClure, "Statistical methods for tomographic image reconstruction", 1987
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <cmath>

namespace npt::inline NPT_ABI {

/// Energies of fits are square centimetres of meshes in metres.
inline constexpr double per_square_metre = 1e4;

/// How far a place is usually off that a network reads or a fit ends in, in metres: of bodies that no training had.
/// What is nearer is taken to be in one place.
inline constexpr double usual_error = 0.05;

/// The least cosine between normals that face alike.
inline constexpr double least_facing = 0.2;

/// Whether a mesh's normal faces as a body's does, both unit. facing: 1: the mesh's triangles turn outwards; -1:
/// inwards; 0: that is not known
NPT_INLINE bool faces_alike(Vec3d body, Vec3d mesh, double facing, double least_cosine = least_facing) {
  const double cosine = dot(body, mesh);
  return (facing == 0 ? std::abs(cosine) : facing * cosine) > least_cosine;
}

/// squared: d^2; scale: s, in the same unit as d
constexpr double robust_squared(double squared, double scale) {
  return squared * scale * scale / (squared + scale * scale);
}
/// What a squared distance weighs in the least squares step for rho, its slope: from 1 at none to 0.
constexpr double robust_weight(double squared, double scale) {
  const double share = scale * scale / (squared + scale * scale);
  return share * share;
}

}  // namespace npt::inline NPT_ABI
