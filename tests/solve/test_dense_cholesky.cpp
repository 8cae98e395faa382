#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/solve/dense_cholesky.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

TEST_CASE("both halves of the factor solve their systems") {
  // L = [[2, 0, 0], [1, 3, 0], [-1, 2, 0.5]]; above the diagonal stands what must not be read.
  const npt::DenseCholesky cholesky(3, {4, 99, 99, 2, 10, 99, -2, 5, 5.25});
  std::vector<double> x{4, 11, 7};
  cholesky.solve_lower(x);
  CHECK(x == std::vector<double>{2, 3, 6});
  cholesky.solve_upper(x);  // L^T x = (2, 3, 6)
  CHECK(std::abs(x[2] - 12) < 1e-12);
  CHECK(std::abs(x[1] - (3 - 2 * 12) / 3.0) < 1e-12);
  CHECK(std::abs(x[0] - (2 - x[1] + 12) / 2) < 1e-12);
}

TEST_CASE("a matrix that isn't positive definite is an error that names the unknown") {
  try {
    npt::DenseCholesky(2, {1, 0, 2, 4});
    FAIL("no error");
  } catch (const npt::Error& error) {
    CHECK(error.parts().place == "unknown 1");
  }
  CHECK_THROWS_AS(npt::DenseCholesky(1, {std::nan("")}), npt::Error);
}
