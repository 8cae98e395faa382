#include <render/axis.hpp>
#include <render/data_colours.hpp>
#include <render/painter.hpp>
#include <render/render.hpp>
#include <render/text.hpp>

#include <npt/base/error.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <utility>

namespace render {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

Pixel page_of(const FigureOptions& options) {
  return options.backdrop == Backdrop::colour ? to_pixel(options.background) : Pixel{0, 0, 0, 0};
}

Pixel ink(const FigureOptions& options) {
  const bool dark = options.backdrop == Backdrop::colour && luminance(options.background) < 0.18F;
  return dark ? Pixel{235, 235, 235, 255} : Pixel{40, 42, 46, 255};
}

/// Lines of text of one size, one below the other, each in the middle of the space; all smaller where one is too wide.
class TextBlock {
 public:
  TextBlock(const std::string& text, double line, double space) : lines_(lines_of(text)), line_(line) {
    double widest = 0;
    for (const std::string& l : lines_) widest = std::max(widest, text_width(l, line));
    if (widest > space && widest > 0) line_ = line * space / widest;
  }

  /// How much space a text takes from top to bottom, in lines, without changing its size.
  static double height_in_lines(const std::string& text) {
    const std::size_t count = lines_of(text).size();
    return count == 0 ? 0 : 1.2 * static_cast<double>(count) + 0.3;
  }

  /// `middle` is the x of the lines' middles, `top` the upper border of the first.
  void draw(Image& image, double middle, double top, Pixel colour) const {
    double baseline = top + line_ * 0.95;
    for (const std::string& text : lines_) {
      draw_text(image, text, middle - 0.5 * text_width(text, line_), baseline, line_, colour);
      baseline += line_ * 1.2;
    }
  }

 private:
  std::vector<std::string> lines_;
  double line_;
};

/// Columns and rows of panels, and their sizes in pixels.
struct Grid {
  int columns = 0, rows = 0;
  std::vector<int> widths, heights;  ///< [columns], [rows]

  Grid(std::size_t panels, const FigureOptions& o) {
    const int count = static_cast<int>(panels);
    columns = o.columns > 0 ? std::min(o.columns, count) : count;
    rows = (count + columns - 1) / columns;
    widths.assign(static_cast<std::size_t>(columns), o.panel_width);
    heights.assign(static_cast<std::size_t>(rows), o.panel_height);
  }
  std::size_t column_of(std::size_t panel) const { return panel % static_cast<std::size_t>(columns); }
  std::size_t row_of(std::size_t panel) const { return panel / static_cast<std::size_t>(columns); }
  int width_of(std::size_t panel) const { return widths[column_of(panel)]; }
  int height_of(std::size_t panel) const { return heights[row_of(panel)]; }
};

/// Where the parts of the picture are, from the border inwards.
struct Layout {
  Grid grid;
  double line = 0;         ///< height of a line of text in pixels
  int caption_height = 0;  ///< below each panel
  int left = 0, top = 0, bar_height = 0;
  std::vector<int> x, y;  ///< [columns], [rows]
  std::int64_t width = 0, height = 0;

  Layout(Grid sizes, std::span<const Panel> panels, const FigureOptions& o) : grid(std::move(sizes)) {
    line = std::max(10.0, o.caption_size * (o.panel_width > 0 ? std::min(o.panel_width, o.panel_height)
                                                              : static_cast<double>(o.panel_height) * 0.8));
    const auto space = [this](double lines, double more) {
      return lines > 0 ? static_cast<int>(std::lround(line * (lines + more))) : 0;
    };
    double lines = 0;
    for (const Panel& panel : panels) lines = std::max(lines, TextBlock::height_in_lines(panel.caption));
    caption_height = space(lines, 0);
    top = space(most_lines(o.column_captions), 0.2);
    left = space(most_lines(o.row_captions), 0.6);
    bar_height = o.colour_bar.shown() ? space(o.colour_bar.label.empty() ? 2.7 : 3.9, 0) : 0;
    width = left;
    for (const int w : grid.widths) {
      x.push_back(static_cast<int>(std::min<std::int64_t>(width, largest_side)));
      width += w + o.gap;
    }
    height = top;
    for (const int h : grid.heights) {
      y.push_back(static_cast<int>(std::min<std::int64_t>(height, largest_side)));
      height += h + caption_height + o.gap;
    }
    width -= o.gap;
    height += bar_height - o.gap;
  }

 private:
  static double most_lines(const std::vector<std::string>& captions) {
    double most = 0;
    for (const std::string& caption : captions) most = std::max(most, TextBlock::height_in_lines(caption));
    return most;
  }
};

void check_options(std::span<const Panel> panels, const FigureOptions& o) {
  if (panels.empty()) throw npt::Error({"picture", {}, "no mesh", "at least one"});
  const auto in_range = [](const char* name, int value, int low, int high) {
    if (value < low || value > high)
      throw npt::Error({name, {}, std::to_string(value), std::to_string(low) + " to " + std::to_string(high)});
  };
  if (o.panel_width != 0) in_range("panel width", o.panel_width, 16, 8192);
  in_range("panel height", o.panel_height, 16, 8192);
  in_range("samples", o.samples, 1, most_samples);
  in_range("gap", o.gap, 0, 8192);
  in_range("shadow cells", o.shadow_cells, 16, 8192);
  for (const Panel& panel : panels)
    if (panel.mesh != nullptr && panel.picture != nullptr)
      throw npt::Error({"picture", {}, "a panel with a mesh and a picture", "one of them"});
}

void check_layout(const Layout& layout, const FigureOptions& o) {
  const auto matches = [](const char* name, std::size_t captions, int count) {
    if (captions != 0 && captions != static_cast<std::size_t>(count))
      throw npt::Error({name, {}, std::to_string(captions), std::to_string(count) + ", one for each"});
  };
  matches("column captions", o.column_captions.size(), layout.grid.columns);
  matches("row captions", o.row_captions.size(), layout.grid.rows);
  if (layout.width > largest_side || layout.height > largest_side)
    throw npt::Error({"picture",
                      {},
                      std::to_string(layout.grid.columns) + " x " + std::to_string(layout.grid.rows) +
                          " panels of at most " + std::to_string(std::ranges::max(layout.grid.widths)) + " x " +
                          std::to_string(std::ranges::max(layout.grid.heights)),
                      "at most " + std::to_string(largest_side) + " pixels each way"});
}

void draw_column_captions(Image& image, const Layout& layout, const FigureOptions& options) {
  for (std::size_t c = 0; c < options.column_captions.size(); ++c)
    TextBlock(options.column_captions[c], layout.line, 0.98 * layout.grid.widths[c])
        .draw(image, layout.x[c] + 0.5 * layout.grid.widths[c], 0.1 * layout.line, ink(options));
}

/// Beside the rows, turned by a quarter: read from below.
void draw_row_captions(Image& image, const Layout& layout, const FigureOptions& options) {
  for (std::size_t r = 0; r < options.row_captions.size(); ++r) {
    const int length = layout.grid.heights[r];
    Image strip(length, layout.left, page_of(options));
    TextBlock(options.row_captions[r], layout.line, 0.98 * length)
        .draw(strip, 0.5 * length, 0.1 * layout.line, ink(options));
    for (int y = 0; y < length; ++y)
      for (int x = 0; x < layout.left; ++x) image.at(x, layout.y[r] + y) = strip.at(length - 1 - y, x);
  }
}

void draw_colour_bar(Image& image, int top, const Layout& layout, const FigureOptions& options) {
  const double line = layout.line;
  const int width = static_cast<int>(std::min(0.9 * (image.width - layout.left), 26 * line));
  const int left = layout.left + (image.width - layout.left - width) / 2;
  const int bar_top = top + static_cast<int>(0.7 * line), bar_bottom = bar_top + static_cast<int>(0.7 * line);
  for (int x = 0; x < width; ++x)
    for (int y = bar_top; y < std::min(bar_bottom, image.height); ++y)
      image.at(left + x, y) = to_pixel(heat_colour((static_cast<float>(x) + 0.5F) / static_cast<float>(width)));
  const ColourBar& bar = options.colour_bar;
  const double size = 0.85 * line, baseline = bar_bottom + 1.2 * line;
  const Pixel colour = ink(options);
  double free_from = -1e9;  // numbers don't overlap
  for (const double value : axis_ticks(bar.low, bar.high, false, 7)) {
    const double share = (value - bar.low) / (bar.high - bar.low), x = left + share * (width - 1);
    for (int y = bar_bottom; y < std::min(bar_bottom + static_cast<int>(0.25 * line), image.height); ++y)
      image.at(std::clamp(static_cast<int>(std::lround(x)), 0, image.width - 1), y) = colour;
    const std::string text = tick_text(value) + (bar.open_end && share > 1 - 1e-9 ? "+" : "");
    const double text_left = x - 0.5 * text_width(tick_text(value), size);
    if (text_left < free_from) continue;
    draw_text(image, text, text_left, baseline, size, colour);
    free_from = text_left + text_width(text, size) + 0.5 * size;
  }
  TextBlock(bar.label, size, static_cast<double>(image.width - layout.left))
      .draw(image, left + 0.5 * width, baseline + 0.35 * line, colour);
}

/// How much smaller a picture has to be for its panel.
double scale_of(const Image& picture, double width, double height) {
  return std::min({1.0, width / std::max(picture.width, 1), height / std::max(picture.height, 1)});
}

/// A picture in the middle of a panel, over the page where it is transparent.
void place(Image& image, const Image& picture, int left, int top, int width, int height) {
  const double scale = scale_of(picture, width, height);
  const auto fitted_side = [scale](int side) { return std::max(1, static_cast<int>(std::floor(scale * side + 1e-6))); };
  const Image fitted = scale < 1 ? shrunk(picture, fitted_side(picture.width), fitted_side(picture.height)) : picture;
  image.lay_over(fitted, left + (width - fitted.width) / 2, top + (height - fitted.height) / 2);
}

/// The border around figures in panels of their size, as a share of the height: space for the shadows' ends.
constexpr float tight_border = 0.1F;

/// The panels' figures and cameras: at one scale row by row, or all.
struct Scene {
  Grid grid;
  std::vector<Figure> figures;
  std::vector<Camera> cameras;
};

/// The scale at which the tallest row of a group is as high as options.panel_height.
float focal_of_rows(const Silhouettes& seen, std::span<const Range> rows, const FigureOptions& options) {
  float tallest = 0, widest = 0;
  for (const Range& row : rows) tallest = std::max(tallest, row.size());
  for (const Range& across : seen.across) widest = std::max(widest, across.size());
  const float h = static_cast<float>(options.panel_height), space = (1 - tight_border) * h;
  // What lies flat, such as a single point, doesn't get wider than four heights.
  return std::min({focal_for(space, tallest), focal_for(4 * h, widest), 1e3F * h});
}

void grow(int& side, double pixels) {
  side = std::max(side, static_cast<int>(std::min(std::ceil(pixels), 1.0 * largest_side)));
}

/// Panels just as large as their figures need.
void fit_panels(Scene& scene, std::span<const Panel> panels, const std::vector<std::vector<Vec3f>>& outlines,
                std::size_t group, const FigureOptions& options) {
  Grid& grid = scene.grid;
  std::ranges::fill(grid.heights, 16);
  std::ranges::fill(grid.widths, 16);
  const double border = static_cast<double>(tight_border) * options.panel_height;
  std::vector<Range> rows(static_cast<std::size_t>(grid.rows));
  std::vector<Silhouettes> groups;
  std::vector<float> focal;
  for (std::size_t first = 0; first < panels.size(); first += group) {
    const std::size_t count = std::min(group, panels.size() - first);
    const Silhouettes& seen = groups.emplace_back(std::span(outlines).subspan(first, count), options.view);
    for (std::size_t i = 0; i < count; ++i) rows[grid.row_of(first + i)].add(seen.down[i]);
    const std::size_t top = grid.row_of(first), bottom = grid.row_of(first + count - 1);
    focal.push_back(focal_of_rows(seen, std::span(rows).subspan(top, bottom - top + 1), options));
  }
  for (std::size_t i = 0; i < panels.size(); ++i) {
    int &width = grid.widths[grid.column_of(i)], &height = grid.heights[grid.row_of(i)];
    const double scale = static_cast<double>(focal[i / group]);
    if (const Image* picture = panels[i].picture; picture != nullptr) {
      const double shrink = scale_of(*picture, 1e9, options.panel_height);
      grow(width, shrink * picture->width);
      grow(height, shrink * picture->height);
    } else if (panels[i].mesh != nullptr) {
      grow(width, scale * static_cast<double>(groups[i / group].across[i % group].size()) + border);
      grow(height, scale * static_cast<double>(rows[grid.row_of(i)].size()) + border);
    }
  }
  for (std::size_t i = 0; i < panels.size(); ++i)
    scene.cameras.push_back(groups[i / group].of_panel(i % group, focal[i / group], rows[grid.row_of(i)],
                                                       grid.width_of(i), grid.height_of(i)));
}

Scene scene_of(std::span<const Panel> panels, const FigureOptions& options) {
  Scene scene{Grid(panels.size(), options), {}, {}};
  const std::size_t group = options.one_scale ? panels.size() : static_cast<std::size_t>(scene.grid.columns);
  std::vector<std::vector<Vec3f>> outlines;
  for (std::size_t first = 0; first < panels.size(); first += group)
    for (Figure& figure :
         make_figures(panels.subspan(first, std::min(group, panels.size() - first)), options.up, options.surface)) {
      outlines.push_back(figure.outline);
      scene.figures.push_back(std::move(figure));
    }
  if (options.panel_width == 0) {
    fit_panels(scene, panels, outlines, group, options);
    return scene;
  }
  for (std::size_t first = 0; first < panels.size(); first += group)
    for (const Camera& camera : fit_cameras(std::span(outlines).subspan(first, std::min(group, panels.size() - first)),
                                            options.view, options.panel_width, options.panel_height))
      scene.cameras.push_back(camera);
  return scene;
}

}  // namespace

Image draw_figure(std::span<const Panel> panels, const FigureOptions& options) {
  check_options(panels, options);
  const Scene scene = scene_of(panels, options);
  const Layout layout(scene.grid, panels, options);
  check_layout(layout, options);
  Image image(static_cast<int>(layout.width), static_cast<int>(layout.height), page_of(options));
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const int left = layout.x[layout.grid.column_of(i)], top = layout.y[layout.grid.row_of(i)];
    const int width = layout.grid.width_of(i), height = layout.grid.height_of(i);
    if (panels[i].picture != nullptr) {
      place(image, *panels[i].picture, left, top, width, height);
    } else if (panels[i].mesh != nullptr) {
      FigureOptions own = options;
      own.panel_width = width;
      own.panel_height = height;
      image.paste(paint_panel(scene.figures[i], scene.cameras[i], own), left, top);
    }
    TextBlock(panels[i].caption, layout.line, 0.96 * width).draw(image, left + 0.5 * width, top + height, ink(options));
  }
  draw_column_captions(image, layout, options);
  draw_row_captions(image, layout, options);
  if (options.colour_bar.shown()) draw_colour_bar(image, image.height - layout.bar_height, layout, options);
  return image;
}

}  // namespace render
