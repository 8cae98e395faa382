/// The matrix product on matrix registers (AMX), for fp32 values that are split into one, two or three bfloat16 parts.
///
///   x = x1 + x2 + ...       each part the bfloat16 next to what the parts before it leave over
///   w x ~ sum of wi xj      over i + j <= parts + 1: 1, 3 or 6 products, smallest terms left out
///
/// Every bfloat16 product is exact in fp32, in which the sums run. One part keeps 8 bits of the operands, two 16, three all 24: the
/// error of three parts is that of a product in fp32.
///
/// Layouts, in 32-bit words of two bfloat16 values:
///   weights  [block of 32 rows][32 columns][part][16 rows][16 words], words along the columns, zero behind rows and columns
///   operand  [panel][part][words][panel_width], the words along the channels, zero behind them up to a multiple of 16
///   bias     [rows][16], each value 16 times
/// The result is a tile as everywhere (panel.hpp).
#pragma once

#include <npt/config.hpp>
#include <npt/core/aligned.hpp>
#include <npt/kernel/panel.hpp>
#include <npt/simd/amx.hpp>
#include <npt/simd/batch.hpp>
#include <npt/simd/bf16.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace npt::inline NPT_ABI::kernel {

using Word = std::uint32_t;  ///< two bfloat16 values

inline constexpr int max_parts = 3;
/// Rows of weights that one call of the kernel takes.
inline constexpr int amx_block_rows = 2 * simd::matrix_rows;
/// Columns of weights, and so channels of the operand, that one product of matrix registers takes.
inline constexpr int amx_columns = 2 * simd::matrix_words;

/// Matrix registers side by side that hold `columns` columns.
constexpr int amx_depth(int columns) { return (columns + amx_columns - 1) / amx_columns; }

/// tile[32 or fewer rows][panel_width] = bias + weights * operand for one block and one panel.
///   depth     products of matrix registers along the columns
///   bias      of the block's rows; nullptr: none
///   tile      rows are written in whole registers of 16
using AmxKernel = void (*)(int depth, const Word* weights, const Word* operand, const float* bias, float* tile);

#if NPT_HAS_AMX

template <int Parts, int RowRegisters>
NPT_NOINLINE void amx_kernel(int depth, const Word* NPT_RESTRICT weights, const Word* NPT_RESTRICT operand,
                             const float* NPT_RESTRICT bias, float* NPT_RESTRICT tile) {
  static_assert(panel_width<float> == 2 * simd::matrix_words && (RowRegisters == 1 || RowRegisters == 2));
  constexpr int stride = panel_width<float> * static_cast<int>(sizeof(Word));
  constexpr int row_stride = simd::matrix_words * static_cast<int>(sizeof(Word));
  constexpr std::size_t matrix = std::size_t{simd::matrix_rows} * simd::matrix_words;
  constexpr std::size_t lower = std::size_t{simd::matrix_rows} * panel_width<float>;
  const std::size_t part = static_cast<std::size_t>(depth) * lower;
  asm volatile("" ::: "memory");  // g++ doesn't know that loading a matrix register reads memory
  // Biases lie spread out: writing them here, just before they are loaded, took 40 % of the kernel's time in training at bottleneck 128.
  if (bias != nullptr) {
    _tile_loadd(0, bias, row_stride);
    _tile_loadd(1, bias, row_stride);
    if constexpr (RowRegisters == 2) {
      _tile_loadd(2, bias + matrix, row_stride);
      _tile_loadd(3, bias + matrix, row_stride);
    }
  } else {
    _tile_zero(0);
    _tile_zero(1);
    if constexpr (RowRegisters == 2) {
      _tile_zero(2);
      _tile_zero(3);
    }
  }
  for (int k = 0; k < depth; ++k) {
    simd::unroll<Parts>([&](auto i) NPT_LAMBDA_INLINE {
      _tile_loadd(4, weights, row_stride);
      if constexpr (RowRegisters == 2) _tile_loadd(5, weights + matrix, row_stride);
      simd::unroll<Parts - i>([&](auto j) NPT_LAMBDA_INLINE {
        const Word* x = operand + static_cast<std::size_t>(j) * part;
        _tile_loadd(6, x, stride);
        _tile_dpbf16ps(0, 4, 6);
        _tile_loadd(7, x + simd::matrix_words, stride);
        _tile_dpbf16ps(1, 4, 7);
        if constexpr (RowRegisters == 2) {
          _tile_dpbf16ps(2, 5, 6);
          _tile_dpbf16ps(3, 5, 7);
        }
      });
      weights += RowRegisters * matrix;
    });
    operand += lower;
  }
  _tile_stored(0, tile, stride);
  _tile_stored(1, tile + simd::matrix_words, stride);
  if constexpr (RowRegisters == 2) {
    _tile_stored(2, tile + lower, stride);
    _tile_stored(3, tile + lower + simd::matrix_words, stride);
  }
  asm volatile("" ::: "memory");
}

/// The kernel for a number of parts and of row registers.
inline AmxKernel amx_kernel_for(int parts, int row_registers) {
  static constexpr AmxKernel kernels[max_parts][2] = {{&amx_kernel<1, 1>, &amx_kernel<1, 2>},
                                                      {&amx_kernel<2, 1>, &amx_kernel<2, 2>},
                                                      {&amx_kernel<3, 1>, &amx_kernel<3, 2>}};
  return kernels[parts - 1][row_registers - 1];
}

#else

// Never called: there is no engine for it. It keeps code that names both products compiling.
inline AmxKernel amx_kernel_for(int, int) { return nullptr; }

#endif

/// Elements behind the last of several meshes' biases that the kernel may read: it takes 16 rows at a time.
inline constexpr std::size_t bias_slack = std::size_t{simd::matrix_rows} * simd::matrix_words;

/// Spreads biases [rows] in place to [rows][16], as the kernel takes them.
inline void spread_biases(float* biases, int rows) {
  for (int r = rows - 1; r >= 0; --r) {
    const float bias = biases[r];
    std::fill_n(biases + static_cast<std::size_t>(r) * simd::matrix_words, simd::matrix_words, bias);
  }
}

/// Weights of a product on matrix registers, with biases.
class AmxWeights {
 public:
  AmxWeights() = default;
  template <class Weight, class Bias>
  AmxWeights(int rows, int columns, int parts, Weight&& weight, Bias&& bias) {
    pack(rows, columns, parts, weight, bias);
  }

  /// weight(row, column) and bias(row) are called for every entry. Allocates nothing where the shape stays.
  template <class Weight, class Bias>
  void pack(int rows, int columns, int parts, Weight&& weight, Bias&& bias) {
    pack_rows(rows, columns, parts, bias, [&](int row, int first, int count, float* values) {
      for (int c = 0; c < count; ++c) values[c] = weight(row, first + c);
      return static_cast<const float*>(values);
    });
  }

  /// The same for a matrix in memory, whose rows are `stride` elements apart: several times as fast.
  template <class Bias>
  void pack_matrix(int rows, int columns, int parts, const float* from, std::size_t stride, Bias&& bias) {
    pack_rows(rows, columns, parts, bias, [&](int row, int first, int count, float* values) {
      const float* line = from + index(row) * stride + index(first);
      if (count == amx_columns) return line;
      std::copy_n(line, count, values);
      return static_cast<const float*>(values);
    });
  }

  int rows() const { return rows_; }
  int parts() const { return parts_; }
  int depth() const { return depth_; }
  static constexpr int tallest_block = amx_block_rows;
  static constexpr int rows_written = simd::matrix_rows;  ///< whose multiples the kernel writes
  static constexpr int bias_width = simd::matrix_words;   ///< values of a row's bias
  int block_count() const { return (rows_ + amx_block_rows - 1) / amx_block_rows; }
  int first_row(int block) const { return block * amx_block_rows; }
  int rows(int block) const { return std::min(amx_block_rows, rows_ - first_row(block)); }
  /// Matrix registers below each other that a block takes.
  int row_registers(int block) const { return rows(block) > simd::matrix_rows ? 2 : 1; }
  const Word* block(int b) const { return words_.data() + block_offset(b); }
  /// [rows][bias_width]; nullptr: all are zero.
  const float* bias() const { return biased_ ? bias_.data() : nullptr; }
  /// Of a row, in biases like these.
  static const float* bias_at(const float* biases, int row) {
    return biases == nullptr ? nullptr : biases + index(row) * bias_width;
  }
  std::size_t bytes() const { return words_.size() * sizeof(Word) + bias_.size() * sizeof(float); }
  /// Words of an operand for `panels` panels.
  std::size_t operand_words(int panels) const { return panel_words() * index(panels); }
  std::size_t panel_words() const { return part_words() * index(parts_); }
  std::size_t part_words() const { return index(depth_ * simd::matrix_rows) * panel_width<float>; }

 private:
  static constexpr std::size_t matrix = std::size_t{simd::matrix_rows} * simd::matrix_words;
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }
  std::size_t block_offset(int b) const { return index(first_row(b)) * index(depth_ * parts_) * simd::matrix_words; }
  /// read(row, first column, count, memory) gives `count` values of a row, wherever they lie; the rest of the memory is zero.
  template <class Bias, class Read>
  void pack_rows(int rows, int columns, int parts, Bias&& bias, Read&& read) {
    rows_ = rows;
    depth_ = amx_depth(columns);
    parts_ = parts;
    const int padded = (rows + simd::matrix_rows - 1) / simd::matrix_rows * simd::matrix_rows;
    words_.grow_to(index(padded) * index(depth_ * parts_) * simd::matrix_words);
    bias_.grow_to(index(padded) * bias_width);
    biased_ = false;
    for (int r = 0; r < padded; ++r) {
      bias_[index(r)] = r < rows ? bias(r) : 0.0F;
      biased_ = biased_ || bias_[index(r)] != 0;
    }
    spread_biases(bias_.data(), padded);
    alignas(simd_alignment) float values[amx_columns] = {};
    for (int k = 0; k < depth_; ++k) {
      const int first = k * amx_columns, count = std::min(amx_columns, columns - first);
      std::fill(values + count, values + amx_columns, 0.0F);
      for (int row = 0; row < padded; ++row) {
        const int b = row / amx_block_rows;
        const std::size_t registers = index(row_registers(b));
        Word* out = words_.data() + block_offset(b) + index(k * parts) * registers * matrix +
                    index(row - first_row(b)) * simd::matrix_words;
        if (row < rows)
          split_row(read(row, first, count, values), out, registers * matrix);
        else
          for (int p = 0; p < parts; ++p) std::fill_n(out + index(p) * registers * matrix, simd::matrix_words, Word{0});
      }
    }
  }

  void split_row(const float* values, Word* to, std::size_t part_stride) const {
    if constexpr (simd::has_bf16) {
      simd::Batch<float> front = simd::load_unaligned(values), back = simd::load_unaligned(values + simd::lanes<float>);
      for (int p = 0; p < parts_; ++p) {
        const simd::Batch<float> sequence = simd::bf16_sequence(front, back);
        simd::store_words(to + index(p) * part_stride, sequence);
        front -= simd::front_of_sequence(sequence);
        back -= simd::back_of_sequence(sequence);
      }
    }
  }

  int rows_ = 0, depth_ = 0, parts_ = 0;
  bool biased_ = false;
  AlignedBuffer<Word> words_;
  AlignedBuffer<float> bias_;
};

/// Splits `rows` channels of one panel [rows][panel_width]. `to` is where their first word stands in the first part; an odd last channel is
/// paired with zero. Gives the number of words.
inline int split_channels(const float* from, int rows, int parts, Word* to, std::size_t part_words) {
  constexpr int width = panel_width<float>;
  for (int c = 0; c < rows; c += 2, from += 2 * width, to += width)
    simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE {
      constexpr int lanes = simd::lanes<float>;
      simd::Batch<float> first = simd::load(from + q * lanes);
      simd::Batch<float> second = c + 1 < rows ? simd::load(from + width + q * lanes) : simd::broadcast(0.0F);
      for (int p = 0; p < parts; ++p) {
        const simd::Batch<float> pairs = simd::bf16_pairs(first, second);
        simd::store_words(to + q * lanes + static_cast<std::size_t>(p) * part_words, pairs);
        if (p + 1 == parts) break;
        first -= simd::first_of_pairs(pairs);
        second -= simd::second_of_pairs(pairs);
      }
    });
  return (rows + 1) / 2;
}

/// Zeros behind an operand's last word, in every part.
inline void end_channels(Word* panel, int words, int parts, std::size_t part_words) {
  for (int p = 0; p < parts; ++p) {
    Word* part = panel + static_cast<std::size_t>(p) * part_words;
    std::fill(part + static_cast<std::size_t>(words) * panel_width<float>, part + part_words, Word{0});
  }
}

}  // namespace npt::inline NPT_ABI::kernel
