/// A network as engines and tapes see it, without its type: constants, and the compiled loops of its chains.
#pragma once

#include <npt/nn/engine/row_transforms.hpp>
#include <npt/nn/graph/expression.hpp>
#include <npt/nn/graph/lower.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/simd/bf16.hpp>
#include <npt/nn/tape/chain_loops.hpp>
#include <npt/nn/tape/lower.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace random_networks {

struct Network {
  /// Empty where a network is not checked in the scalar.
  template <class T>
  struct Loops {
    std::span<const npt::kernel::RowTransform<T>> rows;
    std::span<const npt::tape::ChainLoops<T>> tape;
  };

  std::string text;  ///< for messages
  std::vector<npt::NamedParameter> parameters;
  int buffer_size = 0;                                ///< elements of the parameter buffer
  const npt::graph::Graph* graph = nullptr;           ///< of what reaches the output
  const npt::graph::Program* program = nullptr;       ///< null: the engine can't run it
  const npt::graph::Program* bf16_program = nullptr;  ///< for products of bfloat16 pairs
  const npt::tape::Tape* tape = nullptr;              ///< null: it can't be trained
  Loops<float> fp32{};
  Loops<double> fp64{};
  std::span<const npt::kernel::RowTransform<float>> bf16_rows{};
};

/// Holds a network against the plain loops: each scalar and precision, several vertex counts, forwards and backwards,
/// on one and three threads, as a batch, as an encoded pose, and everything twice. Failures are doctest's; `seed` makes
/// weights and meshes.
void check(const Network& network, std::uint64_t seed);

/// A network that is a type, through the library's own tables for some of the scalars.
template <class Net, class... Scalars>
Network network_of(std::string text) {
  namespace graph = npt::graph;
  static constexpr graph::Graph recorded = graph::record(graph::bound_network<Net>);
  Network network;
  network.text = std::move(text);
  network.parameters = npt::list_parameters(graph::bound_network<Net>);
  network.buffer_size = npt::parameter_buffer_size(graph::bound_network<Net>);
  network.graph = &recorded;
  network.program = &graph::program_of<Net>;
  network.tape = &npt::tape::tape_of<Net>;
  if constexpr ((std::is_same_v<Scalars, double> || ...))
    network.fp64 = {npt::engine::row_transforms<double, Net>, npt::tape::chain_loops<double, Net>};
  if constexpr ((std::is_same_v<Scalars, float> || ...)) {
    network.fp32 = {npt::engine::row_transforms<float, Net>, npt::tape::chain_loops<float, Net>};
    if constexpr (npt::simd::has_bf16) {
      network.bf16_program = &graph::bf16_program_of<Net>;
      network.bf16_rows = npt::engine::row_transforms<float, Net, npt::kernel::Product::bf16_pairs>;
    }
  }
  return network;
}

}  // namespace random_networks
