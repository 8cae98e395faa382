/// A product's last columns in fp32, where all before them were multiplied on matrix registers, which take 32 at a
/// time: with 131 = 128 + 3 columns a fifth of their work would meet zeros.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/simd/batch.hpp>

#include <array>
#include <cstddef>
#include <utility>

namespace npt::inline NPT_ABI::kernel {

/// The most columns that are added this way.
inline constexpr int most_few_columns = 8;

namespace internal {

template <int Columns, class T>
NPT_NOINLINE void add_columns(int rows, const T* NPT_RESTRICT weights, const T* NPT_RESTRICT values,
                              T* NPT_RESTRICT tile) {
  constexpr int lanes = simd::lanes<T>;
  simd::Batch<T> x[static_cast<std::size_t>(Columns)][panel_registers];
  simd::unroll<Columns>([&](auto c) NPT_LAMBDA_INLINE {
    simd::unroll<panel_registers>(
        [&](auto q) NPT_LAMBDA_INLINE { x[c][q] = simd::load(values + (c * panel_registers + q) * lanes); });
  });
  for (int r = 0; r < rows; ++r, weights += Columns, tile += panel_width<T>) {
    simd::Batch<T> sum[panel_registers];
    simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE { sum[q] = simd::load(tile + q * lanes); });
    simd::unroll<Columns>([&](auto c) NPT_LAMBDA_INLINE {
      const simd::Batch<T> w = simd::broadcast(weights[c]);
      simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE { sum[q] = simd::fma(w, x[c][q], sum[q]); });
    });
    simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE { simd::store(tile + q * lanes, sum[q]); });
  }
}

}  // namespace internal

/// tile[r][v] += sum over c < columns of weights[r][c] * values[c][v], for r < rows, v < panel_width. 1 <= columns <=
/// most_few_columns.
template <class T>
void add_few_columns(int columns, int rows, const T* weights, const T* values, T* tile) {
  static constexpr auto kernels = []<int... I>(std::integer_sequence<int, I...>) {
    return std::array{&internal::add_columns<I + 1, T>...};
  }
  (std::make_integer_sequence<int, most_few_columns>{});
  kernels[static_cast<std::size_t>(columns - 1)](rows, weights, values, tile);
}

#ifdef NPT_COMPILED
extern template void add_few_columns(int, int, const float*, const float*, float*);
#endif

}  // namespace npt::inline NPT_ABI::kernel
