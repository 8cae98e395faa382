// Sculpts npt's own bodies: the header that holds the mannequin's surface, and the file of the four-legged template.
// usage: npt_sculpt [--check] include/npt/body/mannequin/surface_data.hpp
//        npt_sculpt --quadruped examples/sculpt/quadruped FILE
#include <npt/body/body_file.hpp>
#include <npt/io/file.hpp>

#include <chrono>
#include <cstdio>
#include <exception>
#include <sculpt/header_text.hpp>
#include <sculpt/quadruped/quadruped.hpp>
#include <sculpt/sculpture.hpp>
#include <string>
#include <string_view>

namespace {

constexpr const char* usage =
    "usage: npt_sculpt [--check] FILE\n"
    "Writes the header that holds the mannequin's surface, or compares.\n"
    "       npt_sculpt --quadruped TABLES FILE\n"
    "Writes the four-legged template with the joints of TABLES.plan and the poses of TABLES.poses as a body file.";

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

int make_quadruped(const std::string& tables, const std::string& path) {
  const auto start = std::chrono::steady_clock::now();
  const npt::BodyModel body =
      sculpt::quadruped::make_body(npt::read_file(tables + ".plan"), npt::read_file(tables + ".poses"));
  npt::save_body(body, path);
  std::printf("%s: %zu vertices, %zu joints, %zu shapes, sculpted in %.2f s\n", path.c_str(), body.vertex_count(),
              body.joint_count(), body.shape_count(), seconds_since(start));
  return 0;
}

int make_header(const std::string& path, bool check) {
  const auto start = std::chrono::steady_clock::now();
  const std::string text = sculpt::header_text(sculpt::mannequin_half());
  if (!check) {
    npt::write_file(path, text);
    std::printf("%s: %zu bytes, sculpted in %.2f s\n", path.c_str(), text.size(), seconds_since(start));
    return 0;
  }
  const bool same = npt::read_file(path) == text;
  std::printf("%s: %s what sculpting gives (%.2f s)\n", path.c_str(), same ? "is" : "is NOT", seconds_since(start));
  return same ? 0 : 1;
}

}  // namespace

int main(int count, char** arguments) try {
  const std::string_view first = count > 1 ? arguments[1] : "";
  if (count == 4 && first == "--quadruped") return make_quadruped(arguments[2], arguments[3]);
  const bool check = count == 3 && first == "--check";
  if (count != 2 && !check) {
    std::puts(usage);
    return 2;
  }
  return make_header(arguments[count - 1], check);
} catch (const std::exception& error) {
  std::fprintf(stderr, "npt_sculpt: %s\n", error.what());
  return 1;
}
