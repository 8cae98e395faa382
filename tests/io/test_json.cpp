#include <doctest/doctest.h>

#include <npt/io/json.hpp>

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

namespace {

/// Writes the events down: "{k:'a' n1 }" and so on.
struct Log {
  std::string text;
  void null() { text += "null "; }
  void boolean(bool value) { text += value ? "true " : "false "; }
  void number(std::string_view value) { text.append("n").append(value).append(" "); }
  void string(const std::string& value) { text.append("'").append(value).append("' "); }
  void key(const std::string& value) { text += value + ": "; }
  void start_object() { text += "{ "; }
  void end_object() { text += "} "; }
  void start_array() { text += "[ "; }
  void end_array() { text += "] "; }
  [[noreturn]] void syntax_error(std::size_t position) const { throw std::runtime_error(std::to_string(position)); }
};

std::string events(std::string_view text) {
  Log log;
  try {
    npt::internal::read_json(text, log);
  } catch (const std::runtime_error& e) {
    return std::string("error at ") + e.what();
  }
  log.text.pop_back();
  return log.text;
}

/// The text between two of the given characters.
std::string between(char quote, std::string_view text) { return std::string(1, quote).append(text).append(1, quote); }

std::string json_quoted(std::string_view text) {
  std::string out;
  return npt::internal::append_json_string(out, text) ? out : "no UTF-8" + out;
}

}  // namespace

TEST_CASE("JSON becomes events in the order of the text") {
  CHECK(events(R"( {"a" : [1, -2.5e+3 ,"x"], "b":{ }, "c":[],"d":[[],{"e":null}]} )") ==
        "{ a: [ n1 n-2.5e+3 'x' ] b: { } c: [ ] d: [ [ ] { e: null } ] }");
  CHECK(events("true") == "true");
  CHECK(events("\t\r\n false ") == "false");
  CHECK(events("[0,-0,0.0,1E5,1e-05]") == "[ n0 n-0 n0.0 n1E5 n1e-05 ]");
}

TEST_CASE("JSON strings: escapes, pairs of surrogates, UTF-8") {
  CHECK(events(R"("\"\\\/\b\f\n\r\t")") == "'\"\\/\b\f\n\r\t'");
  CHECK(events(R"("\u0041\u00e4\u20AC\uD83D\uDE00")") == "'A\u00e4\u20ac\U0001F600'");
  CHECK(events("\"\u00e4\u20ac\U0001F600\x7F\"") == "'\u00e4\u20ac\U0001F600\x7F'");
  CHECK(events(R"("\u0000")") == std::string("'\0'", 3));
  for (const char* bad : {R"("\u12")", R"("\u12G4")", R"("\x")", R"("\)", R"("\uD83D")", R"("\uD83Dx")",
                          R"("\uD83D\n")", R"("\uD83D\u0041")", R"("\uDE00")", "\"a\nb\"", "\"abc", "\""})
    CHECK_MESSAGE(events(bad).starts_with("error"), bad);
}

TEST_CASE("JSON strings that are no UTF-8 are refused, read or written") {
  for (const char* bad : {"\xFF", "\x80", "\xC3", "\xC0\xAF", "\xE0\x80\x80", "\xED\xA0\x80", "\xF0\x8F\xBF\xBF",
                          "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xE2\x82", "\xF0\x9F\x98", "\xE2\x28\xA1"}) {
    CHECK(events(between('"', bad)) == "error at 1");
    CHECK(json_quoted("abc" + std::string(bad)) == "no UTF-8");
  }
  for (const char* good : {"\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80", "\xEF\xBF\xBF",
                           "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"})
    CHECK(json_quoted(good) == between('"', good));
}

TEST_CASE("names that are no UTF-8 become it") {
  CHECK(npt::internal::utf8_of("Arm \xC3\xA4") == "Arm \xC3\xA4");
  CHECK(npt::internal::utf8_of("\xE4\xC3") == "\xC3\xA4\xC3\x83");
  CHECK(npt::internal::utf8_of("").empty());
}

TEST_CASE("what is no JSON is an error at its place") {
  CHECK(events("") == "error at 0");
  CHECK(events("  ") == "error at 2");
  CHECK(events("{} x") == "error at 3");
  CHECK(events("{\"a\":}") == "error at 5");
  CHECK(events("[1,]") == "error at 3");
  CHECK(events("{\"a\":1,}") == "error at 7");
  CHECK(events("[1 2]") == "error at 3");
  CHECK(events("{\"a\" 1}") == "error at 5");
  CHECK(events("{1:2}") == "error at 1");
  CHECK(events("[}") == "error at 1");
  CHECK(events("{\"a\":1]") == "error at 6");
  CHECK(events(std::string_view("[1\0]", 4)) == "error at 2");
  for (const char* bad : {"01",   "-",   "+1", ".5", "1.",     "1e",       "1e+",    "0x1", "NaN", "Infinity", "nul",
                          "True", "'a'", "[",  "{",  "{\"a\"", "{\"a\":1", "[1,,2]", "\v1", "1,2", "// c\n1",  "]"})
    CHECK_MESSAGE(events(bad).starts_with("error"), bad);
}

TEST_CASE("nesting costs a byte a level and no stack") {
  const std::size_t depth = 1000000;
  CHECK(events(std::string(depth, '[') + std::string(depth, ']')).size() == 4 * depth - 1);
  CHECK(events(std::string(depth, '[')) == "error at 1000000");
}

TEST_CASE("what is written as a JSON string is read as the same text") {
  std::string all;
  for (int c = 0; c < 0x80; ++c) all += static_cast<char>(c);
  all += "\u00e4\u20ac\U0001F600";
  CHECK(events(json_quoted(all)) == between('\'', all));
  CHECK(json_quoted("a\"b\\c\n\x01\x1f/") == R"("a\"b\\c\n\u0001\u001f/")");
  CHECK(json_quoted("") == "\"\"");
}
