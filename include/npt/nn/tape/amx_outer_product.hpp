/// Products that sum over the vertices on matrix registers (AMX): what outer_product.hpp computes, of values in
/// bfloat16 parts (amx_product.hpp); of one part without matrix registers too (nn/kernel/word_kernel.hpp).
///   out[r][k] += sum over v of a[r][v] * b[k][v]
/// Rows of `a` need no transposition: vertices lie side by side in a tile, and so they do in the matrix register on the
/// left. Those of `b` are transposed as words of two vertices, half of what single values would take.
///
/// Layouts, in words of two vertices' values, by blocks of 32 vertices (one panel):
///   a       [16 rows][block][part][16][16], words along the vertices
///   b       [16 columns][block][part][16][16], words along the columns
///   result  [16 rows][16 columns][16][16], fp32
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/amx_product.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/word_kernel.hpp>
#include <npt/nn/simd/amx.hpp>
#include <npt/nn/simd/batch.hpp>
#include <npt/nn/simd/bf16.hpp>
#include <npt/nn/simd/transpose.hpp>
#include <npt/nn/tape/outer_product.hpp>

#include <algorithm>
#include <cstddef>

namespace npt::inline NPT_ABI::tape {

/// Shape and memory layout of an outer product on matrix registers.
struct AmxOuterShape {
  int rows = 0, columns = 0;
  int parts = 1;
  int blocks = 0;  ///< of 32 vertices that are collected before they are multiplied

  /// The shape with as many blocks as keep both operands inside the second-level cache beside the tiles they come from.
  static AmxOuterShape of(int rows, int columns, int parts) {
    constexpr int budget = 768 * 1024, group_blocks = kernel::group_panels<float>, most_groups = 4;
    AmxOuterShape shape{rows, columns, parts, group_blocks};
    const std::size_t group = (shape.a_size() + shape.b_size()) * sizeof(kernel::Word);
    shape.blocks *= std::clamp(static_cast<int>(budget / group), 1, most_groups);
    return shape;
  }

  static constexpr int width = simd::matrix_words;
  /// Columns that stand side by side in the result, by panel, and the first of them.
  static constexpr int panel_columns(int) { return width; }
  static constexpr int first_column(int panel) { return panel * width; }
  int panels() const { return (columns + width - 1) / width; }
  int row_registers() const { return (rows + simd::matrix_rows - 1) / simd::matrix_rows; }
  /// Elements of the result.
  std::size_t result_size() const { return index(row_registers() * panels()) * kernel::matrix_size; }
  /// The result's element (r, k).
  std::size_t at(int r, int k) const {
    return index((r / simd::matrix_rows) * panels() + k / width) * kernel::matrix_size +
           index(r % simd::matrix_rows * width) + index(k % width);
  }
  /// Words of the collected operands.
  std::size_t a_size() const { return index(row_registers()) * line(); }
  std::size_t b_size() const { return index(panels()) * line(); }
  static constexpr std::size_t collected_values() { return 0; }
  std::size_t collected_words() const { return a_size() + b_size(); }
  static constexpr bool overwrites = true;
  std::size_t line() const { return index(blocks * parts) * kernel::matrix_size; }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }
};

/// Collects tiles of both operands and sums their products up as OuterProduct does, but the first product overwrites
/// the result. The caller holds simd::MatrixRegisters where there are some.
class AmxOuterProduct {
 public:
  AmxOuterProduct(const AmxOuterShape& shape, kernel::Word* a, kernel::Word* b, float* result)
      : shape_(shape), a_(a), b_(b), result_(result) {}

  bool full() const { return collected_ + kernel::group_panels<float> > shape_.blocks; }

  /// First the group's b tile [panel][columns][panel_width], then its a tile. Row `ones` of b, behind those of its
  /// tile, is 1 everywhere: the product's column for it is the sum of a.
  void collect_b(const float* tile, int tile_rows, int ones, int valid) {
    alignas(simd_alignment) kernel::Word lines[kernel::max_parts][kernel::matrix_size];
    for (int p = 0; p < kernel::used_panels<float>(valid); ++p)
      for (int c = 0; c < shape_.panels(); ++c) {
        for (int r = 0; r < simd::matrix_rows; ++r) {
          const int row = c * simd::matrix_rows + r;
          const float* from =
              tile + kernel::panel_stride<float>(tile_rows) * index(p) + index(row) * kernel::panel_width<float>;
          const simd::Batch<float> zero = simd::broadcast(0.0F), one = simd::broadcast(1.0F);
          const bool read = row < tile_rows;
          const simd::Batch<float> other = row == ones ? one : zero;
          split(read ? simd::load(from) : other, read ? simd::load(from + simd::lanes<float>) : other,
                valid - p * kernel::panel_width<float>, lines[0] + r * simd::matrix_words, kernel::matrix_size);
        }
        kernel::Word* to = b_ + index(c) * shape_.line() + index((collected_ + p) * shape_.parts) * kernel::matrix_size;
        for (int part = 0; part < shape_.parts; ++part)
          simd::transpose(reinterpret_cast<const float*>(lines[part]), simd::matrix_words,
                          reinterpret_cast<float*>(to + index(part) * kernel::matrix_size), simd::matrix_words);
      }
  }
  void collect_a(const float* tile, int tile_rows, int valid) {
    const int panels = kernel::used_panels<float>(valid);
    for (int p = 0; p < panels; ++p)
      for (int row = 0; row < shape_.row_registers() * simd::matrix_rows; ++row) {
        const float* from =
            tile + kernel::panel_stride<float>(tile_rows) * index(p) + index(row) * kernel::panel_width<float>;
        const simd::Batch<float> zero = simd::broadcast(0.0F);
        const bool read = row < shape_.rows;
        split(read ? simd::load(from) : zero, read ? simd::load(from + simd::lanes<float>) : zero,
              valid - p * kernel::panel_width<float>,
              a_ + index(row / simd::matrix_rows) * shape_.line() +
                  index((collected_ + p) * shape_.parts) * kernel::matrix_size +
                  index(row % simd::matrix_rows * simd::matrix_words),
              kernel::matrix_size);
      }
    collected_ += panels;
  }

  void multiply() {
    for (int c = 0; c < shape_.panels(); c += 2)
      for (int r = 0; r < shape_.row_registers(); r += 2) {
        const bool two_rows = r + 1 < shape_.row_registers(), two_columns = c + 1 < shape_.panels();
        if (two_rows && two_columns)
          add_parts<2, 2>(r, c);
        else if (two_rows)
          add_parts<2, 1>(r, c);
        else if (two_columns)
          add_parts<1, 2>(r, c);
        else
          add_parts<1, 1>(r, c);
      }
    collected_ = 0;
    adds_ = true;
  }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  /// Values of 32 vertices, those from `valid` on as zeros, to 16 words a part: number i holds vertices i and 16 + i.
  void split(simd::Batch<float> front, simd::Batch<float> back, int valid, kernel::Word* to,
             std::size_t part_stride) const {
    if (valid < kernel::panel_width<float>) {
      const simd::Batch<float> zero = simd::broadcast(0.0F);
      front = simd::keep_first(front, 0, valid, zero);
      back = simd::keep_first(back, simd::lanes<float>, valid, zero);
    }
    kernel::split_pair(shape_.parts, front, back, to, part_stride);
  }

  template <int Rows, int Columns>
  void add_parts(int r, int c) const {
    static_assert(kernel::max_parts == 3);
    if (!simd::has_matrix_registers()) {
      if constexpr (kernel::has_word_kernel) add_words<Rows, Columns>(r, c);
      return;
    }
    if (shape_.parts == 1)
      add<Rows, Columns, 1>(r, c);
    else if (shape_.parts == 2)
      add<Rows, Columns, 2>(r, c);
    else
      add<Rows, Columns, 3>(r, c);
  }

  /// As add(), of one part, in vector registers.
  template <int Rows, int Columns>
  NPT_NOINLINE void add_words(int r, int c) const {
    for (int first = 0; first < Rows * simd::matrix_rows; first += kernel::word_strip) {
      const int row = r * simd::matrix_rows + first;
      const kernel::Word *a = a_ + index(row / simd::matrix_rows) * shape_.line() +
                              index(row % simd::matrix_rows * simd::matrix_words),
                         *b = b_ + index(c) * shape_.line();
      float* out = result_ + shape_.at(row, c * AmxOuterShape::width);
      kernel::WordSums<Columns> sums;
      simd::unroll<kernel::word_strip>([&](auto i) NPT_LAMBDA_INLINE {
        simd::unroll<Columns>([&](auto k) NPT_LAMBDA_INLINE {
          sums.at[i][k] =
              adds_ ? simd::load(out + k * kernel::matrix_size + i * simd::matrix_words) : simd::broadcast(0.0F);
        });
      });
      for (int v = 0; v < collected_; ++v, a += kernel::matrix_size, b += kernel::matrix_size)
        sums.add(a, b, shape_.line());
      simd::unroll<kernel::word_strip>([&](auto i) NPT_LAMBDA_INLINE {
        simd::unroll<Columns>([&](auto k) NPT_LAMBDA_INLINE {
          simd::store(out + k * kernel::matrix_size + i * simd::matrix_words, sums.at[i][k]);
        });
      });
    }
  }

  template <int Rows, int Columns, int Parts>
  NPT_NOINLINE void add(int r, int c) const {
#if NPT_HAS_AMX
    constexpr int stride = simd::matrix_words * static_cast<int>(sizeof(kernel::Word));
    float* out = result_ + shape_.at(r * simd::matrix_rows, c * AmxOuterShape::width);
    float* lower = Rows == 2 ? out + index(shape_.panels()) * kernel::matrix_size : nullptr;
    const kernel::Word *a = a_ + index(r) * shape_.line(), *b = b_ + index(c) * shape_.line();
    const std::size_t line = shape_.line();
    asm volatile("" ::: "memory");  // g++ doesn't know that loading a matrix register reads memory
    if (adds_) {
      _tile_loadd(0, out, stride);
      if constexpr (Columns == 2) _tile_loadd(1, out + kernel::matrix_size, stride);
      if constexpr (Rows == 2) _tile_loadd(2, lower, stride);
      if constexpr (Rows == 2 && Columns == 2) _tile_loadd(3, lower + kernel::matrix_size, stride);
    } else {
      _tile_zero(0);
      _tile_zero(1);
      _tile_zero(2);
      _tile_zero(3);
    }
    for (int v = 0; v < collected_; ++v) {
      kernel::for_each_part_pair<Parts>([&](auto i, auto j, auto new_a, auto new_b) NPT_LAMBDA_INLINE {
        if constexpr (new_a) {
          _tile_loadd(4, a + i * kernel::matrix_size, stride);
          if constexpr (Rows == 2) _tile_loadd(5, a + line + i * kernel::matrix_size, stride);
        }
        if constexpr (new_b) {
          _tile_loadd(6, b + j * kernel::matrix_size, stride);
          if constexpr (Columns == 2) _tile_loadd(7, b + line + j * kernel::matrix_size, stride);
        }
        _tile_dpbf16ps(0, 4, 6);
        if constexpr (Columns == 2) _tile_dpbf16ps(1, 4, 7);
        if constexpr (Rows == 2) _tile_dpbf16ps(2, 5, 6);
        if constexpr (Rows == 2 && Columns == 2) _tile_dpbf16ps(3, 5, 7);
      });
      a += Parts * kernel::matrix_size;
      b += Parts * kernel::matrix_size;
    }
    _tile_stored(0, out, stride);
    if constexpr (Columns == 2) _tile_stored(1, out + kernel::matrix_size, stride);
    if constexpr (Rows == 2) _tile_stored(2, lower, stride);
    if constexpr (Rows == 2 && Columns == 2) _tile_stored(3, lower + kernel::matrix_size, stride);
    asm volatile("" ::: "memory");
#else
    static_cast<void>(r + c);
    static_cast<void>(result_);
#endif
  }

  AmxOuterShape shape_;
  kernel::Word* a_;
  kernel::Word* b_;
  float* result_;
  int collected_ = 0;  ///< blocks
  bool adds_ = false;  ///< to the result, which holds something
};

inline AmxOuterProduct make_outer_product(const AmxOuterShape& shape, float*, kernel::Word* words, float* result) {
  return AmxOuterProduct(shape, words, words + shape.a_size(), result);
}

}  // namespace npt::inline NPT_ABI::tape
