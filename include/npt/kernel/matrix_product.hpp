/// Plain matrix products on the micro-kernel, for matrices that no vertices are in: the optimiser's.
#pragma once

#include <npt/config.hpp>
#include <npt/core/aligned.hpp>
#include <npt/kernel/amx_product.hpp>
#include <npt/kernel/micro_kernel.hpp>
#include <npt/kernel/packed_weights.hpp>
#include <npt/kernel/panel.hpp>
#include <npt/simd/amx.hpp>
#include <npt/simd/transpose.hpp>

#include <algorithm>
#include <cstddef>
#include <type_traits>

namespace npt::inline NPT_ABI::kernel {

/// c = a b for row-major matrices, a also given transposed: one or the other lies as the kernel wants it. Keeps its packing memory
/// between calls; one thread.
template <class T>
class MatrixProduct {
 public:
  /// `parts`: of bfloat16 values, on matrix registers (amx_product.hpp); 0: products in T.
  explicit MatrixProduct(int parts = 0)
      : parts_(std::is_same_v<T, float> && simd::has_matrix_registers() ? parts : 0) {}

  /// a: [m, k]   transposed: [k, m]   b: [k, n]   c: [m, n], which may not overlap them.
  void operator()(int m, int n, int k, const T* a, const T* transposed, const T* b, T* c) {
    const auto bias = [](int) { return T(0); };
    operand_.grow_to(index(k) * panel_width<T>);
    if constexpr (std::is_same_v<T, float>) {
      if (parts_ > 0) {
        amx_weights_.pack_matrix(m, k, parts_, a, index(k), bias);
        words_.grow_to(amx_weights_.operand_words(1));
        [[maybe_unused]] const simd::MatrixRegisters registers;
        AmxOperand operand{};
        for_each_panel(amx_weights_, n, k, b, c, [&](int block, T* tile) {
          if (block == 0) operand = split_panel(amx_weights_, operand_.data(), panel_width<float>, words_.data());
          amx_weights_.multiply(block, operand, static_cast<const T*>(nullptr), tile);
        });
        return;
      }
    }
    weights_.pack(
        m, k, [&](int row, int step) { return transposed[index(step) * index(m) + index(row)]; }, bias);
    for_each_panel(weights_, n, k, b, c, [&](int block, T* tile) {
      micro_kernels<T>[index(weights_.rows(block))](k, weights_.block(block), operand_.data(),
                                                    weights_.bias() + weights_.first_row(block), tile);
    });
  }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  /// Calls product(block, tile) for every panel of b, which is then in operand_, and every block of rows.
  template <class Weights, class Product>
  void for_each_panel(const Weights& weights, int n, int k, const T* b, T* c, Product&& product) {
    alignas(simd_alignment) T tile[index(Weights::tallest_block) * panel_width<T>];
    for (int first = 0; first < n; first += panel_width<T>) {
      const int width = std::min(panel_width<T>, n - first);
      for (int step = 0; step < k; ++step) {
        T* to = operand_.data() + index(step) * panel_width<T>;
        std::copy_n(b + index(step) * index(n) + index(first), width, to);
        std::fill(to + width, to + panel_width<T>, T(0));
      }
      for (int block = 0; block < weights.block_count(); ++block) {
        product(block, tile);
        for (int r = 0; r < weights.rows(block); ++r)
          std::copy_n(tile + index(r) * panel_width<T>, width,
                      c + index(weights.first_row(block) + r) * index(n) + index(first));
      }
    }
  }

  int parts_;
  PackedWeights<T> weights_;
  AmxWeights amx_weights_;
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
