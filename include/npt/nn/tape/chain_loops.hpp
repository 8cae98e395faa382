/// From the pointwise chains of a tape, which it names by number, to compiled loops.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/engine/row_transforms.hpp>
#include <npt/nn/kernel/pointwise.hpp>
#include <npt/nn/tape/chain_backward.hpp>
#include <npt/nn/tape/lower.hpp>

#include <array>
#include <cstddef>
#include <utility>

namespace npt::inline NPT_ABI::tape {

/// The loops of one chain. Null where the tape needs none.
template <class T>
struct ChainLoops {
  kernel::RowTransform<T> read = nullptr;  ///< to an operand
  kernel::RowTransform<T> add = nullptr;   ///< to an operand that holds something; one more argument names it
  BackwardRows<T> backward = nullptr;
  BackwardRows<T> backward_others = nullptr;
  FinishRows<T> finish = nullptr;  ///< as the layers in front of a norm
  int read_sums = 0;               ///< sums a channel that `backward` gathers
  int prefix_sums = 0;             ///< and `finish`
  std::array<int, graph::max_chain> operation_sums{};
};

namespace internal {

template <class Net, std::size_t S, std::size_t I>
using Operation =
    typename graph::OperationAt<graph::find_operation(typename graph::ResultOf<Net>::Operations{},
                                                      tape_of<Net>.signatures[S].operations.operations[I]),
                                typename graph::ResultOf<Net>::Operations>::type;

template <class T, bool Reads, bool Adds, bool Finishes, class... Ops>
constexpr ChainLoops<T> loops_of_chain() {
  ChainLoops<T> loops;
  constexpr int norm = norm_position<Ops...>();
  constexpr int first = norm < static_cast<int>(sizeof...(Ops)) ? norm + 1 : 0;
  if constexpr (Reads) loops.read = &kernel::transform_rows<T, Ops...>;
  if constexpr (Adds) loops.add = &kernel::transform_rows<T, Ops..., kernel::AddTile>;
  if constexpr (Reads || Adds) {
    loops.backward = &backward_rows<T, Ops...>;
    if constexpr (((Ops::other_channels > 0) || ...)) loops.backward_others = &backward_others<T, Ops...>;
  }
  if constexpr (Finishes) loops.finish = &finish_rows<T, Ops...>;
  loops.read_sums = sums_of_chain<Ops...>(first);
  loops.prefix_sums = sums_of_chain<Ops...>(0);
  std::size_t i = 0;
  ((loops.operation_sums[i++] = Ops::sums_per_channel), ...);
  return loops;
}

template <class T, class Net, std::size_t S, std::size_t... I>
constexpr ChainLoops<T> loops_of_signature(std::index_sequence<I...>) {
  constexpr const Signature& signature = tape_of<Net>.signatures[S];
  return loops_of_chain<T, signature.reads, signature.adds, signature.finishes, Operation<Net, S, I>...>();
}

template <class T, class Net, std::size_t... S>
constexpr auto loops_of_tape(std::index_sequence<S...>) {
  return std::array<ChainLoops<T>, sizeof...(S)>{loops_of_signature<T, Net, S>(
      std::make_index_sequence<static_cast<std::size_t>(tape_of<Net>.signatures[S].operations.count)>{})...};
}

}  // namespace internal

/// The loops of a network's tape by signature number. Networks that use the same chains share them.
template <class T, class Net>
inline constexpr auto chain_loops =
    internal::loops_of_tape<T, Net>(std::make_index_sequence<static_cast<std::size_t>(tape_of<Net>.signature_count)>{});

}  // namespace npt::inline NPT_ABI::tape
