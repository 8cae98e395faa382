/// Tapes: what a network is lowered to for training (nn/tape/lower.hpp). Plain constant data, made at compile time,
/// interpreted forwards and backwards (nn/tape/forward.hpp, nn/tape/backward.hpp).
///
/// A tape has one stage for each convolution, and a few that only gather what several convolutions made. It stores what
/// the convolutions put out, nothing else: pointwise layers stay in the paths by which a stage reads a stored
/// activation, and are run again when the gradient comes back along the same path. So that norms can be differentiated
/// in tiles, gradients are kept behind the norm, where their two sums over the vertices are known one barrier later.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/program.hpp>

#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::tape {

using graph::Chain;
using graph::max_chain;
using graph::Step;

inline constexpr int max_paths = 8;
inline constexpr int max_adjoints = 64;
inline constexpr int max_stages = 64;
inline constexpr int max_activations = max_stages + 16;
inline constexpr int max_signatures = 32;

/// Where gradients of a stored activation arrive: behind a norm of it, or at the activation itself.
struct Adjoint {
  int activation = -1;
  bool normalises = false;
  Chain prefix{};               ///< the layers in front of the norm
  bool dense = false;           ///< gradients come for all vertices, in a buffer; else only from maxima
  bool starts_at_zero = false;  ///< the buffer is cleared first: no path is the first into it everywhere
  int buffer = -1;              ///< number among the buffers of the activation's side
};

/// How a stage reads an activation: rows of its operand, through a chain of pointwise layers.
struct ReadPath {
  int activation = -1;
  int channels = 0;
  int column = 0;           ///< first column of the weights
  int row = 0;              ///< first row of the operand tile, which has no rows for pooled activations
  bool adds = false;        ///< to rows that an earlier path wrote
  Chain chain{};            ///< from the activation to the operand
  int norm = -1;            ///< position of the instance norm in the chain, -1: none
  int adjoint = -1;         ///< where its gradient goes; pooled activations have none
  bool overwrites = false;  ///< backwards it is the first into its adjoint: it writes instead of adding
  std::array<int, max_chain> other_adjoints{-1, -1, -1, -1, -1, -1};  ///< by step: the adjoint of its second input
};

struct Activation {
  int channels = 0;
  bool encoded = false;  ///< depends on the encoded input alone
  int input = -1;        ///< number of the network's input, -1: none
  int stage = -1;        ///< that writes it
  // pooled: maxima over the vertices of another activation, then pointwise layers
  int pooled_from = -1;
  Chain chain{};
  int norm = -1;
  int adjoint = -1;  ///< of the other activation
};

struct Stage {
  int node = -1;
  bool product = true;         ///< a convolution; else the rows of its operand are its output
  int weight = -1, bias = -1;  ///< offsets in the parameter buffer
  int rows = 0;                ///< output channels
  int columns = 0;             ///< input channels, pooled ones included
  int operand_rows = 0;        ///< without them
  int path_count = 0;
  std::array<ReadPath, max_paths> paths{};
  int output = -1;            ///< activation
  bool encodes = false;       ///< runs over the encoded input's vertices, else the result's
  bool bias_is_dead = false;  ///< it only reaches instance norms: its gradient is zero
};

/// A chain for which loops have to be compiled, and which.
struct Signature {
  graph::Signature operations{};
  bool reads = false;     ///< as a path's chain that writes
  bool adds = false;      ///< as a path's chain that adds
  bool finishes = false;  ///< in front of a norm
};

struct Tape {
  graph::InputList inputs{};
  std::array<Stage, max_stages> stages{};
  int stage_count = 0;
  std::array<Activation, max_activations> activations{};
  int activation_count = 0;
  std::array<Adjoint, max_adjoints> adjoints{};
  int adjoint_count = 0;
  std::array<Signature, max_signatures> signatures{};
  int signature_count = 0;
  std::array<std::array<int, max_adjoints>, 2> buffer_channels{};  ///< by side (encoder 0, rest 1): widest tenant
  std::array<int, 2> buffer_count{};
  bool paired = false;       ///< the encoded input must have as many vertices as the others
  double multiply_adds = 0;  ///< a vertex, of the forward pass, by the plain algorithm

  constexpr const Stage& stage(int i) const { return stages[static_cast<std::size_t>(i)]; }
  constexpr const Activation& activation(int i) const { return activations[static_cast<std::size_t>(i)]; }
  constexpr const Adjoint& adjoint(int i) const { return adjoints[static_cast<std::size_t>(i)]; }
};

}  // namespace npt::inline NPT_ABI::tape
