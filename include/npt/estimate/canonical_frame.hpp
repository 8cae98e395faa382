/// The frame in which a network reads a mesh: points about their mean, at a fixed root mean square distance from it.
/// A bounding box, which turns and grows with the pose, has no part in it.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/normalise.hpp>

#include <cmath>
#include <cstddef>

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
  // What is left of points in one place is rounding.
  const double rounding = 1e-12 * length(frame.centre);
  frame.scale = reading_radius / (square > rounding * rounding ? std::sqrt(square) : 0.0);
  return frame;
}

}  // namespace npt::inline NPT_ABI
