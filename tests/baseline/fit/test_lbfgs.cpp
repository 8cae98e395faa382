#include <doctest/doctest.h>

#include <npt/baseline/fit/lbfgs.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

namespace {

double rosenbrock(std::span<const double> x, std::span<double> g) {
  const double a = 1 - x[0], b = x[1] - x[0] * x[0];
  g[0] = -2 * a - 400 * x[0] * b;
  g[1] = 200 * b;
  return a * a + 100 * b * b;
}

}  // namespace

TEST_CASE("a valley's bottom is found, and the value belongs to the point") {
  std::array<double, 2> x{-1.2, 1};
  const npt::LbfgsResult result = npt::minimise_lbfgs(rosenbrock, x, {.gradient_tolerance = 1e-9});
  CHECK(result.converged);
  CHECK(std::abs(x[0] - 1) < 1e-6);
  CHECK(std::abs(x[1] - 1) < 1e-6);
  CHECK(result.iterations > 5);
  CHECK(result.evaluations >= result.iterations);
  std::array<double, 2> gradient{};
  CHECK(result.value == rosenbrock(x, gradient));
}

TEST_CASE("iterations that run out leave the best point so far") {
  std::array<double, 2> x{-1.2, 1}, gradient{};
  const npt::LbfgsResult result = npt::minimise_lbfgs(rosenbrock, x, {.max_iterations = 4});
  CHECK(!result.converged);
  CHECK(result.iterations == 4);
  CHECK(result.value == rosenbrock(x, gradient));
  CHECK(result.value < 10);
}

TEST_CASE("no parameters, and a start that is the minimum") {
  CHECK(npt::minimise_lbfgs(rosenbrock, std::span<double>{}).converged);
  std::array<double, 2> x{1, 1};
  const npt::LbfgsResult result = npt::minimise_lbfgs(rosenbrock, x);
  CHECK(result.converged);
  CHECK(result.value == 0);
  CHECK(x == std::array<double, 2>{1, 1});
}

TEST_CASE("what the objective throws comes out, at any call") {
  for (const int fatal : {1, 2, 5}) {
    std::array<double, 2> x{-1.2, 1};
    int calls = 0;
    const auto objective = [&](std::span<const double> at, std::span<double> gradient) {
      if (++calls == fatal) throw std::domain_error("enough");
      return rosenbrock(at, gradient);
    };
    CHECK_THROWS_AS(npt::minimise_lbfgs(objective, x), std::domain_error);
    CHECK(calls == fatal);
  }
}

TEST_CASE("a value that is no number ends the search where it was good") {
  std::array<double, 1> x{3};
  // Only x >= 2 has a value; the minimum is beyond.
  const auto objective = [](std::span<const double> at, std::span<double> gradient) {
    gradient[0] = 2 * at[0];
    return at[0] >= 2 ? at[0] * at[0] : std::numeric_limits<double>::quiet_NaN();
  };
  const npt::LbfgsResult result = npt::minimise_lbfgs(objective, x);
  CHECK(std::isfinite(result.value));
  CHECK(x[0] >= 2);
  CHECK(x[0] <= 3);
}

TEST_CASE("where no step succeeds the start and its value are left") {
  std::array<double, 1> x{3};
  const auto uphill = [](std::span<const double> at, std::span<double> gradient) {
    gradient[0] = 1;  // a lie: the value grows to the left
    return -at[0];
  };
  const npt::LbfgsResult result = npt::minimise_lbfgs(uphill, x);
  CHECK(!result.converged);
  CHECK(result.iterations == 0);
  CHECK(x[0] == 3);
  CHECK(result.value == -3);
}
