/// The register tile of bfloat16 pairs on ARM's BFMMLA: one instruction adds to a square of two rows and two vertices
/// four channels' products, twice of what BFDOT adds. Weights, operand and tile lie as the micro-kernel has them.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/simd/bf16.hpp>

#include <cstdint>
#include <type_traits>

#if NPT_HAS_XSIMD && defined(__aarch64__) && defined(__ARM_FEATURE_BF16_VECTOR_ARITHMETIC)
#include <arm_neon.h>
#endif

namespace npt::inline NPT_ABI::kernel {

#if NPT_HAS_XSIMD && defined(__aarch64__) && defined(__ARM_FEATURE_BF16_VECTOR_ARITHMETIC)
inline constexpr bool has_bf16_squares = true;

template <int I>
using Number = std::integral_constant<int, I>;

/// As kernel::micro_kernel does, two steps (four channels) at a time.
template <int MR>
NPT_ALWAYS_INLINE void bf16_square_tile(int steps, const float* NPT_RESTRICT weights, const float* NPT_RESTRICT operand,
                                        const float* NPT_RESTRICT bias, float* NPT_RESTRICT tile) {
  static_assert(panel_width<float> == 8);
  constexpr int row_pairs = (MR + 1) / 2;  // of an odd number the last pair holds the last row twice
  float32x4_t sum[row_pairs][4];
  simd::unroll<row_pairs>([&](auto i) NPT_LAMBDA_INLINE {
    constexpr int row = 2 * i, next = row + 1 < MR ? row + 1 : row;
    const float32x4_t start = vcombine_f32(vdup_n_f32(bias[row]), vdup_n_f32(bias[next]));
    simd::unroll<4>([&](auto v) NPT_LAMBDA_INLINE { sum[i][v] = start; });
  });
  // Squares want a row's, or a vertex's, four channels side by side: the words of two steps, interleaved.
  const auto add = [&](const float32x4_t(&vertices)[4], auto i, float32x4_t rows) NPT_LAMBDA_INLINE {
    simd::unroll<4>([&](auto v) NPT_LAMBDA_INLINE {
      sum[i][v] = vbfmmlaq_f32(sum[i][v], vreinterpretq_bf16_f32(rows), vreinterpretq_bf16_f32(vertices[v]));
    });
  };
  const auto step = [&](auto two) NPT_LAMBDA_INLINE {
    constexpr bool both = decltype(two)::value != 0;  // else nothing follows the last step
    const float32x4_t none = vdupq_n_f32(0);
    const float32x4_t a = vld1q_f32(operand), b = vld1q_f32(operand + 4);
    const float32x4_t c = both ? vld1q_f32(operand + 8) : none, d = both ? vld1q_f32(operand + 12) : none;
    const float32x4_t vertices[4] = {vzip1q_f32(a, c), vzip2q_f32(a, c), vzip1q_f32(b, d), vzip2q_f32(b, d)};
    const float* const second = weights + MR;
    simd::unroll<MR / 4>([&](auto j) NPT_LAMBDA_INLINE {
      const float32x4_t p = vld1q_f32(weights + 4 * j), q = both ? vld1q_f32(second + 4 * j) : none;
      add(vertices, Number<2 * j>(), vzip1q_f32(p, q));
      add(vertices, Number<2 * j + 1>(), vzip2q_f32(p, q));
    });
    constexpr int done = MR / 4 * 4;
    if constexpr (MR - done >= 2) {
      const float32x2_t p = vld1_f32(weights + done), q = both ? vld1_f32(second + done) : vdup_n_f32(0);
      add(vertices, Number<done / 2>(), vcombine_f32(vzip1_f32(p, q), vzip2_f32(p, q)));
    }
    if constexpr (MR % 2 == 1) {
      const float32x4_t p = vld1q_dup_f32(weights + MR - 1), q = both ? vld1q_dup_f32(second + MR - 1) : none;
      add(vertices, Number<row_pairs - 1>(), vzip1q_f32(p, q));
    }
  };
  const auto next_block = reinterpret_cast<std::uintptr_t>(weights) +
                          static_cast<std::uintptr_t>(steps) * static_cast<std::uintptr_t>(MR) * sizeof(float);
  for (int k = 0; k + 1 < steps; k += 2) {
    simd::prefetch_to_second_level(next_block +
                                   static_cast<std::uintptr_t>(k) * static_cast<std::uintptr_t>(MR) * sizeof(float));
    step(Number<1>());
    weights += 2 * MR;
    operand += 16;
  }
  if (steps % 2 != 0) step(Number<0>());
  simd::unroll<row_pairs>([&](auto i) NPT_LAMBDA_INLINE {
    constexpr int row = 2 * i;
    simd::unroll<2>([&](auto half) NPT_LAMBDA_INLINE {
      const auto x = vreinterpretq_f64_f32(sum[row / 2][2 * half]),
                 y = vreinterpretq_f64_f32(sum[row / 2][2 * half + 1]);
      float* const to = tile + 8 * row + 4 * half;
      vst1q_f32(to, vreinterpretq_f32_f64(vzip1q_f64(x, y)));
      if constexpr (row + 1 < MR) vst1q_f32(to + 8, vreinterpretq_f32_f64(vzip2q_f64(x, y)));
    });
  });
}
#else
inline constexpr bool has_bf16_squares = false;
#endif

}  // namespace npt::inline NPT_ABI::kernel
