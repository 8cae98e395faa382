/// Every module has a folder of tests, and every header a test that names it: one of its module that includes or mentions
/// it, or the one that tested_with.txt names.
#include <doctest/doctest.h>

#include <structure/source_tree.hpp>

#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace {

using structure::SourceFile;

/// Lines of `HEADER: TEST`; the test reaches the header through others.
std::map<std::string, std::string> parse_tested_with(const std::string& text) {
  std::map<std::string, std::string> tests;
  for (const std::string& line : structure::lines_of(text)) {
    std::istringstream words(line);
    std::string header, test, rest;
    if (!(words >> header) || header.starts_with('#')) continue;
    if (!header.ends_with(".hpp:")) throw std::runtime_error("tested_with.txt: unreadable line '" + line + "'");
    header.pop_back();
    if (!(words >> test) || words >> rest || !tests.emplace(header, test).second)
      throw std::runtime_error("tested_with.txt: unreadable line '" + line + "'");
  }
  return tests;
}

/// What `text` includes of `files`, through others too.
std::set<std::string> reached_from(const std::string& text, const std::map<std::string, std::string>& files) {
  static const std::regex include(R"re(#include [<"]([^>"]+)[>"])re");
  std::set<std::string> reached;
  std::vector<const std::string*> open{&text};
  while (!open.empty()) {
    const std::string& from = *open.back();
    open.pop_back();
    for (std::sregex_iterator it(from.begin(), from.end(), include), end; it != end; ++it) {
      const auto file = files.find(it->str(1));
      if (file != files.end() && reached.insert(file->first).second) open.push_back(&file->second);
    }
  }
  return reached;
}

/// `headers`: paths below include/npt. `tests`: files below tests.
std::vector<std::string> test_complaints(const std::vector<SourceFile>& headers, const std::vector<SourceFile>& tests,
                                         std::map<std::string, std::string> tested_with) {
  std::map<std::string, std::string> files;  // by the names that they are included by
  for (const SourceFile& header : headers) files.emplace("npt/" + header.path, header.text);
  for (const SourceFile& test : tests) files.emplace(test.path, test.text);
  std::vector<std::string> complaints;
  for (const auto& [header, text] : headers) {
    const std::size_t slash = header.find('/');
    if (slash == std::string::npos) continue;  // config.hpp and umbrellas
    // The folders of nn are modules of their own.
    const std::size_t end = header.starts_with("nn/") ? header.find('/', slash + 1) : slash;
    const std::string folder = header.substr(0, end + 1);
    bool any = false, named = false;
    for (const SourceFile& test : tests) {
      if (!test.path.starts_with(folder)) continue;
      any = true;
      named = named || test.text.find(header) != std::string::npos;
    }
    if (!any) complaints.push_back("tests/" + folder + ": no tests of the module");
    const auto listed = tested_with.find(header);
    if (listed == tested_with.end()) {
      if (any && !named)
        complaints.push_back(header + ": no test in tests/" + folder + " names it, nor does tested_with.txt");
      continue;
    }
    const auto test = std::ranges::find(tests, listed->second, &SourceFile::path);
    if (test == tests.end())
      complaints.push_back(header + ": tested_with.txt names tests/" + listed->second + ", which doesn't exist");
    else if (!reached_from(test->text, files).contains("npt/" + header))
      complaints.push_back(header + ": tests/" + listed->second + " doesn't include it, not even through others");
    tested_with.erase(listed);
  }
  for (const auto& [header, test] : tested_with)
    complaints.push_back(header + ": tested_with.txt names it, but it doesn't exist");
  return complaints;
}

}  // namespace

TEST_CASE("every module has tests, and every header is named by one") {
  const std::vector<SourceFile> headers = structure::read_tree(NPT_SOURCE_DIR "/include/npt", {".hpp"});
  const std::vector<SourceFile> tests = structure::read_tree(NPT_SOURCE_DIR "/tests", {".hpp", ".cpp"});
  REQUIRE(tests.size() > 20);
  const std::vector<std::string> complaints = test_complaints(
      headers, tests, parse_tested_with(structure::read_text(NPT_SOURCE_DIR "/tests/structure/tested_with.txt")));
  CHECK_MESSAGE(complaints.empty(), structure::join(complaints));
}

TEST_CASE("the rule about tests finds each kind of offence") {
  const std::vector<SourceFile> tests{{"io/test_obj.cpp", "#include <npt/io/obj.hpp>\n"},
                                      {"mesh/test_mesh.cpp", "// <npt/mesh/mesh.hpp>\n"}};
  const SourceFile obj{"io/obj.hpp", "#include <npt/io/text.hpp>\n"}, text{"io/text.hpp", ""}, ply{"io/ply.hpp", ""},
      mesh{"mesh/mesh.hpp", ""}, net{"net/net.hpp", ""}, config{"config.hpp", ""};
  const auto complaints = [&](const std::vector<SourceFile>& headers, const std::string& list) {
    return test_complaints(headers, tests, parse_tested_with(list)).size();
  };
  CHECK(complaints({obj, mesh, config}, "") == 0);
  CHECK(complaints({obj, text}, "# why\nio/text.hpp: io/test_obj.cpp\n") == 0);
  CHECK(complaints({obj, text}, "") == 1);
  CHECK(complaints({net}, "") == 1);
  CHECK(complaints({obj, ply}, "io/ply.hpp: io/test_obj.cpp") == 1);
  CHECK(complaints({obj, text}, "io/text.hpp: io/test_none.cpp") == 1);
  CHECK(complaints({obj}, "io/gone.hpp: io/test_obj.cpp") == 1);
  CHECK_THROWS_AS(parse_tested_with("io/obj.hpp io/test_obj.cpp"), std::runtime_error);
  CHECK_THROWS_AS(parse_tested_with("io/obj.hpp: io/test_obj.cpp and more"), std::runtime_error);
}
