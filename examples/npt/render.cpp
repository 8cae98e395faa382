/// npt render: pictures of meshes.
#include "arguments.hpp"
#include "subcommand.hpp"

#include <render/png.hpp>
#include <render/render.hpp>

#include <npt/io/mesh_file.hpp>
#include <npt/mesh/metrics.hpp>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<fs::path> files;
  fs::path out;
  std::optional<std::string> captions, colours, heat;
  std::optional<fs::path> distance_to;
  std::string view = "three-quarter", background = "white", up = "y";
  std::optional<double> yaw, pitch;
  int width = 500, height = 640, columns = 0, samples = 4;
  bool no_shadow = false;
};

render::View view_of(const Options& options) {
  render::View view = options.view == "front"  ? render::front_view
                      : options.view == "side" ? render::side_view
                      : options.view == "back" ? render::back_view
                                               : render::three_quarter_view;
  if (options.yaw) view.yaw = *options.yaw;
  if (options.pitch) view.pitch = *options.pitch;
  return view;
}

/// One text for each mesh.
std::vector<std::string> one_for_each(const std::string& argument, const std::string& text, std::size_t meshes) {
  std::vector<std::string> parts = program::split_list(text);
  if (parts.size() != meshes)
    throw npt::Error(
        {argument, {}, std::to_string(parts.size()) + " entries", std::to_string(meshes) + ", one for each mesh"});
  return parts;
}

/// A number for each vertex, to be shown as a colour.
std::vector<double> heat_values(const npt::Mesh& mesh, const fs::path& file, const Options& options,
                                const npt::Mesh& reference) {
  if (options.distance_to) {
    if (mesh.vertex_count() != reference.vertex_count())
      throw npt::Error({file.string(),
                        {},
                        std::to_string(mesh.vertex_count()) + " vertices",
                        std::to_string(reference.vertex_count()) + " as in " + options.distance_to->string()});
    return npt::vertex_distances(mesh.coordinates(), reference.coordinates());
  }
  for (const npt::VertexProperty& property : mesh.properties)
    if (property.name == *options.heat) return property.values;
  std::string known;
  for (const npt::VertexProperty& property : mesh.properties) known += (known.empty() ? "" : ", ") + property.name;
  throw npt::Error({file.string(), "vertex property '" + *options.heat + "'", "none of that name",
                    known.empty() ? "a mesh with vertex properties" : "one of: " + known});
}

/// Colours all panels on one scale and adds its bar to the picture.
void colour_by_numbers(std::vector<render::Panel>& panels, const Options& options, render::FigureOptions& figure) {
  const npt::Mesh reference = options.distance_to ? npt::read_mesh(*options.distance_to) : npt::Mesh{};
  std::vector<std::vector<double>> values;
  double low = options.distance_to ? 0 : std::numeric_limits<double>::max(),
         high = std::numeric_limits<double>::lowest();
  for (std::size_t i = 0; i < panels.size(); ++i) {
    values.push_back(heat_values(*panels[i].mesh, options.files[i], options, reference));
    for (double v : values.back()) low = std::min(low, v), high = std::max(high, v);
  }
  const double range = high > low ? high - low : 1;
  for (std::size_t i = 0; i < panels.size(); ++i) {
    panels[i].colours.clear();
    for (double v : values[i]) panels[i].colours.push_back(render::heat_colour(static_cast<float>((v - low) / range)));
  }
  figure.colour_bar = {low, low + range,
                       options.distance_to ? "distance to " + options.distance_to->filename().string() : *options.heat};
}

render::FigureOptions figure_options(const Options& options) {
  render::FigureOptions figure;
  figure.panel_width = options.width;
  figure.panel_height = options.height;
  figure.columns = options.columns;
  figure.samples = options.samples;
  figure.view = view_of(options);
  figure.up = options.up == "z" ? render::UpAxis::z : render::UpAxis::y;
  figure.floor_shadow = !options.no_shadow;
  if (options.background == "transparent") {
    figure.backdrop = render::Backdrop::transparent;
  } else {
    figure.background = render::parse_colour(options.background, "--background");
  }
  return figure;
}

void run(const Options& options) {
  static constexpr std::array<std::string_view, 1> png{".png"};
  program::expect_extension(options.out, png);
  render::FigureOptions figure = figure_options(options);
  std::vector<std::string> captions(options.files.size()), colours;
  if (options.captions) captions = one_for_each("--captions", *options.captions, options.files.size());
  if (options.colours) colours = one_for_each("--colours", *options.colours, options.files.size());
  program::check_output(options.out, options.files);

  std::vector<npt::Mesh> meshes;
  for (const fs::path& file : options.files) meshes.push_back(npt::read_mesh(file));
  std::vector<render::Panel> panels;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    panels.push_back({&meshes[i], captions[i], render::vertex_colours(meshes[i])});
    if (!colours.empty()) panels.back().colours = {render::parse_colour(colours[i], "--colours")};
  }
  if (options.heat || options.distance_to) colour_by_numbers(panels, options, figure);
  const render::Image image = render::draw_figure(panels, figure);
  render::write_png(options.out, image);
  std::cout << options.out.string() << ": " << image.width << " x " << image.height << " pixels, " << panels.size()
            << (panels.size() == 1 ? " mesh\n" : " meshes\n");
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  command.add_option("MESH", o->files, "Meshes to draw (.ply, .obj), one panel each")->required();
  command.add_option("-o,--out", o->out, "Picture to write (.png)")->required();
  command.add_option("--captions", o->captions, "Texts below the panels: \"identity,pose,result\" (\\, is a comma)");
  command.add_option("--view", o->view, "front, side, back or three-quarter")
      ->check(CLI::IsMember({"front", "side", "back", "three-quarter"}))
      ->capture_default_str();
  command.add_option("--yaw", o->yaw, "Degrees around the figure, instead of the view's: 0 front, 90 its left side");
  command.add_option("--pitch", o->pitch, "Degrees from above, instead of the view's")->check(CLI::Range(-90.0, 90.0));
  command.add_option("--width", o->width, "Width of a panel in pixels")
      ->check(CLI::Range(16, 8192))
      ->capture_default_str();
  command.add_option("--height", o->height, "Height of a panel in pixels, without its caption")
      ->check(CLI::Range(16, 8192))
      ->capture_default_str();
  command.add_option("--columns", o->columns, "Panels in a row; 0: all")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  command.add_option("--background", o->background, "transparent, a colour's name or #rrggbb")->capture_default_str();
  command.add_option("--colours", o->colours, "Colours of the meshes: \"blue,sand,#9db7d5\"");
  CLI::Option* heat = command.add_option("--heat", o->heat, "Colour by this vertex property of the PLY files");
  command
      .add_option("--distance-to", o->distance_to, "Colour by each vertex's distance to the same vertex of this mesh")
      ->excludes(heat);
  command.add_option("--up", o->up, "The meshes' axis that points up: y or z")
      ->check(CLI::IsMember({"y", "z"}))
      ->capture_default_str();
  command.add_option("--samples", o->samples, "Each pixel is the mean of N x N samples")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  command.add_flag("--no-shadow", o->no_shadow, "No shadow on the floor");
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("render", "Draw meshes into a PNG", add);

}  // namespace
