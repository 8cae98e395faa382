/// Pictures of meshes for papers, demos and figures: a grid of captioned panels at one scale, drawn without display or
/// GPU.
///
///   const render::Panel panels[] = {{&identity, "identity", {}}, {&pose, "pose", {}}, {&result, "result", {}}};
///   render::write_png("result.png", render::draw_figure(panels, {}));
///
/// The same input gives the same picture, whatever the number of threads.
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

/// A scale of colours under the picture: the smallest and the largest value, and what they are.
struct ColourBar {
  double low = 0, high = 0;
  std::string label;
  bool shown() const { return high > low; }
};

struct FigureOptions {
  int panel_width = 500;
  int panel_height = 640;  ///< without its caption
  int columns = 0;         ///< 0: all panels in one row
  View view = three_quarter_view;
  UpAxis up = UpAxis::y;
  int samples = 4;  ///< each pixel is samples x samples points
  bool floor_shadow = true;
  Backdrop backdrop = Backdrop::colour;
  Colour background{1, 1, 1};
  Colour surface = from_hex(0xD3CCC3);  ///< of panels that name no colour
  double caption_size = 0.052;          ///< height of a line, as a share of the panel's smaller side
  ColourBar colour_bar;
};

/// The widest and highest picture that is drawn.
inline constexpr int largest_side = 16384;

/// All panels, row by row, with their captions. Panels of one row share their scale and their ground line.
/// Errors    npt::Error for no panel, a mesh without vertices, and sizes outside 16 .. largest_side.
Image draw_figure(std::span<const Panel> panels, const FigureOptions& options);

}  // namespace render
