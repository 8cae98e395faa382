/// Plain matrix products on the micro-kernel, for matrices that no vertices are in: the optimiser's.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/product.hpp>
#include <npt/nn/simd/amx.hpp>
#include <npt/nn/simd/transpose.hpp>

#include <algorithm>
#include <cstddef>

namespace npt::inline NPT_ABI::kernel {

/// c = a b for row-major matrices, a also given transposed: one or the other lies as the kernel wants it. Keeps its
/// packing memory between calls; one thread.
template <class T>
class MatrixProduct {
 public:
  /// `parts`: of bfloat16 values, on matrix registers (amx_product.hpp); 0: products in T.
  explicit MatrixProduct(int parts = 0)
      : format_{.parts = ProductFormat::has_parts<T> && has_word_products(parts) ? parts : 0} {}

  /// a: [m, k]   transposed: [k, m]   b: [k, n]   c: [m, n], which may not overlap them.
  void operator()(int m, int n, int k, const T* a, const T* transposed, const T* b, T* c) {
    const auto bias = [](int) { return T(0); };
    if (format_.parts > 0)
      weights_.pack_matrix(m, k, format_, a, index(k), bias);
    else
      weights_.pack(
          m, k, format_, [&](int row, int step) { return transposed[index(step) * index(m) + index(row)]; }, bias);
    operand_.grow_to(index(k) * panel_width<T>);
    words_.grow_to(weights_.operand_words(1));
    [[maybe_unused]] const ProductScope scope(format_);
    alignas(simd_alignment) T tile[index(ProductWeights<T>::tallest_block) * panel_width<T>];
    for (int first = 0; first < n; first += panel_width<T>) {
      const int width = std::min(panel_width<T>, n - first);
      for (int step = 0; step < k; ++step) {
        T* to = operand_.data() + index(step) * panel_width<T>;
        std::copy_n(b + index(step) * index(n) + index(first), width, to);
        std::fill(to + width, to + panel_width<T>, T(0));
      }
      const GroupProduct<T> product(weights_, operand_.data(), panel_width<T>, words_.data());
      for (int block = 0; block < weights_.block_count(); ++block) {
        const int row = weights_.first_row(block);
        product.multiply(block, 0, weights_.bias_at(weights_.bias(), row), tile);
        for (int r = 0; r < weights_.rows(block); ++r)
          std::copy_n(tile + index(r) * panel_width<T>, width, c + index(row + r) * index(n) + index(first));
      }
    }
  }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  ProductFormat format_;
  ProductWeights<T> weights_;
  AlignedBuffer<T> operand_;
  AlignedBuffer<Word> words_;
};

/// to[j][i] = from[i][j] for a row-major [rows, columns] matrix.
template <class T>
void transpose_matrix(const T* from, int rows, int columns, T* to) {
  constexpr int lanes = simd::lanes<T>;
  const auto n = static_cast<std::size_t>(rows), m = static_cast<std::size_t>(columns);
  const int whole_rows = rows / lanes * lanes, whole_columns = columns / lanes * lanes;
  for (int i = 0; i < whole_rows; i += lanes)
    for (int j = 0; j < whole_columns; j += lanes)
      simd::transpose(from + static_cast<std::size_t>(i) * m + static_cast<std::size_t>(j), m,
                      to + static_cast<std::size_t>(j) * n + static_cast<std::size_t>(i), n);
  for (int i = 0; i < rows; ++i)
    for (int j = i < whole_rows ? whole_columns : 0; j < columns; ++j)
      to[static_cast<std::size_t>(j) * n + static_cast<std::size_t>(i)] =
          from[static_cast<std::size_t>(i) * m + static_cast<std::size_t>(j)];
}

}  // namespace npt::inline NPT_ABI::kernel
