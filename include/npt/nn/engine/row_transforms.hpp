/// From a network's pointwise chains, which a program names by number, to compiled loops.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/lower.hpp>
#include <npt/nn/kernel/micro_kernel.hpp>
#include <npt/nn/kernel/pointwise.hpp>

#include <array>
#include <cstddef>
#include <utility>

namespace npt::inline NPT_ABI::engine {

namespace internal {

/// The operation at position I of chain signature S of the network.
template <class Net, std::size_t S, std::size_t I>
using SignatureOperation =
    typename graph::OperationAt<graph::find_operation(typename graph::ResultOf<Net>::Operations{},
                                                      graph::program_of<Net>.signatures[S].operations[I]),
                                typename graph::ResultOf<Net>::Operations>::type;

template <class T, class Net, kernel::Product P, std::size_t S, std::size_t... I>
constexpr kernel::RowTransform<T> transform_of(std::index_sequence<I...>) {
  if constexpr (P == kernel::Product::bf16_pairs)
    return &kernel::transform_rows_to_bf16<T, SignatureOperation<Net, S, I>...>;
  else
    return &kernel::transform_rows<T, SignatureOperation<Net, S, I>...>;
}

template <class T, class Net, kernel::Product P, std::size_t... S>
constexpr auto transforms_of(std::index_sequence<S...>) {
  return std::array<kernel::RowTransform<T>, sizeof...(S)>{transform_of<T, Net, P, S>(
      std::make_index_sequence<static_cast<std::size_t>(graph::program_of<Net>.signatures[S].count)>{})...};
}

}  // namespace internal

/// The loops of a network's chains by signature number. Networks that use the same chains share them.
template <class T, class Net, kernel::Product P = kernel::Product::plain>
inline constexpr auto row_transforms = internal::transforms_of<T, Net, P>(
    std::make_index_sequence<static_cast<std::size_t>(graph::program_of<Net>.signature_count)>{});

}  // namespace npt::inline NPT_ABI::engine
