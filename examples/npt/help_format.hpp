/// How `--help` is laid out: lines of at most 100 columns, the kind of value behind an option's name, and at the end of
/// each description in brackets the default, what the option needs, and what it can't stand beside:
///   --worst N            Also list this many of the worst pairs (not with --sequences)
/// A default that the program works out stands in the description as "... (default: 30)".
#pragma once

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstddef>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace program {

class HelpFormat : public CLI::Formatter {
 public:
  HelpFormat() { column_width(static_cast<std::size_t>(names)); }

  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string kind = kind_of(*option);
    const bool repeated = option->get_expected_max() == CLI::detail::expected_max_vector_size;
    return (kind.empty() ? "" : " " + kind) + (repeated ? " ..." : "");
  }

  std::string make_option_desc(const CLI::Option* option) const override {
    constexpr std::string_view mark = " (default: ";
    std::string text = option->get_description(), fallback = option->get_default_str();
    if (const std::size_t at = text.rfind(mark); at != std::string::npos) {
      fallback = text.substr(at + mark.size(), text.size() - at - mark.size() - 1);
      text.resize(at);
    }
    std::string more;
    const auto add = [&more](const std::string& part) { more += (more.empty() ? "" : "; ") + part; };
    if (option->get_required()) add("required");
    if (!fallback.empty()) add("default: " + fallback);
    if (!option->get_needs().empty()) add("needs " + names_of(option->get_needs()));
    if (!option->get_excludes().empty()) add("not with " + names_of(option->get_excludes()));
    return wrapped(text + (more.empty() ? "" : " (" + more + ")"));
  }

 private:
  static constexpr int names = 34, columns = 100;

  /// CLI11 says "TEXT:{ply,obj}", "INT:INT in [0 - 4096]", "PATH".
  static std::string kind_of(const CLI::Option& option) {
    if (option.get_type_size() == 0 || option.get_positional()) return {};
    std::string kind = option.get_type_name();
    if (const std::size_t brace = kind.find(":{"); brace != std::string::npos) {
      kind = kind.substr(brace + 2, kind.find('}') - brace - 2);
      std::ranges::replace(kind, ',', '|');
      return kind;
    }
    kind.resize(std::min(kind.find(':'), kind.size()));
    return kind == "INT" || kind == "UINT" ? "N" : kind == "FLOAT" ? "X" : kind;
  }

  static std::string names_of(const std::set<CLI::Option*>& options) {
    std::vector<std::string> all;
    all.reserve(options.size());
    for (const CLI::Option* option : options) all.push_back("--" + option->get_single_name());
    std::ranges::sort(all);  // the set is in the order of addresses
    std::string text;
    for (const std::string& name : all) text += (text.empty() ? "" : ", ") + name;
    return text;
  }

  static std::string wrapped(const std::string& text) {
    std::istringstream words(text);
    std::string line, lines;
    for (std::string word; words >> word;) {
      if (!line.empty() && line.size() + 1 + word.size() > static_cast<std::size_t>(columns - names)) {
        lines += line + '\n';
        line.clear();
      }
      line += (line.empty() ? "" : " ") + word;
    }
    return lines + line;
  }
};

}  // namespace program
