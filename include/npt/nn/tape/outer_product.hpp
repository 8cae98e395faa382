/// Products that sum over the vertices: the gradient of a convolution's weights,
///   out[r][k] += sum over v of a[r][v] * b[k][v]
/// Both operands come as tiles, are transposed a register block at a time and collected for some groups of vertices;
/// then the same kind of register tile as in the forward product runs over them: `rows` of a broadcast, columns of b in
/// registers.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/kernel/amx_kernel.hpp>
#include <npt/nn/kernel/packed_weights.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/simd/batch.hpp>
#include <npt/nn/simd/transpose.hpp>

#include <array>
#include <cstddef>
#include <utility>

namespace npt::inline NPT_ABI::tape {

/// tile[r][q] += sum over v of a[v][r] * b[v][q], for MR rows and Registers registers of columns.
template <class T>
using OuterKernel = void (*)(int vertices, const T* a, const T* b, T* tile);

template <class T, int MR, int Registers>
NPT_NOINLINE void outer_kernel(int vertices, const T* NPT_RESTRICT a, const T* NPT_RESTRICT b, T* NPT_RESTRICT tile) {
  constexpr int lanes = simd::lanes<T>;
  // The tile lies in the third-level cache or further: asked for now, needed at the end.
  simd::unroll<MR * Registers>(
      [&](auto i) NPT_LAMBDA_INLINE { simd::prefetch_to_first_level(tile + static_cast<int>(i) * lanes); });
  simd::Batch<T> sum[static_cast<std::size_t>(MR)][static_cast<std::size_t>(Registers)];
  simd::unroll<MR>([&](auto r) NPT_LAMBDA_INLINE {
    simd::unroll<Registers>([&](auto q) NPT_LAMBDA_INLINE { sum[r][q] = simd::broadcast(T(0)); });
  });
  for (int v = 0; v < vertices; ++v) {
    simd::Batch<T> x[static_cast<std::size_t>(Registers)];
    simd::unroll<Registers>([&](auto q) NPT_LAMBDA_INLINE { x[q] = simd::load(b + q * lanes); });
    simd::unroll<MR>([&](auto r) NPT_LAMBDA_INLINE {
      const simd::Batch<T> w = simd::broadcast(a[r]);
      simd::unroll<Registers>([&](auto q) NPT_LAMBDA_INLINE { sum[r][q] = simd::fma(w, x[q], sum[r][q]); });
    });
    a += MR;
    b += Registers * lanes;
  }
  simd::unroll<MR>([&](auto r) NPT_LAMBDA_INLINE {
    simd::unroll<Registers>([&](auto q) NPT_LAMBDA_INLINE {
      T* to = tile + (r * Registers + q) * lanes;
      simd::store(to, simd::load(to) + sum[r][q]);
    });
  });
}

/// The outer kernel of a tile's height, 1 to kernel::max_tile_rows.
template <class T, int Registers>
OuterKernel<T> outer_kernel_of(int rows) {
  static constexpr auto kernels = []<int... I>(std::integer_sequence<int, I...>) {
    return std::array{&outer_kernel<T, I + 1, Registers>...};
  }
  (std::make_integer_sequence<int, kernel::max_tile_rows>{});
  return kernels[static_cast<std::size_t>(rows - 1)];
}

#ifdef NPT_COMPILED
extern template OuterKernel<float> outer_kernel_of<float, 1>(int);
extern template OuterKernel<float> outer_kernel_of<float, kernel::panel_registers>(int);
extern template OuterKernel<double> outer_kernel_of<double, 1>(int);
extern template OuterKernel<double> outer_kernel_of<double, kernel::panel_registers>(int);
#endif

/// Shape and memory layout of an outer product: columns in panels of two registers, the last of one where that is
/// enough.
template <class T>
struct OuterShape {
  int rows = 0, columns = 0;
  int vertices = 0;  ///< that are collected before they are multiplied

  static constexpr int lanes = simd::lanes<T>;

  /// The shape with as many vertices as keep both operands inside the second-level cache beside the tiles they come
  /// from.
  static OuterShape of(int rows, int columns) {
    constexpr int budget = 768 * 1024 / static_cast<int>(sizeof(T));
    const int fitting = budget / (rows + columns) / kernel::group_width * kernel::group_width;
    return {rows, columns,
            fitting < kernel::group_width ? kernel::group_width
            : fitting > max_vertices      ? max_vertices
                                          : fitting};
  }

  kernel::RowBlocks blocks() const { return kernel::RowBlocks::of(rows); }
  int panels() const { return (columns + kernel::panel_width<T> - 1) / kernel::panel_width<T>; }
  /// Registers of a panel.
  int registers(int panel) const {
    const int rest = columns - panel * kernel::panel_width<T>;
    return rest >= kernel::panel_width<T> ? kernel::panel_registers : (rest + lanes - 1) / lanes;
  }
  /// Columns that stand side by side in the result, by panel, and the first of them.
  int panel_columns(int panel) const { return registers(panel) * lanes; }
  static constexpr int first_column(int panel) { return panel * kernel::panel_width<T>; }
  /// Elements of the result, [panel][rows][columns of the panel].
  std::size_t result_size() const { return index(panels()) * panel_size(); }
  std::size_t panel_size() const { return index(rows) * kernel::panel_width<T>; }
  /// The result's element (r, k).
  std::size_t at(int r, int k) const {
    const int p = k / kernel::panel_width<T>;
    return index(p) * panel_size() + index(r) * index(registers(p) * lanes) + index(k % kernel::panel_width<T>);
  }
  /// Elements of the collected operands. A register's worth of vertices and of rows may be written behind each part.
  std::size_t a_stride() const { return index(vertices + lanes) * kernel::max_tile_rows + lanes; }
  std::size_t b_stride() const { return index(vertices + lanes) * kernel::panel_width<T>; }
  std::size_t a_size() const {
    constexpr std::size_t unit = simd_alignment / sizeof(T);
    return (a_stride() * index(blocks().count) + unit - 1) / unit * unit;
  }
  std::size_t b_size() const { return b_stride() * index(panels()); }
  /// Elements of both, and words on matrix registers.
  std::size_t collected_values() const { return a_size() + b_size(); }
  static constexpr std::size_t collected_words() { return 0; }
  /// Whether the first product overwrites the result; else it must be zero before.
  static constexpr bool overwrites = false;

 private:
  static constexpr int max_vertices = 4 * kernel::group_width;
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }
};

/// Collects tiles of both operands and adds their product to a result. Works in memory of the caller: a and b as large
/// as the shape says.
template <class T>
class OuterProduct {
 public:
  OuterProduct(const OuterShape<T>& shape, T* a, T* b, T* result)
      : shape_(shape), blocks_(shape.blocks()), a_(a), b_(b), result_(result) {}

  /// Whether another group has space.
  bool full() const { return collected_ + kernel::group_width > shape_.vertices; }

  /// First the group's b tile [panel][columns][panel_width], then its a tile: they may be in the same memory, one after
  /// the other. Row `ones` of b, behind those of its tile, is 1 everywhere: the product's column for it sums a.
  void collect_b(const T* tile, int tile_rows, int ones, int valid) {
    for (int p = 0; p < shape_.panels(); ++p) {
      const int width = shape_.registers(p) * simd::lanes<T>;
      T* panel = b_ + static_cast<std::size_t>(p) * shape_.b_stride();
      transpose_rows(tile, tile_rows, p * kernel::panel_width<T>, valid, panel, width);
    }
    collect_ones(ones, valid);
  }
  void collect_a(const T* tile, int tile_rows, int valid) {
    for (int block = 0; block < blocks_.count; ++block)
      transpose_rows(tile, tile_rows, blocks_.first_row(block), valid,
                     a_ + static_cast<std::size_t>(block) * shape_.a_stride(), blocks_.rows(block));
    collected_ += valid;
  }
  void multiply() {
    for (int p = 0; p < shape_.panels(); ++p) {
      const auto kernel_of =
          shape_.registers(p) == 1 ? &outer_kernel_of<T, 1> : &outer_kernel_of<T, kernel::panel_registers>;
      const int width = shape_.registers(p) * simd::lanes<T>;
      const T* b = b_ + static_cast<std::size_t>(p) * shape_.b_stride();
      T* out = result_ + static_cast<std::size_t>(p) * shape_.panel_size();
      for (int block = 0; block < blocks_.count; ++block)
        kernel_of(blocks_.rows(block))(
            collected_, a_ + static_cast<std::size_t>(block) * shape_.a_stride(), b,
            out + static_cast<std::size_t>(blocks_.first_row(block)) * static_cast<std::size_t>(width));
    }
    collected_ = 0;
  }

 private:
  void collect_ones(int row, int valid) {
    const int panel = row / kernel::panel_width<T>;
    const int width = shape_.registers(panel) * simd::lanes<T>;
    T* to = b_ + static_cast<std::size_t>(panel) * shape_.b_stride() + row % kernel::panel_width<T>;
    for (int v = collected_; v < collected_ + valid; ++v)
      to[static_cast<std::size_t>(v) * static_cast<std::size_t>(width)] = 1;
  }

  /// `width` rows of the tile, from first_row on, to columns of `to` behind the vertices collected so far. A register
  /// may hold more rows than are left: what it writes too much is the next vertices', which are written later, and of
  /// their rows the first last.
  void transpose_rows(const T* tile, int tile_rows, int first_row, int valid, T* to, int width) const {
    constexpr int lanes = simd::lanes<T>;
    for (int v = 0; v < valid; v += lanes) {
      const T* from = tile + kernel::panel_stride<T>(tile_rows) * static_cast<std::size_t>(v / kernel::panel_width<T>) +
                      static_cast<std::size_t>(v % kernel::panel_width<T>);
      T* out = to + static_cast<std::size_t>(collected_ + v) * static_cast<std::size_t>(width);
      for (int row = (width - 1) / lanes * lanes; row >= 0; row -= lanes)
        simd::transpose(from + static_cast<std::size_t>(first_row + row) * kernel::panel_width<T>,
                        kernel::panel_width<T>, out + row, static_cast<std::size_t>(width));
    }
  }

  OuterShape<T> shape_;
  kernel::RowBlocks blocks_;
  T* a_;
  T* b_;
  T* result_;
  int collected_ = 0;
};

/// The product of a shape in an executor slot's memory: `values` in T, `words` for matrix registers.
template <class T>
OuterProduct<T> make_outer_product(const OuterShape<T>& shape, T* values, kernel::Word*, T* result) {
  return OuterProduct<T>(shape, values, values + shape.a_size(), result);
}

}  // namespace npt::inline NPT_ABI::tape
