#include <doctest/doctest.h>

#include <npt/base/digits.hpp>

#include <cstdint>
#include <vector>

TEST_CASE("numbers are made of digits, the first the most significant") {
  CHECK(npt::digits::numbers_of("00+-0z", 2) == std::vector<std::uint32_t>{0, 62 * 64 + 63, 61});
  CHECK(npt::digits::numbers_of("100A", 4) == std::vector<std::uint32_t>{64 * 64 * 64 + 10});
  CHECK(npt::digits::numbers_of("", 2).empty());
}
