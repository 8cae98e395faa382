#include <render/font_bytes.hpp>
#include <render/text.hpp>

#define STB_TRUETYPE_IMPLEMENTATION
#define STBTT_STATIC
#include <stb/stb_truetype.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace render {
namespace {

constexpr double em = 0.86;  ///< of a line's height: capitals are 0.63 of it

/// The embedded font.
const stbtt_fontinfo& font() {
  static const stbtt_fontinfo loaded = [] {
    stbtt_fontinfo info;
    if (stbtt_InitFont(&info, font_bytes, 0) == 0) throw std::logic_error("the embedded font is broken");
    return info;
  }();
  return loaded;
}

double scale_of(double size) { return static_cast<double>(stbtt_ScaleForMappingEmToPixels(&font(), 1)) * em * size; }

/// The text as ASCII; a character of UTF-8 beyond it is one '?'.
std::string printable(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0U) == 0x80U) continue;
    result += byte >= 32 && byte < 127 ? c : '?';
  }
  return result;
}

/// Calls draw(letter, x) for each letter of printable text, x in the font's units from the first; gives where the last
/// ends.
template <class Draw>
double lay_out(const std::string& text, Draw draw) {
  int x = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    int advance = 0, bearing = 0;
    stbtt_GetCodepointHMetrics(&font(), text[i], &advance, &bearing);
    if (i > 0) x += stbtt_GetCodepointKernAdvance(&font(), text[i - 1], text[i]);
    draw(text[i], x);
    x += advance;
  }
  return x;
}

void blend(Pixel& pixel, Pixel colour, double coverage) {
  const double a = pixel.a / 255.0, result = coverage + a * (1 - coverage);
  if (result <= 0) return;
  const auto channel = [&](std::uint8_t under, std::uint8_t over) {
    return static_cast<std::uint8_t>((over * coverage + under * a * (1 - coverage)) / result + 0.5);
  };
  pixel = {channel(pixel.r, colour.r), channel(pixel.g, colour.g), channel(pixel.b, colour.b),
           static_cast<std::uint8_t>(result * 255 + 0.5)};
}

/// One letter over a picture, what stands out of it cut off.
void draw_letter(Image& image, char letter, double x, int baseline, float scale, Pixel colour) {
  if (!(std::abs(x) < 1e6)) return;
  const double column = std::floor(x);
  const auto shift = static_cast<float>(x - column);
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  stbtt_GetCodepointBitmapBoxSubpixel(&font(), letter, scale, scale, shift, 0, &x0, &y0, &x1, &y1);
  const int columns = x1 - x0, rows = y1 - y0, left = x0 + static_cast<int>(column), top = y0 + baseline;
  if (columns <= 0 || rows <= 0) return;
  if (left >= image.width || top >= image.height || left + columns <= 0 || top + rows <= 0) return;
  std::vector<unsigned char> coverage(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  stbtt_MakeCodepointBitmapSubpixel(&font(), coverage.data(), columns, rows, columns, scale, scale, shift, 0, letter);
  for (int y = std::max(0, top); y < std::min(image.height, top + rows); ++y)
    for (int c = std::max(0, left); c < std::min(image.width, left + columns); ++c) {
      const auto i =
          static_cast<std::size_t>(y - top) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(c - left);
      blend(image.at(c, y), colour, coverage[i] / 255.0 * (colour.a / 255.0));
    }
}

}  // namespace

double text_width(std::string_view text, double size) {
  return lay_out(printable(text), [](char, int) {}) * scale_of(size);
}

void draw_text(Image& image, std::string_view text, double x, double baseline, double size, Pixel colour) {
  if (!(std::abs(baseline) < 1e6)) return;
  const double scale = scale_of(size);
  const int row = static_cast<int>(std::lround(baseline));  // letters that stand on whole pixels look sharper
  lay_out(printable(text), [&](char letter, int at) {
    draw_letter(image, letter, x + at * scale, row, static_cast<float>(scale), colour);
  });
}

}  // namespace render
