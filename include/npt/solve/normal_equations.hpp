/// The normal equations of a linear least squares problem, summed row by row.
///   minimise sum over rows of weight (row . x + residual)^2   ->   (A + damping) x = -b
///   A = sum of weight row row^T,  b = sum of weight residual row
/// Rows may be mostly zeros: a row with m of n entries costs m n / 2 multiplications, in whole registers.
/// Numerics  double, summed in the order of the calls
/// Errors    npt::Error of solve() for a matrix that isn't positive definite
/// Source    Nocedal and Wright, "Numerical Optimization", 2006, chapter 10
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/config.hpp>
#include <npt/solve/dense_cholesky.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

class NormalEquations {
 public:
  explicit NormalEquations(std::size_t unknowns)
      : size_(unknowns),
        stride_((unknowns + lanes - 1) / lanes * lanes),
        matrix_(size_ * stride_, 0.0),
        right_(stride_, 0.0),
        row_(stride_, 0.0) {}

  std::size_t size() const noexcept { return size_; }

  void clear() {
    std::fill(matrix_.begin(), matrix_.end(), 0.0);
    std::fill(right_.begin(), right_.end(), 0.0);
  }

  /// row: [n]
  void add(std::span<const double> row, double weight, double residual) {
    NPT_ASSERT(row.size() == size_);
    std::copy(row.begin(), row.end(), row_.begin());
    for (std::size_t i = 0; i < size_; ++i) {
      if (row[i] == 0) continue;
      const double factor = weight * row[i];
      right_[i] += factor * residual;
      double* to = &matrix_[i * stride_];
      for (std::size_t k = 0; k <= i; k += lanes) add_block(&row_[k], factor, to + k);
    }
  }

  /// Adds to A[i, k], and to A[k, i]. Requires k <= i
  void add_to_matrix(std::size_t i, std::size_t k, double value) {
    NPT_ASSERT(k <= i && i < size_);
    matrix_[i * stride_ + k] += value;
  }
  /// Adds to b[i].
  void add_to_right(std::size_t i, double value) { right_[i] += value; }

  double diagonal(std::size_t i) const { return matrix_[i * stride_ + i]; }
  double right(std::size_t i) const { return right_[i]; }

  /// The solution with the diagonal multiplied by 1 + damping, and `floor` added to it.
  std::vector<double> solve(double damping, double floor) const {
    std::vector<double> matrix(size_ * size_);
    for (std::size_t i = 0; i < size_; ++i) {
      std::copy_n(&matrix_[i * stride_], i + 1, &matrix[i * size_]);
      matrix[i * size_ + i] += damping * diagonal(i) + floor;
    }
    const DenseCholesky factor(size_, std::move(matrix));
    std::vector<double> x(size_);
    for (std::size_t i = 0; i < size_; ++i) x[i] = -right_[i];
    factor.solve_lower(as_span(x));
    factor.solve_upper(as_span(x));
    return x;
  }

 private:
  static constexpr std::size_t lanes = 8;

  /// In a block of its own, so that a compiler sees at -O2 that it may use registers: 3 times as fast.
  static void add_block(const double* row, double factor, double* to) {
    std::array<double, lanes> sum;
    for (std::size_t lane = 0; lane < lanes; ++lane) sum[lane] = to[lane] + factor * row[lane];
    for (std::size_t lane = 0; lane < lanes; ++lane) to[lane] = sum[lane];
  }

  std::size_t size_, stride_;
  std::vector<double> matrix_;  ///< [n, stride]: the lower half of A, and what stands right of it in whole registers
  std::vector<double> right_, row_;
};

}  // namespace npt::inline NPT_ABI
