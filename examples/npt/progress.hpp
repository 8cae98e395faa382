/// A line on standard error that says how far long work is: done and total, rate, time left. Nothing is printed where
/// standard error is no terminal.
#pragma once

#include "host/host.hpp"
#include "status_line.hpp"

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>

namespace program {

/// "3 s", "2 min 05 s", "1 h 07 min".
inline std::string duration_text(double seconds) {
  const auto whole = std::llround(seconds);
  const auto two_digits = [](long long v) { return (v < 10 ? "0" : "") + std::to_string(v); };
  if (whole < 60) return std::to_string(whole) + " s";
  if (whole < 3600) return std::to_string(whole / 60) + " min " + two_digits(whole % 60) + " s";
  return std::to_string(whole / 3600) + " h " + two_digits(whole / 60 % 60) + " min";
}

class Progress {
 public:
  /// `what` in the plural: "pairs", "meshes".
  Progress(std::string what, std::size_t total, bool shown = host::error_output_is_terminal())
      : what_(std::move(what)), total_(total), line_(shown && total > 1) {
    draw();
  }

  void advance() {
    ++done_;
    if (line_.due() || done_ == total_) draw();
  }

  /// Takes the line away, so that a message can be printed; the next advance() brings it back.
  void clear() { line_.clear(); }

  /// The line for `done` pieces after `seconds`.
  std::string line(std::size_t done, double seconds) const {
    std::string text = std::to_string(done) + "/" + std::to_string(total_) + " " + what_;
    if (done == 0 || seconds <= 0) return text;
    const double rate = static_cast<double>(done) / seconds;
    char number[32];
    std::snprintf(number, sizeof number, rate < 10 ? "%.2f" : "%.0f", rate);
    text += std::string(", ") + number + "/s";
    if (done < total_) text += ", " + duration_text(static_cast<double>(total_ - done) / rate) + " left";
    return text;
  }

 private:
  void draw() {
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start_;
    line_.show(line(done_, passed.count()));
  }

  std::string what_;
  std::size_t total_, done_ = 0;
  StatusLine line_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace program
