/// Line plots: values over time with labelled axes, linear or logarithmic.
#pragma once

#include <render/axis.hpp>
#include <render/colour.hpp>
#include <render/image.hpp>

#include <span>
#include <string>
#include <vector>

namespace render {

/// A line through points in the order of the list. Points that an axis can't show (not finite, or not above 0 on a
/// logarithmic one) are left out.
struct Series {
  std::string name;
  std::vector<double> x, y;  ///< of equal length
  Colour colour{};
  double width = 2;      ///< of the line, in pixels
  bool markers = false;  ///< a disc at each point
};

struct PlotOptions {
  int width = 960;
  int height = 540;
  std::string title, x_label, y_label;
  bool log_x = false;
  bool log_y = false;
  double text_size = 15;  ///< height of a line of text, in pixels
};

/// The plot with a legend. Without a point to show it has axes from 0 to 1 (1 to 10 logarithmic).
/// Errors    npt::Error for series whose x and y differ in length, and sizes outside 64 .. 16384.
Image draw_plot(std::span<const Series> series, const PlotOptions& options);

}  // namespace render
