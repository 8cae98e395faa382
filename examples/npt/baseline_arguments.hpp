/// What the commands of transfer without networks share: one pose mesh or a folder of them, a picture of the results, and the paper's
/// protocol instead.
#pragma once

#include "arguments.hpp"
#include "evaluation_report.hpp"
#include "report.hpp"
#include "subcommand.hpp"
#include "transfer_jobs.hpp"

#include <render/png.hpp>
#include <render/render.hpp>

#include <npt/body/pose_sampler.hpp>
#include <npt/core/error.hpp>
#include <npt/data/evaluation.hpp>
#include <npt/mesh/mesh.hpp>

#include <array>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace program {

/// A job for the pose mesh, or one for each of the folder `pose`, which makes the folder `out`. `format`: of the results in a folder;
/// without: as the identity.
inline std::vector<TransferJob> pose_jobs(const std::filesystem::path& identity, const std::filesystem::path& pose,
                                          const std::filesystem::path& out, const std::optional<std::string>& format,
                                          std::optional<OutputFolder>& folder) {
  if (!std::filesystem::is_directory(pose)) {
    if (format) throw npt::Error({"--format", {}, "one output file", "a folder of poses"});
    return {{identity, pose, out, {}}};
  }
  folder.emplace(out);
  return folder_jobs(identity, pose, out, format ? "." + *format : extension_of(identity));
}

/// The most poses that a picture shows, one in a row.
inline constexpr std::size_t most_picture_rows = 16;

/// Errors    npt::Error for more poses than a picture shows, and unless `picture` is a PNG that can be written beside `files`, to
///           which it is added
inline void check_picture(const std::filesystem::path& picture, std::size_t poses,
                          std::vector<std::filesystem::path>& files) {
  if (poses > most_picture_rows)
    throw npt::Error(
        {"--render", {}, std::to_string(poses) + " poses", "at most " + std::to_string(most_picture_rows)});
  static constexpr std::array<std::string_view, 1> png{".png"};
  expect_extension(picture, png);
  check_output(picture, files);
  files.push_back(picture);
}

/// A mesh in each row of a picture.
struct PictureCell {
  const npt::Mesh* mesh;
  const char* caption;
  const char* colour;
};

/// Rows of equally many cells, with captions below the last.
inline void draw_rows(const std::filesystem::path& picture, const std::vector<std::vector<PictureCell>>& rows) {
  std::vector<render::Panel> panels;
  for (const std::vector<PictureCell>& row : rows)
    for (const PictureCell& cell : row)
      panels.push_back(
          {cell.mesh, &row == &rows.back() ? cell.caption : "", {render::parse_colour(cell.colour, "picture")}});
  render::FigureOptions figure;
  figure.columns = static_cast<int>(rows.front().size());
  render::write_png(picture, render::draw_figure(panels, figure));
}

/// --protocol and the options that belong to it.
struct ProtocolArguments {
  bool asked_for = false, json = false;
  std::string shapes = "normal";
  std::size_t first = 0, worst = 0;

  npt::ShapeDistribution distribution() const {
    return shapes == "uniform" ? npt::ShapeDistribution::uniform : npt::ShapeDistribution::normal;
  }
};

/// `single`: an option that only a transfer takes.
inline CLI::Option* add_protocol_options(CLI::App& command, ProtocolArguments& a, CLI::Option* single) {
  CLI::Option* protocol =
      command.add_flag("--protocol", a.asked_for, "Instead: the error on the paper's 72 seen and 72 unseen poses")
          ->excludes(single);
  command.add_option("--shapes", a.shapes, "Distribution of the protocol's shapes: normal, or uniform in [-4, 4]")
      ->check(CLI::IsMember({"normal", "uniform"}))
      ->capture_default_str()
      ->needs(protocol);
  command.add_option("--first", a.first, "The first so many pairs of each set of the protocol only")
      ->check(CLI::Range(1, 72))
      ->needs(protocol);
  command.add_option("--worst", a.worst, "Also list the protocol's so many worst pairs")
      ->check(CLI::Range(0, 1000000))
      ->needs(protocol);
  command.add_flag("--json", a.json, "The protocol's errors as one line of JSON")->needs(protocol);
  return protocol;
}

/// The protocol's errors: a table below `title`, or JSON that begins with `head`.
inline void print_protocol(const ProtocolArguments& a, const std::vector<npt::Evaluation>& evaluations, Report head,
                           const std::string& title, double seconds) {
  if (a.json) {
    for (const npt::Evaluation& e : evaluations) head["sets"].push_back(report_of(e, a.worst));
    head["seconds"] = seconds;
    std::cout << head.dump(-1, ' ', false, Report::error_handler_t::replace) << '\n';
    return;
  }
  std::printf("%s\n", title.c_str());
  print_table(evaluations, a.worst, false);
  std::printf("%.1f s\n", seconds);
  std::fflush(stdout);
}

}  // namespace program
