/// Tapes: what a network is lowered to for training (graph/lower_tape.hpp). Plain constant data, made at compile time, interpreted
/// forwards and backwards (engine/tape_forward.hpp, engine/tape_backward.hpp).
///
/// A tape has one stage for each convolution, and a few that only gather what several convolutions made. It stores what the
/// convolutions put out, nothing else: pointwise layers stay in the routes by which a stage reads a stored tensor, and are run again
/// when the gradient comes back along the same route. So that norms can be differentiated in tiles, gradients are kept behind the
/// norm, where their two sums over the vertices are known one barrier later.
#pragma once

#include <npt/config.hpp>
#include <npt/graph/program.hpp>

#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::graph {

inline constexpr int max_routes = 8;
inline constexpr int max_ports = 64;
inline constexpr int max_tape_stages = 64;
inline constexpr int max_tape_tensors = max_tape_stages + 16;
inline constexpr int max_tape_signatures = 32;

/// Where gradients of a stored tensor arrive: behind a norm of it, or at the tensor itself.
struct Port {
  int tensor = -1;
  bool normalises = false;
  Chain prefix{};               ///< the layers in front of the norm
  bool dense = false;           ///< gradients come for all vertices, in a buffer; else only from maxima
  bool starts_at_zero = false;  ///< the buffer is cleared first: no route is the first into it everywhere
  int buffer = -1;              ///< number among the buffers of the tensor's side
};

/// How a stage reads a tensor: rows of its operand, through a chain of pointwise layers.
struct Route {
  int tensor = -1;
  int channels = 0;
  int column = 0;      ///< first column of the weights
  int row = 0;         ///< first row of the operand tile, which has no rows for pooled tensors
  bool adds = false;   ///< to rows that an earlier route wrote
  Chain chain{};       ///< from the tensor to the operand
  int norm = -1;       ///< position of the instance norm in the chain, -1: none
  int port = -1;       ///< where its gradient goes; pooled tensors have none
  bool opens = false;  ///< backwards it is the first into its port: it writes instead of adding
  std::array<int, max_chain> other_ports{-1, -1, -1, -1, -1, -1};  ///< by step: the port of its second input
};

struct TapeTensor {
  int channels = 0;
  bool from_pose = false;
  int input = -1;  ///< number of the network's input, -1: none
  int stage = -1;  ///< that writes it
  // pooled: maxima over the vertices of another tensor, then pointwise layers
  int pooled_from = -1;
  Chain chain{};
  int norm = -1;
  int port = -1;  ///< of the other tensor
};

struct TapeStage {
  int node = -1;
  bool product = true;         ///< a convolution; else the rows of its operand are its output
  int weight = -1, bias = -1;  ///< offsets in the parameter buffer
  int rows = 0;                ///< output channels
  int columns = 0;             ///< input channels, pooled ones included
  int operand_rows = 0;        ///< without them
  int route_count = 0;
  std::array<Route, max_routes> routes{};
  int output = -1;  ///< tensor
  bool from_pose = false;
  bool bias_is_dead = false;  ///< it only reaches instance norms: its gradient is zero
};

/// A chain for which loops have to be compiled, and which.
struct TapeSignature {
  Signature operations{};
  bool reads = false;     ///< as a route's chain that writes
  bool adds = false;      ///< as a route's chain that adds
  bool finishes = false;  ///< in front of a norm
};

struct Tape {
  std::array<TapeStage, max_tape_stages> stages{};
  int stage_count = 0;
  std::array<TapeTensor, max_tape_tensors> tensors{};
  int tensor_count = 0;
  std::array<Port, max_ports> ports{};
  int port_count = 0;
  std::array<TapeSignature, max_tape_signatures> signatures{};
  int signature_count = 0;
  std::array<std::array<int, max_ports>, 2> buffer_channels{};  ///< by side (pose 0, identity 1): widest tenant
  std::array<int, 2> buffer_count{};
  bool paired = false;       ///< pose and identity must have equally many vertices
  double multiply_adds = 0;  ///< a vertex, of the forward pass, by the plain algorithm

  constexpr const TapeStage& stage(int i) const { return stages[static_cast<std::size_t>(i)]; }
  constexpr const TapeTensor& tensor(int i) const { return tensors[static_cast<std::size_t>(i)]; }
  constexpr const Port& port(int i) const { return ports[static_cast<std::size_t>(i)]; }
};

}  // namespace npt::inline NPT_ABI::graph
