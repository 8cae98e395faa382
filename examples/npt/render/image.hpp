/// A picture in memory: 8 bits a channel, sRGB, with alpha. Rows from top to bottom.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace render {

/// One pixel, sRGB encoded, alpha not multiplied in.
struct Pixel {
  std::uint8_t r = 0, g = 0, b = 0, a = 255;
  friend bool operator==(const Pixel&, const Pixel&) = default;
};

struct Image {
  int width = 0;
  int height = 0;
  std::vector<Pixel> pixels;  ///< [height * width]

  Image() = default;
  Image(int w, int h, Pixel fill = {})
      : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), fill) {}

  Pixel& at(int x, int y) { return pixels[index(x, y)]; }
  const Pixel& at(int x, int y) const { return pixels[index(x, y)]; }

  /// Copies `other` over this picture with its upper left corner at (left, top). What stands out is cut off.
  void paste(const Image& other, int left, int top) {
    const int first = std::max(0, -left);
    const int last = std::min(other.width, width - left);
    if (first >= last) return;
    for (int y = std::max(0, -top); y < std::min(other.height, height - top); ++y)
      std::copy(&other.at(first, y), &other.at(first, y) + (last - first), &at(left + first, top + y));
  }

  /// Lays `other` over this picture with its upper left corner at (left, top); this one shows through where `other` is
  /// transparent.
  void lay_over(const Image& other, int left, int top) {
    for (int y = std::max(0, -top); y < std::min(other.height, height - top); ++y)
      for (int x = std::max(0, -left); x < std::min(other.width, width - left); ++x) {
        const Pixel over = other.at(x, y);
        Pixel& under = at(left + x, top + y);
        const double a = over.a / 255.0, b = under.a / 255.0 * (1 - a), sum = a + b;
        if (!(sum > 0)) continue;
        const auto mixed = [&](std::uint8_t o, std::uint8_t u) {
          return static_cast<std::uint8_t>(std::lround((o * a + u * b) / sum));
        };
        under = {mixed(over.r, under.r), mixed(over.g, under.g), mixed(over.b, under.b),
                 static_cast<std::uint8_t>(std::lround(sum * 255))};
      }
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// A smaller version of a picture: each pixel is the mean of those it covers. Colours are averaged as they are stored,
/// weighted by alpha.
Image shrunk(const Image& image, int width, int height);

}  // namespace render
