#include <render/plot.hpp>

#include <render/text.hpp>

#include <npt/base/error.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace render {

namespace {

/// Position on an axis, in its own scale: the value, or its logarithm.
struct Axis {
  double low = 0, high = 1;
  bool logarithmic = false;

  bool shows(double value) const { return std::isfinite(value) && (!logarithmic || value > 0); }
  double position(double value) const { return logarithmic ? std::log10(value) : value; }
  double share(double value) const { return (position(value) - position(low)) / (position(high) - position(low)); }
};

/// The range of the values, with a little margin; whatever they are, high is above low.
template <class Get>
Axis fit_axis(std::span<const Series> series, bool logarithmic, double margin, Get get) {
  Axis axis{.low = std::numeric_limits<double>::infinity(), .high = -axis.low, .logarithmic = logarithmic};
  for (const Series& s : series)
    for (const double value : get(s)) {
      if (!axis.shows(value)) continue;
      axis.low = std::min(axis.low, value);
      axis.high = std::max(axis.high, value);
    }
  if (axis.low > axis.high) return {logarithmic ? 1.0 : 0.0, logarithmic ? 10.0 : 1.0, logarithmic};
  if (logarithmic) {
    if (axis.high < 1.5 * axis.low) {
      axis.low /= 1.3;
      axis.high *= 1.3;
    }
    const double factor = std::pow(axis.high / axis.low, margin);
    return {axis.low / factor, axis.high * factor, true};
  }
  const double span = axis.high > axis.low ? axis.high - axis.low : std::max(1.0, std::abs(axis.high));
  return {axis.low - margin * span, axis.high + margin * span, false};
}

Pixel blended(Pixel below, Pixel above, double coverage) {
  const auto mix_channel = [coverage](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround(a + (b - a) * coverage));
  };
  return {mix_channel(below.r, above.r), mix_channel(below.g, above.g), mix_channel(below.b, above.b), 255};
}

struct Point {
  double x = 0, y = 0;
};

/// How much of each pixel a line covers. A line's own crossings and joints don't darken it.
class Coverage {
 public:
  Coverage(int width, int height)
      : width_(width), height_(height), values_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  /// All points at most `radius` from the segment.
  void stroke(Point a, Point b, double radius) {
    const double reach = radius + 1;
    const int x0 = std::max(0, static_cast<int>(std::floor(std::min(a.x, b.x) - reach)));
    const int x1 = std::min(width_ - 1, static_cast<int>(std::ceil(std::max(a.x, b.x) + reach)));
    const int y0 = std::max(0, static_cast<int>(std::floor(std::min(a.y, b.y) - reach)));
    const int y1 = std::min(height_ - 1, static_cast<int>(std::ceil(std::max(a.y, b.y) + reach)));
    const double dx = b.x - a.x, dy = b.y - a.y, square = dx * dx + dy * dy;
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        const double px = x + 0.5 - a.x, py = y + 0.5 - a.y;
        const double t = square > 0 ? std::clamp((px * dx + py * dy) / square, 0.0, 1.0) : 0.0;
        const double distance = std::hypot(px - t * dx, py - t * dy);
        double& value =
            values_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
        value = std::max(value, std::clamp(radius + 0.5 - distance, 0.0, 1.0));
      }
  }

  void paint(Image& image, Pixel colour) const {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const double c =
            values_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
        if (c > 0) image.at(x, y) = blended(image.at(x, y), colour, c);
      }
  }

 private:
  int width_, height_;
  std::vector<double> values_;
};

class Plot {
 public:
  Plot(std::span<const Series> series, const PlotOptions& options)
      : series_(series),
        options_(options),
        x_(fit_axis(
            series, options.log_x, 0.0, [](const Series& s) -> const auto& { return s.x; })),
        y_(fit_axis(
            series, options.log_y, 0.04, [](const Series& s) -> const auto& { return s.y; })),
        image_(options.width, options.height, {255, 255, 255, 255}) {
    x_ticks_ = axis_ticks(x_.low, x_.high, x_.logarithmic, std::max(2, options.width / 90));
    y_ticks_ = axis_ticks(y_.low, y_.high, y_.logarithmic, std::max(2, options.height / 45));
    double widest = 0;
    for (const double tick : y_ticks_) widest = std::max(widest, text_width(tick_text(tick), size()));
    left_ = widest + 1.6 * size();
    right_ = options.width - 1.5 * size();
    top_ = (options.title.empty() ? 2.2 : 4.2) * size();
    bottom_ = options.height - (options.x_label.empty() ? 2.2 : 3.8) * size();
  }

  Image draw() {
    grid();
    for (const Series& s : series_) line(s);
    labels();
    legend();
    return std::move(image_);
  }

 private:
  static constexpr Pixel ink{51, 54, 57, 255}, faint{228, 228, 228, 255};
  double size() const { return options_.text_size; }
  Point place(double x, double y) const {
    return {left_ + x_.share(x) * (right_ - left_), bottom_ - y_.share(y) * (bottom_ - top_)};
  }
  void rule(Point a, Point b, Pixel colour, double width) {
    Coverage coverage(image_.width, image_.height);
    coverage.stroke(a, b, width / 2);
    coverage.paint(image_, colour);
  }
  void centred(const std::string& text, double x, double baseline) {
    draw_text(image_, text, x - text_width(text, size()) / 2, baseline, size(), ink);
  }

  void grid() {
    for (const double tick : x_ticks_) {
      const double x = std::floor(place(tick, y_.low).x) + 0.5;
      rule({x, top_}, {x, bottom_}, faint, 1);
      centred(tick_text(tick), x, bottom_ + 1.5 * size());
    }
    for (const double tick : y_ticks_) {
      const double y = std::floor(place(x_.low, tick).y) + 0.5;
      rule({left_, y}, {right_, y}, faint, 1);
      const std::string text = tick_text(tick);
      draw_text(image_, text, left_ - text_width(text, size()) - 0.6 * size(), y + 0.35 * size(), size(), ink);
    }
    rule({left_, bottom_}, {right_, bottom_}, ink, 1);
    rule({left_, top_}, {left_, bottom_}, ink, 1);
  }

  void line(const Series& s) {
    Coverage coverage(image_.width, image_.height);
    bool connected = false;
    Point last{};
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (!x_.shows(s.x[i]) || !y_.shows(s.y[i])) continue;
      const Point point = place(s.x[i], s.y[i]);
      coverage.stroke(connected ? last : point, point, s.width / 2);
      if (s.markers) coverage.stroke(point, point, 1.5 * s.width);
      last = point;
      connected = true;
    }
    coverage.paint(image_, to_pixel(s.colour));
  }

  void labels() {
    if (!options_.title.empty()) draw_text(image_, options_.title, left_, 1.6 * size(), 1.15 * size(), ink);
    draw_text(image_, options_.y_label, 0.6 * size(), top_ - 0.8 * size(), size(), ink);
    centred(options_.x_label, (left_ + right_) / 2, bottom_ + 3.1 * size());
  }

  /// In the upper right corner, where curves that fall leave space.
  void legend() {
    double widest = 0;
    for (const Series& s : series_) widest = std::max(widest, text_width(s.name, size()));
    double y = top_ + 1.4 * size();
    for (const Series& s : series_) {
      if (s.name.empty()) continue;
      const double x = right_ - widest - 1.0 * size(), middle = y - 0.33 * size();
      rule({x - 2.4 * size(), middle}, {x - 0.6 * size(), middle}, to_pixel(s.colour), s.width);
      if (s.markers) rule({x - 1.5 * size(), middle}, {x - 1.5 * size(), middle}, to_pixel(s.colour), 3 * s.width);
      draw_text(image_, s.name, x, y, size(), ink);
      y += 1.5 * size();
    }
  }

  std::span<const Series> series_;
  const PlotOptions& options_;
  Axis x_, y_;
  Image image_;
  std::vector<double> x_ticks_, y_ticks_;
  double left_ = 0, right_ = 0, top_ = 0, bottom_ = 0;
};

}  // namespace

Image draw_plot(std::span<const Series> series, const PlotOptions& options) {
  for (const int side : {options.width, options.height})
    if (side < 64 || side > 16384)
      throw npt::Error({"plot", {}, std::to_string(side) + " pixels", "64 to 16384 pixels"});
  for (const Series& s : series)
    if (s.x.size() != s.y.size())
      throw npt::Error({"plot", "series " + s.name, std::to_string(s.y.size()) + " values",
                        std::to_string(s.x.size()) + ", one for each place"});
  return Plot(series, options).draw();
}

}  // namespace render
