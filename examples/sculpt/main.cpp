// Sculpts npt's own bodies: the header that holds the mannequin's surface, and the file of the four-legged template.
// usage: npt_sculpt [--check] include/npt/body/mannequin/surface_data.hpp
//        npt_sculpt --quadruped examples/sculpt/quadruped FILE [PROPORTION=FACTOR ...]
#include <npt/base/error.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/io/file.hpp>
#include <npt/io/text.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <map>
#include <sculpt/header_text.hpp>
#include <sculpt/quadruped/grown.hpp>
#include <sculpt/quadruped/quadruped.hpp>
#include <sculpt/sculpture.hpp>
#include <span>
#include <string>
#include <string_view>

namespace {

constexpr const char* usage =
    "usage: npt_sculpt [--check] FILE\n"
    "Writes the header that holds the mannequin's surface, or compares.\n"
    "       npt_sculpt --quadruped TABLES FILE [PROPORTION=FACTOR ...]\n"
    "Writes the four-legged template with the joints of TABLES.plan and the poses of TABLES.poses as a body file,\n"
    "grown by factors of the plan's proportions.";

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::map<std::string, double> read_factors(std::span<char* const> texts) {
  std::map<std::string, double> factors;
  for (const std::string_view text : texts) {
    const std::size_t equals = text.find('=');
    const auto factor = npt::parse_number<double>(text.substr(std::min(equals, text.size() - 1) + 1));
    if (equals == std::string_view::npos || !factor)
      throw npt::Error({.file = "arguments", .found = std::string(text), .expected = "PROPORTION=FACTOR"});
    factors[std::string(text.substr(0, equals))] = *factor;
  }
  return factors;
}

int make_quadruped(const std::string& tables, const std::string& path, std::span<char* const> factors) {
  const auto start = std::chrono::steady_clock::now();
  const std::string plan = npt::read_file(tables + ".plan");
  npt::BodyModel body = sculpt::quadruped::make_body(plan, npt::read_file(tables + ".poses"));
  if (!factors.empty())
    body = sculpt::quadruped::grown(body, npt::read_body_plan(plan, tables + ".plan"), read_factors(factors));
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
  if (count >= 4 && first == "--quadruped")
    return make_quadruped(arguments[2], arguments[3],
                          std::span<char* const>(arguments, static_cast<std::size_t>(count)).subspan(4));
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
