/// Programs: what a network is lowered to. Plain constant data, made once at compile time (nn/graph/lower.hpp),
/// interpreted by the engine and printed by explain.
///
/// A program is a list of sweeps. A sweep carries each group of vertices through its stages without leaving the cache;
/// between sweeps stands one barrier, at which moments and maxima over all vertices are merged. A stage is prologue ->
/// matrix product -> epilogue: sources read through pointwise chains, one contraction, bias, a pointwise chain on the
/// way out.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/graph.hpp>

#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::graph {

inline constexpr int max_chain = 6;
inline constexpr int max_sources = 4;
inline constexpr int max_stages = 40;
inline constexpr int max_activations = max_stages + 2;
inline constexpr int max_buffers = 6;
inline constexpr int max_signatures = 24;

/// One pointwise operation in a chain.
struct Step {
  OperationId operation = 0;
  bool normalises = false;
  int other = -1;                                                                ///< activation that it also reads
  std::array<int, kernel::max_pointwise_parameters> parameters{-1, -1, -1, -1};  ///< offsets in the parameter buffer
  std::array<int, kernel::max_pointwise_parameters> sizes{};                     ///< their elements
  std::array<bool, kernel::max_pointwise_parameters> per_channel{};              ///< or shared by all channels

  constexpr bool operator==(const Step&) const = default;
};

/// Pointwise operations applied one after another in registers.
struct Chain {
  int count = 0;
  std::array<Step, max_chain> steps{};
  int signature = -1;  ///< number of its operation sequence in Program::signatures

  constexpr void push(const Step& step) {
    if (count == max_chain) throw "npt: more than graph::max_chain pointwise layers in a row";
    steps[static_cast<std::size_t>(count++)] = step;
  }
  constexpr bool operator==(const Chain&) const = default;
};

/// Where an activation lives.
enum class Storage : unsigned char {
  input,    ///< the caller's numbers, as tiles
  scratch,  ///< scratch of the task that carries the group: never leaves the cache
  buffer,   ///< one tile a group, for later sweeps
  code,     ///< as buffer, but part of the encoded input, which outlives the run
  pooled,   ///< one value a channel for each mesh
  none,     ///< only its maxima are used
};

/// An activation: an input, a stage's output or a pooled vector.
struct Activation {
  int channels = 0;
  Storage storage = Storage::scratch;
  int place = -1;        ///< number of the input, scratch tile, buffer or code activation
  int stage = -1;        ///< that writes it, -1: an input
  bool moments = false;  ///< someone normalises it
  int pooled_from = -1;  ///< pooled: the activation whose maxima it holds
  Chain chain{};         ///< pooled: applied to the maxima
  bool encoded = false;  ///< depends on the encoded input alone
};

/// One operand of a stage: `channels` rows of its contraction, from `first` on.
struct Source {
  int activation = -1;
  int channels = 0;
  int first = 0;
  Chain chain{};
};

/// A convolution that was multiplied into the weights of the one behind it.
struct Folded {
  int weight = -1, bias = -1;  ///< offsets in the parameter buffer
  int rows = 0, columns = 0;   ///< its output and input channels
};

struct Stage {
  int node = -1;               ///< the convolution
  int weight = -1, bias = -1;  ///< offsets in the parameter buffer
  int rows = 0;                ///< output channels
  int columns = 0;             ///< input channels, pooled ones included
  int source_count = 0;
  std::array<Source, max_sources> sources{};
  int folded_count = 0;
  std::array<Folded, 2> folded{};  ///< inner convolutions whose sum this one reads: their operands are its sources
  bool direct = false;             ///< the single source is read as it lies, without a prologue
  int operand_scratch = -1;        ///< scratch for the prologue's output
  Chain epilogue{};
  int output = -1;  ///< activation
  bool gathers_maxima = false;
  bool bias_is_dead = false;  ///< it only reaches an instance norm, which removes it
  int level = 0;              ///< number of its sweep
};

struct Sweep {
  int first_stage = 0;
  int stage_count = 0;
  bool encodes = false;  ///< runs over the encoded input's vertices (the encoder), else the result's
};

/// A sequence of operations for which a loop has to be compiled.
struct Signature {
  int count = 0;
  std::array<OperationId, max_chain> operations{};

  constexpr bool operator==(const Signature&) const = default;
};

struct Program {
  InputList inputs{};
  std::array<Stage, max_stages> stages{};
  int stage_count = 0;
  std::array<Activation, max_activations> activations{};
  int activation_count = 0;
  std::array<Sweep, max_stages> sweeps{};
  int sweep_count = 0;
  int encoder_sweeps = 0;  ///< the first ones; they depend on the encoded input alone
  std::array<Signature, max_signatures> signatures{};
  int signature_count = 0;
  int output = -1;  ///< activation

  /// By side (encoder 0, decoder 1): widest tenant of each buffer, its tiles' stride; 0: the side doesn't use it.
  std::array<std::array<int, max_buffers>, 2> buffer_channels{};
  int buffer_count = 0;
  int code_count = 0;
  int code_alias = -1;  ///< buffer that may be the first code activation's memory when nobody needs the code afterwards
  std::array<int, max_stages> scratch_channels{};  ///< widest tenant of each scratch tile
  int scratch_count = 0;

  bool paired = false;       ///< the encoded input meets the others vertex by vertex: it must have as many
  double multiply_adds = 0;  ///< a vertex, by the plain algorithm: every convolution, SPAdaIN's included

  constexpr Stage& stage(int i) { return stages[static_cast<std::size_t>(i)]; }
  constexpr const Stage& stage(int i) const { return stages[static_cast<std::size_t>(i)]; }
  constexpr Activation& activation(int i) { return activations[static_cast<std::size_t>(i)]; }
  constexpr const Activation& activation(int i) const { return activations[static_cast<std::size_t>(i)]; }
  constexpr const Sweep& sweep(int i) const { return sweeps[static_cast<std::size_t>(i)]; }
};

}  // namespace npt::inline NPT_ABI::graph
