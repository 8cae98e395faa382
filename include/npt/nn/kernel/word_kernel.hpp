/// The kernels of products in bfloat16 words (amx_product.hpp) on AVX-512's vector registers, for processors that
/// multiply bfloat16 pairs and have no matrix registers (AVX512_BF16: Zen 4 and 5, Cooper Lake). Operands lie as matrix
/// registers take them, so that one packing serves both; sums run in another order. One part only: the three products
/// of two parts would cost more than the one in fp32 that they replace.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/simd/amx.hpp>
#include <npt/nn/simd/batch.hpp>
#include <npt/nn/simd/bf16.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>

namespace npt::inline NPT_ABI::kernel {

using Word = std::uint32_t;  ///< two bfloat16 values

/// Elements of a matrix register, of either kind.
inline constexpr std::size_t matrix_size = std::size_t{simd::matrix_rows} * simd::matrix_words;

/// Whether vector registers multiply words here.
inline constexpr bool has_word_kernel = simd::has_bf16 && simd::lanes<float> == simd::matrix_words;

/// Rows whose sums stay in vector registers: with two columns of registers 16 sums, two of the operand, one weight.
inline constexpr int word_strip = simd::matrix_rows / 2;

/// Sums of a strip of rows, one or two registers of columns wide.
template <int Columns>
struct WordSums {
  simd::Batch<float> at[std::size_t{word_strip}][std::size_t{Columns}];

  /// += a strip of the matrix [16 rows][16 words] at `a` times the matrices [16 words][16 columns] at `b` and, for two
  /// columns, at `b` + `next`.
  NPT_ALWAYS_INLINE void add(const Word* NPT_RESTRICT a, const Word* NPT_RESTRICT b, std::size_t next) {
    for (int w = 0; w < simd::matrix_words; ++w, ++a, b += simd::matrix_words) {
      simd::Batch<float> x[std::size_t{Columns}];
      simd::unroll<Columns>([&](auto c) NPT_LAMBDA_INLINE {
        x[c] = simd::load(reinterpret_cast<const float*>(b + static_cast<std::size_t>(c) * next));
      });
      simd::unroll<word_strip>([&](auto r) NPT_LAMBDA_INLINE {
        const simd::Batch<float> pair = simd::broadcast(std::bit_cast<float>(a[r * simd::matrix_words]));
        simd::unroll<Columns>([&](auto c) NPT_LAMBDA_INLINE { at[r][c] = simd::dot_bf16(pair, x[c], at[r][c]); });
      });
    }
  }
};

/// As an AmxKernel (amx_kernel.hpp) of one part.
template <int RowRegisters, int Halves>
NPT_NOINLINE void word_kernel(int depth, const Word* NPT_RESTRICT weights, const Word* NPT_RESTRICT operand,
                              const float* NPT_RESTRICT bias, float* NPT_RESTRICT tile) {
  const simd::Batch<float> zero = simd::broadcast(0.0F);
  for (int first = 0; first < RowRegisters * simd::matrix_rows; first += word_strip) {
    WordSums<Halves> sums;
    simd::unroll<word_strip>([&](auto r) NPT_LAMBDA_INLINE {
      const simd::Batch<float> start = bias == nullptr ? zero : simd::load(bias + (first + r) * simd::matrix_words);
      simd::unroll<Halves>([&](auto h) NPT_LAMBDA_INLINE { sums.at[r][h] = start; });
    });
    const Word *w = weights, *x = operand;  // of depth 0 nullptr
    for (int k = 0; k < depth; ++k, w += RowRegisters * matrix_size, x += 2 * matrix_size)
      sums.add(w + first * simd::matrix_words, x, matrix_size);
    simd::unroll<word_strip>([&](auto r) NPT_LAMBDA_INLINE {
      float* to = tile + (first + r) * panel_width<float>;
      simd::store(to, sums.at[r][0]);
      simd::store(to + simd::matrix_words, Halves == 2 ? sums.at[r][Halves - 1] : zero);
    });
  }
}

}  // namespace npt::inline NPT_ABI::kernel
