// Sparse matrices in rows.
#include <doctest/doctest.h>
#include <npt/body/sparse_matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

TEST_CASE("a dense matrix comes back as it was; zeros are not stored") {
  const std::vector<float> dense{0, 1, 0, 0, 0, 0, 2, 0, -3};
  const npt::SparseMatrix m = npt::SparseMatrix::from_dense(dense, 3, 3);
  CHECK(m.to_dense() == dense);
  CHECK(m.start == std::vector<std::uint32_t>{0, 1, 1, 3});
  CHECK(m.column == std::vector<std::uint32_t>{1, 0, 2});
  CHECK(std::ranges::equal(m.columns_of(2), std::vector<std::uint32_t>{0, 2}));
  CHECK(std::ranges::equal(m.values_of(2), std::vector<float>{2, -3}));
  CHECK(m.columns_of(1).empty());
  CHECK(m.row_sum(1) == 0);
  CHECK(m.row_sum(2) == -1);
}

TEST_CASE("rows are built one after another") {
  npt::SparseMatrix m;
  m.columns = 3;
  m.append(1, 1.0F);
  m.end_row();
  m.end_row();
  m.append(0, 2.0F);
  m.append(2, -3.0F);
  m.end_row();
  CHECK(m == npt::SparseMatrix::from_dense(std::vector<float>{0, 1, 0, 0, 0, 0, 2, 0, -3}, 3, 3));
}

TEST_CASE("a NaN is stored") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const npt::SparseMatrix m = npt::SparseMatrix::from_dense(std::vector<float>{0, nan}, 1, 2);
  REQUIRE(m.value.size() == 1);
  CHECK(std::isnan(m.value[0]));
}

TEST_CASE("each row's heaviest column, of equal ones the first") {
  const std::vector<float> dense{0.2F, 0.5F, 0.3F, 0, 0, 1, 0.5F, 0, 0.5F};
  CHECK(npt::SparseMatrix::from_dense(dense, 3, 3).heaviest_columns() == std::vector<std::uint32_t>{1, 2, 0});
}
