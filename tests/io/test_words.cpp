#include <doctest/doctest.h>

#include <npt/io/words.hpp>

#include <string>
#include <vector>

TEST_CASE("words of a line are separated by blanks, quotes hold them together, # ends them") {
  using npt::internal::words_of;
  using Words = std::vector<std::string>;
  CHECK(words_of("") == Words{});
  CHECK(words_of(" \t# a b") == Words{});
  CHECK(words_of("a  b\tc\r") == Words{"a", "b", "c"});
  CHECK(words_of("'a b' \"c'd\" e'f g'h # i") == Words{"a b", "c'd", "ef gh"});
  CHECK(words_of("a '' b") == Words{"a", "", "b"});
  CHECK(words_of("a#b") == Words{"a#b"});
  CHECK(!words_of("a 'b"));
}
