/// What every file of the project looks like: how headers open, white space, and no path of one machine.
#include <doctest/doctest.h>

#include <structure/source_tree.hpp>

#include <cstdio>
#include <regex>

#include "support/needs.hpp"

namespace {

using structure::SourceFile;

/// Blanks out comments, so that a macro named in prose is no macro. Line comments are all the project uses.
std::string without_comments(const std::string& text) {
  std::string code;
  for (const std::string& line : structure::lines_of(text)) code += line.substr(0, line.find("//")) + "\n";
  return code;
}

std::vector<std::string> header_complaints(const SourceFile& header) {
  std::vector<std::string> complaints;
  const auto expect = [&](bool good, const char* what) {
    if (!good) complaints.push_back(header.path + ": " + what);
  };
  const std::vector<std::string> lines = structure::lines_of(header.text);
  const std::string code = without_comments(header.text);
  const bool umbrella = header.path == "npt.hpp" || header.path == "baseline.hpp";

  expect(!lines.empty() && lines[0].starts_with("/// "), "does not open with a /// comment that says what it is");
  const auto first_code = std::ranges::find_if(lines, [](const auto& l) { return !l.starts_with("///"); });
  expect(first_code != lines.end() && *first_code == "#pragma once", "#pragma once does not follow the opening");
  expect(umbrella || code.find("namespace npt::inline NPT_ABI") != std::string::npos,
         "nothing in namespace npt::inline NPT_ABI");
  expect(!std::regex_search(code, std::regex(R"(namespace\s+npt\b(?!::inline NPT_ABI))")),
         "opens namespace npt without its inline namespace");
  expect(!std::regex_search(code, std::regex(R"((^|\n)using\s+namespace)")), "using namespace for all who include it");
  static const std::regex macro(R"(#\s*define\s+(\w+))");
  for (std::sregex_iterator it(code.begin(), code.end(), macro), end; it != end; ++it)
    expect(header.path == "config.hpp" && it->str(1).starts_with("NPT_"),
           ("macro " + it->str(1) + ": macros are NPT_* and stand in config.hpp").c_str());
  return complaints;
}

std::vector<std::string> text_complaints(const SourceFile& file) {
  // Split literals, so that this file does not offend against itself.
  static const std::regex machine_path(
      "(^|[\\s\"'`(=])/("
      "work|home|tmp|root|Users)/[\\w.]");
  std::vector<std::string> complaints;
  const std::vector<std::string> lines = structure::lines_of(file.text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto complain = [&](const char* what) {
      complaints.push_back(file.path + ":" + std::to_string(i + 1) + ": " + what);
    };
    if (lines[i].find('\t') != std::string::npos) complain("tab");
    if (lines[i].ends_with(' ')) complain("blank at the end of the line");
    if (lines[i].ends_with('\r')) complain("carriage return");
    if (std::regex_search(lines[i], machine_path)) complain("absolute path of a machine");
  }
  if (!file.text.empty() && !file.text.ends_with('\n')) complaints.push_back(file.path + ": last line has no end");
  return complaints;
}

/// Namespaces whose end does not name them. clang-format's own check takes `npt::inline NPT_ABI` for no name of a
/// namespace.
std::vector<std::string> namespace_complaints(const SourceFile& file) {
  static const std::regex opening(R"((inline )?namespace ?([^={;]*)\{)");
  static const std::regex closing(R"(\}  // namespace ?(.*))");
  std::vector<std::string> complaints, open;
  for (const std::string& line : structure::lines_of(file.text)) {
    std::smatch match;
    if (std::regex_match(line, match, opening)) {
      open.push_back(match.str(2).substr(0, match.str(2).find_last_not_of(' ') + 1));
    } else if (std::regex_match(line, match, closing)) {
      if (open.empty() || open.back() != match.str(1))
        complaints.push_back(file.path + ": no namespace to end: " + line);
      if (!open.empty()) open.pop_back();
    }
  }
  for (const std::string& name : open) complaints.push_back(file.path + ": no }  // namespace " + name);
  return complaints;
}

/// Everything a person wrote: not the build folders, not data.
std::vector<SourceFile> project_files() {
  const std::filesystem::path root(NPT_SOURCE_DIR);
  std::vector<SourceFile> files;
  for (const char* folder : {"include", "examples", "tests", "bench", "cmake", "docs"})
    for (SourceFile& file :
         structure::read_tree(root / folder, {".hpp", ".cpp", ".md", ".txt", ".cmake", ".in", ".sh", ".py"}))
      if (!file.path.starts_with("data/"))  // tests/data holds files that are wrong on purpose
        files.push_back({std::string(folder) + "/" + file.path, std::move(file.text)});
  for (const char* name : {"CMakeLists.txt", "CMakePresets.json", "README.md", "CHANGELOG.md", "LICENSE"})
    files.push_back({name, structure::read_text(root / name)});
  return files;
}

/// Names at the top level that git knows: what lies about in somebody's working copy is theirs. Empty without git.
std::vector<std::string> committed_top_level() {
  std::FILE* git = ::popen("git -C '" NPT_SOURCE_DIR "' ls-tree --name-only HEAD 2>/dev/null", "r");
  if (git == nullptr) return {};
  std::string output;
  for (int c = std::fgetc(git); c != EOF; c = std::fgetc(git)) output += static_cast<char>(c);
  ::pclose(git);
  return structure::lines_of(output);
}

}  // namespace

TEST_CASE("every public header says what it is, is guarded, and lives in the inline namespace") {
  std::vector<std::string> complaints;
  for (const SourceFile& header : structure::read_tree(NPT_SOURCE_DIR "/include/npt", {".hpp"}))
    for (std::string& complaint : header_complaints(header)) complaints.push_back(std::move(complaint));
  CHECK_MESSAGE(complaints.empty(), structure::join(complaints));
}

TEST_CASE("no tabs, no trailing blanks, no path of a machine in any file of the project") {
  const std::vector<SourceFile> files = project_files();
  REQUIRE(files.size() > 20);
  std::vector<std::string> complaints;
  for (const SourceFile& file : files)
    for (std::string& complaint : text_complaints(file)) complaints.push_back(std::move(complaint));
  CHECK_MESSAGE(complaints.empty(), structure::join(complaints));
}

TEST_CASE("the end of every namespace names it") {
  std::vector<std::string> complaints;
  for (const SourceFile& file : project_files())
    if (file.path.ends_with(".hpp") || file.path.ends_with(".cpp"))
      for (std::string& complaint : namespace_complaints(file)) complaints.push_back(std::move(complaint));
  CHECK_MESSAGE(complaints.empty(), structure::join(complaints));
}

TEST_CASE("the top level holds what a visitor expects and nothing else" *
          support::Needs(!committed_top_level().empty(), "git, and a clone")) {
  const std::vector<std::string> known = {
      "CMakeLists.txt", "CMakePresets.json", "LICENSE",     "CHANGELOG.md", "README.md",
      "include",        "examples",          "tests",       "bench",        "cmake",
      "docs",           ".clang-format",     ".clang-tidy", ".gitignore",   ".ci"};
  const std::vector<std::string> committed = committed_top_level();
  for (const std::string& name : committed) CHECK_MESSAGE(std::ranges::find(known, name) != known.end(), name);
}

TEST_CASE("the conventions find each kind of offence") {
  const auto bad_header = [](const std::string& text) { return header_complaints({"core/x.hpp", text}).size(); };
  const std::string good = "/// A thing.\n#pragma once\n\nnamespace npt::inline NPT_ABI {\n}\n";
  CHECK(bad_header(good) == 0);
  CHECK(bad_header("#pragma once\nnamespace npt::inline NPT_ABI {\n}\n") == 1);
  CHECK(bad_header("/// A thing.\nnamespace npt::inline NPT_ABI {\n}\n") == 1);
  CHECK(bad_header("/// A thing.\n#pragma once\nnamespace npt {\n}\n") == 2);
  CHECK(bad_header(good + "#define NPT_X 1\n") == 1);
  CHECK(bad_header(good + "// #define X 1\n") == 0);
  CHECK(bad_header(good + "using namespace std;\n") == 1);
  CHECK(bad_header(good + "void f() {\n  using namespace std;\n}\n") == 0);

  const auto bad_ends = [](const std::string& text) { return namespace_complaints({"core/x.hpp", text}).size(); };
  CHECK(
      bad_ends("namespace a::inline B {\nvoid f() {\n}\nnamespace {\n}  // namespace\n}  // namespace a::inline B\n") ==
      0);
  CHECK(bad_ends("namespace a {\n}\n") == 1);
  CHECK(bad_ends("namespace a {\n}  // namespace b\n") == 1);
  CHECK(bad_ends("}  // namespace a\n") == 1);

  const auto bad_text = [](const std::string& text) { return text_complaints({"README.md", text}).size(); };
  CHECK(bad_text("good\n") == 0);
  CHECK(bad_text("a\tb\n") == 1);
  CHECK(bad_text("a \n") == 1);
  CHECK(bad_text("a\r\n") == 1);
  CHECK(bad_text("a") == 1);
  CHECK(bad_text("see /ho"
                 "me/someone/x\n") == 1);
  CHECK(bad_text("see <https://example.org/ho"
                 "me/x> and src/t"
                 "mp/x\n") == 0);
}
