/// A product's last rows in fp32, where all before them were multiplied on matrix registers, which take 16 at a time.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/simd/batch.hpp>

#include <array>
#include <cstddef>
#include <utility>

namespace npt::inline NPT_ABI::kernel {

/// The most rows that are computed this way, and the most columns of a product in which they are: their operand is kept
/// in fp32.
inline constexpr int most_few_rows = 4;
inline constexpr int most_value_columns = 512;

namespace internal {

/// A row's multiply-adds wait for each other: where rows are few, each has several sums.
template <int Rows, class T>
NPT_NOINLINE void multiply_rows(int columns, const T* NPT_RESTRICT weights, const T* NPT_RESTRICT values,
                                const T* NPT_RESTRICT bias, int bias_stride, T* NPT_RESTRICT tile) {
  constexpr int lanes = simd::lanes<T>, ways = Rows == 1 ? 4 : Rows < 4 ? 2 : 1;
  simd::Batch<T> sum[std::size_t{ways}][static_cast<std::size_t>(Rows)][panel_registers];
  simd::unroll<ways>([&](auto way) NPT_LAMBDA_INLINE {
    simd::unroll<Rows>([&](auto r) NPT_LAMBDA_INLINE {
      const T first = way == 0 && bias != nullptr ? bias[r * bias_stride] : T(0);
      simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE { sum[way][r][q] = simd::broadcast(first); });
    });
  });
  const auto step = [&](auto way) NPT_LAMBDA_INLINE {
    simd::unroll<Rows>([&](auto r) NPT_LAMBDA_INLINE {
      const simd::Batch<T> w = simd::broadcast(weights[way * Rows + r]);
      simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE {
        sum[way][r][q] = simd::fma(w, simd::load(values + (way * panel_registers + q) * lanes), sum[way][r][q]);
      });
    });
  };
  int k = 0;
  for (; k + ways <= columns; k += ways, weights += ways * Rows, values += ways * panel_width<T>)
    simd::unroll<ways>(step);
  for (; k < columns; ++k, weights += Rows, values += panel_width<T>) step(std::integral_constant<int, 0>{});
  simd::unroll<Rows>([&](auto r) NPT_LAMBDA_INLINE {
    simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE {
      simd::unroll<ways - 1>([&](auto way) NPT_LAMBDA_INLINE { sum[0][r][q] += sum[way + 1][r][q]; });
      simd::store(tile + (r * panel_registers + q) * lanes, sum[0][r][q]);
    });
  });
}

}  // namespace internal

/// tile[r][v] = bias[r * bias_stride] + sum over c < columns of weights[c][r] * values[c][v], for r < rows, v <
/// panel_width. 1 <= rows <= most_few_rows; no bias where it is nullptr.
template <class T>
void multiply_few_rows(int rows, int columns, const T* weights, const T* values, const T* bias, int bias_stride,
                       T* tile) {
  static constexpr auto kernels = []<int... I>(std::integer_sequence<int, I...>) {
    return std::array{&internal::multiply_rows<I + 1, T>...};
  }
  (std::make_integer_sequence<int, most_few_rows>{});
  kernels[static_cast<std::size_t>(rows - 1)](columns, weights, values, bias, bias_stride, tile);
}

#ifdef NPT_COMPILED
extern template void multiply_few_rows(int, int, const float*, const float*, const float*, int, float*);
#endif

}  // namespace npt::inline NPT_ABI::kernel
