/// The matrix product on matrix registers (AMX), for fp32 values that are split into one, two or three bfloat16 parts.
/// Of one part also where vector registers alone multiply bfloat16 pairs (word_kernel.hpp), as training needs it.
///
///   x = x1 + x2 + ...       each part the bfloat16 next to what the parts before it leave over
///   w x ~ sum of wi xj      over i + j <= parts + 1: 1, 3 or 6 products, smallest terms left out
///
/// Every bfloat16 product is exact in fp32, in which the sums run. One part keeps 8 bits of the operands, two 16, three
/// all 24: the error of three parts is that of a product in fp32.
///
/// Matrix registers take 32 columns and 16 rows at a time. A few more of either (131 = 128 + 3, 65 = 64 + 1) are left
/// to few_columns.hpp and few_rows.hpp, in fp32.
///
/// Layouts, in 32-bit words of two bfloat16 values:
///   weights  [block of 32 rows][32 columns][part, the last first][16 rows][16 words], words along the columns
///   operand  [panel][32 channels][part][half of the panel][16 words][16 vertices], words along the channels
///   bias     [rows][16], each value 16 times
/// with zeros behind columns, channels and rows. The result is a tile as everywhere (panel.hpp).
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/kernel/amx_kernel.hpp>
#include <npt/nn/kernel/amx_operand.hpp>
#include <npt/nn/kernel/few_columns.hpp>
#include <npt/nn/kernel/few_rows.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/word_kernel.hpp>
#include <npt/nn/simd/amx.hpp>
#include <npt/nn/simd/batch.hpp>
#include <npt/nn/simd/bf16.hpp>

#include <algorithm>
#include <cstddef>
#include <type_traits>

namespace npt::inline NPT_ABI::kernel {

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

  /// Packs a matrix in memory, whose rows are `stride` elements apart: several times as fast as entry by entry.
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
  int columns() const { return columns_; }
  int parts() const { return parts_; }
  /// Columns whose channels the operand holds as words: all, or all but a few.
  int word_columns() const { return std::min(columns_, depth_ * amx_columns); }
  int few_columns() const { return columns_ - word_columns(); }
  /// Whether the last block reads AmxOperand::values.
  bool reads_values() const { return few_rows_ > 0; }
  /// Where an operand's values are kept that is made a few channels at a time: rows of memory
  /// [value_rows()][panel_width], and the one for a column. Up to `value_strip` columns may be written there before
  /// they become words; those that nobody reads later are overwritten.
  static constexpr int value_strip = 4 * amx_columns;
  int value_rows() const { return reads_values() ? columns_ : value_strip + few_columns(); }
  int value_row(int column) const {
    if (reads_values()) return column;
    return column < word_columns() ? 0 : value_strip + column - word_columns();
  }
  static constexpr int tallest_block = amx_block_rows;
  static constexpr int bias_width = simd::matrix_words;  ///< values of a row's bias
  int block_count() const { return amx_blocks() + (few_rows_ > 0 ? 1 : 0); }
  int first_row(int block) const { return std::min(block * amx_block_rows, amx_rows()); }
  int rows(int block) const {
    return block < amx_blocks() ? std::min(amx_block_rows, amx_rows() - first_row(block)) : few_rows_;
  }
  /// Whether multiply() writes no rows behind those of the block.
  bool writes_exactly(int block) const { return block == amx_blocks() || rows(block) % simd::matrix_rows == 0; }
  /// Whether all rows of one panel should come before the next panel: its operand stays in the first-level cache, while
  /// the weights, which must fit the second, pass by for every panel. Otherwise they pass by once for all panels.
  bool panel_by_panel() const { return words_.size() * sizeof(Word) <= most_passing_bytes; }
  /// [rows][bias_width]; nullptr: all are zero.
  const float* bias() const { return biased_ ? bias_.data() : nullptr; }
  /// The bias of a row in biases that are laid out like bias().
  static const float* bias_at(const float* biases, int row) {
    return biases == nullptr ? nullptr : biases + index(row) * bias_width;
  }
  std::size_t bytes() const {
    return words_.size() * sizeof(Word) + (bias_.size() + column_weights_.size() + row_weights_.size()) * sizeof(float);
  }
  /// Words of an operand for `panels` panels.
  std::size_t operand_words(int panels) const { return panel_words() * index(panels); }
  std::size_t panel_words() const { return index(depth_ * parts_) * 2 * matrix_size; }

  /// tile[rows(block)][panel_width] = bias + weights * operand for one block and one panel; anything finite in a half
  /// that isn't used. `bias`: of the block's first row, or nullptr; whole matrix registers of it are read. The caller
  /// holds simd::MatrixRegisters. A template, as split_channels is, so that only units that use it compile the kernels.
  template <class T>
  void multiply(int block, const AmxOperand& operand, const T* bias, T* tile) const {
    static_assert(std::is_same_v<T, float>);
    if (block == amx_blocks()) {
      multiply_few_rows(few_rows_, columns_, row_weights_.data(), operand.values, bias, bias_width, tile);
      return;
    }
    amx_kernel_for(parts_, row_registers(block), operand.halves)(depth_, words_.data() + block_offset(block),
                                                                 operand.words, bias, tile);
    if (few_columns() > 0)
      add_few_columns(few_columns(), rows(block), column_weights_.data() + index(first_row(block) * few_columns()),
                      operand.few, tile);
  }

 private:
  static constexpr std::size_t most_passing_bytes = 512 * 1024;
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  /// Rows that matrix registers compute, and their blocks.
  int amx_rows() const { return rows_ - few_rows_; }
  int amx_blocks() const { return (amx_rows() + amx_block_rows - 1) / amx_block_rows; }
  /// Matrix registers below each other that a block takes.
  int row_registers(int block) const { return rows(block) > simd::matrix_rows ? 2 : 1; }
  std::size_t block_offset(int b) const { return index(first_row(b)) * index(depth_ * parts_) * simd::matrix_words; }

  /// read(row, first column, count, memory) gives `count` values of a row, wherever they lie; the rest of the memory is
  /// zero.
  template <class Bias, class Read>
  void pack_rows(int rows, int columns, int parts, Bias&& bias, Read&& read) {
    rows_ = rows;
    columns_ = columns;
    parts_ = parts;
    const int over = columns % amx_columns, rows_over = rows % simd::matrix_rows;
    depth_ = columns / amx_columns + (over > most_few_columns ? 1 : 0);
    few_rows_ = rows_over <= most_few_rows && columns <= most_value_columns ? rows_over : 0;
    const int padded = (amx_rows() + simd::matrix_rows - 1) / simd::matrix_rows * simd::matrix_rows;
    words_.grow_to(index(padded) * index(depth_ * parts_) * simd::matrix_words);
    bias_.grow_to(index(padded + simd::matrix_rows) * bias_width);
    biased_ = false;
    for (int r = 0; r < padded + few_rows_; ++r) {
      bias_[index(r)] = r < rows ? bias(r) : 0.0F;
      biased_ = biased_ || bias_[index(r)] != 0;
    }
    spread_biases(bias_.data(), padded + few_rows_);
    alignas(simd_alignment) float values[amx_columns] = {};
    for (int k = 0; k < depth_; ++k) {
      const int first = k * amx_columns, count = std::min(amx_columns, columns - first);
      std::fill(values + count, values + amx_columns, 0.0F);
      for (int row = 0; row < padded; ++row) {
        const int b = row / amx_block_rows;
        const std::size_t registers = index(row_registers(b));
        Word* out = words_.data() + block_offset(b) + index(k * parts) * registers * matrix_size +
                    index(row - first_row(b)) * simd::matrix_words;
        if (row < rows)
          split_row(read(row, first, count, values), out, registers * matrix_size);
        else
          for (int p = 0; p < parts; ++p)
            std::fill_n(out + index(p) * registers * matrix_size, simd::matrix_words, Word{0});
      }
    }
    pack_few(values, read);
  }

  /// What matrix registers don't compute, in fp32: [rows][few columns] and [columns][few rows].
  template <class Read>
  void pack_few(float* values, Read&& read) {
    const int few = few_columns();
    column_weights_.grow_to(index(amx_rows() * few));
    for (int row = 0; few > 0 && row < amx_rows(); ++row)
      std::copy_n(read(row, word_columns(), few, values), few, column_weights_.data() + index(row * few));
    row_weights_.grow_to(index(columns_ * few_rows_));
    for (int r = 0; r < few_rows_; ++r)
      for (int first = 0; first < columns_; first += amx_columns) {
        const int count = std::min(amx_columns, columns_ - first);
        const float* line = read(amx_rows() + r, first, count, values);
        for (int c = 0; c < count; ++c) row_weights_[index((first + c) * few_rows_ + r)] = line[c];
      }
  }

  void split_row(const float* values, Word* to, std::size_t part_stride) const {
    if constexpr (simd::has_bf16) {
      simd::Batch<float> front = simd::load_unaligned(values), back = simd::load_unaligned(values + simd::lanes<float>);
      for (int p = 0; p < parts_; ++p) {
        const simd::Batch<float> sequence = simd::bf16_sequence(front, back);
        simd::store_words(to + index(parts_ - 1 - p) * part_stride, sequence);
        front -= simd::front_of_sequence(sequence);
        back -= simd::back_of_sequence(sequence);
      }
    }
  }

  int rows_ = 0, columns_ = 0, depth_ = 0, parts_ = 0;
  int few_rows_ = 0;  ///< behind those that matrix registers compute
  bool biased_ = false;
  AlignedBuffer<Word> words_;
  AlignedBuffer<float> bias_;
  AlignedBuffer<float> column_weights_, row_weights_;
};

/// A panel [weights.columns()][panel_width] with `valid` vertices as an operand; its words go to `words`.
template <class T>
AmxOperand split_panel(const AmxWeights& weights, const T* values, int valid, Word* words) {
  const int used = split_channels(values, weights.word_columns(), weights.parts(), words, 0);
  end_channels(words, used, weights.parts());
  return {words, values, values + static_cast<std::size_t>(weights.word_columns()) * panel_width<float>,
          used_halves(valid)};
}

}  // namespace npt::inline NPT_ABI::kernel
