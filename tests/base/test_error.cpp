#include <doctest/doctest.h>

#include <npt/base/error.hpp>

TEST_CASE("an error says file, place, found and expected, and leaves out what is empty") {
  const npt::Error full({.file = "a.obj", .place = "line 3", .found = "'v x'", .expected = "three numbers"});
  CHECK(std::string(full.what()) == "a.obj: line 3: found 'v x', expected three numbers");
  CHECK(full.parts().place == "line 3");
  CHECK(std::string(npt::Error({.file = "b", .expected = "a file"}).what()) == "b: expected a file");
  CHECK(std::string(npt::Error({.found = "nothing"}).what()) == "found nothing");
}
