#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/solve/normal_equations.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

TEST_CASE("normal equations give the least squares solution for any number of unknowns") {
  for (const std::size_t n : {1U, 2U, 7U, 8U, 9U, 30U}) {
    npt::Random random(n);
    npt::NormalEquations equations(n);
    std::vector<double> truth(n);
    for (double& t : truth) t = random.normal();
    for (std::size_t g = 0; g < 12; ++g) {
      std::vector<std::uint32_t> unknowns;
      for (std::uint32_t i = 0; i < n; ++i)
        if (g == 0 || random.uniform() < 0.6) unknowns.push_back(i);
      npt::NormalEquations::Group group = npt::NormalEquations::group(unknowns, n);
      for (std::size_t r = 0; r < n; ++r) {
        std::vector<double> values;
        double residual = 0;
        for (const std::uint32_t i : unknowns) residual -= values.emplace_back(random.normal()) * truth[i];
        std::ranges::copy(values, group.row(0.5 + random.uniform(), residual).begin());
      }
      equations.add(group);
    }
    const std::vector<double> x = equations.solve(0, 1e-12);
    for (std::size_t i = 0; i < n; ++i) CHECK(std::abs(x[i] - truth[i]) < 1e-6);
  }
}

TEST_CASE("damping shortens the step, clearing forgets, and what no row tells needs a floor") {
  npt::NormalEquations equations(2);
  npt::NormalEquations::Group group = npt::NormalEquations::group(std::vector<std::uint32_t>{0}, 1);
  group.row(1, -6)[0] = 2;
  equations.add(group);
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
