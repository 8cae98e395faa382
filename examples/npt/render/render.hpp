/// Pictures of meshes for papers, demos and figures: a grid of captioned panels, drawn without display or GPU.
///
///   const render::Panel panels[] = {{&identity, "identity", {}}, {&pose, "pose", {}}, {&result, "result", {}}};
///   render::write_png("result.png", render::draw_figure(panels, {}));
///
/// A paper's figure is a grid with captions outside, at one scale, and perhaps errors as colours (data_colours.hpp):
///
///   render::FigureOptions figure = render::grid_figure(3);
///   figure.column_captions = {"identity", "pose", "ours"};
///   figure.row_captions = {"seen", "unseen"};
///   figure.colour_bar = {0, 80, "error (mm)", true};
///   panels[2].colours = render::heat_colours(render::centred_distances(xyz, truth), 0, 0.08);
///   panels[2].even_light = render::data_light;
///
/// A picture depends on its input alone, not on the number of threads.
#pragma once

#include <render/camera.hpp>
#include <render/colour.hpp>
#include <render/image.hpp>
#include <render/surface.hpp>

#include <span>
#include <string>
#include <vector>

namespace render {

enum class Backdrop { colour, transparent };

/// A scale of heat_colour under the picture: the smallest and the largest value, and what they are.
struct ColourBar {
  double low = 0, high = 0;
  std::string label;      ///< with the unit: "error (mm)"
  bool open_end = false;  ///< larger values have the colour of the largest: "80+"
  bool shown() const { return high > low; }
};

struct FigureOptions {
  int panel_width = 500;                     ///< 0: as the widest figure needs
  int panel_height = 640;                    ///< without its caption
  int columns = 0;                           ///< 0: all panels in one row
  int gap = 0;                               ///< pixels between panels
  bool one_scale = false;                    ///< all panels at one scale, not only those of each row
  std::vector<std::string> column_captions;  ///< above the columns: none, or one for each; lines are separated by '\n'
  std::vector<std::string> row_captions;     ///< left of the rows, turned to be read from below
  View view = three_quarter_view;
  UpAxis up = UpAxis::y;
  int samples = 4;  ///< each pixel is samples x samples points
  bool floor_shadow = true;
  /// Across a lamp's shadow map; no more than the panel's height in pixels. A cell of 448 is 4 mm on a person of 1.8 m: less than any mesh's faces.
  int shadow_cells = 448;
  Backdrop backdrop = Backdrop::colour;
  Colour background{1, 1, 1};
  Colour surface = from_hex(0xD3CCC3);  ///< of panels that name no colour
  double caption_size = 0.052;          ///< height of a line, as a share of the panel's smaller side
  ColourBar colour_bar;
};

/// The widest and highest picture that is drawn.
inline constexpr int largest_side = 16384;

/// The share of even light in which colours can be compared with their scale and shapes are still seen.
inline constexpr double data_light = 0.55;

/// The options of a grid for print: so many columns, one scale, panels no larger than their figures.
inline FigureOptions grid_figure(int columns, int panel_height = 420) {
  FigureOptions options;
  options.columns = columns;
  options.panel_width = 0;
  options.panel_height = panel_height;
  options.one_scale = true;
  options.gap = panel_height / 40;
  options.caption_size = 0.075;
  return options;
}

/// All panels, row by row, with their captions. Panels of one row share their scale and their ground line.
/// Errors    npt::Error for no panel, a mesh without vertices, captions of another number than columns or rows, and
///           sizes outside 16 .. largest_side.
Image draw_figure(std::span<const Panel> panels, const FigureOptions& options);

}  // namespace render
