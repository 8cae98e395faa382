/// The paper's figures 6 to 20 as PNG grids: which meshes stand where. Meshes are made by figure_meshes.hpp, pictures
/// by `npt render`, whose command is kept beside each picture: a figure that was drawn by the same command from the
/// same meshes is not drawn again.
#pragma once

#include <reproduce/figure_meshes.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace reproduce {

struct Figure {
  int number = 0;
  std::string title;
  std::vector<std::string> systems;  ///< whose results it shows
};

/// Figures 6 to 20.
const std::vector<Figure>& figures();
/// Errors  npt::Error for another number
const Figure& figure_of(int number);

/// "6..9", "12" to 6, 7, 8, 9, 12: numbers and ranges.
/// Errors  npt::Error that names `argument`
std::vector<int> parse_numbers(const std::vector<std::string>& texts, const std::string& argument);

/// One place of a grid.
struct GridPanel {
  std::filesystem::path mesh;     ///< empty: nothing
  std::string colour = "blue";    ///< as `npt render` understands it
  std::filesystem::path truth{};  ///< not empty: coloured by the distance to it
};

/// A figure before it is drawn.
struct Plate {
  std::vector<std::string> columns, rows;  ///< captions
  std::vector<GridPanel> panels;           ///< row by row
  bool index_colours = false;              ///< all meshes by their vertices' numbers
};

/// Asks the store for everything that a figure shows, and says where it stands.
/// Errors  npt::Error for another number, and for meshes that can't be made
Plate plate_of(int number, MeshStore& store);

/// The arguments of `npt render` that draw it.
std::vector<std::string> render_arguments(const Plate& plate, const std::filesystem::path& out, int panel_height);

enum class Outcome {
  drawn,
  kept,     ///< it was there
  left_out  ///< what it shows was not given
};

/// Draws folder/figure_NN.png.
/// Errors  npt::Error that names the figure
Outcome draw_figure(int number, MeshStore& store, const std::filesystem::path& folder, const RunCommand& run);

/// Why a figure is left out; empty: it isn't.
std::string left_out_because(int number, const FigureSources& sources);

}  // namespace reproduce
