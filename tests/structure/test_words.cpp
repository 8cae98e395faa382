/// The field's words: words.tsv lists private ones, and what to say instead. None stands in a guide, in the program, in a
/// package, or in the library.
#include <doctest/doctest.h>

#include <structure/source_tree.hpp>

#include <regex>
#include <string>
#include <vector>

namespace {

using structure::SourceFile;

struct PrivateWord {
  std::string pattern, instead;
  std::regex regex;
};

std::vector<PrivateWord> parse_words(const std::string& text) {
  std::vector<PrivateWord> words;
  std::vector<std::string> lines = structure::lines_of(text);
  for (std::size_t i = 1; i < lines.size(); ++i) {  // the first names the columns
    const std::size_t tab = lines[i].find('\t');
    if (tab == std::string::npos) throw std::runtime_error("words.tsv: unreadable line '" + lines[i] + "'");
    const std::string pattern = lines[i].substr(0, tab);
    words.push_back({pattern, lines[i].substr(tab + 1), std::regex(pattern, std::regex::icase)});
  }
  return words;
}

std::vector<std::string> word_complaints(const std::vector<SourceFile>& files, const std::vector<PrivateWord>& words) {
  std::vector<std::string> complaints;
  for (const SourceFile& file : files) {
    const std::vector<std::string> lines = structure::lines_of(file.text);
    for (std::size_t i = 0; i < lines.size(); ++i)
      for (const PrivateWord& word : words) {
        std::smatch match;
        if (std::regex_search(lines[i], match, word.regex))
          complaints.push_back(file.path + ":" + std::to_string(i + 1) + ": '" + match.str() + "': say " +
                               word.instead);
      }
  }
  return complaints;
}

/// What users and readers see: guides, the program, packages and pages, the library.
std::vector<SourceFile> texts() {
  const std::filesystem::path root(NPT_SOURCE_DIR);
  std::vector<SourceFile> files{{"README.md", structure::read_text(root / "README.md")}};
  for (const char* folder : {"docs", "examples", "include"})
    for (SourceFile& file : structure::read_tree(
             root / folder,
             {".md", ".hpp", ".h", ".cpp", ".c", ".txt", ".py", ".sh", ".js", ".mjs", ".html", ".css", ".in", ".toml"}))
      if (file.path.find("/three/") == std::string::npos)  // another project's
        files.push_back({std::string(folder) + "/" + file.path, std::move(file.text)});
  return files;
}

}  // namespace

TEST_CASE("guides, programs, packages and the library use the field's words") {
  const std::vector<PrivateWord> words = parse_words(structure::read_text(NPT_SOURCE_DIR "/tests/structure/words.tsv"));
  REQUIRE(words.size() > 20);
  const std::vector<SourceFile> files = texts();
  REQUIRE(files.size() > 300);
  const std::vector<std::string> complaints = word_complaints(files, words);
  CHECK_MESSAGE(complaints.empty(), structure::join(complaints));

  CHECK(word_complaints({{"a.md", "A mesh that\nreads as a person.\n"}}, words) ==
        std::vector<std::string>{"a.md:2: 'reads as a person': say is recognised as"});
  CHECK(word_complaints({{"a.md", "Body estimation recognises a person with confidence.\n"}}, words).empty());
  CHECK_THROWS_AS(parse_words("head\nno tab\n"), std::runtime_error);
}
