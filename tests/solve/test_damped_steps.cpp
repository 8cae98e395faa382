#include <doctest/doctest.h>

#include <npt/base/as_span.hpp>
#include <npt/solve/damped_steps.hpp>
#include <npt/solve/normal_equations.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace {

/// Rosenbrock's valley: (10 (y - x^2))^2 + (1 - x)^2.
struct Valley {
  std::array<double, 2> at{0.9, 0.7}, tried{};
  npt::NormalEquations equations{2};
  int tries = 0;

  static double sum(const std::array<double, 2>& p) {
    return std::pow(10 * (p[1] - p[0] * p[0]), 2) + std::pow(1 - p[0], 2);
  }
  double value() const { return sum(at); }
  double try_step(std::span<const double> step) {
    ++tries;
    tried = {at[0] + step[0], at[1] + step[1]};
    return sum(tried);
  }
  bool whole_step() const { return true; }
  void take_step() { at = tried; }
  const npt::NormalEquations& linearise() {
    equations.clear();
    npt::NormalEquations::Group rows = npt::NormalEquations::group(std::array{0U, 1U}, 2);
    std::ranges::copy(std::array{-20 * at[0], 10.0}, rows.row(1, 10 * (at[1] - at[0] * at[0])).begin());
    std::ranges::copy(std::array{-1.0, 0.0}, rows.row(1, 1 - at[0]).begin());
    equations.add(rows);
    return equations;
  }
};

}  // namespace

TEST_CASE("damped steps follow a curved valley to its lowest point, and never up") {
  Valley valley;
  double last = valley.value();
  for (int i = 0; i < 60 && last > 1e-6; ++i) {
    npt::take_damped_steps(valley, {.steps = 1, .enough = -1});
    CHECK(valley.value() <= last);
    last = valley.value();
  }
  CHECK(last < 1e-6);
  CHECK(valley.at[0] == doctest::Approx(1).epsilon(1e-2));
}

TEST_CASE("a step that takes hardly anything is the last one") {
  Valley lazy, eager;
  lazy.at = eager.at = {0.999, 0.998};
  npt::take_damped_steps(lazy, {.steps = 20, .enough = 1.1});
  CHECK(lazy.tries == 1);
  npt::take_damped_steps(eager, {.steps = 20, .enough = -1});
  CHECK(eager.tries > 5);
}
