#include <doctest/doctest.h>

#include <render/plot.hpp>

#include <npt/base/error.hpp>

#include <cmath>
#include <limits>
#include <vector>

namespace {

using render::PlotOptions;
using render::Series;

/// Mean row of the pixels in a column that are about this colour, or -1.
double row_of(const render::Image& image, int x, render::Pixel colour) {
  double sum = 0;
  int count = 0;
  for (int y = 0; y < image.height; ++y) {
    const render::Pixel p = image.at(x, y);
    if (std::abs(p.r - colour.r) + std::abs(p.g - colour.g) + std::abs(p.b - colour.b) < 60) {
      sum += y + 0.5;
      ++count;
    }
  }
  return count == 0 ? -1 : sum / count;
}

const render::Colour dark_red = render::from_hex(0xD00000);
const render::Pixel red_pixel{0xD0, 0, 0, 255};

}  // namespace

TEST_CASE("ticks are round numbers inside the axis") {
  using V = std::vector<double>;
  CHECK(render::axis_ticks(0, 10, false, 5) == V{0, 2, 4, 6, 8, 10});
  CHECK(render::axis_ticks(1, 100, true) == V{1, 2, 5, 10, 20, 50, 100});
  CHECK(render::axis_ticks(1, 1e12, true, 7) == V{1, 1e2, 1e4, 1e6, 1e8, 1e10, 1e12});
  for (const auto& range : {std::pair{1.0, 2.5}, {3.1, 3.4}, {20.0, 35.0}, {1e-7, 3e-7}})
    for (const bool logarithmic : {false, true}) {
      const double low = range.first, high = range.second;
      const V ticks = render::axis_ticks(low, high, logarithmic);
      CAPTURE(low);
      CAPTURE(logarithmic);
      CHECK(ticks.size() >= 2);
      CHECK(ticks.size() <= 12);
      for (const double tick : ticks) CHECK((tick >= low * 0.999 && tick <= high * 1.001));
    }
}

TEST_CASE("a power law is a straight line on logarithmic axes and none on linear ones") {
  Series s{.name = "", .x = {}, .y = {}, .colour = dark_red, .width = 3};
  for (double x = 1; x < 1001; x *= 1.1) {
    s.x.push_back(x);
    s.y.push_back(40 * std::pow(x, -0.34));
  }
  const auto bend = [&](bool logarithmic) {
    PlotOptions options;
    options.log_x = options.log_y = logarithmic;
    const render::Image image = render::draw_plot({&s, 1}, options);
    CHECK(image.width == options.width);
    const double a = row_of(image, 200, red_pixel), b = row_of(image, 500, red_pixel),
                 c = row_of(image, 800, red_pixel);
    REQUIRE(a > 0);
    CHECK(a < b);
    CHECK(b < c);
    return std::abs(b - (a + c) / 2);
  };
  CHECK(bend(true) < 1.5);
  CHECK(bend(false) > 5);
}

TEST_CASE("what can't be shown is left out, and a plot of nothing has axes") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  Series s{.name = "odd", .x = {0, 1, 2, 3, 4}, .y = {1, nan, -3, inf, 2}, .colour = dark_red};
  PlotOptions options{.title = "title", .x_label = "x", .y_label = "y"};
  options.log_x = options.log_y = true;
  CHECK(render::draw_plot({&s, 1}, options).height == options.height);
  s.x.clear();
  s.y.clear();
  CHECK(render::draw_plot({&s, 1}, options).height == options.height);
  CHECK(render::draw_plot({}, options).height == options.height);
  s.x = {5, 5};
  s.y = {7, 7};
  for (const bool logarithmic : {false, true}) {
    options.log_x = options.log_y = logarithmic;
    CHECK(render::draw_plot({&s, 1}, options).height == options.height);
  }
}

TEST_CASE("series and sizes without sense are refused") {
  Series s{.name = "s", .x = {1, 2}, .y = {1}, .colour = dark_red};
  CHECK_THROWS_WITH(render::draw_plot({&s, 1}, {}), "plot: series s: found 1 values, expected 2, one for each place");
  PlotOptions options;
  options.width = 10;
  CHECK_THROWS_AS(render::draw_plot({}, options), npt::Error);
}
