#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/io/list_file.hpp>

#include <filesystem>
#include <fstream>
#include <string>

namespace {

namespace fs = std::filesystem;

struct TextFile {
  fs::path path = fs::temp_directory_path() / "npt_test_list.txt";
  explicit TextFile(const std::string& text) { std::ofstream(path, std::ios::binary) << text; }
  ~TextFile() { fs::remove(path); }
};

std::string message_of(const std::string& text) {
  const TextFile file(text);
  try {
    npt::read_list_file(file.path, "identity pose");
  } catch (const npt::Error& error) {
    return std::string(error.what()).substr(file.path.string().size());
  }
  return "no error";
}

}  // namespace

TEST_CASE("names in a list are relative to it") {
  const TextFile file("a.obj \"b c.ply\"\r\n\n# nothing\n'd' /e # more\n");
  const auto lines = npt::read_list_file(file.path, "identity pose");
  REQUIRE(lines.size() == 2);
  CHECK(lines[0].files ==
        std::vector<fs::path>{file.path.parent_path() / "a.obj", file.path.parent_path() / "b c.ply"});
  CHECK(lines[0].place == "line 1");
  CHECK(lines[1].files == std::vector<fs::path>{file.path.parent_path() / "d", file.path.parent_path() / "/e"});
  CHECK(lines[1].place == "line 4");
}

TEST_CASE("a list that can't be read is an error that names the line") {
  CHECK(message_of("a b\nc\n") == ": line 2: found 1 name, expected identity pose (quotes around names with blanks)");
  CHECK(message_of("a b c\n") == ": line 1: found 3 names, expected identity pose (quotes around names with blanks)");
  CHECK(message_of("a 'b\n").starts_with(": line 1: found a quotation mark that is not closed"));
  CHECK(message_of("# nothing\n") == ": found no pairs, expected lines of: identity pose");
}
