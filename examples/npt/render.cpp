/// npt render: pictures of meshes.
#include "arguments.hpp"
#include "subcommand.hpp"

#include <render/data_colours.hpp>
#include <render/png.hpp>
#include <render/render.hpp>

#include <formats/read.hpp>

#include <npt/io/mesh_file.hpp>
#include <npt/mesh/metrics.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace render_command {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> files;
  fs::path out;
  std::optional<std::string> captions, row_captions, column_captions, colours, colour, truth, heat;
  std::optional<fs::path> distance_to;
  std::string view = "three-quarter", background = "white", up = "y";
  std::optional<double> yaw, pitch, scale_bar;
  std::optional<int> width, height, grid, gap;
  int columns = 0, samples = 4;
  bool no_shadow = false;
};

/// What stands for an empty place, and for no truth.
constexpr std::string_view nothing = "-";

bool is_picture(const std::string& file) { return program::extension_of(file) == ".png"; }

render::View view_of(const Options& options) {
  render::View view = options.view == "front"  ? render::front_view
                      : options.view == "side" ? render::side_view
                      : options.view == "back" ? render::back_view
                                               : render::three_quarter_view;
  if (options.yaw) view.yaw = *options.yaw;
  if (options.pitch) view.pitch = *options.pitch;
  return view;
}

/// One text for each of so many `what`.
std::vector<std::string> one_for_each(const std::string& argument, const std::string& text, std::size_t count,
                                      const std::string& what = "mesh") {
  std::vector<std::string> parts = program::split_list(text);
  if (parts.size() != count)
    throw npt::Error(
        {argument, {}, std::to_string(parts.size()) + " entries", std::to_string(count) + ", one for each " + what});
  return parts;
}

/// What is drawn: a mesh or a picture for each panel, or neither.
struct Contents {
  std::vector<npt::Mesh> meshes;        ///< [files], empty where there is none
  std::vector<render::Image> pictures;  ///< [files]

  explicit Contents(const std::vector<std::string>& files) : meshes(files.size()), pictures(files.size()) {
    for (std::size_t i = 0; i < files.size(); ++i) {
      if (files[i] == nothing) continue;
      if (is_picture(files[i]))
        pictures[i] = render::read_png(files[i]);
      else
        meshes[i] = formats::read_mesh(files[i]);
    }
  }
  bool has_mesh(std::size_t i) const { return !meshes[i].positions.empty(); }
};

void expect_same_count(const npt::Mesh& mesh, const std::string& file, const npt::Mesh& reference,
                       const std::string& reference_file) {
  if (mesh.vertex_count() != reference.vertex_count())
    throw npt::Error({file,
                      {},
                      std::to_string(mesh.vertex_count()) + " vertices",
                      std::to_string(reference.vertex_count()) + " as in " + reference_file});
}

/// A number for each vertex, to be shown as a colour.
std::vector<double> heat_values(const npt::Mesh& mesh, const std::string& file, const Options& options,
                                const npt::Mesh& reference) {
  if (options.distance_to) {
    expect_same_count(mesh, file, reference, options.distance_to->string());
    return npt::vertex_distances(mesh.coordinates(), reference.coordinates());
  }
  for (const npt::VertexProperty& property : mesh.properties)
    if (property.name == *options.heat) return property.values;
  std::string known;
  for (const npt::VertexProperty& property : mesh.properties) known += (known.empty() ? "" : ", ") + property.name;
  throw npt::Error({file, "vertex property '" + *options.heat + "'", "none of that name",
                    known.empty() ? "a mesh with vertex properties" : "one of: " + known});
}

/// Colours all meshes on one scale and adds its bar to the picture.
void colour_by_numbers(std::vector<render::Panel>& panels, const Options& options, render::FigureOptions& figure) {
  const npt::Mesh reference = options.distance_to ? formats::read_mesh(*options.distance_to) : npt::Mesh{};
  std::vector<std::vector<double>> values(panels.size());
  double low = options.distance_to ? 0 : std::numeric_limits<double>::max(),
         high = std::numeric_limits<double>::lowest();
  for (std::size_t i = 0; i < panels.size(); ++i) {
    if (panels[i].mesh == nullptr) continue;
    values[i] = heat_values(*panels[i].mesh, options.files[i], options, reference);
    for (double v : values[i]) low = std::min(low, v), high = std::max(high, v);
  }
  if (!(high > low)) high = low + 1;
  for (std::size_t i = 0; i < panels.size(); ++i)
    if (panels[i].mesh != nullptr) {
      panels[i].colours = render::heat_colours(values[i], low, high);
      panels[i].even_light = render::data_light;
    }
  figure.colour_bar = {low, high,
                       options.distance_to ? "distance to " + options.distance_to->filename().string() : *options.heat,
                       false};
}

/// Colours the meshes that have a truth by their vertices' distances to it, in millimetres. The scale ends where one
/// vertex in a hundred lies beyond it, at a round number.
void colour_by_error(std::vector<render::Panel>& panels, const Options& options, render::FigureOptions& figure) {
  std::vector<std::string> truths = program::split_list(*options.truth);
  if (truths.size() == 1) truths.assign(panels.size(), std::string(truths[0]));
  if (truths.size() != panels.size())
    throw npt::Error({"--truth",
                      {},
                      std::to_string(truths.size()) + " entries",
                      "one for all, or " + std::to_string(panels.size()) + ", one for each mesh"});
  std::vector<std::vector<double>> errors(panels.size());
  std::vector<double> all;
  for (std::size_t i = 0; i < panels.size(); ++i) {
    if (panels[i].mesh == nullptr || truths[i] == nothing) continue;
    const npt::Mesh truth = formats::read_mesh(truths[i]);
    expect_same_count(*panels[i].mesh, options.files[i], truth, truths[i]);
    errors[i] = render::centred_distances(panels[i].mesh->coordinates(), truth.coordinates());
    for (double& e : errors[i]) all.push_back(e *= 1000);
  }
  if (all.empty()) throw npt::Error({"--truth", {}, "no mesh with a truth", "one at least"});
  const auto [high, open_end] = render::error_scale(std::move(all), options.scale_bar.value_or(0));
  for (std::size_t i = 0; i < panels.size(); ++i) {
    if (errors[i].empty()) continue;
    panels[i].colours = render::heat_colours(errors[i], 0, high);
    panels[i].even_light = render::data_light;
  }
  figure.colour_bar = {0, high, "distance to the ground truth (mm)", open_end};
}

void colour(std::vector<render::Panel>& panels, const Options& options, render::FigureOptions& figure) {
  if (options.heat || options.distance_to) colour_by_numbers(panels, options, figure);
  if (!options.colour) return;
  if (*options.colour == "error") return colour_by_error(panels, options, figure);
  for (render::Panel& panel : panels) {
    if (panel.mesh == nullptr) continue;
    panel.colours = *options.colour == "index" ? render::index_colours(panel.mesh->vertex_count())
                                               : render::normal_colours(*panel.mesh);
    panel.even_light = render::data_light;
  }
}

render::FigureOptions figure_options(const Options& options) {
  render::FigureOptions figure;
  if (options.grid) {
    figure = render::grid_figure(*options.grid, options.height.value_or(420));
    if (options.width) figure.panel_width = *options.width;
  } else {
    figure.panel_width = options.width.value_or(500);
    figure.panel_height = options.height.value_or(640);
    figure.columns = options.columns;
  }
  if (options.gap) figure.gap = *options.gap;
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
  const std::size_t count = options.files.size();
  const std::size_t columns =
      figure.columns > 0 ? std::min<std::size_t>(static_cast<std::size_t>(figure.columns), count) : count;
  std::vector<std::string> captions(count), colours;
  if (options.captions) captions = one_for_each("--captions", *options.captions, count);
  if (options.colours) colours = one_for_each("--colours", *options.colours, count);
  if (options.column_captions)
    figure.column_captions = one_for_each("--column-captions", *options.column_captions, columns, "column");
  if (options.row_captions)
    figure.row_captions = one_for_each("--row-captions", *options.row_captions, (count + columns - 1) / columns, "row");
  if (options.colour == "error" && !options.truth) throw CLI::RequiresError("--colour error", "--truth");
  std::vector<fs::path> inputs;
  for (const std::string& file : options.files)
    if (file != nothing) inputs.emplace_back(file);
  program::check_output(options.out, inputs);

  const Contents contents(options.files);
  std::vector<render::Panel> panels;
  for (std::size_t i = 0; i < count; ++i) {
    render::Panel& panel = panels.emplace_back();
    panel.caption = captions[i];
    if (is_picture(options.files[i])) panel.picture = &contents.pictures[i];
    if (!contents.has_mesh(i)) continue;
    panel.mesh = &contents.meshes[i];
    panel.colours = render::vertex_colours(contents.meshes[i]);
    if (!colours.empty() && colours[i] != nothing) panel.colours = {render::parse_colour(colours[i], "--colours")};
  }
  colour(panels, options, figure);
  const render::Image image = render::draw_figure(panels, figure);
  render::write_png(options.out, image);
  const auto meshes = std::ranges::count_if(panels, [](const render::Panel& panel) { return panel.mesh != nullptr; });
  std::cout << options.out.string() << ": " << image.width << " x " << image.height << " pixels, " << meshes
            << (meshes == 1 ? " mesh\n" : " meshes\n");
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  command
      .add_option(
          "MESH", o->files,
          "Draw these, one panel each: meshes (.ply, .obj, .glb), finished pictures (.png), - for an empty place")
      ->required();
  command.add_option("-o,--out", o->out, "Write the picture to this file (.png)")->required();
  command
      .add_option("--captions", o->captions,
                  "Write these texts below the panels: \"identity,pose,result\" (\\, is a comma)")
      ->type_name("LIST");
  CLI::Option* columns = command.add_option("--columns", o->columns, "Put this many panels in a row; 0: all")
                             ->check(CLI::Range(0, 1000))
                             ->capture_default_str();
  command
      .add_option("--grid", o->grid,
                  "Make a figure for print: this many panels in a row, all at one scale, as wide as the meshes need")
      ->check(CLI::Range(1, 1000))
      ->excludes(columns);
  command
      .add_option("--column-captions", o->column_captions,
                  "Write these texts above the columns: \"identity,pose,ours\"")
      ->type_name("LIST");
  command.add_option("--row-captions", o->row_captions, "Write these texts beside the rows: \"seen,unseen\"")
      ->type_name("LIST");
  command.add_option("--view", o->view, "Look from here")
      ->check(CLI::IsMember({"front", "side", "back", "three-quarter"}))
      ->capture_default_str();
  command.add_option(
      "--yaw", o->yaw,
      "Turn the figure by this many degrees instead: 0 shows its front, 90 its left side (default: the view's)");
  command
      .add_option("--pitch", o->pitch,
                  "Look from this many degrees above instead, from -90 to 90 (default: the view's)")
      ->check(CLI::Range(-90.0, 90.0));
  command
      .add_option("--width", o->width, "Make a panel this many pixels wide (default: 500, in a grid as wide as needed)")
      ->check(CLI::Range(16, 8192));
  command
      .add_option("--height", o->height,
                  "Make a panel this many pixels high, without its caption (default: 640, in a grid 420)")
      ->check(CLI::Range(16, 8192));
  command
      .add_option("--gap", o->gap,
                  "Leave this many pixels between panels (default: 0, in a grid a fortieth of a panel's height)")
      ->check(CLI::Range(0, 8192));
  command
      .add_option("--background", o->background,
                  "Fill the background with a colour's name or #rrggbb, or leave it transparent")
      ->capture_default_str();
  command
      .add_option("--colours", o->colours,
                  "Paint the meshes in these colours: \"blue,sand,#9db7d5\" (- keeps the default)")
      ->type_name("LIST");
  CLI::Option* heat =
      command.add_option("--heat", o->heat, "Colour by this vertex property of the PLY files")->type_name("NAME");
  CLI::Option* distance = command
                              .add_option("--distance-to", o->distance_to,
                                          "Colour by each vertex's distance to the same vertex of this mesh")
                              ->excludes(heat);
  CLI::Option* colour =
      command
          .add_option(
              "--colour", o->colour,
              "Colour by the vertices' numbers (index), their normals (normal), or their distance to --truth (error)")
          ->check(CLI::IsMember({"index", "normal", "error"}))
          ->excludes(heat)
          ->excludes(distance);
  CLI::Option* truth = command
                           .add_option("--truth", o->truth,
                                       "Measure errors against this ground truth, in metres: a mesh for all, or a list "
                                       "(- for none); bounding boxes are centred, as for the PMD")
                           ->type_name("LIST")
                           ->needs(colour);
  command
      .add_option("--scale-bar", o->scale_bar,
                  "End the scale of errors at this many millimetres (default: a round number that few vertices exceed)")
      ->check(CLI::Range(1e-6, 1e9))
      ->needs(truth);
  command.add_option("--up", o->up, "Take this axis of the meshes as up")
      ->check(CLI::IsMember({"y", "z"}))
      ->capture_default_str();
  command.add_option("--samples", o->samples, "Average N x N samples for each pixel")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  command.add_flag("--no-shadow", o->no_shadow, "Draw no shadow on the floor");
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("render", "Draw meshes into a PNG, without display or GPU", add);

}  // namespace render_command
