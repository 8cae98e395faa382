/// Small symmetric positive definite matrices: A = L L^T. Plain loops, and not Eigen's LLT: with AVX-512 that makes g++
/// 12 give hundreds of false warnings from intrinsics in the unit of whoever includes it (GCC bug 105593), and the unit
/// of a fit compiled in 21 s instead of 17; a fit spends its time on distances.
/// Requires  A given as [n, n], row major; only its lower half is read
/// Errors    npt::Error for a matrix that isn't positive definite
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

class DenseCholesky {
 public:
  DenseCholesky(std::size_t size, std::vector<double> matrix) : size_(size), factor_(std::move(matrix)) {
    NPT_ASSERT(factor_.size() == size * size);
    for (std::size_t i = 0; i < size_; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = at(i, j);
        for (std::size_t k = 0; k < j; ++k) sum -= at(i, k) * at(j, k);
        if (i != j) {
          at(i, j) = sum / at(j, j);
          continue;
        }
        if (!(sum > 0))
          throw Error({.file = "linear system",
                       .place = "unknown " + std::to_string(i),
                       .found = "pivot " + std::to_string(sum),
                       .expected = "a positive definite matrix"});
        at(i, i) = std::sqrt(sum);
      }
  }

  std::size_t size() const noexcept { return size_; }

  /// Of the matrix, its natural logarithm.
  double log_determinant() const {
    double sum = 0;
    for (std::size_t i = 0; i < size_; ++i) sum += 2 * std::log(at(i, i));
    return sum;
  }

  /// x becomes L^-1 x.
  void solve_lower(std::span<double> x) const {
    NPT_ASSERT(x.size() == size_);
    for (std::size_t i = 0; i < size_; ++i) {
      for (std::size_t k = 0; k < i; ++k) x[i] -= at(i, k) * x[k];
      x[i] /= at(i, i);
    }
  }
  /// x becomes L^-T x.
  void solve_upper(std::span<double> x) const {
    NPT_ASSERT(x.size() == size_);
    for (std::size_t i = size_; i-- > 0;) {
      for (std::size_t k = i + 1; k < size_; ++k) x[i] -= at(k, i) * x[k];
      x[i] /= at(i, i);
    }
  }

 private:
  double& at(std::size_t i, std::size_t j) { return factor_[i * size_ + j]; }
  double at(std::size_t i, std::size_t j) const { return factor_[i * size_ + j]; }

  std::size_t size_;
  std::vector<double> factor_;
};

}  // namespace npt::inline NPT_ABI
