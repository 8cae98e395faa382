/// --view of the commands that transfer poses: a page with the meshes of each transfer side by side.
#pragma once

#include "arguments.hpp"
#include "transfer_jobs.hpp"
#include "transfer_picture.hpp"

#include <render/colour.hpp>
#include <view/page.hpp>

#include <npt/base/error.hpp>
#include <npt/mesh/mesh.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace program {

/// The most transfers that a page shows.
inline constexpr std::size_t most_page_transfers = 2000;

/// The page's file is not to be one of the jobs' files or `files`.
/// Errors    npt::Error for more jobs than a page shows, and unless `page` can be written
inline void check_page(const std::filesystem::path& page, const std::vector<TransferJob>& jobs, const char* what,
                       std::vector<std::filesystem::path> files = {}) {
  if (jobs.size() > most_page_transfers)
    throw npt::Error(
        {"--view", {}, std::to_string(jobs.size()) + " " + what, "at most " + std::to_string(most_page_transfers)});
  for (const TransferJob& job : jobs) files.insert(files.end(), {job.identity, job.pose, job.out});
  static constexpr std::array<std::string_view, 2> html{".html", ".htm"};
  expect_extension(page, html);
  check_output(page, files);
}

/// Collects the meshes of transfers, in any order, and writes the page: successive transfers of one series whose meshes
/// keep their faces are one group that moves, any other is a group of its own.
class TransferPage {
 public:
  explicit TransferPage(std::size_t transfers) : rows_(transfers) {}

  /// One transfer at a time.
  void add(std::size_t i, const TransferJob& job, const std::vector<PictureCell>& cells) {
    Row& row = rows_[i];
    row.series = job.series;
    row.caption = job.out.filename().string();
    columns_.resize(std::max(columns_.size(), cells.size()));
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const npt::Mesh& mesh = *cells[c].mesh;
      // The frames of a sequence share their faces, and what stands still its positions.
      Kept& last = columns_[c];
      if (last.mesh == nullptr || !view::same_faces(*last.mesh, mesh))
        last.mesh = std::make_shared<const npt::Mesh>(mesh);
      if (last.positions == nullptr || *last.positions != mesh.positions)
        last.positions = std::make_shared<const Positions>(mesh.positions);
      row.cells.push_back({cells[c].caption, cells[c].colour, last});
    }
  }

  /// Writes nothing where no transfer was added.
  void write(const std::filesystem::path& file, const std::string& title) const {
    view::Page page;
    page.title = title;
    const Row* first = nullptr;  // of the group
    for (const Row& row : rows_) {
      if (row.cells.empty()) continue;  // failed, or skipped
      if (first != nullptr && goes_on(*first, row)) {
        for (std::size_t c = 0; c < row.cells.size(); ++c)
          page.groups.back().panels[c].frames.push_back(*row.cells[c].kept.positions);
        continue;
      }
      first = &row;
      page.groups.push_back({row.caption, {}});
      for (const Cell& cell : row.cells) {
        view::Panel panel = view::mesh_panel(cell.caption, *cell.kept.mesh);
        panel.frames.front() = *cell.kept.positions;
        panel.colour = render::parse_colour(cell.colour, "--view");
        page.groups.back().panels.push_back(std::move(panel));
      }
    }
    // What stands still needs one frame.
    for (view::Group& group : page.groups)
      for (view::Panel& panel : group.panels)
        if (std::ranges::all_of(panel.frames, [&](const Positions& frame) { return frame == panel.frames.front(); }))
          panel.frames.resize(1);
    if (!page.groups.empty()) view::write_page(file, page);
  }

 private:
  using Positions = std::vector<npt::Vec3f>;
  struct Kept {
    std::shared_ptr<const npt::Mesh> mesh;  ///< for its faces
    std::shared_ptr<const Positions> positions;
  };
  struct Cell {
    std::string caption, colour;
    Kept kept;
  };
  struct Row {
    std::size_t series = 0;
    std::string caption;
    std::vector<Cell> cells;
  };

  static bool goes_on(const Row& first, const Row& row) {
    if (row.series != first.series) return false;
    for (std::size_t c = 0; c < row.cells.size(); ++c)
      if (!view::same_faces(*first.cells[c].kept.mesh, *row.cells[c].kept.mesh)) return false;
    return true;
  }

  std::vector<Row> rows_;
  std::vector<Kept> columns_;  ///< what was added last
};

}  // namespace program
