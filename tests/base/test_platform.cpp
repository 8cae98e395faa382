#include <doctest/doctest.h>

#include <npt/base/platform.hpp>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

namespace {

namespace fs = std::filesystem;
namespace platform = npt::platform;

std::string content_of(const fs::path& path) {
  std::ifstream file(path);
  std::string text;
  std::getline(file, text);
  return text;
}

void write(std::FILE* file, const char* text) {
  REQUIRE(file != nullptr);
  std::fputs(text, file);
  std::fflush(file);
  CHECK(platform::sync(file));
  std::fclose(file);
}

}  // namespace

TEST_CASE("files of any name are made once, replaced and read") {
  const fs::path folder = fs::temp_directory_path() / ("npt-platform-" + std::to_string(platform::process_id()));
  fs::create_directory(folder);
  const fs::path first = folder / fs::path(u8"Gr\u00f6\u00dfe \u732b \U0001F40E"), second = folder / "second";
  write(platform::create_file(first), "first");
  CHECK(platform::create_file(first) == nullptr);
  CHECK(errno == EEXIST);
  write(platform::create_file(second), "second");
  CHECK(platform::may_write(first));
  CHECK_FALSE(platform::may_write(folder / "none"));

  std::error_code code;
  platform::replace_file(second, first, code);
  CHECK_FALSE(code);
  CHECK(content_of(first) == "second");
  CHECK_FALSE(fs::exists(second));
  platform::replace_file(second, first, code);
  CHECK(code);
  std::FILE* file = platform::open_file(first, "rb");
  REQUIRE(file != nullptr);
  std::fclose(file);
  fs::remove_all(folder);
}
