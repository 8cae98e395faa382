/// Operands of products on matrix registers (AMX): fp32 values split into bfloat16 parts (amx_product.hpp has the
/// layout).
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/amx_kernel.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/word_kernel.hpp>
#include <npt/nn/simd/amx.hpp>
#include <npt/nn/simd/batch.hpp>
#include <npt/nn/simd/bf16.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::kernel {

/// One panel of an operand.
struct AmxOperand {
  const Word* words;    ///< parts of the channels that matrix registers take
  const float* values;  ///< [channels][panel_width] of all of them; read where AmxWeights::reads_values()
  const float* few;     ///< of the channels behind those in `words`
  int halves;           ///< of the panel that hold vertices, 1 or 2
};

/// Halves of a panel that its `valid` vertices take; more than a panel's are all.
constexpr int used_halves(int valid) { return valid > simd::matrix_words ? 2 : 1; }

namespace internal {

/// Three parts hold all 24 bits of a value even if each is cut off, which takes half as long as rounding each: what the
/// products leave out, and the terms that no pair of parts stands for, are below 2^-24 of a term.
template <int Parts>
NPT_ALWAYS_INLINE void split_pair(simd::Batch<float> first, simd::Batch<float> second, Word* to,
                                  std::size_t part_stride) {
  simd::unroll<Parts>([&](auto p) NPT_LAMBDA_INLINE {
    constexpr bool last = p + 1 == Parts;
    Word* part = to + p * part_stride;
    if constexpr (Parts == max_parts) {
      simd::store_words(part, simd::bf16_cut_pairs(first, second));
      if constexpr (!last) {
        first = simd::below_bf16(first);
        second = simd::below_bf16(second);
      }
    } else {
      const simd::Batch<float> pairs = simd::bf16_pairs(first, second);
      simd::store_words(part, pairs);
      if constexpr (!last) {
        first -= simd::first_of_pairs(pairs);
        second -= simd::second_of_pairs(pairs);
      }
    }
  });
}

template <int Parts>
NPT_NOINLINE void split_channels(const float* NPT_RESTRICT from, int rows, Word* NPT_RESTRICT panel, int first_word) {
  constexpr int width = panel_width<float>, lanes = simd::lanes<float>;
  for (int c = 0, word = first_word; c < rows; c += 2, ++word, from += 2 * width) {
    Word* to = panel + static_cast<std::size_t>(word / simd::matrix_rows * Parts) * 2 * matrix_size +
               static_cast<std::size_t>(word % simd::matrix_rows * simd::matrix_words);
    const bool paired = c + 1 < rows;
    simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE {
      split_pair<Parts>(simd::load(from + q * lanes),
                        paired ? simd::load(from + width + q * lanes) : simd::broadcast(0.0F), to + q * matrix_size,
                        2 * matrix_size);
    });
  }
}

}  // namespace internal

/// Splits the pairs (first, second) of each lane into parts of one register of words each, `part_stride` words apart.
NPT_ALWAYS_INLINE void split_pair(int parts, const simd::Batch<float>& first, const simd::Batch<float>& second,
                                  Word* to, std::size_t part_stride) {
  static_assert(max_parts == 3);
  if (parts == 1)
    internal::split_pair<1>(first, second, to, part_stride);
  else if (parts == 2)
    internal::split_pair<2>(first, second, to, part_stride);
  else
    internal::split_pair<3>(first, second, to, part_stride);
}

/// Splits `rows` channels of one panel [rows][panel_width]. `panel`: the operand's words of that panel; the channels'
/// first word is number `first_word`. An odd last channel is paired with zero. Gives the number of words.
template <class T>
int split_channels(const T* from, int rows, int parts, Word* panel, int first_word) {
  static_assert(max_parts == 3);
  constexpr std::array split{&internal::split_channels<1>, &internal::split_channels<2>, &internal::split_channels<3>};
  split[static_cast<std::size_t>(parts - 1)](from, rows, panel, first_word);
  return (rows + 1) / 2;
}

/// Zeros behind a panel's last word, as far as matrix registers read.
inline void end_channels(Word* panel, int words, int parts) {
  const int over = words % simd::matrix_rows;
  if (over == 0) return;
  Word* last = panel + static_cast<std::size_t>(words / simd::matrix_rows * parts) * 2 * matrix_size;
  for (int m = 0; m < 2 * parts; ++m) {
    Word* matrix = last + static_cast<std::size_t>(m) * matrix_size;
    std::fill(matrix + over * simd::matrix_words, matrix + matrix_size, Word{0});
  }
}

}  // namespace npt::inline NPT_ABI::kernel
