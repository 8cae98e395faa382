// Streams of random numbers for the parts of samples, and choices of vertices.
#include <doctest/doctest.h>
#include <npt/lab/draws.hpp>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

using namespace npt::data;

TEST_CASE("every purpose, seed, step, index and part has numbers of its own, the same at every call") {
  std::set<double> first;
  std::size_t count = 0;
  for (const Purpose purpose : {Purpose::training, Purpose::evaluation, Purpose::support})
    for (const std::uint64_t seed : {0U, 1U})
      for (const std::uint64_t step : {std::uint64_t{0}, std::uint64_t{1}, max_step - 1})
        for (const std::uint64_t index : {std::uint64_t{0}, std::uint64_t{1}, max_index - 1})
          for (const Part part : {Part::choice, Part::pose, Part::noise}) {
            npt::Random random = random_for(purpose, seed, step, index, part);
            npt::Random again = random_for(purpose, seed, step, index, part);
            const double x = random.uniform();
            CHECK(again.uniform() == x);
            first.insert(x);
            ++count;
          }
  CHECK(first.size() == count);
}

TEST_CASE("a choice has no repeats, and a choice of all is an order") {
  VertexChoice choice;
  npt::Random random(4);
  std::vector<std::uint32_t> chosen;
  for (const std::uint32_t n : {0U, 1U, 7U, 50U}) {
    choice.draw(n, 50, random, chosen);
    REQUIRE(chosen.size() == n);
    CHECK(std::set<std::uint32_t>(chosen.begin(), chosen.end()).size() == n);
    CHECK(std::ranges::all_of(chosen, [](std::uint32_t v) { return v < 50; }));
  }
}

TEST_CASE("what was drawn before doesn't change a draw, for larger and smaller counts") {
  VertexChoice used, fresh;
  std::vector<std::uint32_t> a, b;
  npt::Random other(9);
  used.draw(30, 100, other, a);
  used.draw(3, 5, other, a);
  npt::Random one(7), two(7);
  used.draw(10, 40, one, a);
  fresh.draw(10, 40, two, b);
  CHECK(a == b);
}

TEST_CASE("every vertex is chosen equally often, in every place") {
  VertexChoice choice;
  npt::Random random(1);
  std::vector<std::uint32_t> chosen;
  std::array<std::array<int, 5>, 2> counts{};
  for (int i = 0; i < 10000; ++i) {
    choice.draw(2, 5, random, chosen);
    for (std::size_t k = 0; k < 2; ++k) ++counts[k][chosen[k]];
  }
  for (const auto& place : counts)
    for (const int n : place) CHECK(std::abs(n - 2000) < 200);  // 5 standard deviations
}
