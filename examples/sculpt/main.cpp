// Sculpts the mannequin: makes the header that holds its surface, or checks that the header is what sculpting gives.
// usage: npt_sculpt [--check] include/npt/body/mannequin/surface_data.hpp
#include <npt/io/file.hpp>

#include <chrono>
#include <cstdio>
#include <exception>
#include <sculpt/header_text.hpp>
#include <sculpt/sculpture.hpp>
#include <string>
#include <string_view>

int main(int count, char** arguments) try {
  const bool check = count == 3 && arguments[1] == std::string_view("--check");
  if (count != 2 && !check) {
    std::puts("usage: npt_sculpt [--check] FILE\nWrites the header that holds the mannequin's surface, or compares.");
    return 2;
  }
  const std::string path = arguments[count - 1];
  const auto start = std::chrono::steady_clock::now();
  const std::string text = sculpt::header_text(sculpt::mannequin_half());
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!check) {
    npt::write_file(path, text);
    std::printf("%s: %zu bytes, sculpted in %.2f s\n", path.c_str(), text.size(), seconds);
    return 0;
  }
  const bool same = npt::read_file(path) == text;
  std::printf("%s: %s what sculpting gives (%.2f s)\n", path.c_str(), same ? "is" : "is NOT", seconds);
  return same ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "npt_sculpt: %s\n", error.what());
  return 1;
}
