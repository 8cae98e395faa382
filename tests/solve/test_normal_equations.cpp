#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/solve/normal_equations.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

TEST_CASE("normal equations give the least squares solution for any number of unknowns") {
  for (const std::size_t n : {1U, 2U, 7U, 8U, 9U, 30U}) {
    npt::Random random(n);
    npt::NormalEquations equations(n);
    std::vector<double> truth(n), row(n);
    for (double& t : truth) t = random.normal();
    for (std::size_t r = 0; r < 3 * n; ++r) {
      double residual = 0;
      for (std::size_t i = 0; i < n; ++i) {
        row[i] = random.uniform() < 0.4 ? 0 : random.normal();
        residual -= row[i] * truth[i];
      }
      equations.add(row, 0.5 + random.uniform(), residual);
    }
    const std::vector<double> x = equations.solve(0, 1e-12);
    for (std::size_t i = 0; i < n; ++i) CHECK(std::abs(x[i] - truth[i]) < 1e-6);
  }
}

TEST_CASE("damping shortens the step, clearing forgets, and what no row tells needs a floor") {
  npt::NormalEquations equations(2);
  equations.add(std::vector<double>{2, 0}, 1, -6);
  CHECK_THROWS_AS(equations.solve(0, 0), npt::Error);
  CHECK(equations.solve(0, 1e-9)[0] == doctest::Approx(3));
  CHECK(equations.solve(1, 1e-9)[0] == doctest::Approx(1.5));
  CHECK(equations.solve(0, 1e-9)[1] == 0);
  equations.clear();
  equations.add_to_matrix(0, 0, 1);
  equations.add_to_matrix(1, 1, 4);
  equations.add_to_right(1, 8);
  CHECK(equations.solve(0, 0)[0] == 0);
  CHECK(equations.solve(0, 0)[1] == doctest::Approx(-2));
}
