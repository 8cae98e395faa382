/// The frame in which a network reads a mesh: points about their mean, at a fixed root mean square distance from it.
/// A bounding box, which turns and grows with the pose, has no part in it.
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/normalise.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace npt::inline NPT_ABI {

/// Root mean square distance of the points that a reading network sees from their mean.
inline constexpr double reading_radius = 0.45;

/// point(i): the i-th of `count` points. The scale is infinite where they have no extent, and not a number where they
/// are not finite.
template <class PointOf>
NormalisingTransform canonical_frame(std::size_t count, const PointOf& point) {
  NormalisingTransform frame;
  const auto n = static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) frame.centre += point(i) / n;
  double square = 0;
  for (std::size_t i = 0; i < count; ++i) square += dot(point(i) - frame.centre, point(i) - frame.centre) / n;
  // What is left of points in one place is rounding of the sum.
  const double rounding = n * std::numeric_limits<double>::epsilon() * length(frame.centre);
  frame.scale = reading_radius / (square > rounding * rounding ? std::sqrt(square) : 0.0);
  return frame;
}

/// Turns that bring each of a mesh's six axes up, as axis angles; y first.
inline constexpr std::array<Vec3d, 6> upright_turns{{{0, 0, 0},
                                                     {std::numbers::pi, 0, 0},
                                                     {std::numbers::pi / 2, 0, 0},
                                                     {-std::numbers::pi / 2, 0, 0},
                                                     {0, 0, std::numbers::pi / 2},
                                                     {0, 0, -std::numbers::pi / 2}}};
/// Turns the axis upwards that is nearest to a direction.
inline Matrix3 turn_upright(Vec3d up) {
  return rotation_matrix(
      *std::ranges::max_element(upright_turns, {}, [up](Vec3d turn) { return (rotation_matrix(turn) * up).y; }));
}

}  // namespace npt::inline NPT_ABI
