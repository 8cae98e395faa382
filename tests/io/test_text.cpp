#include <doctest/doctest.h>

#include <npt/io/text.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

using npt::append_number;
using npt::fits_float;
using npt::in_quotes;
using npt::next_word;
using npt::parse_number;
using npt::TextLines;
using npt::trimmed;

TEST_CASE("lines end in any of the three ways, the last one in none") {
  TextLines lines("a\nb\r\nc\rd\n\ne");
  std::vector<std::string> read;
  for (std::string_view line; lines.next(line);) read.emplace_back(line);
  CHECK(read == std::vector<std::string>{"a", "b", "c", "d", "", "e"});
  CHECK(lines.number() == 6);
  std::string_view line;
  CHECK_FALSE(TextLines("").next(line));
}

TEST_CASE("words are what stands between blanks") {
  std::string_view line = " \ta  bc\t";
  CHECK(next_word(line) == "a");
  CHECK(next_word(line) == "bc");
  CHECK(next_word(line).empty());
  CHECK(trimmed("  a b \r") == "a b");
  CHECK(trimmed(" \t ").empty());
}

TEST_CASE("a number is a whole word") {
  CHECK(parse_number<double>("+1.5e3") == 1500);
  CHECK(parse_number<double>(".5") == 0.5);
  CHECK(parse_number<double>("-3.") == -3);
  CHECK(parse_number<double>("1e-400") == 0);
  CHECK(std::isnan(*parse_number<double>("nan")));
  for (const char* word : {"", "+", "-", "1x", "x", "1,5", "0x10", "1e", "+-1", "++1", "1e400", "--1", " 1", "1 "})
    CHECK_MESSAGE(!parse_number<double>(word), word);
  CHECK(parse_number<std::int32_t>("-2147483648") == std::numeric_limits<std::int32_t>::min());
  CHECK_FALSE(parse_number<std::int32_t>("2147483648"));
  CHECK_FALSE(parse_number<std::int32_t>("1.0"));
  CHECK_FALSE(parse_number<std::uint64_t>("-1"));
}

TEST_CASE("floats survive writing and reading") {
  for (const float x : {0.1F, -0.0F, 1e-45F, 3.4028235e38F, 16777217.0F, 1.0F / 3}) {
    std::string text;
    append_number(text, x);
    const double back = *parse_number<double>(text);
    CHECK(static_cast<float>(back) == x);
    CHECK(std::signbit(back) == std::signbit(x));
  }
}

TEST_CASE("quoted text is printable and short") {
  CHECK(in_quotes("a'b") == "'a'b'");
  CHECK(in_quotes(std::string_view("\0\x80\n", 3)) == "'\\x00\\x80\\x0a'");
  CHECK(in_quotes(std::string(100, 'a')).size() == 65);
  CHECK(npt::lower_case("A.GlTF \xC4") == "a.gltf \xC4");
}
