/// Sparse symmetric positive definite systems: factored once, solved for many right-hand sides, by Eigen's simplicial
/// L D L^T on an approximate minimum degree ordering.
///   a = a list of entries;  x = a^-1 b
/// Shapes    a: [n, n];  right-hand sides: [n], or [n] points, whose x, y and z are three systems
/// Numerics  double; a solve gives the same bits at every call
/// Threads   one object may be used by several threads for solves. It can be moved, not copied
/// Errors    npt::Error for entries outside of the matrix, numbers that are not finite, and a matrix that is not
///           positive definite, which names the first unknown at fault
/// Eigen's own symbols don't carry the instruction set: units of one program that use this header need the same -march.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// An entry of a symmetric matrix. One stands for both (row, column) and (column, row), so each pair is given once, in
/// whichever order; entries of one place are summed.
struct SymmetricEntry {
  std::uint32_t row = 0, column = 0;
  double value = 0;
};

class SparseCholesky {
 public:
  /// Factors the matrix of `size` unknowns.
  SparseCholesky(std::size_t size, std::span<const SymmetricEntry> entries) : size_(size) {
    const Matrix matrix = assemble(entries);
    solver_->analyzePattern(matrix);
    pattern_ = pattern_of(matrix);
    factorise(matrix);
  }

  /// Factors a matrix of the same size again. Where its entries stand in the same places as before, the ordering is
  /// kept, which is about a third of the work.
  void factor(std::span<const SymmetricEntry> entries) {
    const Matrix matrix = assemble(entries);
    if (std::vector<int> pattern = pattern_of(matrix); pattern != pattern_) {
      solver_->analyzePattern(matrix);
      pattern_ = std::move(pattern);
    }
    factorise(matrix);
  }

  std::size_t size() const noexcept { return size_; }
  /// Entries of the factor below its diagonal: what a solve costs, twice.
  std::size_t factor_entries() const {
    return static_cast<std::size_t>(solver_->matrixL().nestedExpression().nonZeros());
  }

  /// b becomes x. [n]
  void solve(std::span<double> b) const {
    NPT_ASSERT(b.size() == size_);
    std::vector<double> scratch;
    solve_columns<1>(b, scratch);
  }

  /// b becomes x for three systems at once: x, y and z of the points. [n]
  void solve(std::span<Vec3d> b) const {
    std::vector<double> scratch;
    solve(b, scratch);
  }

  /// b becomes x for three systems at once, in memory that is used again: a second solve allocates nothing. [n]
  void solve(std::span<Vec3d> b, std::vector<double>& scratch) const {
    NPT_ASSERT(b.size() == size_);
    static_assert(sizeof(Vec3d) == 3 * sizeof(double));
    if (!b.empty()) solve_columns<3>({&b.front().x, 3 * b.size()}, scratch);
  }

 private:
  using Matrix = Eigen::SparseMatrix<double>;

  /// The steps of Eigen's solve in memory of the caller's, which Eigen's own allocates. `b`: [n, N], row major.
  template <int N>
  void solve_columns(std::span<double> b, std::vector<double>& scratch) const {
    if (b.empty()) return;
    const auto n = static_cast<Eigen::Index>(size_);
    scratch.resize(b.size());
    // Columns one after another: each stays in the cache, and Eigen reads the factor in one go for each.
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, N>> columns(scratch.data(), n, N);
    const auto& place = solver_->permutationP().indices();
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index c = 0; c < N; ++c) columns(place(i), c) = b[static_cast<std::size_t>(N * i + c)];
    solver_->matrixL().solveInPlace(columns);
    for (Eigen::Index c = 0; c < N; ++c)
      for (Eigen::Index i = 0; i < n; ++i) columns(i, c) *= inverse_pivots_(i);
    solver_->matrixU().solveInPlace(columns);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index c = 0; c < N; ++c) b[static_cast<std::size_t>(N * i + c)] = columns(place(i), c);
  }

  Matrix assemble(std::span<const SymmetricEntry> entries) const {
    if (size_ > static_cast<std::size_t>(std::numeric_limits<int>::max()))
      throw Error({.file = "linear system", .found = std::to_string(size_) + " unknowns", .expected = "below 2^31"});
    std::vector<Eigen::Triplet<double>> triplets;
    triplets.reserve(entries.size());
    for (const SymmetricEntry& e : entries) {
      if (e.row >= size_ || e.column >= size_)
        throw Error({.file = "linear system",
                     .place = "entry (" + std::to_string(e.row) + ", " + std::to_string(e.column) + ")",
                     .expected = "numbers below " + std::to_string(size_)});
      if (!std::isfinite(e.value))
        throw Error({.file = "linear system",
                     .place = "entry (" + std::to_string(e.row) + ", " + std::to_string(e.column) + ")",
                     .found = std::to_string(e.value),
                     .expected = "a finite number"});
      const auto [low, high] = std::minmax(e.row, e.column);
      triplets.emplace_back(static_cast<int>(high), static_cast<int>(low), e.value);
    }
    const auto n = static_cast<Eigen::Index>(size_);
    Matrix matrix(n, n);
    matrix.setFromTriplets(triplets.begin(), triplets.end());
    return matrix;
  }

  static std::vector<int> pattern_of(const Matrix& matrix) {
    std::vector<int> pattern(matrix.outerIndexPtr(), matrix.outerIndexPtr() + matrix.outerSize() + 1);
    pattern.insert(pattern.end(), matrix.innerIndexPtr(), matrix.innerIndexPtr() + matrix.nonZeros());
    return pattern;
  }

  void factorise(const Matrix& matrix) {
    solver_->factorize(matrix);
    if (size_ == 0) return;
    // Eigen stops at a pivot of exactly 0 only, and takes negative ones. Where there should be 0, rounding leaves about
    // 1e-15 of the diagonal entry.
    const Eigen::VectorXd pivots = solver_->vectorD();
    inverse_pivots_ = pivots.cwiseInverse();
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
      const int unknown = solver_->permutationPinv().indices()(i);
      if (const double d = matrix.coeff(unknown, unknown); d > 0 && pivots(i) > 1e-13 * d) continue;
      throw Error({.file = "linear system",
                   .place = "unknown " + std::to_string(unknown),
                   .found = "pivot " + std::to_string(pivots(i)),
                   .expected = "a positive definite matrix"});
    }
  }

  std::size_t size_;
  std::vector<int> pattern_;
  Eigen::VectorXd inverse_pivots_;
  std::unique_ptr<Eigen::SimplicialLDLT<Matrix>> solver_ =
      std::make_unique<Eigen::SimplicialLDLT<Matrix>>();  // can't be moved
};

}  // namespace npt::inline NPT_ABI
