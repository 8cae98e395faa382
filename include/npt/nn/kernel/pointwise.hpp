/// Pointwise layers: what one is to the kernels, and how a chain of them is applied to rows of a tile.
///
/// A pointwise operation maps one value of one channel at one vertex to another. It is a type with static members;
/// derive from Pointwise for the defaults.
///   column(args, at)       what it needs for a register of vertices, e.g. the coordinates that SPAdaIN is conditioned
///                          on
///   row(args, c)           what it needs for a channel, e.g. its mean, or its modulation weights, broadcast
///   apply(x, row, column)  the values of channel c in that register
/// The first two are computed once for a column and a row of registers and held there.
/// Chains are compiled into one loop that a stage runs while it reads (prologue) or writes (epilogue) a tile, so a
/// pointwise layer costs no pass over memory.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/simd/batch.hpp>
#include <npt/nn/simd/bf16.hpp>

#include <array>
#include <cstddef>
#include <tuple>
#include <utility>

namespace npt::inline NPT_ABI::kernel {

/// Most parameter tensors a pointwise layer may have.
inline constexpr int max_pointwise_parameters = 4;

/// What a pointwise operation may read. The engine fills what the operation declares and leaves the rest null.
template <class T>
struct PointwiseArgs {
  const T* parameters[max_pointwise_parameters] = {};  ///< the layer's tensors, first channel first
  const T* mean = nullptr;                             ///< [C] the input's mean over the vertices (if normalises)
  const T* inverse_deviation = nullptr;                ///< [C] 1 / sqrt(variance + eps)        (if normalises)
  const T* other = nullptr;                            ///< tile of the second input (if other_channels != 0)
  int other_channels = 0;                              ///< its channels
};

/// Where a register stands: panel of the tile, which of the two registers of the panel.
struct Position {
  int panel;
  int half;
};

/// Defaults of a pointwise operation.
struct Pointwise {
  struct Nothing {};
  static constexpr bool normalises = false;  ///< needs mean and deviation of its input over all vertices
  /// x <= y implies f(x) <= f(y): a maximum over vertices may be taken before it.
  static constexpr bool increasing = false;
  /// Whether a parameter, by its number in visit's order, has elements for each channel; else all channels share it.
  static constexpr std::array<bool, max_pointwise_parameters> per_channel{true, true, true, true};
  // For training, see nn/tape/chain_backward.hpp:
  static constexpr int sums_per_channel = 0;  ///< sums that the gradients of its parameters are made of
  static constexpr int other_channels = 0;    ///< channels of its second input that vjp knows a gradient for
  template <class T>
  static NPT_ALWAYS_INLINE Nothing column(const PointwiseArgs<T>&, Position) {
    return {};
  }
  template <class T>
  static NPT_ALWAYS_INLINE Nothing row(const PointwiseArgs<T>&, int) {
    return {};
  }
};

/// The operation that adds a second tile: a residual connection. Recorded by `a + b`, never written by users.
struct AddTile : Pointwise {
  static constexpr const char* name = "add";
  template <class T>
  struct Column {
    const T* tile;
  };
  template <class T>
  static NPT_ALWAYS_INLINE Column<T> column(const PointwiseArgs<T>& args, Position at) {
    return {args.other + panel_stride<T>(args.other_channels) * static_cast<std::size_t>(at.panel) +
            at.half * simd::lanes<T>};
  }
  template <class T>
  static NPT_ALWAYS_INLINE std::size_t row(const PointwiseArgs<T>&, int c) {
    return static_cast<std::size_t>(c) * panel_width<T>;
  }
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> apply(simd::Batch<T> x, std::size_t row, const Column<T>& column) {
    return x + simd::load(column.tile + row);
  }
};

/// Rows of a tile to transform: from and to may be the same memory.
template <class T>
struct RowRange {
  const T* from;
  T* to;
  std::size_t from_stride;  ///< elements from one panel to the next
  std::size_t to_stride;
  int first_panel;  ///< number in the tile of the first panel (for the operations' columns)
  int panels;
  int first_channel;  ///< channel number of the first row (for the operations' rows)
  int rows;
  const PointwiseArgs<T>* args;  ///< one for each operation of the chain
};

template <class T>
using RowTransform = void (*)(const RowRange<T>&);

namespace internal {

/// Walks the panels and channels of a range; body(from, to, row, column[], first) handles the rows that one step takes.
template <class T, class... Ops, class Body>
NPT_ALWAYS_INLINE void for_each_row(const RowRange<T>& range, Body&& body) {
  [&]<std::size_t... I>(std::index_sequence<I...>) NPT_LAMBDA_INLINE {
    // Copies, which stores to tiles can't change: else they are read again for every row.
    const std::array<PointwiseArgs<T>, sizeof...(Ops)> args{range.args[I]...};
    const int first_channel = range.first_channel;
    for (int p = 0; p < range.panels; ++p) {
      const auto columns = [&]([[maybe_unused]] int half) NPT_LAMBDA_INLINE {
        return std::tuple{Ops::template column<T>(args[I], Position{range.first_panel + p, half})...};
      };
      [[maybe_unused]] const std::array column{columns(0), columns(1)};
      // The values of row c in register q, through the chain.
      const auto value = [&](const T* from, const auto& row, auto q) NPT_LAMBDA_INLINE {
        simd::Batch<T> x = simd::load(from + q * simd::lanes<T>);
        ((x = Ops::template apply<T>(x, std::get<I>(row), std::get<I>(column[q]))), ...);
        return x;
      };
      const auto row_of = [&]([[maybe_unused]] int c) NPT_LAMBDA_INLINE {
        return std::tuple{Ops::template row<T>(args[I], first_channel + c)...};
      };
      body(range.from + range.from_stride * static_cast<std::size_t>(p),
           range.to + range.to_stride * static_cast<std::size_t>(p), row_of, value);
    }
  }
  (std::index_sequence_for<Ops...>{});
}

}  // namespace internal

/// Applies Ops, first to last, to every value of the range. An empty chain copies.
template <class T, class... Ops>
NPT_NOINLINE void transform_rows(const RowRange<T>& range) {
  internal::for_each_row<T, Ops...>(
      range, [&](const T* from, T* to, const auto& row_of, const auto& value) NPT_LAMBDA_INLINE {
        const int rows = range.rows;
        for (int c = 0; c < rows; ++c, from += panel_width<T>, to += panel_width<T>) {
          [[maybe_unused]] const auto row = row_of(c);
          simd::unroll<panel_registers>(
              [&](auto q) NPT_LAMBDA_INLINE { simd::store(to + q * simd::lanes<T>, value(from, row, q)); });
        }
      });
}

/// Applies Ops, and two channels become one row of bfloat16 pairs; an odd last channel is paired with zero.
template <class T, class... Ops>
NPT_NOINLINE void transform_rows_to_bf16(const RowRange<T>& range) {
  internal::for_each_row<T, Ops...>(
      range, [&](const T* from, T* to, const auto& row_of, const auto& value) NPT_LAMBDA_INLINE {
        for (int c = 0; c < range.rows; c += 2, from += 2 * panel_width<T>, to += panel_width<T>) {
          const bool paired = c + 1 < range.rows;
          [[maybe_unused]] const auto row = row_of(c);
          [[maybe_unused]] const auto next = row_of(paired ? c + 1 : c);
          simd::unroll<panel_registers>([&](auto q) NPT_LAMBDA_INLINE {
            const simd::Batch<T> second = paired ? value(from + panel_width<T>, next, q) : simd::broadcast(T(0));
            simd::store(to + q * simd::lanes<T>, simd::bf16_pairs(value(from, row, q), second));
          });
        }
      });
}

}  // namespace npt::inline NPT_ABI::kernel
