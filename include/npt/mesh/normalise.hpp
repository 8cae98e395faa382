/// The frame that a network sees a mesh in: centred, and scaled so that the output has room. And the way back.
/// Shapes    xyz: [V, 3] floats, row major. Arithmetic in double, no allocation.
/// Numerics  a coordinate that is NaN is left out of the frame; it stays NaN under apply
/// Errors    npt::Error for no vertices, and for vertices that all lie in one point where a scale is asked for
/// Source    Wang et al., CVPR 2020: centre, scale to the unit sphere; the public code only centres.
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
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
inline Normalisation parse_normalisation(std::string_view text, const std::string& where = "normalisation") {
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

/// x -> (x - centre) * scale, and back.
struct Frame {
  Vec3d centre{};
  double scale = 1;

  constexpr Vec3d apply(Vec3d p) const { return (p - centre) * scale; }
  constexpr Vec3d inverse(Vec3d p) const { return p / scale + centre; }
  constexpr Vec3f apply(Vec3f p) const { return apply(p.as<double>()).as<float>(); }
  constexpr Vec3f inverse(Vec3f p) const { return inverse(p.as<double>()).as<float>(); }
};

namespace internal {

inline Vec3d point(std::span<const float> xyz, std::size_t v) { return {xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]}; }

/// Throws unless xyz holds whole points, at least one.
inline void expect_points(std::span<const float> xyz, std::string_view name) {
  if (xyz.empty()) throw Error({.file = std::string(name), .found = "no vertices", .expected = "at least one vertex"});
  if (xyz.size() % 3 != 0)
    throw Error({.file = std::string(name),
                 .found = std::to_string(xyz.size()) + " coordinates",
                 .expected = "a multiple of 3"});
}

inline Vec3d bounding_box_centre(std::span<const float> xyz) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  double low[3] = {inf, inf, inf}, high[3] = {-inf, -inf, -inf};
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    for (std::size_t k = 0; k < 3; ++k) {  // std::min and max keep their first argument against a NaN
      low[k] = std::min(low[k], double{xyz[i + k]});
      high[k] = std::max(high[k], double{xyz[i + k]});
    }
  return {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2};
}

}  // namespace internal

/// The frame of the vertices `xyz`. `name` stands in the message of an Error.
inline Frame frame_of(std::span<const float> xyz, Normalisation normalisation, std::string_view name = "mesh") {
  internal::expect_points(xyz, name);
  if (normalisation == Normalisation::none) return {};
  const Vec3d centre = internal::bounding_box_centre(xyz);
  if (normalisation == Normalisation::centre) return {centre, 1};
  double square = 0;
  for (std::size_t v = 0; v < xyz.size() / 3; ++v) {
    const Vec3d d = internal::point(xyz, v) - centre;
    square = std::max(square, dot(d, d));
  }
  if (square == 0)
    throw Error({.file = std::string(name),
                 .found = "all vertices in one point",
                 .expected = "a mesh with an extent, to scale it to a sphere (or normalise by centre or none)"});
  return {centre, sphere_radius / std::sqrt(square)};
}

/// out[v] = frame.apply(xyz[v]). The spans may be the same memory.
inline void apply(const Frame& frame, std::span<const float> xyz, std::span<float> out) {
  NPT_ASSERT(xyz.size() == out.size() && xyz.size() % 3 == 0);
  const double centre[3] = {frame.centre.x, frame.centre.y, frame.centre.z};
  for (std::size_t i = 0; i < xyz.size(); ++i) out[i] = static_cast<float>((xyz[i] - centre[i % 3]) * frame.scale);
}

/// out[v] = frame.inverse(xyz[v]). The spans may be the same memory.
inline void apply_inverse(const Frame& frame, std::span<const float> xyz, std::span<float> out) {
  NPT_ASSERT(xyz.size() == out.size() && xyz.size() % 3 == 0);
  const double centre[3] = {frame.centre.x, frame.centre.y, frame.centre.z};
  for (std::size_t i = 0; i < xyz.size(); ++i) out[i] = static_cast<float>(xyz[i] / frame.scale + centre[i % 3]);
}

}  // namespace npt::inline NPT_ABI
