/// Which samples of a picture a triangle or a disc covers.
///
/// Coordinates are rounded to 1/256 sample and edges evaluated in integers, so neighbouring triangles leave no gap and
/// the result is the same with every compiler. A sample exactly on an edge belongs to both neighbours: with a depth
/// test either may win, and the order of the triangles decides.
#pragma once

#include <npt/base/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace render {

using npt::Vec3f;

namespace internal {

inline constexpr int subsample_bits = 8;

/// Clamped far outside of any picture, so that no product of two overflows 64 bits.
inline std::int64_t to_fixed(float v) {
  const float limit = 1 << 21;
  return static_cast<std::int64_t>(std::lround(std::clamp(v, -limit, limit) * (1 << subsample_bits)));
}

struct FixedPoint2 {
  std::int64_t x, y;
};

/// Twice the signed area of (a, b, c).
inline std::int64_t area2(FixedPoint2 a, FixedPoint2 b, FixedPoint2 c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

}  // namespace internal

/// Calls emit(x, y, third) for every sample (x + 0.5, y + 0.5) in the triangle a, b, c, of either winding; `third` is
/// the vertices' third coordinate interpolated linearly over the picture.
template <class Emit>
void raster_triangle(Vec3f a, Vec3f b, Vec3f c, int width, int height, Emit&& emit) {
  using internal::FixedPoint2;
  constexpr std::int64_t one = 1 << internal::subsample_bits;
  std::array<FixedPoint2, 3> p{FixedPoint2{internal::to_fixed(a.x), internal::to_fixed(a.y)},
                               FixedPoint2{internal::to_fixed(b.x), internal::to_fixed(b.y)},
                               FixedPoint2{internal::to_fixed(c.x), internal::to_fixed(c.y)}};
  std::int64_t area = internal::area2(p[0], p[1], p[2]);
  if (area == 0) return;
  if (area < 0) {
    std::swap(p[1], p[2]);
    std::swap(b, c);
    area = -area;
  }
  const auto [x_low, x_high] = std::minmax({p[0].x, p[1].x, p[2].x});
  const auto [y_low, y_high] = std::minmax({p[0].y, p[1].y, p[2].y});
  // Sample i stands at i * one + one / 2.
  const auto first = [](std::int64_t low) { return std::max<std::int64_t>(0, (low + one / 2 - 1) >> 8); };
  const auto last = [](std::int64_t high, int size) { return std::min<std::int64_t>(size - 1, (high - one / 2) >> 8); };
  const std::int64_t x0 = first(x_low), x1 = last(x_high, width), y0 = first(y_low), y1 = last(y_high, height);
  if (x0 > x1 || y0 > y1) return;

  const FixedPoint2 start{x0 * one + one / 2, y0 * one + one / 2};
  std::array<std::int64_t, 3> row{internal::area2(p[1], p[2], start), internal::area2(p[2], p[0], start),
                                  internal::area2(p[0], p[1], start)};
  std::array<std::int64_t, 3> step_x{}, step_y{};
  for (std::size_t i = 0; i < 3; ++i) {
    const FixedPoint2 from = p[(i + 1) % 3], to = p[(i + 2) % 3];
    step_x[i] = -(to.y - from.y) * one;
    step_y[i] = (to.x - from.x) * one;
  }
  const float scale = 1.0F / static_cast<float>(area);
  for (std::int64_t y = y0; y <= y1; ++y) {
    std::array<std::int64_t, 3> w = row;
    for (std::int64_t x = x0; x <= x1; ++x) {
      if ((w[0] | w[1] | w[2]) >= 0)
        emit(static_cast<int>(x), static_cast<int>(y),
             a.z + (static_cast<float>(w[1]) * (b.z - a.z) + static_cast<float>(w[2]) * (c.z - a.z)) * scale);
      for (std::size_t i = 0; i < 3; ++i) w[i] += step_x[i];
    }
    for (std::size_t i = 0; i < 3; ++i) row[i] += step_y[i];
  }
}

/// Calls emit(x, y, u, v) for every sample in the disc; (u, v) in the unit disc, v upwards. A disc smaller than a
/// sample still covers the one it stands on.
template <class Emit>
void raster_disc(float centre_x, float centre_y, float radius, int width, int height, Emit&& emit) {
  const float r = std::max(radius, 0.71F);
  const auto clamped = [](float v, int size) {
    return static_cast<int>(std::clamp(v, -1.0F, static_cast<float>(size)));
  };
  const int x0 = std::max(0, clamped(centre_x - r, width)), x1 = std::min(width - 1, clamped(centre_x + r, width));
  const int y0 = std::max(0, clamped(centre_y - r, height)), y1 = std::min(height - 1, clamped(centre_y + r, height));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const float u = (static_cast<float>(x) + 0.5F - centre_x) / r, v = (centre_y - static_cast<float>(y) - 0.5F) / r;
      if (u * u + v * v <= 1.0F) emit(x, y, u, v);
    }
}

}  // namespace render
