/// The normal equations of a linear least squares problem, summed row by row.
///   minimise sum over rows of weight (row . x + residual)^2   ->   (A + damping) x = -b
///   A = sum of weight row row^T,  b = sum of weight residual row
/// Rows that are zero but for the same few unknowns are added as one group, in registers.
/// Numerics  double, summed in the order of the calls
/// Errors    npt::Error of solve() for a matrix that isn't positive definite
/// Source    Nocedal and Wright, "Numerical Optimization", 2006, chapter 10
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/config.hpp>
#include <npt/nn/simd/batch.hpp>
#include <npt/solve/dense_cholesky.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

class NormalEquations {
 public:
  explicit NormalEquations(std::size_t unknowns) : size_(unknowns), matrix_(size_ * size_, 0.0), right_(size_, 0.0) {}

  std::size_t size() const noexcept { return size_; }

  void clear() {
    std::fill(matrix_.begin(), matrix_.end(), 0.0);
    std::fill(right_.begin(), right_.end(), 0.0);
  }

  /// Rows with entries for some unknowns only.
  class Group {
   public:
    /// A row to be filled, [m] for the m unknowns, until the next call.
    std::span<double> row(double weight, double residual) {
      weights_.push_back(weight), residuals_.push_back(residual);
      rows_.resize(rows_.size() + stride_);
      return as_span(rows_).last(stride_).first(unknowns_.size());
    }

   private:
    friend class NormalEquations;
    std::vector<std::uint32_t> unknowns_;
    std::size_t stride_ = 0;
    std::vector<double> rows_, weights_, residuals_;  ///< [rows, stride], [rows], [rows]
  };
  /// Requires  unknowns in ascending order
  static Group group(std::span<const std::uint32_t> unknowns, std::size_t rows) {
    Group group;
    group.unknowns_.assign(unknowns.begin(), unknowns.end());
    group.stride_ = (unknowns.size() + width - 1) / width * width;
    group.rows_.reserve(rows * group.stride_);
    return group;
  }

  void add(const Group& group) {
    const std::size_t count = group.unknowns_.size();
    for (std::size_t r = 0; r < group.weights_.size(); ++r) {
      const double factor = group.weights_[r] * group.residuals_[r];
      for (std::size_t i = 0; i < count; ++i) right_[group.unknowns_[i]] += factor * group.rows_[r * group.stride_ + i];
    }
    for (std::size_t i = 0; i < count; i += height)
      for (std::size_t k = 0; k < i + height; k += width) add_block(group, i, k);
  }

  /// Adds to A[i, k], and to A[k, i]. Requires k <= i
  void add_to_matrix(std::size_t i, std::size_t k, double value) {
    NPT_ASSERT(k <= i && i < size_);
    matrix_[i * size_ + k] += value;
  }
  /// Adds to b[i].
  void add_to_right(std::size_t i, double value) { right_[i] += value; }

  double diagonal(std::size_t i) const { return matrix_[i * size_ + i]; }
  double right(std::size_t i) const { return right_[i]; }

  /// The solution with the diagonal multiplied by 1 + damping, and `floor` added to it.
  std::vector<double> solve(double damping, double floor) const {
    std::vector<double> matrix = matrix_;
    for (std::size_t i = 0; i < size_; ++i) matrix[i * size_ + i] += damping * diagonal(i) + floor;
    const DenseCholesky factor(size_, std::move(matrix));
    std::vector<double> x(size_);
    for (std::size_t i = 0; i < size_; ++i) x[i] = -right_[i];
    factor.solve_lower(as_span(x));
    factor.solve_upper(as_span(x));
    return x;
  }

 private:
  /// Of a block of the matrix, whose sums stay in registers for all rows of a group.
  static constexpr std::size_t height = 4, width = 8;
  using Register = simd::Batch<double>;
  static constexpr std::size_t lanes = Register::size, registers = width / lanes;

  /// Adds entries [i, i + height) x [k, k + width) of a group's sum.
  void add_block(const Group& group, std::size_t i, std::size_t k) {
    std::array<std::array<Register, registers>, height> sums;
    for (auto& line : sums) line.fill(Register(0.0));
    const double* row = group.rows_.data();
    for (const double weight : group.weights_) {
      std::array<Register, registers> right;
      for (std::size_t b = 0; b < registers; ++b) right[b] = simd::load_unaligned(row + k + b * lanes);
      for (std::size_t a = 0; a < height; ++a) {
        const Register factor(weight * row[i + a]);
        for (std::size_t b = 0; b < registers; ++b) sums[a][b] = sums[a][b] + factor * right[b];
      }
      row += group.stride_;
    }
    const std::span<const std::uint32_t> unknowns = as_span(group.unknowns_);
    for (std::size_t a = 0; a < height && i + a < unknowns.size(); ++a) {
      std::array<double, width> line;
      for (std::size_t b = 0; b < registers; ++b) simd::store_unaligned(&line[b * lanes], sums[a][b]);
      double* to = &matrix_[unknowns[i + a] * size_];
      for (std::size_t b = 0; b < width && k + b <= i + a; ++b) to[unknowns[k + b]] += line[b];
    }
  }

  std::size_t size_;
  std::vector<double> matrix_, right_;  ///< [n, n]: the lower half of A; [n]
};

}  // namespace npt::inline NPT_ABI
