/// The size of the library: each header is reached from one that users include (the entries of modules.txt), modules
/// are few, and the headers don't grow.
#include <doctest/doctest.h>

#include <structure/source_tree.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using structure::SourceFile;

struct Modules {
  std::vector<std::string> entries;  ///< headers, below include/npt
  std::set<std::string> folders;     ///< of include/npt, without config
};

Modules parse_modules(const std::string& text) {
  Modules modules;
  for (const std::string& line : structure::lines_of(text)) {
    std::istringstream words(line);
    std::string kind, word;
    words >> kind;
    if (kind == "entry")
      while (words >> word) modules.entries.push_back(word);
    if (kind == "module" && words >> word && word != "config:")
      modules.folders.insert(word.substr(0, word.find_first_of("/:")));
  }
  return modules;
}

/// Headers that no entry includes, not even through others, and entries that don't exist or that nothing names.
std::vector<std::string> entry_complaints(const std::vector<SourceFile>& headers,
                                          const std::vector<std::string>& entries,
                                          const std::vector<SourceFile>& users) {
  static const std::regex include("#include <npt/([^>]+)>");
  std::map<std::string, const std::string*> unreached;
  for (const SourceFile& header : headers) unreached.emplace(header.path, &header.text);
  std::vector<std::string> complaints, open;
  for (const std::string& entry : entries) {
    if (!unreached.contains(entry)) complaints.push_back(entry + ": an entry of modules.txt that doesn't exist");
    const auto names_it = [&](const SourceFile& user) { return user.text.find(entry) != std::string::npos; };
    if (std::ranges::none_of(users, names_it)) complaints.push_back(entry + ": no example, program or guide names it");
    open.push_back(entry);
  }
  while (!open.empty()) {
    const auto found = unreached.find(open.back());
    open.pop_back();
    if (found == unreached.end()) continue;
    const std::string& text = *found->second;
    unreached.erase(found);
    for (std::sregex_iterator it(text.begin(), text.end(), include), end; it != end; ++it) open.push_back(it->str(1));
  }
  for (const auto& [path, text] : unreached) complaints.push_back(path + ": no entry of modules.txt includes it");
  return complaints;
}

std::vector<SourceFile> headers_of_library() { return structure::read_tree(NPT_SOURCE_DIR "/include/npt", {".hpp"}); }

Modules project_modules() { return parse_modules(structure::read_text(NPT_SOURCE_DIR "/tests/structure/modules.txt")); }

}  // namespace

TEST_CASE("every header is one that users include, or is reached from one") {
  std::vector<SourceFile> users = structure::read_tree(NPT_SOURCE_DIR "/examples", {".cpp", ".hpp"});
  std::ranges::move(structure::read_tree(NPT_SOURCE_DIR "/docs", {".md"}), std::back_inserter(users));
  std::vector<SourceFile> headers = headers_of_library();
  std::erase_if(headers, [](const SourceFile& header) { return header.path == "config.hpp"; });
  const Modules modules = project_modules();
  REQUIRE(modules.entries.size() > 5);
  const std::vector<std::string> complaints = entry_complaints(headers, modules.entries, users);
  CHECK_MESSAGE(complaints.empty(), structure::join(complaints));

  const SourceFile plate{"plate.hpp", "#include <npt/dish.hpp>\n"}, dish{"dish.hpp", ""}, user{"main.cpp", "plate.hpp"};
  CHECK(entry_complaints({plate, dish}, {"plate.hpp"}, {user}).empty());
  CHECK(entry_complaints({plate, dish, {"fork.hpp", ""}}, {"plate.hpp"}, {user}) ==
        std::vector<std::string>{"fork.hpp: no entry of modules.txt includes it"});
  CHECK(entry_complaints({plate, dish}, {"plate.hpp", "dish.hpp"}, {user}) ==
        std::vector<std::string>{"dish.hpp: no example, program or guide names it"});
  CHECK(entry_complaints({plate, dish}, {"plate.hpp", "cup.hpp"}, {user, {"cup.md", "cup.hpp"}}).size() == 1);
}

TEST_CASE("there are at most 14 modules, each a folder of include/npt") {
  const Modules modules = project_modules();
  CHECK(modules.folders.size() <= 14);
  for (const auto& entry : std::filesystem::directory_iterator(NPT_SOURCE_DIR "/include/npt"))
    if (entry.is_directory())
      CHECK_MESSAGE(modules.folders.contains(entry.path().filename().string()), entry.path().string());
  CHECK(
      parse_modules("module config:\nmodule a: config\nmodule a/b: a\nmodule c: a/b\nentry a/x.hpp y.hpp\n").folders ==
      std::set<std::string>{"a", "c"});
}

TEST_CASE("the headers, without tables of data, have fewer than 49,700 lines") {
  std::size_t lines = 0, tables = 0;
  for (const SourceFile& header : headers_of_library()) {
    const bool table = header.path == "body/natural_pose_data.hpp" || header.path == "body/mannequin/surface_data.hpp";
    (table ? tables : lines) += structure::lines_of(header.text).size();
  }
  CHECK(tables > 0);
  CHECK(lines < 49700);
}
