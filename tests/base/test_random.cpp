#include <doctest/doctest.h>

#include <npt/base/random.hpp>

#include <algorithm>

TEST_CASE("philox gives the known answers of its authors") {
  // Random123's kat_vectors, philox4x32-10.
  CHECK(npt::philox({0, 0, 0, 0}, {0, 0}) ==
        std::array<std::uint32_t, 4>{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
  CHECK(npt::philox({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}) ==
        std::array<std::uint32_t, 4>{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
  CHECK(npt::philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
        std::array<std::uint32_t, 4>{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
}

TEST_CASE("equal seeds repeat, other seeds and streams differ") {
  npt::Random a(7), b(7), c(8), d(7, 1);
  const std::uint32_t first = a();
  CHECK(first == b());
  CHECK(first != c());
  CHECK(first != d());
}

TEST_CASE("uniform and normal have the right moments") {
  npt::Random random(1);
  double sum = 0, sum_normal = 0, square_normal = 0;
  constexpr int n = 100000;
  for (int i = 0; i < n; ++i) {
    const double u = random.uniform();
    REQUIRE(u >= 0);
    REQUIRE(u < 1);
    sum += u;
    const double g = random.normal();
    sum_normal += g;
    square_normal += g * g;
  }
  CHECK(std::abs(sum / n - 0.5) < 0.005);
  CHECK(std::abs(sum_normal / n) < 0.015);
  CHECK(std::abs(square_normal / n - 1) < 0.02);
}

TEST_CASE("a permutation holds every index once") {
  npt::Random random(3);
  auto order = npt::random_permutation(1000, random);
  CHECK_FALSE(std::is_sorted(order.begin(), order.end()));
  std::sort(order.begin(), order.end());
  for (std::uint32_t i = 0; i < 1000; ++i) REQUIRE(order[i] == i);
  CHECK(npt::random_permutation(0, random).empty());
}
