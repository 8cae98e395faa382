/// --render of the commands that transfer poses: a row of meshes for each transfer.
#pragma once

#include "arguments.hpp"
#include "transfer_jobs.hpp"

#include <render/png.hpp>
#include <render/render.hpp>

#include <npt/base/error.hpp>
#include <npt/mesh/mesh.hpp>

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace program {

/// The most transfers that a picture shows, one in a row.
inline constexpr std::size_t most_picture_rows = 16;

/// The jobs' files and `files` are not to be overwritten. `what`: "pairs" or "poses", for the message.
/// Errors    npt::Error for more jobs than a picture shows, and unless `picture` is a PNG that can be written
inline void check_picture(const std::filesystem::path& picture, const std::vector<TransferJob>& jobs, const char* what,
                          std::vector<std::filesystem::path> files = {}) {
  if (jobs.size() > most_picture_rows)
    throw npt::Error(
        {"--render", {}, std::to_string(jobs.size()) + " " + what, "at most " + std::to_string(most_picture_rows)});
  for (const TransferJob& job : jobs) files.insert(files.end(), {job.identity, job.pose, job.out});
  static constexpr std::array<std::string_view, 1> png{".png"};
  expect_extension(picture, png);
  check_output(picture, files);
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

}  // namespace program
