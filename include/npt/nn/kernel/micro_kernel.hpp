/// The register tile of the matrix product, and the only loop in which the network spends its time.
///   tile[r][v] = bias[r] + sum over k of weights[k][r] * operand[k][v]      r < MR rows, v < panel_width
/// The sum runs over all of K in one go, so accumulators never leave their registers before the end.
/// One function a tile height and instruction set; K is a run-time value.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/bf16_square_tile.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/simd/batch.hpp>
#include <npt/nn/simd/bf16.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace npt::inline NPT_ABI::kernel {

/// The tallest tile that fits the registers: 2 * rows accumulators, the panel's two registers and a broadcast weight.
/// With 32 registers 12 to 14 rows were equal within noise (90 % of the FMA peak); 16 registers hold 6.
/// On ARM64 g++ 12 moves loads of weights and operand forward and spills accumulators of 11 rows and more, and squares
/// of bfloat16 want four registers for the panel.
#if defined(__aarch64__) && (!defined(__clang__) || defined(__ARM_FEATURE_BF16_VECTOR_ARITHMETIC))
inline constexpr int max_tile_rows = 10;
#elif defined(__AVX512F__) || defined(__aarch64__)
inline constexpr int max_tile_rows = 13;
#else
inline constexpr int max_tile_rows = 6;
#endif

template <class T>
using MicroKernel = void (*)(int steps, const T* weights, const T* operand, const T* bias, T* tile);

/// What one step of the sum multiplies. Either way a step is one 32-bit (fp64: 64-bit) lane a row of weights and a
/// vertex.
enum class Product {
  plain,       ///< one channel
  bf16_pairs,  ///< two channels as bfloat16, summed in float
};

template <class T, Product P, int MR>
NPT_NOINLINE void micro_kernel(int steps, const T* NPT_RESTRICT weights, const T* NPT_RESTRICT operand,
                               const T* NPT_RESTRICT bias, T* NPT_RESTRICT tile) {
#if defined(__aarch64__)
  if constexpr (P == Product::bf16_pairs && has_bf16_squares) {
    bf16_square_tile<MR>(steps, weights, operand, bias, tile);
    return;
  }
#endif
  constexpr int lanes = simd::lanes<T>;
  simd::Batch<T> sum[static_cast<std::size_t>(MR)][panel_registers];
  simd::unroll<MR>([&](auto r) NPT_LAMBDA_INLINE {
    simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE { sum[r][q] = simd::broadcast(bias[r]); });
  });
  // The block of weights behind this one comes from the third-level cache, which other cores share: asking for it while
  // this one is used gave 16 % on one thread and 12 % on two (187 to 218 and 380 to 425 GFLOP/s, bottleneck 1024,
  // paired runs on a busy Zen 5).
  const auto next_block = reinterpret_cast<std::uintptr_t>(weights) +
                          static_cast<std::uintptr_t>(steps) * static_cast<std::uintptr_t>(MR) * sizeof(T);
  for (int k = 0; k < steps; ++k) {
    simd::prefetch_to_second_level(next_block +
                                   static_cast<std::uintptr_t>(k) * static_cast<std::uintptr_t>(MR) * sizeof(T));
    simd::Batch<T> x[panel_registers];
    simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE { x[q] = simd::load(operand + q * lanes); });
    simd::unroll<MR>([&](auto r) NPT_LAMBDA_INLINE {
      const simd::Batch<T> w = simd::broadcast(weights[r]);
      simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE {
        if constexpr (P == Product::plain)
          sum[r][q] = simd::fma(w, x[q], sum[r][q]);
        else
          sum[r][q] = simd::dot_bf16(w, x[q], sum[r][q]);
      });
    });
    weights += MR;
    operand += panel_registers * lanes;
  }
  simd::unroll<MR>([&](auto r) NPT_LAMBDA_INLINE {
    simd::unroll<panel_registers>(
        [&](auto q) NPT_LAMBDA_INLINE { simd::store(tile + (r * panel_registers + q) * lanes, sum[r][q]); });
  });
}

/// The micro-kernel of a tile's height, 1 to max_tile_rows.
template <class T, Product P = Product::plain>
MicroKernel<T> micro_kernel_of(int rows) {
  static constexpr auto kernels = []<int... I>(std::integer_sequence<int, I...>) {
    return std::array{&micro_kernel<T, P, I + 1>...};
  }
  (std::make_integer_sequence<int, max_tile_rows>{});
  return kernels[static_cast<std::size_t>(rows - 1)];
}

#ifdef NPT_COMPILED
extern template MicroKernel<float> micro_kernel_of<float, Product::plain>(int);
extern template MicroKernel<float> micro_kernel_of<float, Product::bf16_pairs>(int);
extern template MicroKernel<double> micro_kernel_of<double, Product::plain>(int);
#endif

}  // namespace npt::inline NPT_ABI::kernel
