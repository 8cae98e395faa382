/// A weight matrix laid out for the micro-kernel: blocks of rows, each [K][rows].
///
/// The M rows are split into the fewest blocks that the registers allow, of heights that differ by at most one: no
/// row is wasted at any width (with 13 rows at most, 1027 = 79 x 13, 513 = 33 x 13 + 7 x 12, 257 = 17 x 13 + 3 x 12).
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/kernel/micro_kernel.hpp>

#include <cstddef>

namespace npt::inline NPT_ABI::kernel {

/// Heights of the row blocks of an M-row matrix.
struct RowBlocks {
  int count = 0;
  int height = 0;  ///< of the first `taller` blocks; the others have one row less
  int taller = 0;

  static constexpr RowBlocks of(int rows) {
    RowBlocks b;
    b.count = (rows + max_tile_rows - 1) / max_tile_rows;
    b.height = (rows + b.count - 1) / b.count;
    b.taller = rows - b.count * (b.height - 1);
    return b;
  }
  constexpr int first_row(int block) const { return block * height - (block > taller ? block - taller : 0); }
  constexpr int rows(int block) const { return block < taller ? height : height - 1; }
};

/// M x K weights and M biases, packed.
template <class T>
class PackedWeights {
 public:
  PackedWeights() = default;

  /// weight(row, k) and bias(row) are called for every entry.
  template <class Weight, class Bias>
  PackedWeights(int rows, int k_count, Weight&& weight, Bias&& bias) {
    pack(rows, k_count, weight, bias);
  }

  /// Packs other weights. Allocates nothing where the shape stays.
  template <class Weight, class Bias>
  void pack(int rows, int k_count, Weight&& weight, Bias&& bias) {
    rows_ = rows;
    k_count_ = k_count;
    blocks_ = RowBlocks::of(rows);
    weights_.grow_to(static_cast<std::size_t>(rows) * static_cast<std::size_t>(k_count));
    bias_.grow_to(static_cast<std::size_t>(rows));
    T* out = weights_.data();
    for (int b = 0; b < blocks_.count; ++b)
      for (int k = 0; k < k_count; ++k)
        for (int r = 0; r < blocks_.rows(b); ++r) *out++ = weight(blocks_.first_row(b) + r, k);
    for (int r = 0; r < rows; ++r) bias_[static_cast<std::size_t>(r)] = bias(r);
  }

  int rows() const { return rows_; }
  int k_count() const { return k_count_; }
  const RowBlocks& blocks() const { return blocks_; }
  static constexpr int tallest_block = max_tile_rows;
  /// Whether the kernel writes no rows behind those of the block.
  static constexpr bool writes_exactly(int) { return true; }
  int block_count() const { return blocks_.count; }
  int first_row(int block) const { return blocks_.first_row(block); }
  int rows(int block) const { return blocks_.rows(block); }
  const T* block(int b) const {
    return weights_.data() + static_cast<std::size_t>(blocks_.first_row(b)) * static_cast<std::size_t>(k_count_);
  }
  const T* bias() const { return bias_.data(); }
  /// The bias of a row in biases that are laid out like bias().
  static const T* bias_at(const T* biases, int row) { return biases + row; }
  std::size_t bytes() const { return (weights_.size() + bias_.size()) * sizeof(T); }

 private:
  int rows_ = 0;
  int k_count_ = 0;
  RowBlocks blocks_;
  AlignedBuffer<T> weights_;
  AlignedBuffer<T> bias_;
};

}  // namespace npt::inline NPT_ABI::kernel
