/// Muon, an optimiser for the matrices inside a network: momentum whose every direction is made equally long.
///   m = momentum m + g        u = g + momentum m
///   w -= rate sqrt(max(1, rows / columns)) orthogonalised(u)
/// orthogonalised(u) is about U V^T of u = U S V^T, by five steps of a Newton-Schulz iteration. A gradient's few large
/// directions no longer hide the many small ones: after 1200 steps of this network it was at a PMD of 48e-4 where Adam
/// was at 217e-4 (docs/training.md). Vectors and the layers at the ends stay with Adam.
/// Numerics  every matrix is one task, and its sums have a fixed order: the same bits for any number of threads
/// Source    Jordan et al., "Muon: An optimizer for hidden layers in neural networks", 2024 (the iteration's
///           coefficients are theirs); Bernstein and Newhouse, "Old Optimizer, New Norm: An Anthology", 2024
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/base/executor.hpp>
#include <npt/config.hpp>
#include <npt/nn/kernel/matrix_product.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

struct MuonOptions {
  double momentum = 0.95;
  int iterations = 5;
  /// bfloat16 parts of a value in the iteration's products, where this machine has them; else and with 0: fp32. One is
  /// enough, as in its authors' code: the iteration only aims at singular values between 0.7 and 1.2.
  int parts = 0;
};

/// Whether a parameter is a matrix for Muon: a convolution between layers, not from or to coordinates.
inline bool is_hidden_matrix(const Parameter& p) {
  return !p.attribute && p.rank == 3 && p.dims[0] > 3 && p.dims[1] > 3 && p.dims[2] == 1;
}

/// Replaces a row-major [rows, columns] matrix by one with the same singular vectors and singular values of about 1
/// (0.7 .. 1.2, small ones less). A zero matrix stays zero.
template <class T>
class Orthogonaliser {
 public:
  /// `parts` as in MuonOptions.
  explicit Orthogonaliser(int parts = 0) : product_(parts) {}

  void operator()(std::span<T> matrix, int rows, int columns, int iterations) {
    NPT_ASSERT(matrix.size() == index(rows) * index(columns));
    // The iteration multiplies the shorter side with itself.
    const int n = std::min(rows, columns), m = std::max(rows, columns);
    double square = 0;
    for (const T value : matrix) square += static_cast<double>(value) * static_cast<double>(value);
    if (!(square > 0)) return;
    const T scale = static_cast<T>(1 / std::sqrt(square));
    for (AlignedBuffer<T>* b : {&x_, &transposed_, &update_}) b->grow_to(matrix.size());
    for (AlignedBuffer<T>* b : {&gram_, &square_}) b->grow_to(index(n) * index(n));
    if (rows <= columns)
      std::ranges::copy(matrix, x_.data());
    else
      kernel::transpose_matrix(matrix.data(), rows, columns, x_.data());
    for (std::size_t k = 0; k < matrix.size(); ++k) x_[k] *= scale;
    constexpr T a = T(3.4445), b = T(-4.7750), c = T(2.0315);
    for (int step = 0; step < iterations; ++step) {  // X <- a X + (b G + c G^2) X with G = X X^T, which is symmetric
      kernel::transpose_matrix(x_.data(), n, m, transposed_.data());
      product_(n, n, m, x_.data(), transposed_.data(), transposed_.data(), gram_.data());
      product_(n, n, n, gram_.data(), gram_.data(), gram_.data(), square_.data());
      for (std::size_t k = 0; k < index(n) * index(n); ++k) square_[k] = b * gram_[k] + c * square_[k];
      product_(n, m, n, square_.data(), square_.data(), x_.data(), update_.data());
      for (std::size_t k = 0; k < matrix.size(); ++k) x_[k] = a * x_[k] + update_[k];
    }
    if (rows <= columns)
      std::copy_n(x_.data(), matrix.size(), matrix.begin());
    else
      kernel::transpose_matrix(x_.data(), n, m, matrix.data());
  }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }
  kernel::MatrixProduct<T> product_;
  AlignedBuffer<T> x_, transposed_, update_, gram_, square_;
};

/// Steps of the matrices of one parameter buffer. The momentum lies in a buffer of the caller, laid out like this one.
template <class T>
class Muon {
 public:
  Muon(std::span<const NamedParameter> parameters, const MuonOptions& options) : options_(options) {
    for (const NamedParameter& p : parameters)
      if (is_hidden_matrix(p.parameter)) matrices_.push_back(p.parameter);
    // Large ones first, so that threads end together.
    std::ranges::stable_sort(matrices_, [](const Parameter& a, const Parameter& b) { return a.size() > b.size(); });
  }

  std::span<const Parameter> matrices() const { return matrices_; }

  /// One step with the given rate; the gradient is multiplied by `gradient_scale` first, which clipping makes smaller
  /// than 1.
  template <Executor E>
  void step(std::span<T> parameters, std::span<const T> gradient, std::span<T> momentum, double rate,
            double gradient_scale, const E& executor) {
    while (scratch_.size() < static_cast<std::size_t>(executor.slots()))
      scratch_.push_back({Orthogonaliser<T>(options_.parts), {}});
    executor.for_each(static_cast<int>(matrices_.size()), [&](int i, int slot) {
      const Parameter& p = matrices_[static_cast<std::size_t>(i)];
      const auto first = static_cast<std::size_t>(p.offset), size = static_cast<std::size_t>(p.size());
      Scratch& scratch = scratch_[static_cast<std::size_t>(slot)];
      scratch.update.grow_to(size);
      const std::span<T> u = scratch.update.span().first(size);
      const T keep = static_cast<T>(options_.momentum), shrink = static_cast<T>(gradient_scale);
      for (std::size_t k = 0; k < size; ++k) {
        const T g = gradient[first + k] * shrink;
        momentum[first + k] = keep * momentum[first + k] + g;
        u[k] = g + keep * momentum[first + k];
      }
      scratch.orthogonalise(u, p.dims[0], p.dims[1], options_.iterations);
      const double tall = std::max(1.0, static_cast<double>(p.dims[0]) / p.dims[1]);
      const T length = static_cast<T>(rate * std::sqrt(tall));
      for (std::size_t k = 0; k < size; ++k) parameters[first + k] -= length * u[k];
    });
  }

 private:
  struct Scratch {
    Orthogonaliser<T> orthogonalise;
    AlignedBuffer<T> update;
  };
  MuonOptions options_;
  std::vector<Parameter> matrices_;
  std::vector<Scratch> scratch_;
};

}  // namespace npt::inline NPT_ABI
