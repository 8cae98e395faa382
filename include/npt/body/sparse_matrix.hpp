/// A sparse matrix, row by row (CSR): joint regressors and skin weights.
///   row r holds entries start[r] .. start[r + 1] - 1, in ascending columns
#pragma once

#include <npt/config.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(struct, SparseMatrix);
template <class>
struct BasicSparseMatrix {
  std::size_t rows = 0;
  std::size_t columns = 0;
  std::vector<std::uint32_t> start{0};  ///< [rows + 1]
  std::vector<std::uint32_t> column;    ///< [entries]
  std::vector<float> value;             ///< [entries]

  /// The entries of a dense row-major [rows, columns] array that are not 0 (a NaN is kept).
  static SparseMatrix from_dense(std::span<const float> dense, std::size_t rows, std::size_t columns) {
    NPT_ASSERT(dense.size() == rows * columns);
    SparseMatrix m;
    m.columns = columns;
    for (std::size_t r = 0; r < rows; ++r) {
      for (std::size_t c = 0; c < columns; ++c) {
        const float v = dense[r * columns + c];
        if (v != 0.0F) m.append(static_cast<std::uint32_t>(c), v);
      }
      m.end_row();
    }
    return m;
  }

  std::vector<float> to_dense() const {
    std::vector<float> dense(rows * columns, 0.0F);
    for (std::size_t r = 0; r < rows; ++r)
      for (std::size_t i = start[r]; i < start[r + 1]; ++i) dense[r * columns + column[i]] = value[i];
    return dense;
  }

  /// Adds an entry to the row under construction; end_row() closes that row.
  void append(std::uint32_t c, float v) {
    column.push_back(c);
    value.push_back(v);
  }
  void end_row() {
    start.push_back(static_cast<std::uint32_t>(value.size()));
    ++rows;
  }

  std::span<const std::uint32_t> columns_of(std::size_t r) const {
    return std::span(column).subspan(start[r], start[r + 1] - start[r]);
  }
  std::span<const float> values_of(std::size_t r) const {
    return std::span(value).subspan(start[r], start[r + 1] - start[r]);
  }

  double row_sum(std::size_t r) const {
    double sum = 0;
    for (std::size_t i = start[r]; i < start[r + 1]; ++i) sum += static_cast<double>(value[i]);
    return sum;
  }

  /// [rows] column of the greatest entry of each row; of equal ones the first.
  /// Requires  no empty row
  std::vector<std::uint32_t> heaviest_columns() const {
    std::vector<std::uint32_t> result;
    for (std::size_t r = 0; r < rows; ++r) {
      NPT_ASSERT(start[r] < start[r + 1]);
      std::size_t heaviest = start[r];
      for (std::size_t i = heaviest; i < start[r + 1]; ++i)
        if (value[i] > value[heaviest]) heaviest = i;
      result.push_back(column[heaviest]);
    }
    return result;
  }

  /// Row i of the result is row rows_of[i] of this matrix.
  SparseMatrix gathered(std::span<const std::uint32_t> rows_of) const {
    SparseMatrix result;
    result.columns = columns;
    for (const std::uint32_t r : rows_of) {
      NPT_ASSERT(r < rows);
      for (std::size_t i = start[r]; i < start[r + 1]; ++i) result.append(column[i], value[i]);
      result.end_row();
    }
    return result;
  }

  friend bool operator==(const BasicSparseMatrix&, const BasicSparseMatrix&) = default;
};

}  // namespace npt::inline NPT_ABI
