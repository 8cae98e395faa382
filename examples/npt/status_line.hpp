/// One line on standard error that is written over again and again; nothing where standard error is no terminal.
#pragma once

#include "host/host.hpp"

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <string>

namespace program {

class StatusLine {
 public:
  explicit StatusLine(bool shown = host::error_output_is_terminal()) : shown_(shown) {}
  ~StatusLine() { clear(); }
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  /// Whether it is time for another text: a terminal costs more than many a small piece of work.
  bool due() const { return shown_ && std::chrono::steady_clock::now() - drawn_ >= std::chrono::milliseconds(200); }

  void show(const std::string& text) {
    if (!shown_) return;
    drawn_ = std::chrono::steady_clock::now();
    const std::size_t padding = width_ > text.size() ? width_ - text.size() : 0;
    std::fprintf(stderr, "\r%s%*s", text.c_str(), static_cast<int>(padding), "");
    std::fflush(stderr);
    width_ = text.size();
  }

  /// Takes the line away, so that something else can be printed.
  void clear() {
    if (!shown_ || width_ == 0) return;
    std::fprintf(stderr, "\r%*s\r", static_cast<int>(width_), "");
    std::fflush(stderr);
    width_ = 0;
    drawn_ = {};
  }

 private:
  bool shown_;
  std::size_t width_ = 0;
  std::chrono::steady_clock::time_point drawn_{};
};

}  // namespace program
