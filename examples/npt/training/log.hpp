/// The log of a training: a CSV file that grows by a line at a time, and its plot.
#pragma once

#include <render/image.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace training {

/// Losses, PMD and gradient norm are means over the steps since the row before.
struct LogRow {
  std::uint64_t step = 0;
  double seconds = 0;   ///< of training so far, over all runs
  double progress = 0;  ///< 0 .. 1
  double rate = 0;
  double loss = 0, reconstruction = 0, edge = 0;
  double pmd = 0;  ///< of the training samples, in square metres (squares of the meshes' unit)
  double gradient_norm = 0;
  std::size_t batch = 0, vertices = 0;   ///< vertices: of a sample's identity, at most
  double data_share = 0;                 ///< of the steps' time
  std::optional<double> validation_pmd;  ///< where one was measured

  bool operator==(const LogRow&) const = default;
};

/// The rows of a log. A last line that was not finished is left out.
/// Errors    npt::Error that names the file and the line.
std::vector<LogRow> read_log(const std::filesystem::path& path);

class Log {
 public:
  /// A new file; or, for a training that goes on at `resumed_step`, the old one without the rows after that step, which
  /// are going to be written again. Errors    npt::Error for a file that can't be written or is no log
  Log(std::filesystem::path path, std::optional<std::uint64_t> resumed_step);

  /// Once this returns, the row is with the operating system.
  void append(const LogRow& row);

 private:
  std::filesystem::path path_;
};

/// PMD of the training samples and of the validation over the training time, on logarithmic axes.
render::Image plot_log(std::span<const LogRow> rows, const std::string& title);

}  // namespace training
