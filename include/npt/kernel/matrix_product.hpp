/// Plain matrix products on the micro-kernel, for matrices that no vertices are in: the optimiser's.
#pragma once

#include <npt/config.hpp>
#include <npt/core/aligned.hpp>
#include <npt/kernel/micro_kernel.hpp>
#include <npt/kernel/packed_weights.hpp>
#include <npt/kernel/panel.hpp>
#include <npt/simd/transpose.hpp>

#include <algorithm>
#include <cstddef>

namespace npt::inline NPT_ABI::kernel {

/// c = a^T b for row-major matrices: with a transposed, what a tile's rows are multiplied with lies side by side. Keeps its packing
/// memory between calls; one thread.
template <class T>
class MatrixProduct {
 public:
  /// a: [k, m]   b: [k, n]   c: [m, n], which may not overlap them.
  void operator()(int m, int n, int k, const T* a, const T* b, T* c) {
    weights_.pack(
        m, k, [&](int row, int step) { return a[index(step) * index(m) + index(row)]; }, [](int) { return T(0); });
    operand_.grow_to(index(k) * panel_width<T>);
    alignas(simd_alignment) T tile[index(max_tile_rows) * panel_width<T>];
    for (int first = 0; first < n; first += panel_width<T>) {
      const int width = std::min(panel_width<T>, n - first);
      for (int step = 0; step < k; ++step) {
        T* to = operand_.data() + index(step) * panel_width<T>;
        std::copy_n(b + index(step) * index(n) + index(first), width, to);
        std::fill(to + width, to + panel_width<T>, T(0));
      }
      for (int block = 0; block < weights_.blocks().count; ++block) {
        const int row = weights_.blocks().first_row(block), rows = weights_.blocks().rows(block);
        micro_kernels<T>[index(rows)](k, weights_.block(block), operand_.data(), weights_.bias() + row, tile);
        for (int r = 0; r < rows; ++r)
          std::copy_n(tile + index(r) * panel_width<T>, width, c + index(row + r) * index(n) + index(first));
      }
    }
  }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }
  PackedWeights<T> weights_;
  AlignedBuffer<T> operand_;
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
