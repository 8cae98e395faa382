#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/base/weighted_choice.hpp>

#include <array>
#include <cstddef>

namespace {

npt::WeightedChoice choice_of(std::initializer_list<double> weights) {
  npt::WeightedChoice choice;
  for (const double w : weights) choice.add(w);
  return choice;
}

}  // namespace

TEST_CASE("a target chooses what its share of the sum belongs to") {
  const npt::WeightedChoice choice = choice_of({1, 0, 2, 1});
  CHECK(choice.size() == 4);
  CHECK(choice.total() == 4);
  CHECK(choice.weight(0) == 1);
  CHECK(choice.weight(1) == 0);
  CHECK(choice.weight(2) == 2);
  CHECK(choice.at(0) == 0);
  CHECK(choice.at(0.999) == 0);
  CHECK(choice.at(1) == 2);
  CHECK(choice.at(2.999) == 2);
  CHECK(choice.at(3) == 3);
  CHECK(choice.at(5) == 3);
}

TEST_CASE("things are drawn as often as their weights say, one of weight 0 never") {
  const npt::WeightedChoice choice = choice_of({1, 0, 3});
  npt::Random random(1);
  std::array<int, 3> count{};
  for (int i = 0; i < 4000; ++i) ++count[choice(random)];
  CHECK(count[1] == 0);
  CHECK(count[2] == doctest::Approx(3000).epsilon(0.05));
}

TEST_CASE("a cleared choice begins anew") {
  npt::WeightedChoice choice = choice_of({1, 2});
  choice.clear();
  CHECK(choice.total() == 0);
  choice.add(3);
  CHECK(choice.size() == 1);
  CHECK(choice.total() == 3);
}
