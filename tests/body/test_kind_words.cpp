#include <doctest/doctest.h>

#include <npt/body/kind_words.hpp>

#include <string>

TEST_CASE("equal words have one address, others another one") {
  const npt::KindWords& birds = npt::kept_words({.one = "bird", .many = "birds", .upper_limb = "wing"});
  CHECK(birds.lower_limb == "limb");
  CHECK(&npt::kept_words({.one = "bird", .many = "birds", .upper_limb = "wing"}) == &birds);
  CHECK(&npt::kept_words({.one = "bird", .many = "birds"}) != &birds);
  CHECK(birds.one == "bird");
}

TEST_CASE("articles go by the first letter") {
  CHECK(npt::with_article("arm") == "an arm");
  CHECK(npt::with_article("leg") == "a leg");
}
