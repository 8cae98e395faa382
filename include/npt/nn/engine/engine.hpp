/// The engine, whole: how a network's type becomes a program and its loops.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/engine/engine_class.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/engine/row_transforms.hpp>
#include <npt/nn/graph/lower.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/kernel/pointwise.hpp>
#include <npt/nn/kernel/product.hpp>

#include <span>

namespace npt::inline NPT_ABI {

template <class Net, class T, class Exec>
constexpr const graph::Program& Engine<Net, T, Exec>::program() {
  return graph::program_of<Net>;
}
template <class Net, class T, class Exec>
constexpr bool Engine<Net, T, Exec>::pairs_vertices() {
  return graph::program_of<Net>.paired;
}

// Not inlined, so that a unit which makes engines of the network (network_list.hpp) holds it for others.
template <class Net, class T, class Exec>
NPT_NOINLINE const engine::CompiledNetwork<T>& Engine<Net, T, Exec>::compiled() {
  static constexpr engine::CompiledNetwork<T> constants = [] {
    constexpr std::span<const kernel::RowTransform<T>> plain = engine::row_transforms<T, Net>;
    engine::CompiledNetwork<T> network{.plain = {&graph::program_of<Net>, {plain, plain}}, .pairs = {}};
    if constexpr (engine::pairs_compiled<T>) {
      static_assert(graph::bf16_program_of<Net>.signature_count == graph::program_of<Net>.signature_count);
      network.pairs = {&graph::bf16_program_of<Net>,
                       {engine::row_transforms<T, Net, kernel::Product::bf16_pairs>, plain}};
    }
    return network;
  }();
  return constants;
}

}  // namespace npt::inline NPT_ABI
