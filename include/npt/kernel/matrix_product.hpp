/// Plain matrix products on the micro-kernel, for matrices that no vertices are in: the optimiser's.
#pragma once

#include <npt/config.hpp>
#include <npt/core/aligned.hpp>
#include <npt/kernel/micro_kernel.hpp>
#include <npt/kernel/packed_weights.hpp>
#include <npt/kernel/panel.hpp>

#include <algorithm>
#include <cstddef>

namespace npt::inline NPT_ABI::kernel {

/// c = a b for row-major matrices. Keeps its packing memory between calls; one thread.
template <class T>
class MatrixProduct {
 public:
  /// a: [m, k]   b: [k, n]   c: [m, n], which may not overlap them.
  void operator()(int m, int n, int k, const T* a, const T* b, T* c) {
    weights_.pack(
        m, k, [&](int row, int step) { return a[index(row) * index(k) + index(step)]; }, [](int) { return T(0); });
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

}  // namespace npt::inline NPT_ABI::kernel
