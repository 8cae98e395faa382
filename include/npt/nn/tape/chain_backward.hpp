/// Chains of pointwise layers run backwards: from the gradient of a chain's output to that of its input, with the sums
/// over the vertices that the gradients of parameters and norms are made of. Values between the layers are computed
/// again from the stored activation, which costs less than reading them would.
///
/// A pointwise layer that can be trained has, beside what pointwise.hpp asks for,
///   vjp(x, dy, row, column, sums)        returns dL/dx from x and dL/dy and adds to sums[0 .. sums_per_channel - 1]
///                                        what this register of vertices gives to its parameters' gradients: one sum
///                                        for each element that a channel has, in the order of visit
///   sums_per_channel                     how many those are; 0, the default, for a layer without learned parameters
/// and, if it reads a second input at the same vertex,
///   other_channels                       how many channels of that input
///   other_vjp(x, dy, row, column, sums)  adds to sums[0 .. other_channels - 1] the gradient of that input
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/pointwise.hpp>
#include <npt/nn/simd/batch.hpp>

#include <array>
#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

namespace npt::inline NPT_ABI::tape {

/// Rows of tiles through which a gradient goes backwards.
template <class T>
struct BackwardRange {
  const T* values;  ///< the stored activation
  std::size_t values_stride;
  const T* upstream;  ///< gradient of the chain's output
  std::size_t upstream_stride;
  T* downstream;  ///< gradient of the chain's input, or of its norm's output
  std::size_t downstream_stride;
  bool adds;  ///< to what `downstream` and `norm_sums` hold
  int valid;  ///< vertices; lanes behind them get zero
  int first_channel;
  int rows;
  const kernel::PointwiseArgs<T>* args;  ///< one for each operation of the chain
  T* parameter_sums;                     ///< [rows][sums of the chain], added to
  T* norm_sums[2];  ///< [rows] each: sums of the gradient, and of its product with the norm's output
  T* other[8];      ///< by operation: tile of the gradient of its second input, added to, or null
};

template <class T>
using BackwardRows = void (*)(const BackwardRange<T>&);

/// Whether a layer can be trained.
template <class Op>
concept Differentiable = Op::normalises ||
    requires(simd::Batch<float> x, const kernel::PointwiseArgs<float>& args, simd::Batch<float>* sums) {
  Op::vjp(x, x, Op::template row<float>(args, 0), Op::template column<float>(args, kernel::Position{}), sums);
};

/// kernel::Position of the norm in a chain; the chain's length if there is none.
template <class... Ops>
constexpr int norm_position() {
  int position = 0, found = static_cast<int>(sizeof...(Ops));
  ((Ops::normalises&& position < found ? found = position++ : position++), ...);
  return found;
}

/// Sums a channel of the layers from `first` on.
template <class... Ops>
constexpr int sums_of_chain(int first) {
  int position = 0, sums = 0;
  ((sums += position++ < first ? 0 : Ops::sums_per_channel), ...);
  return sums;
}

namespace internal {

/// The layers `First` and later of a chain, at one register.
template <class T, int First, class... Ops>
struct ChainBackward {
  using B = simd::Batch<T>;
  static constexpr int count = static_cast<int>(sizeof...(Ops));
  static constexpr int sums = sums_of_chain<Ops...>(First);
  using Values = std::array<B, static_cast<std::size_t>(count) + 1>;
  template <int I>
  using Op = std::tuple_element_t<static_cast<std::size_t>(I), std::tuple<Ops...>>;

  /// First sum of operation I.
  template <int I>
  static constexpr int first_sum() {
    int position = 0, n = 0;
    ((n += position >= First && position < I ? Ops::sums_per_channel : 0, ++position), ...);
    return n;
  }

  /// The input of each layer, and the chain's output.
  template <class Rows, class Columns>
  static NPT_ALWAYS_INLINE Values values(B x, const Rows& rows, const Columns& columns) {
    Values value;
    value[0] = x;
    simd::unroll<count>([&](auto i) NPT_LAMBDA_INLINE {
      constexpr auto at = static_cast<std::size_t>(decltype(i)::value);
      value[at + 1] = Op<decltype(i)::value>::template apply<T>(value[at], std::get<at>(rows), std::get<at>(columns));
    });
    return value;
  }

  /// From the gradient behind layer Last - 1 to that in front of layer First; seen(i, gradient behind layer i).
  template <int I, class Rows, class Columns, class Seen>
  static NPT_ALWAYS_INLINE B backward(const Values& value, B dy, const Rows& rows, const Columns& columns, B* sum,
                                      Seen&& seen) {
    if constexpr (I < First) {
      return dy;
    } else {
      constexpr auto at = static_cast<std::size_t>(I);
      seen(std::integral_constant<int, I>{}, dy);
      static_assert(
          Differentiable<Op<I>>,
          "npt: this layer has no vjp, so a network that uses it can't be trained (nn/tape/chain_backward.hpp)");
      const B dx = Op<I>::vjp(value[at], dy, std::get<at>(rows), std::get<at>(columns), sum + first_sum<I>());
      return backward<I - 1>(value, dx, rows, columns, sum, seen);
    }
  }
};

template <class T, class... Ops>
NPT_ALWAYS_INLINE auto columns_of(const kernel::PointwiseArgs<T>* args, kernel::Position at) {
  return [&]<std::size_t... I>(std::index_sequence<I...>) NPT_LAMBDA_INLINE {
    return std::tuple{Ops::template column<T>(args[I], at)...};
  }
  (std::index_sequence_for<Ops...>{});
}
template <class T, class... Ops>
NPT_ALWAYS_INLINE auto rows_of(const kernel::PointwiseArgs<T>* args, int channel) {
  return [&]<std::size_t... I>(std::index_sequence<I...>) NPT_LAMBDA_INLINE {
    return std::tuple{Ops::template row<T>(args[I], channel)...};
  }
  (std::index_sequence_for<Ops...>{});
}

}  // namespace internal

/// From the chain's output back to its norm's output, or to the stored activation where it has no norm. Gathers
/// norm_sums in the first case. `upstream` is zero in lanes without a vertex, and so is what is written.
template <class T, class... Ops>
NPT_NOINLINE void backward_rows(const BackwardRange<T>& range) {
  using B = simd::Batch<T>;
  constexpr int count = static_cast<int>(sizeof...(Ops));
  constexpr int norm = norm_position<Ops...>();
  constexpr bool normalises = norm < count;
  constexpr int first = normalises ? norm + 1 : 0;
  using Backward = internal::ChainBackward<T, first, Ops...>;
  const int registers = (range.valid + simd::lanes<T> - 1) / simd::lanes<T>;
  for (int r = 0; r < range.rows; ++r) {
    const auto rows = internal::rows_of<T, Ops...>(range.args, range.first_channel + r);
    const std::size_t at = static_cast<std::size_t>(r) * kernel::panel_width<T>;
    B sum[Backward::sums + 1];
    for (B& s : sum) s = simd::broadcast(T(0));
    B norm_sum = simd::broadcast(T(0)), norm_product = norm_sum;
    for (int i = 0; i < registers; ++i) {
      const int p = i / kernel::panel_registers, half = i % kernel::panel_registers;
      const auto columns = internal::columns_of<T, Ops...>(range.args, kernel::Position{p, half});
      const auto value = Backward::values(
          simd::load(range.values + at + kernel::register_offset<T>(range.values_stride, p, half)), rows, columns);
      const B dy = simd::load(range.upstream + at + kernel::register_offset<T>(range.upstream_stride, p, half));
      B dx = Backward::template backward<count - 1>(value, dy, rows, columns, sum, [](auto, const B&) {});
      if constexpr (normalises) {
        norm_sum += dx;
        norm_product = simd::fma(dx, value[static_cast<std::size_t>(norm) + 1], norm_product);
      }
      T* to = range.downstream + at + kernel::register_offset<T>(range.downstream_stride, p, half);
      if (range.adds) dx += simd::load(to);
      simd::store(to, dx);
    }
    if constexpr (Backward::sums > 0)
      for (int s = 0; s < Backward::sums; ++s) range.parameter_sums[r * Backward::sums + s] += simd::reduce_add(sum[s]);
    if constexpr (normalises) {
      const T sums[2] = {simd::reduce_add(norm_sum), simd::reduce_add(norm_product)};
      for (int s = 0; s < 2; ++s) range.norm_sums[s][r] = range.adds ? range.norm_sums[s][r] + sums[s] : sums[s];
    }
    // The rest of the last panel: products read whole panels.
    for (int i = registers; i % kernel::panel_registers != 0; ++i) {
      T* to =
          range.downstream + at +
          kernel::register_offset<T>(range.downstream_stride, i / kernel::panel_registers, i % kernel::panel_registers);
      simd::store(to, simd::broadcast(T(0)));
    }
  }
}

/// What instance norm's derivative needs of a channel of a mesh.
template <class T>
struct NormGradient {
  const T* mean;               ///< [C] of the norm's input
  const T* inverse_deviation;  ///< [C]
  const T* gradient;           ///< [C] mean over the vertices of the gradient of the norm's output
  const T* product;            ///< [C] mean of that gradient times the norm's output
};

/// From the norm's output back to the stored activation, through the layers Ops in front of the norm:
///   d input = inverse_deviation * (d output - mean(d output) - output * mean(d output * output))
template <class T>
struct FinishRange {
  BackwardRange<T> rows;
  NormGradient<T> norm;
};
template <class T>
using FinishRows = void (*)(const FinishRange<T>&);

template <class T, class... Ops>
NPT_NOINLINE void finish_rows(const FinishRange<T>& finish) {
  using B = simd::Batch<T>;
  constexpr int count = static_cast<int>(sizeof...(Ops));
  using Backward = internal::ChainBackward<T, 0, Ops...>;
  const BackwardRange<T>& range = finish.rows;
  const int registers = (range.valid + simd::lanes<T> - 1) / simd::lanes<T>;
  const B zero = simd::broadcast(T(0));
  for (int r = 0; r < range.rows; ++r) {
    const int c = range.first_channel + r;
    const auto rows = internal::rows_of<T, Ops...>(range.args, c);
    const std::size_t at = static_cast<std::size_t>(r) * kernel::panel_width<T>;
    const B mean = simd::broadcast(finish.norm.mean[c]);
    const B deviation = simd::broadcast(finish.norm.inverse_deviation[c]);
    const B gradient = simd::broadcast(finish.norm.gradient[c]);
    const B product = simd::broadcast(finish.norm.product[c]);
    B sum[Backward::sums + 1];
    for (B& s : sum) s = zero;
    for (int i = 0; i < registers; ++i) {
      const int p = i / kernel::panel_registers, half = i % kernel::panel_registers;
      const auto columns = internal::columns_of<T, Ops...>(range.args, kernel::Position{p, half});
      const auto value = Backward::values(
          simd::load(range.values + at + kernel::register_offset<T>(range.values_stride, p, half)), rows, columns);
      const B normed = (value[static_cast<std::size_t>(count)] - mean) * deviation;
      const B du = simd::load(range.upstream + at + kernel::register_offset<T>(range.upstream_stride, p, half));
      B dy = deviation * (du - gradient - normed * product);
      if (range.valid - i * simd::lanes<T> < simd::lanes<T>)
        dy = simd::keep_first(dy, i * simd::lanes<T>, range.valid, zero);
      B dx = Backward::template backward<count - 1>(value, dy, rows, columns, sum, [](auto, const B&) {});
      T* to = range.downstream + at + kernel::register_offset<T>(range.downstream_stride, p, half);
      if (range.adds) dx += simd::load(to);
      simd::store(to, dx);
    }
    if constexpr (Backward::sums > 0)
      for (int s = 0; s < Backward::sums; ++s) range.parameter_sums[r * Backward::sums + s] += simd::reduce_add(sum[s]);
    for (int i = registers; i % kernel::panel_registers != 0; ++i) {
      T* to =
          range.downstream + at +
          kernel::register_offset<T>(range.downstream_stride, i / kernel::panel_registers, i % kernel::panel_registers);
      simd::store(to, zero);
    }
  }
}

/// The gradients of the layers' second inputs, from the same gradient of the chain's output. Apart, since training
/// needs none: the network is conditioned on its input.
template <class T, class... Ops>
NPT_NOINLINE void backward_others(const BackwardRange<T>& range) {
  using B = simd::Batch<T>;
  constexpr int count = static_cast<int>(sizeof...(Ops));
  constexpr int norm = norm_position<Ops...>();
  constexpr int first = norm < count ? norm + 1 : 0;
  using Backward = internal::ChainBackward<T, first, Ops...>;
  const int registers = (range.valid + simd::lanes<T> - 1) / simd::lanes<T>;
  for (int i = 0; i < registers; ++i) {
    const int p = i / kernel::panel_registers, half = i % kernel::panel_registers;
    const auto columns = internal::columns_of<T, Ops...>(range.args, kernel::Position{p, half});
    for (int r = 0; r < range.rows; ++r) {
      const auto rows = internal::rows_of<T, Ops...>(range.args, range.first_channel + r);
      const std::size_t at = static_cast<std::size_t>(r) * kernel::panel_width<T>;
      const auto value = Backward::values(
          simd::load(range.values + at + kernel::register_offset<T>(range.values_stride, p, half)), rows, columns);
      const B dy = simd::load(range.upstream + at + kernel::register_offset<T>(range.upstream_stride, p, half));
      B unused[Backward::sums + 1];
      for (B& s : unused) s = simd::broadcast(T(0));
      Backward::template backward<count - 1>(
          value, dy, rows, columns, unused, [&](auto number, const B& gradient) NPT_LAMBDA_INLINE {
            constexpr int k = decltype(number)::value;
            using Op = typename Backward::template Op<k>;
            if constexpr (Op::other_channels > 0) {
              if (range.other[k] == nullptr) return;
              B add[Op::other_channels];
              for (B& a : add) a = simd::broadcast(T(0));
              constexpr auto index = static_cast<std::size_t>(k);
              Op::other_vjp(value[index], gradient, std::get<index>(rows), std::get<index>(columns), add);
              for (int c = 0; c < Op::other_channels; ++c) {
                T* to = range.other[k] + static_cast<std::size_t>(c) * kernel::panel_width<T> +
                        kernel::register_offset<T>(kernel::panel_stride<T>(Op::other_channels), p, half);
                simd::store(to, simd::load(to) + add[c]);
              }
            }
          });
    }
  }
}

}  // namespace npt::inline NPT_ABI::tape
