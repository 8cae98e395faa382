/// The picture and the page of transfers without networks (npt deform, npt skeleton): checked before anything is done,
/// collected while meshes come, written at the end.
/// Threads   add() with different `i` from several at a time, under the caller's lock
#pragma once

#include "arguments.hpp"
#include "transfer_jobs.hpp"
#include "transfer_picture.hpp"
#include "transfer_view.hpp"

#include <npt/mesh/mesh.hpp>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace program {

class ShownResults {
 public:
  /// The meshes beside each other in a row: of a pose and its result.
  using Cells = std::function<std::vector<PictureCell>(const npt::Mesh& pose, const npt::Mesh& result)>;

  /// `files`: inputs that are no job's. `further`: another mesh that will be written.
  /// Errors    npt::Error for what can't be written, would replace an input, or has too many rows
  ShownResults(std::optional<std::filesystem::path> picture, std::optional<std::filesystem::path> page,
               const std::vector<TransferJob>& jobs, std::vector<std::filesystem::path> files,
               const std::optional<std::filesystem::path>& further, Cells cells)
      : picture_(std::move(picture)), page_file_(std::move(page)), cells_(std::move(cells)) {
    if (picture_) {
      check_picture(*picture_, jobs, "poses", files);
      files.push_back(*picture_);
      rows_.resize(jobs.size());
    }
    if (page_file_) {
      check_page(*page_file_, jobs, "poses", files);
      files.push_back(*page_file_);
      page_.emplace(jobs.size());
    }
    if (!further) return;
    for (const TransferJob& job : jobs) files.insert(files.end(), {job.identity, job.pose, job.out});
    expect_extension(*further, output_extensions);
    check_output(*further, files);
  }

  /// Whether anything is to be shown.
  bool any() const noexcept { return picture_ || page_file_; }

  void add(std::size_t i, const TransferJob& job, npt::Mesh pose, npt::Mesh result) {
    if (page_) page_->add(i, job, cells_(pose, result));
    if (picture_) rows_[i] = {std::move(pose), std::move(result)};
  }

  void write(const std::string& title) const {
    if (picture_) {
      std::vector<std::vector<PictureCell>> rows;
      for (const auto& [pose, result] : rows_) rows.push_back(cells_(pose, result));
      draw_rows(*picture_, rows);
    }
    if (page_) page_->write(*page_file_, title);
  }

 private:
  std::optional<std::filesystem::path> picture_, page_file_;
  Cells cells_;
  std::vector<std::pair<npt::Mesh, npt::Mesh>> rows_;  ///< pose and result, for the picture
  std::optional<TransferPage> page_;
};

}  // namespace program
