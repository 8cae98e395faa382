/// From a recorded network to a program, in a constant expression.
///
/// 1. Every convolution becomes a stage (stages.hpp). Its epilogue absorbs what follows and needs no moments:
///    activations, and the sum with an earlier stage's output. Its sources are what its operand resolves to: stored
///    activations, each read through the pointwise layers in between.
/// 2. Convolutions that only another one reads are multiplied into it where that saves work (fold.hpp).
/// 3. Stages are gathered in sweeps (sweeps.hpp).
/// 4. Activations get their memory (storage.hpp).
/// 5. The kinds of pointwise chains are numbered, for each of which a loop is compiled.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/expression.hpp>
#include <npt/nn/graph/fold.hpp>
#include <npt/nn/graph/lowering.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/graph/stages.hpp>
#include <npt/nn/graph/storage.hpp>
#include <npt/nn/graph/sweeps.hpp>
#include <npt/nn/layer/parameter.hpp>

namespace npt::inline NPT_ABI::graph {

/// How a network is lowered.
struct LoweringOptions {
  /// Convolutions are multiplied together where that saves work. Training needs them apart.
  bool fold = true;
  /// Operands are always packed by a prologue, never read as they lie: needed where the product has another format.
  bool pack_every_operand = false;
};

namespace internal {

/// Numbers the kinds of chains, for each of which a loop is compiled.
constexpr void assign_signature(Program& program, Chain& chain) {
  const Signature signature = signature_of(chain);
  int& count = program.signature_count;
  for (chain.signature = 0; chain.signature < count; ++chain.signature)
    if (program.signatures[index(chain.signature)] == signature) return;
  if (count == max_signatures) throw "npt: more than graph::max_signatures kinds of chains";
  program.signatures[index(count++)] = signature;
}

constexpr void assign_signatures(Program& program) {
  for (int i = 0; i < program.stage_count; ++i) {
    Stage& stage = program.stage(i);
    for (int s = 0; s < stage.source_count; ++s) assign_signature(program, stage.sources[index(s)].chain);
    assign_signature(program, stage.epilogue);
  }
  for (int a = 0; a < program.activation_count; ++a)
    if (program.activation(a).storage == Storage::pooled) assign_signature(program, program.activation(a).chain);
}

}  // namespace internal

constexpr Program lower(const Graph& graph, const LoweringOptions& options = {}) {
  Program program = make_stages(graph);
  if (options.fold) fold_convolutions(program);
  if (options.pack_every_operand)
    for (int i = 0; i < program.stage_count; ++i) program.stage(i).direct = false;
  assign_sweeps(program);
  assign_storage(program);
  find_pairing(program);
  find_dead_biases(program);
  internal::assign_signatures(program);
  program.multiply_adds = multiply_adds(graph);
  return program;
}

/// The network with its parameters' places, and its program. Both are constants of the network's type.
template <class Net>
inline constexpr Net bound_network = bind_parameters<Net>();
template <class Net>
inline constexpr Program program_of = lower(record(bound_network<Net>));
/// The program for products of bfloat16 pairs.
template <class Net>
inline constexpr Program bf16_program_of = lower(record(bound_network<Net>), {.pack_every_operand = true});

}  // namespace npt::inline NPT_ABI::graph
