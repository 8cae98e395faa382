#include <doctest/doctest.h>

#include <npt/io/words.hpp>

#include <string>
#include <vector>

TEST_CASE("words of a line are separated by blanks, quotes hold them together, # ends them") {
  using npt::list_words;
  using Words = std::vector<std::string>;
  CHECK(list_words("") == Words{});
  CHECK(list_words(" \t# a b") == Words{});
  CHECK(list_words("a  b\tc\r") == Words{"a", "b", "c"});
  CHECK(list_words("'a b' \"c'd\" e'f g'h # i") == Words{"a b", "c'd", "ef gh"});
  CHECK(list_words("a '' b") == Words{"a", "", "b"});
  CHECK(list_words("a#b") == Words{"a#b"});
  CHECK(!list_words("a 'b"));
}

TEST_CASE("what an error says of words") {
  CHECK(npt::found_words(npt::list_words("a b")) == "2 words");
  CHECK(npt::found_words(npt::list_words("a"), "name") == "1 name");
  CHECK(npt::found_words(npt::list_words("'a")) == "a quotation mark that is not closed");
}
