/// From a mesh's coordinates to those that a network sees, centred and scaled so that the output has space, and back.
/// Shapes    xyz: [V, 3] floats, row major
/// Numerics  arithmetic in double, no allocation; a coordinate that is NaN doesn't count for centre and scale, and
///           stays NaN
/// Errors    npt::Error for no vertices, and for vertices that all lie in one point where a scale is asked for
/// Source    Wang et al., CVPR 2020: centre, scale to the unit sphere; the public code only centres.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/points.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace npt::inline NPT_ABI {

enum class Normalisation {
  sphere,  ///< bounding box's centre to the origin, farthest vertex at distance sphere_radius
  centre,  ///< bounding box's centre to the origin
  none     ///< as it is
};

constexpr const char* to_string(Normalisation n) noexcept {
  return n == Normalisation::sphere ? "sphere" : n == Normalisation::centre ? "centre" : "none";
}

/// Reads "sphere", "centre" or "none". `where` names the argument or file in the error.
NPT_INLINE Normalisation parse_normalisation(std::string_view text, const std::string& where = "normalisation") {
  for (const Normalisation n : {Normalisation::sphere, Normalisation::centre, Normalisation::none})
    if (text == to_string(n)) return n;
  throw Error({.file = where, .found = "'" + std::string(text) + "'", .expected = "sphere, centre or none"});
}

/// The radius that Normalisation::sphere scales a mesh to. The truth of a training pair is centred on itself and scaled
/// by the identity's factor, so that the output maps back to the identity's units; its coordinates must lie inside
/// tanh's range (-1, 1). The worst case is an identity that comes curled up, knees at the chest, and stands up: its
/// radius grows 2.2 times to a T pose and 2.71 times to arms overhead (measured on a human body with 24 joints,
/// tests/mesh), and 0.35 * 2.71 = 0.95. Within the paper's Table 6 it grows 1.5 times.
inline constexpr double sphere_radius = 0.35;

/// x -> (x - centre) * scale, and its inverse.
struct NormalisingTransform {
  Vec3d centre{};
  double scale = 1;

  constexpr Vec3d apply(Vec3d p) const { return (p - centre) * scale; }
  constexpr Vec3f apply(Vec3f p) const { return apply(p.as<double>()).as<float>(); }
  constexpr Vec3d apply_inverse(Vec3d p) const { return p / scale + centre; }
  constexpr Vec3f apply_inverse(Vec3f p) const { return apply_inverse(p.as<double>()).as<float>(); }

  /// Transforms all vertices of `xyz` into `out`, which may be the same memory.
  void apply(std::span<const float> xyz, std::span<float> out) const {
    NPT_ASSERT(xyz.size() == out.size() && xyz.size() % 3 == 0);
    const double c[3] = {centre.x, centre.y, centre.z};
    for (std::size_t i = 0; i < xyz.size(); ++i)
      out[i] = static_cast<float>((static_cast<double>(xyz[i]) - c[i % 3]) * scale);
  }
  void apply_inverse(std::span<const float> xyz, std::span<float> out) const {
    NPT_ASSERT(xyz.size() == out.size() && xyz.size() % 3 == 0);
    const double c[3] = {centre.x, centre.y, centre.z};
    for (std::size_t i = 0; i < xyz.size(); ++i)
      out[i] = static_cast<float>(static_cast<double>(xyz[i]) / scale + c[i % 3]);
  }
};

/// The transform that normalises a mesh with the vertices `xyz`. `name` stands in the message of an Error.
NPT_INLINE NormalisingTransform normalising_transform(std::span<const float> xyz, Normalisation normalisation,
                                                      std::string_view name = "mesh") {
  expect_points(xyz, name);
  if (normalisation == Normalisation::none) return {};
  const Vec3d centre = bounding_box(xyz).centre();
  if (normalisation == Normalisation::centre) return {centre, 1};
  double square = 0;
  for (std::size_t v = 0; v < xyz.size() / 3; ++v) {
    const Vec3d d = point_at(xyz, v) - centre;
    square = std::max(square, dot(d, d));
  }
  if (square == 0)
    throw Error({.file = std::string(name),
                 .found = "all vertices in one point",
                 .expected = "a mesh with an extent, to scale it to a sphere (or normalise by centre or none)"});
  return {centre, sphere_radius / std::sqrt(square)};
}

}  // namespace npt::inline NPT_ABI
