#include <doctest/doctest.h>

#include <npt/base/sort.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

TEST_CASE("keys of two numbers are sorted by the first, then by the second, each once") {
  std::vector<std::uint64_t> keys;
  for (const std::uint32_t first : {7U, 0xFFFFFFFFU, 0U, 7U})
    for (const std::uint32_t second : {3U, 0U, 0xFFFFFFFFU}) keys.push_back(npt::pair_key(first, second));
  npt::sort_keys_once(keys);
  REQUIRE(keys.size() == 9);
  for (std::size_t i = 0; i < 9; ++i) {
    CHECK(npt::first_of_key(keys[i]) == (i < 3 ? 0U : i < 6 ? 7U : 0xFFFFFFFFU));
    CHECK(npt::second_of_key(keys[i]) == (i % 3 == 0 ? 0U : i % 3 == 1 ? 3U : 0xFFFFFFFFU));
  }
}

TEST_CASE("the median is the value in the middle, of an even number the upper one") {
  std::vector<double> values{3, 1, 2};
  CHECK(npt::median(std::span(values)) == 2);
  values.push_back(7);
  CHECK(npt::median(std::span(values)) == 3);
  std::vector<float> one{5};
  CHECK(npt::median(std::span(one)) == 5);
}
