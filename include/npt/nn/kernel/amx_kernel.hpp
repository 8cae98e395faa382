/// The kernel of products on matrix registers (AMX), which bfloat16 parts of weights and operand meet in it
/// (amx_product.hpp), and which kernel takes them where there are none.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/word_kernel.hpp>
#include <npt/nn/simd/amx.hpp>
#include <npt/nn/simd/batch.hpp>

#include <array>
#include <cstddef>
#include <type_traits>

namespace npt::inline NPT_ABI::kernel {

inline constexpr int max_parts = 3;
/// Rows of weights that one call of the kernel takes.
inline constexpr int amx_block_rows = 2 * simd::matrix_rows;
/// Columns of weights, and so channels of the operand, that one product of matrix registers takes.
inline constexpr int amx_columns = 2 * simd::matrix_words;

/// Which parts meet in a product of matrix registers, the largest is 0.
struct PartPair {
  int weight, operand;
};

/// All pairs that count, in an order in which one partner stays from each to the next: 14 instead of 18 loads of matrix
/// registers for three parts. (Alone 7 % faster at 1027 rows, 25 % at 131; Xeon.)
template <int Parts>
inline constexpr auto part_pairs = [] {
  if constexpr (Parts == 1)
    return std::array{PartPair{0, 0}};
  else if constexpr (Parts == 2)
    return std::array{PartPair{1, 0}, PartPair{0, 0}, PartPair{0, 1}};
  else
    return std::array{PartPair{2, 0}, PartPair{1, 0}, PartPair{1, 1}, PartPair{0, 1}, PartPair{0, 0}, PartPair{0, 2}};
}();

/// Calls f(pair, whether its weights are new, whether its operand is), each as an integral constant, for every pair.
template <int Parts, class F>
NPT_ALWAYS_INLINE void for_each_part_pair(F&& f) {
  constexpr auto& pairs = part_pairs<Parts>;
  simd::unroll<static_cast<int>(pairs.size())>([&](auto n) NPT_LAMBDA_INLINE {
    constexpr auto at = static_cast<std::size_t>(n), before = at - (n == 0 ? 0U : 1U);
    f(std::integral_constant<int, pairs[at].weight>{}, std::integral_constant<int, pairs[at].operand>{},
      std::bool_constant < n == 0 || pairs[at].weight != pairs[before].weight > {},
      std::bool_constant < n == 0 || pairs[at].operand != pairs[before].operand > {});
  });
}

/// tile[32 or 16 rows][panel_width] = bias + weights * operand for one block and one panel, or its first half: then the
/// other becomes zero.
///   depth     products of matrix registers along the columns; may be 0
///   bias      of the block's rows; nullptr: none
using AmxKernel = void (*)(int depth, const Word* weights, const Word* operand, const float* bias, float* tile);

#if NPT_HAS_AMX

template <int Parts, int RowRegisters, int Halves>
NPT_NOINLINE void amx_kernel(int depth, const Word* NPT_RESTRICT weights, const Word* NPT_RESTRICT operand,
                             const float* NPT_RESTRICT bias, float* NPT_RESTRICT tile) {
  static_assert(panel_width<float> == 2 * simd::matrix_words && (RowRegisters == 1 || RowRegisters == 2));
  constexpr int stride = panel_width<float> * static_cast<int>(sizeof(Word));
  constexpr int row_stride = simd::matrix_words * static_cast<int>(sizeof(Word));
  constexpr std::size_t lower = std::size_t{simd::matrix_rows} * panel_width<float>;
  asm volatile("" ::: "memory");  // g++ doesn't know that loading a matrix register reads memory
  // Biases lie spread out: writing them here, just before they are loaded, took 40 % of the kernel's time in training
  // at bottleneck 128.
  _tile_zero(1);
  if constexpr (RowRegisters == 2) _tile_zero(3);
  if (bias != nullptr) {
    _tile_loadd(0, bias, row_stride);
    if constexpr (Halves == 2) _tile_loadd(1, bias, row_stride);
    if constexpr (RowRegisters == 2) _tile_loadd(2, bias + matrix_size, row_stride);
    if constexpr (RowRegisters == 2 && Halves == 2) _tile_loadd(3, bias + matrix_size, row_stride);
  } else {
    _tile_zero(0);
    if constexpr (RowRegisters == 2) _tile_zero(2);
  }
  for (int k = 0; k < depth; ++k) {
    for_each_part_pair<Parts>([&](auto i, auto j, auto new_weights, auto new_operand) NPT_LAMBDA_INLINE {
      if constexpr (new_weights) {
        const Word* w = weights + (Parts - 1 - i) * RowRegisters * matrix_size;
        _tile_loadd(4, w, row_stride);
        if constexpr (RowRegisters == 2) _tile_loadd(5, w + matrix_size, row_stride);
      }
      if constexpr (new_operand) {
        const Word* x = operand + j * 2 * matrix_size;
        _tile_loadd(6, x, row_stride);
        if constexpr (Halves == 2) _tile_loadd(7, x + matrix_size, row_stride);
      }
      _tile_dpbf16ps(0, 4, 6);
      if constexpr (Halves == 2) _tile_dpbf16ps(1, 4, 7);
      if constexpr (RowRegisters == 2) _tile_dpbf16ps(2, 5, 6);
      if constexpr (RowRegisters == 2 && Halves == 2) _tile_dpbf16ps(3, 5, 7);
    });
    weights += Parts * RowRegisters * matrix_size;
    operand += Parts * 2 * matrix_size;
  }
  _tile_stored(0, tile, stride);
  _tile_stored(1, tile + simd::matrix_words, stride);
  if constexpr (RowRegisters == 2) {
    _tile_stored(2, tile + lower, stride);
    _tile_stored(3, tile + lower + simd::matrix_words, stride);
  }
  asm volatile("" ::: "memory");
}

#endif

/// Whether products of values in `parts` bfloat16 parts run here: on matrix registers, those of one also on AVX-512's.
inline bool has_word_products(int parts) noexcept {
  return simd::has_matrix_registers() || (has_word_kernel && parts == 1);
}

/// The kernel for a number of parts, of row registers and of halves of a panel, where there is one.
NPT_INLINE AmxKernel amx_kernel_for(int parts, int row_registers, int halves) {
#if NPT_HAS_AMX
  static constexpr AmxKernel kernels[max_parts][2][2] = {
      {{&amx_kernel<1, 1, 1>, &amx_kernel<1, 1, 2>}, {&amx_kernel<1, 2, 1>, &amx_kernel<1, 2, 2>}},
      {{&amx_kernel<2, 1, 1>, &amx_kernel<2, 1, 2>}, {&amx_kernel<2, 2, 1>, &amx_kernel<2, 2, 2>}},
      {{&amx_kernel<3, 1, 1>, &amx_kernel<3, 1, 2>}, {&amx_kernel<3, 2, 1>, &amx_kernel<3, 2, 2>}}};
  if (simd::has_matrix_registers()) return kernels[parts - 1][row_registers - 1][halves - 1];
#endif
  if constexpr (has_word_kernel) {
    static constexpr AmxKernel in_vectors[2][2] = {{&word_kernel<1, 1>, &word_kernel<1, 2>},
                                                   {&word_kernel<2, 1>, &word_kernel<2, 2>}};
    NPT_ASSERT(parts == 1);
    return in_vectors[row_registers - 1][halves - 1];
  } else {
    static_cast<void>(parts + row_registers + halves);
    return nullptr;  // never called: no product has parts
  }
}

}  // namespace npt::inline NPT_ABI::kernel
