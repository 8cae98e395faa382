/// A folder of its own for a test's files, and what tests of readers share.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/platform.hpp>
#include <npt/io/file.hpp>

#include <atomic>
#include <filesystem>
#include <string>
#include <string_view>

namespace scratch {

/// An empty folder that goes with the object.
class Folder {
 public:
  Folder() {
    static std::atomic<int> number{0};
    path_ = std::filesystem::temp_directory_path() /
            ("npt-test-" + std::to_string(npt::platform::process_id()) + "-" + std::to_string(number++));
    std::filesystem::create_directory(path_);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { std::filesystem::remove_all(path_); }

  std::filesystem::path operator/(std::string_view name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }
  std::size_t file_count() const {
    std::size_t n = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(path_)) ++n;
    return n;
  }

 private:
  std::filesystem::path path_;
};

/// The message of the npt::Error that f() throws; "no error" when it throws none. Other exceptions pass.
template <class F>
std::string error_of(F f) {
  try {
    f();
  } catch (const npt::Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace scratch
