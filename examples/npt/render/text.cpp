#include <render/text.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>
#include <vector>

namespace render {
namespace {

/// A letter: how wide it is and the path of its pen. Units: capitals are 10 high, x is 7, the baseline is 0. The path:
///   M x y                       lift the pen and go there
///   L x y                       draw a line there
///   A cx cy rx ry start end     draw an arc of an ellipse between two angles in degrees, after a line to its start;
///                               directly after ';' the pen is lifted first
struct Glyph {
  double width;
  const char* path;
};

constexpr std::array<Glyph, 95> glyphs{{
    {3.2, ""},                                                                                     // space
    {0.6, "M0.3 10L0.3 3;A0.3 0.35 0.25 0.25 0 360"},                                              // !
    {2.4, "M0 10.4L0 7.4;M2.4 10.4L2.4 7.4"},                                                      // "
    {8, "M1.9 0L3.3 10;M4.9 0L6.3 10;M0 3.3L7.4 3.3;M0.8 6.7L8 6.7"},                              // #
    {6, "A3 7.4 2.7 2.3 30 270A3 2.55 3 2.55 90 -150;M3 11.4L3 -1.4"},                             // $
    {9, "A1.9 7.9 1.9 2.1 0 360;A7.1 2.1 1.9 2.1 0 360;M7.4 10L1.6 0"},                            // %
    {7.6, "M7.4 0L2 6.6A3.2 8 1.75 2 220 -35L1.5 5A2.9 2.6 2.9 2.6 120 318L7.2 5"},                // &
    {0.4, "M0.2 10.4L0.2 7.4"},                                                                    // '
    {2.4, "A4.2 4.3 4.2 7.6 118 242"},                                                             // (
    {2.4, "A-1.8 4.3 4.2 7.6 62 -62"},                                                             // )
    {4.4, "M2.2 10.4L2.2 5.6;M0.1 9.2L4.3 6.8;M4.3 9.2L0.1 6.8"},                                  // *
    {6, "M0 4L6 4;M3 7L3 1"},                                                                      // +
    {0.9, "M0.7 0.5L0 -1.8"},                                                                      // ,
    {3.4, "M0 3.8L3.4 3.8"},                                                                       // -
    {0.6, "A0.3 0.35 0.25 0.25 0 360"},                                                            // .
    {4.2, "M0 -1.2L4.2 11"},                                                                       // /
    {6, "A3 5 3 5 0 360"},                                                                         // 0
    {6, "M1.2 8.1L3.6 10L3.6 0"},                                                                  // 1
    {6, "A3 7.1 2.9 2.9 165 -38L0.1 0L6 0"},                                                       // 2
    {6, "A2.9 7.55 2.5 2.45 150 -90A2.9 2.55 3 2.55 90 -150"},                                     // 3
    {6, "M4.7 0L4.7 10L0 2.9L6.2 2.9"},                                                            // 4
    {6, "M5.5 10L1.1 10L0.7 5.5A2.9 3.25 3.1 3.25 130 -150"},                                      // 5
    {6, "A3 3.1 3 3.1 0 360;A5 3.1 5 6.9 180 88"},                                                 // 6
    {6, "M0 10L6 10L2 0"},                                                                         // 7
    {6, "A3 7.6 2.5 2.4 0 360;A3 2.6 3 2.6 0 360"},                                                // 8
    {6, "A3 6.9 3 3.1 0 360;A1 6.9 5 6.9 0 -92"},                                                  // 9
    {0.6, "A0.3 0.35 0.25 0.25 0 360;A0.3 6 0.25 0.25 0 360"},                                     // :
    {0.9, "M0.7 0.5L0 -1.8;A0.6 6 0.25 0.25 0 360"},                                               // ;
    {5.4, "M5.4 7L0 4L5.4 1"},                                                                     // <
    {6, "M0 5.4L6 5.4;M0 2.6L6 2.6"},                                                              // =
    {5.4, "M0 7L5.4 4L0 1"},                                                                       // >
    {5.4, "A2.7 7.4 2.6 2.6 165 -45L2.7 4L2.7 3;A2.7 0.35 0.25 0.25 0 360"},                       // ?
    {9.6, "A4.8 4 1.9 2.1 0 360;M6.7 6.1L6.7 3.4A8.15 3.4 1.45 1.5 180 360A4.8 4 4.8 5.2 0 300"},  // @
    {8, "M0 0L4 10L8 0;M1.4 3.5L6.6 3.5"},                                                         // A
    {6.4, "M0 5.2L3.5 5.2A3.5 7.6 2.4 2.4 -90 90L0 10L0 0L3.8 0A3.8 2.6 2.6 2.6 -90 90"},          // B
    {7.9, "A4.6 5 4.6 5 44 316"},                                                                  // C
    {7.2, "M0 0L0 10L2.6 10A2.6 5 4.6 5 90 -90L0 0"},                                              // D
    {5.4, "M5.4 10L0 10L0 0L5.4 0;M0 5.2L4.7 5.2"},                                                // E
    {5.2, "M5.2 10L0 10L0 0;M0 5.1L4.5 5.1"},                                                      // F
    {8.8, "A4.6 5 4.6 5 44 318L8.1 4.6L5.2 4.6"},                                                  // G
    {6.8, "M0 0L0 10;M6.8 0L6.8 10;M0 5.2L6.8 5.2"},                                               // H
    {0.4, "M0.2 0L0.2 10"},                                                                        // I
    {4, "M4 10L4 2.5A1.9 2.5 2.1 2.5 0 -150"},                                                     // J
    {6.4, "M0 0L0 10;M6 10L0 3.9;M2.3 6.2L6.4 0"},                                                 // K
    {5, "M0 10L0 0L5 0"},                                                                          // L
    {8.6, "M0 0L0 10L4.3 3.2L8.6 10L8.6 0"},                                                       // M
    {6.8, "M0 0L0 10L6.8 0L6.8 10"},                                                               // N
    {9.4, "A4.7 5 4.7 5 0 360"},                                                                   // O
    {6.2, "M0 0L0 10L3.4 10A3.4 7.2 2.8 2.8 90 -90L0 4.4"},                                        // P
    {9.4, "A4.7 5 4.7 5 0 360;M5.8 2.8L9.2 -0.6"},                                                 // Q
    {6.4, "M0 0L0 10L3.4 10A3.4 7.2 2.8 2.8 90 -90L0 4.4;M3 4.4L6.4 0"},                           // R
    {6.2, "A3.1 7.45 2.8 2.55 30 270A3.1 2.45 3.1 2.45 90 -150"},                                  // S
    {7, "M0 10L7 10;M3.5 10L3.5 0"},                                                               // T
    {6.8, "M0 10L0 3.4A3.4 3.4 3.4 3.4 180 360L6.8 10"},                                           // U
    {7.6, "M0 10L3.8 0L7.6 10"},                                                                   // V
    {11, "M0 10L2.75 0L5.5 10L8.25 0L11 10"},                                                      // W
    {7, "M0 0L7 10;M0 10L7 0"},                                                                    // X
    {7, "M0 10L3.5 4.8L7 10;M3.5 4.8L3.5 0"},                                                      // Y
    {6.6, "M0 10L6.6 10L0 0L6.6 0"},                                                               // Z
    {2.2, "M2.2 11L0 11L0 -2.4L2.2 -2.4"},                                                         // [
    {4.2, "M0 11L4.2 -1.2"},                                                                       // backslash
    {2.2, "M0 11L2.2 11L2.2 -2.4L0 -2.4"},                                                         // ]
    {5, "M0 6.4L2.5 10.2L5 6.4"},                                                                  // ^
    {6, "M0 -1.6L6 -1.6"},                                                                         // _
    {1.6, "M0 10.6L1.6 8.6"},                                                                      // `
    {6, "A3 3.5 3 3.5 0 360;M6 7L6 0"},                                                            // a
    {6, "M0 10.6L0 0;A3 3.5 3 3.5 0 360"},                                                         // b
    {5.2, "A3 3.5 3 3.5 46 314"},                                                                  // c
    {6, "A3 3.5 3 3.5 0 360;M6 10.6L6 0"},                                                         // d
    {6, "M0 3.6L6 3.6A3 3.5 3 3.5 0 318"},                                                         // e
    {3.6, "M1.3 0L1.3 8.4A3.3 8.4 2 2.2 180 75;M0 7L3.5 7"},                                       // f
    {6, "A3 3.5 3 3.5 0 360;M6 7L6 -0.3A3 -0.3 3 2.8 0 -150"},                                     // g
    {5.4, "M0 10.6L0 0;M0 4.1A2.7 4.1 2.7 2.9 180 0L5.4 0"},                                       // h
    {0.6, "M0.3 7L0.3 0;A0.3 9.8 0.25 0.25 0 360"},                                                // i
    {2, "M1.7 7L1.7 -1.1A-0.2 -1.1 1.9 2 0 -85;A1.7 9.8 0.25 0.25 0 360"},                         // j
    {5.2, "M0 10.6L0 0;M4.9 7L0 2.6;M1.8 4.2L5.2 0"},                                              // k
    {0.4, "M0.2 10.6L0.2 0"},                                                                      // l
    {9, "M0 7L0 0;M0 4.5A2.25 4.5 2.25 2.5 180 0L4.5 0;M4.5 4.5A6.75 4.5 2.25 2.5 180 0L9 0"},     // m
    {5.4, "M0 7L0 0;M0 4.1A2.7 4.1 2.7 2.9 180 0L5.4 0"},                                          // n
    {6, "A3 3.5 3 3.5 0 360"},                                                                     // o
    {6, "M0 7L0 -3.2;A3 3.5 3 3.5 0 360"},                                                         // p
    {6, "A3 3.5 3 3.5 0 360;M6 7L6 -3.2"},                                                         // q
    {3.2, "M0 7L0 0;M0 3.9A2.5 3.9 2.5 3.1 180 72"},                                               // r
    {4.6, "A2.35 5.2 2.05 1.8 35 270A2.35 1.7 2.3 1.7 90 -145"},                                   // s
    {3.6, "M1.4 9.2L1.4 2A3.2 2 1.8 2 180 285;M0 7L3.5 7"},                                        // t
    {5.4, "M0 7L0 2.9A2.7 2.9 2.7 2.9 180 360;M5.4 7L5.4 0"},                                      // u
    {5.6, "M0 7L2.8 0L5.6 7"},                                                                     // v
    {8.6, "M0 7L2.15 0L4.3 7L6.45 0L8.6 7"},                                                       // w
    {5.2, "M0 7L5.2 0;M5.2 7L0 0"},                                                                // x
    {5.6, "M0 7L2.8 0;M5.6 7L1.5 -3.2"},                                                           // y
    {5, "M0 7L5 7L0 0L5 0"},                                                                       // z
    {2.8, "A2.8 9.2 1.4 1.8 90 180L1.4 6A0 6 1.4 1.7 0 -90A0 2.6 1.4 1.7 90 0L1.4 -0.6A2.8 -0.6 1.4 1.8 180 270"},  // {
    {0.4, "M0.2 11.4L0.2 -2.8"},                                                                                    // |
    {2.8, "A0 9.2 1.4 1.8 90 0L1.4 6A2.8 6 1.4 1.7 180 270A2.8 2.6 1.4 1.7 90 180L1.4 -0.6A0 -0.6 1.4 1.8 0 -90"},  // }
    {6, "A1.6 3.7 1.6 1.2 180 15A4.5 4.3 1.5 1.2 195 360"},                                                         // ~
}};

constexpr double line_height = 15;  ///< units in `size` pixels
constexpr double pen_width = 1.15;
constexpr double letter_space = 2.3;

struct Point {
  double x, y;
};
using Stroke = std::vector<Point>;

/// The pen's strokes as lines; arcs in steps of at most 9 degrees.
std::vector<Stroke> strokes_of(const Glyph& glyph) {
  std::vector<Stroke> strokes;
  bool lifted = true;
  const char* at = glyph.path;
  const char* const end = at + std::strlen(at);
  const auto number = [&at, end] {
    double value = 0;
    at = std::from_chars(at + (*at == ' '), end, value).ptr;
    return value;
  };
  const auto go = [&](double x, double y) {
    if (lifted) strokes.emplace_back();
    lifted = false;
    strokes.back().push_back({x, y});
  };
  while (at != end) {
    const char command = *at++;
    if (command == ';' || command == 'M') lifted = true;
    if (command == 'M' || command == 'L') {
      const double x = number();
      go(x, number());
    } else if (command == 'A') {
      std::array<double, 6> v{};
      for (double& value : v) value = number();
      const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(v[5] - v[4]) / 9)));
      for (int i = 0; i <= steps; ++i) {
        const double angle = (v[4] + (v[5] - v[4]) * i / steps) * std::numbers::pi / 180;
        go(v[0] + v[2] * std::cos(angle), v[1] + v[3] * std::sin(angle));
      }
    }
  }
  return strokes;
}

double distance_to(Point p, Point a, Point b) {
  const double dx = b.x - a.x, dy = b.y - a.y, length2 = dx * dx + dy * dy;
  const double t = length2 > 0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / length2, 0.0, 1.0) : 0.0;
  return std::hypot(p.x - a.x - t * dx, p.y - a.y - t * dy);
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

/// How much of each pixel of a box the pen covers.
class Coverage {
 public:
  Coverage(const Image& image, double x0, double y0, double x1, double y1)
      : left_(static_cast<int>(std::clamp(std::floor(x0), 0.0, 1.0 * image.width))),
        top_(static_cast<int>(std::clamp(std::floor(y0), 0.0, 1.0 * image.height))),
        right_(static_cast<int>(std::clamp(std::ceil(x1), 0.0, 1.0 * image.width))),
        bottom_(static_cast<int>(std::clamp(std::ceil(y1), 0.0, 1.0 * image.height))),
        values_(static_cast<std::size_t>(right_ - left_) * static_cast<std::size_t>(bottom_ - top_)) {}

  void add_segment(Point a, Point b, double half_width) {
    const double reach = half_width + 1;
    const auto low = [&](double v, int least) { return std::max(least, static_cast<int>(std::floor(v - reach))); };
    const auto high = [&](double v, int most) { return std::min(most, static_cast<int>(std::ceil(v + reach))); };
    for (int y = low(std::min(a.y, b.y), top_); y < high(std::max(a.y, b.y), bottom_); ++y)
      for (int x = low(std::min(a.x, b.x), left_); x < high(std::max(a.x, b.x), right_); ++x) {
        const double distance = distance_to({x + 0.5, y + 0.5}, a, b);
        double& value = at(x, y);
        value = std::max(value, std::clamp(half_width + 0.5 - distance, 0.0, 1.0));
      }
  }

  void paint(Image& image, Pixel colour) {
    for (int y = top_; y < bottom_; ++y)
      for (int x = left_; x < right_; ++x) blend(image.at(x, y), colour, at(x, y) * colour.a / 255.0);
  }

 private:
  double& at(int x, int y) {
    return values_[static_cast<std::size_t>(y - top_) * static_cast<std::size_t>(right_ - left_) +
                   static_cast<std::size_t>(x - left_)];
  }

  int left_, top_, right_, bottom_;
  std::vector<double> values_;
};

/// The text as glyph numbers; a character of UTF-8 beyond ASCII is one '?'.
std::vector<std::size_t> glyphs_of(std::string_view text) {
  std::vector<std::size_t> numbers;
  for (char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0U) == 0x80U) continue;
    numbers.push_back(byte >= 32 && byte < 127 ? byte - 32U : std::size_t{'?' - 32});
  }
  return numbers;
}

}  // namespace

double text_width(std::string_view text, double size) {
  const auto numbers = glyphs_of(text);
  if (numbers.empty()) return 0;
  double width = -letter_space;
  for (std::size_t g : numbers) width += glyphs[g].width + letter_space;
  return width * size / line_height;
}

void draw_text(Image& image, std::string_view text, double x, double baseline, double size, Pixel colour) {
  const double unit = size / line_height;
  // Thinner than about a pixel the pen would turn grey.
  const double half_width = std::max(0.55, 0.5 * pen_width * unit);
  Coverage coverage(image, x - size, baseline - size, x + text_width(text, size) + size, baseline + size);
  for (std::size_t g : glyphs_of(text)) {
    for (const Stroke& stroke : strokes_of(glyphs[g])) {
      const auto place = [&](Point p) { return Point{x + p.x * unit, baseline - p.y * unit}; };
      for (std::size_t i = 0; i < stroke.size(); ++i)
        coverage.add_segment(place(stroke[i == 0 ? 0 : i - 1]), place(stroke[i]), half_width);
    }
    x += (glyphs[g].width + letter_space) * unit;
  }
  coverage.paint(image, colour);
}

}  // namespace render
