/// The include rule: modules.txt says which module includes which; every #include line of include/npt is held against it.
#include <doctest/doctest.h>

#include <structure/source_tree.hpp>

#include <cctype>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

using structure::SourceFile;

struct Rules {
  std::map<std::string, std::set<std::string>> modules;  ///< module -> every module it may include, itself among them
  std::vector<std::pair<std::string, std::vector<std::string>>> libraries;  ///< prefix -> modules or files
  std::set<std::string> system;
};

Rules parse_rules(const std::string& text) {
  Rules rules;
  for (const std::string& line : structure::lines_of(text)) {
    std::istringstream words(line);
    std::string kind, name;
    if (!(words >> kind) || kind.starts_with('#') || kind == "entry") continue;  // test_entry_points.cpp reads those
    if (kind == "system") {
      for (std::string header; words >> header;) rules.system.insert(header);
      continue;
    }
    if ((kind != "module" && kind != "library") || !(words >> name) || !name.ends_with(':'))
      throw std::runtime_error("modules.txt: unreadable line '" + line + "'");
    name.pop_back();
    if (kind == "library") {
      rules.libraries.emplace_back(name, std::vector<std::string>{std::istream_iterator<std::string>(words), {}});
      continue;
    }
    if (rules.modules.contains(name)) throw std::runtime_error("modules.txt: module '" + name + "' stands twice");
    std::set<std::string> reach{name};
    for (std::string above; words >> above;) {
      if (!rules.modules.contains(above))
        throw std::runtime_error("modules.txt: module '" + name + "' names '" + above + "', which is not above it");
      reach.merge(std::set<std::string>(rules.modules.at(above)));
    }
    rules.modules.emplace(name, std::move(reach));
  }
  return rules;
}

/// The module of a path below include/npt: the innermost of its folders that modules.txt names, or else its first
/// folder. config.hpp is a module of its own, npt.hpp the umbrella over all.
std::string module_of(const std::string& path, const Rules& rules) {
  for (std::size_t slash = path.rfind('/'); slash != std::string::npos && slash > 0; slash = path.rfind('/', slash - 1))
    if (rules.modules.contains(path.substr(0, slash))) return path.substr(0, slash);
  const std::size_t slash = path.find('/');
  return slash != std::string::npos ? path.substr(0, slash) : path.substr(0, path.rfind('.'));
}

struct Include {
  std::string name;  ///< as between the brackets
  bool quoted = false;
  std::size_t line = 0;
};

std::vector<Include> includes_of(const std::string& text) {
  static const std::regex pattern(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"].*)");
  std::vector<Include> includes;
  const std::vector<std::string> lines = structure::lines_of(text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::smatch match;
    if (std::regex_match(lines[i], match, pattern)) includes.push_back({match[2], match[1] == "\"", i + 1});
  }
  return includes;
}

/// What is wrong with one include of the file at `path`, or nothing.
std::string complaint_about(const std::string& path, const Include& include, const Rules& rules) {
  if (include.quoted) return "quotes: write #include <npt/...>";
  const std::string module = module_of(path, rules);
  if (include.name.starts_with("npt/")) {
    const std::string target = module_of(include.name.substr(4), rules);
    if (target == "npt") return "the umbrella is for users";
    if (!rules.modules.contains(target)) return "'" + target + "' is no module of modules.txt";
    if (module == "npt" || rules.modules.at(module).contains(target)) return {};
    return "module '" + module + "' may not include module '" + target + "'";
  }
  for (const auto& [prefix, places] : rules.libraries) {
    if (!include.name.starts_with(prefix)) continue;
    const auto holds = [&](const std::string& place) { return place == module || place == path; };
    return std::ranges::any_of(places, holds) ? std::string() : "the library stays behind " + places.front();
  }
  const bool standard = include.name.find_first_of("./") == std::string::npos;
  return standard || rules.system.contains(include.name) ? std::string() : "no library of modules.txt";
}

std::vector<std::string> include_complaints(const std::vector<SourceFile>& headers, const Rules& rules) {
  std::vector<std::string> complaints;
  for (const SourceFile& header : headers) {
    const std::string module = module_of(header.path, rules);
    if (module != "npt" && !rules.modules.contains(module)) {
      complaints.push_back(header.path + ": '" + module + "' is no module of modules.txt");
      continue;
    }
    for (const Include& include : includes_of(header.text)) {
      const std::string complaint = complaint_about(header.path, include, rules);
      if (!complaint.empty())
        complaints.push_back(header.path + ":" + std::to_string(include.line) + ": <" + include.name +
                             ">: " + complaint);
    }
  }
  return complaints;
}

/// Headers that include each other in a circle, however long: what is left when every header all of whose own includes
/// are settled has been taken away, again and again.
std::vector<std::string> circular_headers(const std::vector<SourceFile>& headers) {
  std::map<std::string, std::set<std::string>> open;
  for (const SourceFile& header : headers)
    for (const Include& include : (open[header.path], includes_of(header.text)))
      if (include.name.starts_with("npt/")) open[header.path].insert(include.name.substr(4));
  for (bool progress = true; progress;) {
    progress = std::erase_if(open, [&](const auto& header) {
                 return std::ranges::none_of(header.second, [&](const auto& name) { return open.contains(name); });
               }) != 0;
  }
  std::vector<std::string> names;
  names.reserve(open.size());
  for (const auto& [name, includes] : open) names.push_back(name);
  return names;
}

const Rules& project_rules() {
  static const Rules rules =
      parse_rules(structure::read_text(std::filesystem::path(NPT_SOURCE_DIR) / "tests/structure/modules.txt"));
  return rules;
}

std::vector<SourceFile> public_headers() {
  return structure::read_tree(std::filesystem::path(NPT_SOURCE_DIR) / "include/npt", {".hpp"});
}

/// Standard names, by the header that declares them. Headers compile alone behind precompiled standard headers
/// (CMakeLists.txt), which would hide that one of these is missing.
const std::map<std::string, std::string>& standard_names() {
  static const std::map<std::string, std::vector<std::string>> by_header{
      {"vector", {"vector"}},
      {"string", {"string", "to_string", "stoi", "wstring"}},
      {"span", {"span"}},
      {"array", {"array"}},
      {"optional", {"optional", "nullopt"}},
      {"memory", {"unique_ptr", "shared_ptr", "make_unique", "make_shared", "weak_ptr", "addressof"}},
      {"map", {"map", "multimap"}},
      {"set", {"set"}},
      {"unordered_map", {"unordered_map"}},
      {"unordered_set", {"unordered_set"}},
      {"functional", {"function", "hash", "less", "greater", "plus", "invoke", "identity"}},
      {"string_view", {"string_view"}},
      {"filesystem", {"filesystem"}},
      {"fstream", {"ifstream", "ofstream"}},
      {"sstream", {"ostringstream", "istringstream", "stringstream"}},
      {"mutex", {"mutex", "lock_guard", "unique_lock", "scoped_lock", "once_flag", "call_once"}},
      {"atomic", {"atomic"}},
      {"thread", {"thread"}},
      {"chrono", {"chrono"}},
      {"variant", {"variant", "visit"}},
      {"tuple", {"tuple", "tie"}},
      {"limits", {"numeric_limits"}},
      {"utility",
       {"pair", "move", "forward", "exchange", "swap", "as_const", "index_sequence", "make_index_sequence",
        "integer_sequence", "make_integer_sequence", "declval"}},
      {"cstdint",
       {"uint64_t", "int64_t", "uint32_t", "int32_t", "uint8_t", "uint16_t", "int8_t", "int16_t", "uintptr_t"}},
      {"cstddef", {"size_t", "ptrdiff_t", "byte", "nullptr_t", "max_align_t"}},
      {"cmath",
       {"sqrt", "exp", "sin", "cos", "tan", "atan2", "floor", "pow", "isfinite", "log", "tanh", "fma", "hypot", "acos",
        "cbrt"}},
      {"numbers", {"numbers"}},
      {"bit", {"bit_cast", "endian", "has_single_bit", "countr_zero"}},
      {"type_traits",
       {"is_same_v", "conditional_t", "remove_cvref_t", "is_base_of_v", "decay_t", "enable_if_t", "true_type",
        "false_type", "is_integral_v"}},
      {"charconv", {"from_chars", "to_chars"}},
      {"cstring", {"memcpy", "memcmp", "strerror", "strlen", "memset"}},
      {"concepts", {"same_as", "invocable", "integral", "floating_point", "convertible_to"}},
      {"initializer_list", {"initializer_list"}},
      {"algorithm",
       {"sort", "ranges::sort", "max", "min", "clamp", "copy", "fill", "max_element", "min_element", "lower_bound",
        "upper_bound", "ranges::copy", "ranges::fill", "nth_element", "stable_sort", "reverse"}},
      {"numeric", {"iota", "accumulate", "inner_product"}},
      {"random", {"mt19937_64", "uniform_int_distribution"}},
      {"iterator", {"back_inserter", "make_move_iterator"}},
      {"exception", {"exception_ptr", "current_exception"}},
      {"stdexcept", {"runtime_error", "logic_error", "invalid_argument", "out_of_range"}},
      {"condition_variable", {"condition_variable"}},
      {"complex", {"complex"}},
      {"deque", {"deque"}},
      {"queue", {"queue", "priority_queue"}},
  };
  static const std::map<std::string, std::string> names = [] {
    std::map<std::string, std::string> result;
    for (const auto& [header, declared] : by_header)
      for (const std::string& name : declared) result[name] = header;
    return result;
  }();
  return names;
}

/// The header's standard names, and libraries' namespaces, whose own headers it leaves to others to include.
std::vector<std::string> missing_includes(const SourceFile& header) {
  static const std::regex comment("//[^\n]*");
  static const std::regex use(R"(\b(std|Eigen|xsimd|nlohmann|tinyobj|draco)::((?:ranges::)?\w+))");
  std::set<std::string> included;
  for (const Include& include : includes_of(header.text)) {
    included.insert(include.name);
    for (const std::string library : {"Eigen", "xsimd", "nlohmann", "tiny", "draco"})
      if (include.name.starts_with(library)) included.insert(library);
  }
  const std::string code = std::regex_replace(header.text, comment, "");
  std::map<std::string, std::string> missing;
  for (auto match = std::sregex_iterator(code.begin(), code.end(), use); match != std::sregex_iterator(); ++match) {
    std::string wanted = (*match)[1] == "tinyobj" ? "tiny" : (*match)[1].str();
    if (wanted == "std") {
      const auto found = standard_names().find((*match)[2]);
      if (found == standard_names().end()) continue;
      wanted = found->second;
    }
    if (!included.contains(wanted)) missing.emplace(wanted, match->str());
  }
  std::vector<std::string> complaints;
  for (const auto& [wanted, name] : missing)
    complaints.push_back(header.path + ": " + name + " without its own <" + wanted + ">");
  return complaints;
}

/// Standard headers that a header includes and doesn't use. Only those of which standard_names() has all that npt uses.
std::vector<std::string> spare_includes(const SourceFile& header) {
  static const std::set<std::string> whole{
      "array",   "vector",  "span",  "optional",   "map",    "set",    "string_view", "limits",  "utility", "cstdint",
      "cstddef", "numbers", "deque", "filesystem", "chrono", "string", "functional",  "variant", "mutex",   "atomic"};
  const std::set<std::string> words = [&] {
    static const std::regex line("(//|#include)[^\n]*"), word("\\w+");
    const std::string code = std::regex_replace(header.text, line, "");
    return std::set<std::string>(std::sregex_token_iterator(code.begin(), code.end(), word), {});
  }();
  std::vector<std::string> complaints;
  for (const Include& include : includes_of(header.text))
    if (whole.contains(include.name) && std::ranges::none_of(standard_names(), [&](const auto& name) {
          return name.second == include.name && words.contains(name.first);
        }))
      complaints.push_back(header.path + ": <" + include.name + "> without a use");
  return complaints;
}

/// A word or sign of C++, and whether it stands on a line that begins without indentation.
struct Token {
  std::string text;
  bool outermost = false;

  bool is_name() const { return std::isalpha(static_cast<unsigned char>(text[0])) != 0 || text[0] == '_'; }
};

/// Without comments, texts and include lines. Signs are single ones but for :: and ->.
std::vector<Token> tokens_of(const std::string& text) {
  std::vector<Token> tokens;
  for (const std::string& line : structure::lines_of(text)) {
    if (line.empty() || line.starts_with("#include")) continue;
    const bool outermost = line[0] != ' ' && line[0] != '}' && !line.starts_with("namespace");
    const auto in_word = [&](std::size_t i) {
      return i < line.size() && (std::isalnum(static_cast<unsigned char>(line[i])) != 0 || line[i] == '_');
    };
    for (std::size_t i = 0; i < line.size();) {
      std::size_t end = i + 1;
      if (line.compare(i, 2, "//") == 0) break;
      if (line[i] == '"' || (line[i] == '\'' && !in_word(i - 1))) {
        while (end < line.size() && line[end] != line[i]) end += line[end] == '\\' ? 2U : 1U;
        i = end + 1;
        continue;
      }
      if (in_word(i)) {
        while (in_word(end)) ++end;
      } else if (line.compare(i, 2, "::") == 0 || line.compare(i, 2, "->") == 0) {
        ++end;
      }
      if (line[i] != ' ') tokens.push_back({line.substr(i, end - i), outermost});
      i = end;
    }
  }
  return tokens;
}

/// The names that a header declares for others: those of outermost lines, outside of parentheses, that a sign of
/// declarations follows.
std::set<std::string> declared_names(const std::vector<Token>& tokens) {
  static const std::set<std::string> no_names{"char", "requires", "noexcept"};
  std::set<std::string> names;
  int depth = 0;
  for (std::size_t i = 1; i + 1 < tokens.size(); ++i) {
    const std::string &before = tokens[i - 1].text, &after = tokens[i + 1].text;
    if (tokens[i].text == "(") ++depth;
    if (tokens[i].text == ")") --depth;
    if (depth == 0 && tokens[i].outermost && tokens[i].is_name() && !no_names.contains(tokens[i].text) &&
        before != "return" && (tokens[i - 1].is_name() || before == ">" || before == "&" || before == "*") &&
        std::string("({=;:").find(after) != std::string::npos)
      names.insert(tokens[i].text);
  }
  return names;
}

/// The names that a header uses and doesn't declare itself, be it as a member, a parameter or a variable. Those behind
/// a dot, an arrow, a class or another library's namespace belong there.
std::set<std::string> used_names(const std::vector<Token>& tokens) {
  static const std::set<std::string> no_types{"return", "new",   "else",     "case",
                                              "throw",  "const", "typename", "constexpr"},
      others{"std",   "ranges",   "numbers", "chrono", "filesystem", "this_thread", "Eigen",
             "xsimd", "nlohmann", "tinyobj", "draco",  "tbb",        "xt"};
  std::set<std::string> used, own;
  bool enumerators = false;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    enumerators = tokens[i].text == "enum" || (enumerators && tokens[i].text != "}");
    if (!tokens[i].is_name()) continue;
    const std::string before = i > 0 ? tokens[i - 1].text : "", after = i + 1 < tokens.size() ? tokens[i + 1].text : "";
    if (enumerators || (before == "," && (after == "=" || after == ";"))) own.insert(tokens[i].text);
    const std::string scope = before == "::" && i > 1 ? tokens[i - 2].text : "";
    if (before == "." || before == "->" || others.contains(scope) || scope == ">" ||
        (!scope.empty() && std::isupper(static_cast<unsigned char>(scope[0])) != 0))
      continue;
    const bool behind_type = i > 0 && ((tokens[i - 1].is_name() && !no_types.contains(before)) || before == ">" ||
                                       before == "&" || before == "*" || before == "]");
    if (behind_type && std::string("({=;,:)>[").find(after) != std::string::npos) own.insert(tokens[i].text);
    used.insert(tokens[i].text);
  }
  for (const std::string& name : own) used.erase(name);
  return used;
}

/// Names of npt that a header uses without including what declares them, itself or through others.
std::vector<std::string> unseen_names(const std::vector<SourceFile>& headers) {
  std::map<std::string, std::vector<Token>> tokens;
  std::map<std::string, std::set<std::string>> reach;  // of each header; itself among them
  std::map<std::string, std::set<std::string>> places;
  for (const SourceFile& header : headers) {
    tokens[header.path] = tokens_of(header.text);
    for (const std::string& name : declared_names(tokens[header.path])) places[name].insert(header.path);
    for (const Include& include : (reach[header.path].insert(header.path), includes_of(header.text)))
      if (include.name.starts_with("npt/")) reach[header.path].insert(include.name.substr(4));
  }
  for (bool grows = true; grows;) {
    grows = false;
    for (auto& [path, seen] : reach)
      for (const std::string& other : std::vector<std::string>(seen.begin(), seen.end()))
        if (const auto found = reach.find(other); found != reach.end() && other != path)
          for (const std::string& further : found->second) grows = seen.insert(further).second || grows;
  }
  std::vector<std::string> complaints;
  for (const SourceFile& header : headers)
    for (const std::string& name : used_names(tokens[header.path])) {
      const auto declared = places.find(name);
      if (declared == places.end()) continue;
      if (std::ranges::none_of(declared->second, [&](const auto& place) { return reach[header.path].contains(place); }))
        complaints.push_back(header.path + ": " + name + " without <npt/" + *declared->second.begin() + ">");
    }
  return complaints;
}

}  // namespace

TEST_CASE("every header includes, itself or through others, what declares the names of npt that it uses") {
  std::vector<std::string> complaints = unseen_names(public_headers());
  // A template's call, found by its arguments' types: the module graph lies below layer.
  std::erase(complaints, "nn/layer/spadain.hpp: conditioned without <npt/nn/graph/expression.hpp>");
  CHECK_MESSAGE(complaints.empty(), structure::join(complaints));

  const SourceFile plate{"plate.hpp", "struct Plate {\n  int depth;\n};\ninline int depth_of(const Plate& p);\n"};
  const auto complaints_about = [&](const std::string& text) { return unseen_names({plate, {"meal.hpp", text}}); };
  CHECK(complaints_about("#include <npt/plate.hpp>\nPlate a;").empty());
  CHECK(complaints_about("Plate a;") == std::vector<std::string>{"meal.hpp: Plate without <npt/plate.hpp>"});
  CHECK(complaints_about("int a(int b) {\n  return depth_of(b);  // Plate\n}").size() == 1);
  CHECK(complaints_about("int a = kitchen.depth_of(\"Plate\");").empty());
  CHECK(complaints_about("int a(int depth_of) { return depth_of; }").empty());
  CHECK(unseen_names(
            {plate, {"dish.hpp", "#include <npt/plate.hpp>\n"}, {"meal.hpp", "#include <npt/dish.hpp>\nPlate a;"}})
            .empty());
}

TEST_CASE("every header includes what declares the standard names that it uses") {
  std::vector<std::string> complaints;
  for (const SourceFile& header : public_headers())
    for (const std::string& complaint : missing_includes(header)) complaints.push_back(complaint);
  CHECK_MESSAGE(complaints.empty(), structure::join(complaints));

  CHECK(missing_includes({"a.hpp", "#include <vector>\nstd::vector<int> a;  // std::map"}).empty());
  CHECK(missing_includes({"a.hpp", "#include <vector>\nstd::vector<std::string> a;"}) ==
        std::vector<std::string>{"a.hpp: std::string without its own <string>"});
  CHECK(missing_includes({"a.hpp", "Eigen::MatrixXd a;"}).size() == 1);
}

TEST_CASE("no header includes a standard header that it doesn't use") {
  std::vector<std::string> complaints;
  for (const SourceFile& header : public_headers())
    for (const std::string& complaint : spare_includes(header)) complaints.push_back(complaint);
  CHECK_MESSAGE(complaints.empty(), structure::join(complaints));

  CHECK(spare_includes({"a.hpp", "#include <vector>\nstd::vector<int> a;"}).empty());
  CHECK(spare_includes({"a.hpp", "#include <map>\nint a;  // no map"}) ==
        std::vector<std::string>{"a.hpp: <map> without a use"});
}

TEST_CASE("every include stays within the modules its own module may include") {
  const std::vector<SourceFile> headers = public_headers();
  REQUIRE(headers.size() > 4);
  const std::vector<std::string> complaints = include_complaints(headers, project_rules());
  CHECK_MESSAGE(complaints.empty(), structure::join(complaints));
}

TEST_CASE("no header includes itself by way of others") {
  const std::vector<std::string> circular = circular_headers(public_headers());
  CHECK_MESSAGE(circular.empty(), structure::join(circular));
}

TEST_CASE("include/npt holds headers only") {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(NPT_SOURCE_DIR "/include"))
    if (entry.is_regular_file()) CHECK_MESSAGE(entry.path().extension() == ".hpp", entry.path().string());
}

TEST_CASE("the include rule finds each kind of offence") {
  const Rules rules = parse_rules(
      "module config:\nmodule base: config\nmodule nn/simd: base\nmodule mesh: base\nmodule io: mesh\nmodule nn/graph: "
      "base\n"
      "library xsimd/: nn/simd\nlibrary tiny.h: io/obj.hpp\nsystem unistd.h\n");
  const auto complaints = [&](const std::string& path, const std::string& line) {
    return include_complaints({{path, line}}, rules);
  };
  CHECK(complaints("io/obj.hpp", "#include <npt/base/error.hpp>").empty());
  CHECK(complaints("io/obj.hpp", "#include <tiny.h>").empty());
  CHECK(complaints("io/obj.hpp", "#include <vector>").empty());
  CHECK(complaints("io/obj.hpp", "#include <unistd.h>").empty());
  CHECK(complaints("nn/simd/batch.hpp", "#include <xsimd/xsimd.hpp>").empty());
  CHECK(complaints("npt.hpp", "#include <npt/io/obj.hpp>").empty());

  CHECK(complaints("base/error.hpp", "\n  #  include <npt/mesh/mesh.hpp> // why") ==
        std::vector<std::string>{"base/error.hpp:2: <npt/mesh/mesh.hpp>: module 'base' may not include module 'mesh'"});
  CHECK(complaints("mesh/mesh.hpp", "#include <npt/nn/simd/batch.hpp>").size() == 1);
  CHECK(complaints("mesh/mesh.hpp", "#include <xsimd/xsimd.hpp>").size() == 1);
  CHECK(complaints("io/ply.hpp", "#include <tiny.h>").size() == 1);
  CHECK(complaints("io/ply.hpp", "#include <boost/any.hpp>").size() == 1);
  CHECK(complaints("io/ply.hpp", "#include \"obj.hpp\"").size() == 1);
  CHECK(complaints("io/ply.hpp", "#include <npt/npt.hpp>").size() == 1);
  CHECK(complaints("cellar/wine.hpp", "").size() == 1);
  CHECK(complaints("nn/graph/fold.hpp", "#include <npt/base/error.hpp>").empty());
  CHECK(complaints("nn/graph/fold.hpp", "#include <npt/mesh/mesh.hpp>").size() == 1);
  CHECK(complaints("io/gltf/clip.hpp", "#include <npt/mesh/mesh.hpp>").empty());

  CHECK_THROWS_WITH(parse_rules("module a: b\nmodule b:"), "modules.txt: module 'a' names 'b', which is not above it");
  CHECK(circular_headers({{"a.hpp", "#include <npt/b.hpp>"}, {"b.hpp", "#include <npt/a.hpp>"}, {"c.hpp", ""}}) ==
        std::vector<std::string>{"a.hpp", "b.hpp"});
}
