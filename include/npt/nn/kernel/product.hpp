/// A product of packed weights with an operand, on whichever unit multiplies: one class for all, so that nothing
/// outside this header and the making of operands asks which.
///   T or pairs   weights and operand in T (packed_weights.hpp), or as pairs of bfloat16 values (AVX512_BF16)
///   parts        fp32 values in one to three bfloat16 parts, on matrix registers (AMX, amx_product.hpp); of one part
///                vector registers multiply in the same layout where there are none (word_kernel.hpp)
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/kernel/amx_operand.hpp>
#include <npt/nn/kernel/amx_product.hpp>
#include <npt/nn/kernel/micro_kernel.hpp>
#include <npt/nn/kernel/packed_weights.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/word_kernel.hpp>
#include <npt/nn/simd/amx.hpp>
#include <npt/nn/simd/bf16.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <type_traits>

namespace npt::inline NPT_ABI::kernel {

/// What a product's factors are.
struct ProductFormat {
  bool pairs = false;  ///< pairs of bfloat16 values in vector registers; else T there
  int parts = 0;       ///< bfloat16 parts of a value, laid out for matrix registers; 0: T or pairs

  /// Whether products of T may have parts in this build.
  template <class T>
  static constexpr bool has_parts = std::is_same_v<T, float> && (NPT_HAS_AMX != 0 || has_word_kernel);
  /// Several: only matrix registers gain by them. Engines without those take pairs instead of one part.
  template <class T>
  static constexpr bool has_several_parts = std::is_same_v<T, float>&& NPT_HAS_AMX != 0;
};

/// M x K weights and M biases, packed for a format.
template <class T>
class ProductWeights {
 public:
  ProductWeights() = default;

  /// weight(row, column) and bias(row) are called for every entry; pairs need an even number of columns. Allocates
  /// nothing where shape and format stay.
  template <class Weight, class Bias>
  void pack(int rows, int columns, ProductFormat format, Weight&& weight, Bias&& bias) {
    format_ = format;
    if constexpr (matrix) {
      if (format.parts > 0) {
        matrix_.pack(rows, columns, format.parts, weight, bias);
        return;
      }
    }
    if constexpr (std::is_same_v<T, float> && simd::has_bf16) {
      if (format.pairs) {
        vector_.pack(
            rows, columns / 2,
            [&](int row, int step) { return simd::bf16_pair(weight(row, 2 * step), weight(row, 2 * step + 1)); }, bias);
        return;
      }
    }
    vector_.pack(rows, columns, weight, bias);
  }

  /// Packs a matrix in memory, whose rows are `stride` elements apart: several times as fast for parts.
  template <class Bias>
  void pack_matrix(int rows, int columns, ProductFormat format, const T* from, std::size_t stride, Bias&& bias) {
    if constexpr (matrix) {
      if (format.parts > 0) {
        format_ = format;
        matrix_.pack_matrix(rows, columns, format.parts, from, stride, bias);
        return;
      }
    }
    pack(
        rows, columns, format,
        [&](int row, int column) {
          return from[static_cast<std::size_t>(row) * stride + static_cast<std::size_t>(column)];
        },
        bias);
  }

  ProductFormat format() const { return format_; }
  bool in_parts() const { return matrix && format_.parts > 0; }
  /// For making operands.
  const AmxWeights& part_weights() const { return matrix_; }
  /// Rows of the operand's tile for T or pairs.
  int steps() const { return vector_.k_count(); }

  /// Most rows of a block.
  static constexpr int tallest_block =
      ProductFormat::has_parts<T> ? std::max(max_tile_rows, amx_block_rows) : max_tile_rows;
  int block_count() const { return in_parts() ? matrix_.block_count() : vector_.block_count(); }
  int first_row(int block) const { return in_parts() ? matrix_.first_row(block) : vector_.first_row(block); }
  int rows(int block) const { return in_parts() ? matrix_.rows(block) : vector_.rows(block); }
  /// Whether a product writes no rows behind those of the block.
  bool writes_exactly(int block) const { return !in_parts() || matrix_.writes_exactly(block); }
  /// Whether all rows of one panel should come before the next panel.
  bool panel_by_panel() const { return in_parts() && matrix_.panel_by_panel(); }

  /// May be nullptr where all are zero.
  const T* bias() const {
    if constexpr (matrix)
      if (in_parts()) return matrix_.bias();
    return vector_.bias();
  }
  /// The bias of a row.
  T bias(int row) const {
    const T* bias = bias_at(this->bias(), row);
    return bias == nullptr ? T(0) : *bias;
  }
  /// The bias of a row in biases that are laid out as a product reads them: bias_width() elements a row, bias_slack
  /// behind the last.
  const T* bias_at(const T* biases, int row) const {
    if constexpr (matrix)
      if (in_parts()) return AmxWeights::bias_at(biases, row);
    return PackedWeights<T>::bias_at(biases, row);
  }
  int bias_width() const { return in_parts() ? AmxWeights::bias_width : 1; }
  /// Lays out biases [rows] so, in place.
  void lay_out_biases(T* biases, int rows) const {
    if constexpr (matrix)
      if (in_parts()) spread_biases(biases, rows);
  }

  /// Words of an operand in parts for `panels` panels, and elements that it keeps in T.
  std::size_t operand_words(int panels) const { return in_parts() ? matrix_.operand_words(panels) : 0; }
  std::size_t operand_values() const { return in_parts() ? tile_size(matrix_.value_rows()) : 0; }
  std::size_t bytes() const { return vector_.bytes() + matrix_.bytes(); }

  /// tile[rows(block)][panel_width] = bias + weights * operand for one block and one panel, which lies at `panel` for
  /// T or pairs and in `words` for parts. `bias`: of the block's first row.
  void multiply(int block, const T* panel, const AmxOperand& words, const T* bias, T* tile) const {
    if constexpr (matrix) {
      if (in_parts()) {
        matrix_.multiply(block, words, bias, tile);
        return;
      }
    }
    const int height = vector_.rows(block);
    if constexpr (std::is_same_v<T, float>)
      if (format_.pairs) {
        micro_kernel_of<T, Product::bf16_pairs>(height)(vector_.k_count(), vector_.block(block), panel, bias, tile);
        return;
      }
    micro_kernel_of<T>(height)(vector_.k_count(), vector_.block(block), panel, bias, tile);
  }

 private:
  static constexpr bool matrix = ProductFormat::has_parts<T>;

  ProductFormat format_;
  PackedWeights<T> vector_;
  AmxWeights matrix_;
};

/// The unit that multiplies in a format is this thread's to the end of the scope. Not nested.
class ProductScope {
 public:
  explicit ProductScope(ProductFormat format) {
    if (format.parts > 0 && simd::has_matrix_registers()) registers_.emplace();
  }

 private:
  std::optional<simd::MatrixRegisters> registers_;
};

/// Weights and an operand of one group of vertices. The caller holds a ProductScope.
template <class T>
class GroupProduct {
 public:
  /// The operand comes by set_operand or set_panel.
  explicit GroupProduct(const ProductWeights<T>& weights) : weights_(weights) {}
  /// The operand is a tile in T with as many channels as the weights have columns and `valid` vertices. `words`: memory
  /// for it in parts.
  GroupProduct(const ProductWeights<T>& weights, const T* tile, int valid, Word* words)
      : weights_(weights), tile_(tile) {
    if constexpr (ProductFormat::has_parts<T>) {
      if (!weights.in_parts()) return;
      const AmxWeights& amx = weights.part_weights();
      for (int p = 0; p < used_panels<T>(valid); ++p)
        panels_[index(p)] = split_panel(amx, tile + panel_stride<T>(amx.columns()) * index(p),
                                        valid - p * panel_width<T>, words + amx.panel_words() * index(p));
    }
  }

  /// For T or pairs: the tile, in the weights' format.
  void set_operand(const T* tile) { tile_ = tile; }
  /// For parts.
  void set_panel(int panel, const AmxOperand& operand) { panels_[index(panel)] = operand; }

  /// A block's rows of a panel, [rows(block)][panel_width], and up to tallest_block rows where it doesn't write
  /// exactly.
  void multiply(int block, int panel, const T* bias, T* to) const {
    const T* at = weights_.in_parts() ? nullptr : tile_ + panel_stride<T>(weights_.steps()) * index(panel);
    weights_.multiply(block, at, panels_[index(panel)], bias, to);
  }
  /// No more than the block's rows.
  void multiply_exactly(int block, int panel, const T* bias, T* to) const {
    if (weights_.writes_exactly(block)) {
      multiply(block, panel, bias, to);
      return;
    }
    alignas(simd_alignment) T raw[index(ProductWeights<T>::tallest_block) * panel_width<T>];
    multiply(block, panel, bias, raw);
    std::copy_n(raw, index(weights_.rows(block)) * panel_width<T>, to);
  }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  const ProductWeights<T>& weights_;
  const T* tile_ = nullptr;
  std::array<AmxOperand, index(group_panels<T>)> panels_;
};

}  // namespace npt::inline NPT_ABI::kernel
