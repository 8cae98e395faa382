/// What an engine is apart from its network's type: calls, checks, workspaces. Compiled once a scalar and executor,
/// however many networks a program has.
#pragma once

#include <npt/base/control.hpp>
#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/pool.hpp>
#include <npt/base/tensor_adapter.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/encoded_input.hpp>
#include <npt/nn/engine/network_call.hpp>
#include <npt/nn/engine/precision.hpp>
#include <npt/nn/graph/inputs.hpp>

#include <cstddef>
#include <memory>
#include <span>
#include <tuple>
#include <utility>

namespace npt::inline NPT_ABI {

namespace graph {
struct Program;
}  // namespace graph
namespace kernel {
template <class T>
struct RowRange;
}  // namespace kernel
template <class T>
class Workspace;

namespace engine {

/// The loops that a pass uses: in front of products, and behind them.
template <class T>
struct RowTransforms {
  using Loop = void (*)(const kernel::RowRange<T>&);
  std::span<const Loop> prologue, epilogue;
};

/// A network's program and the loops of its chains.
template <class T>
struct CompiledProgram {
  const graph::Program* program = nullptr;
  RowTransforms<T> transforms;
};

/// All that an engine needs to know of its network's type.
template <class T>
struct CompiledNetwork {
  CompiledProgram<T> plain;
  CompiledProgram<T> pairs;  ///< for products of pairs of bfloat16 values in AVX-512 registers, where they are compiled
};

template <class T>
class PackedProgram;
template <class T>
class Forward;
template <class T>
struct MeshBatch;
template <class T>
struct WorkspaceStorage;

/// Whether engines of this build on this machine multiply in a precision.
template <class T>
bool supports(Precision precision);

/// The calls of Engine (nn/engine/engine.hpp), which says what they promise.
template <class T, class Exec>
class Core {
 public:
  using Scalar = T;

  Core(const CompiledNetwork<T>& network, std::span<const T> parameters, Precision precision, Exec executor);
  Core(const graph::Program& program, std::span<const T> parameters, Precision precision, RowTransforms<T> transforms,
       Exec executor);

  Precision precision() const;
  const Exec& executor() const { return executor_; }

  /// The network's inputs, in the order in which they are given.
  const graph::InputList& inputs() const;

  /// Inputs [V, channels] -> result [V, 3].
  void operator()(const Inputs<T>& inputs, std::span<T> result) const {
    const NetworkCall<T> call{inputs, result};
    run({&call, 1});
  }
  void operator()(Workspace<T>& workspace, const Inputs<T>& inputs, std::span<T> result) const;

  /// The same of tensors of the host's (adapt/): an input each, and a new one of the last one's kind.
  template <HostTensor... Tensors>
  requires(sizeof...(Tensors) > 0) auto operator()(const Tensors&... tensors) const {
    if (sizeof...(Tensors) != static_cast<std::size_t>(inputs().count))
      refuse_input_count(inputs(), sizeof...(Tensors), -1, only_call);
    const auto run = [this](const auto&... held) {
      using Adapter = TensorAdapter<std::tuple_element_t<sizeof...(Tensors) - 1, std::tuple<Tensors...>>>;
      const Inputs<T> given{held.span()...};
      const int first = inputs().of_result();
      auto result = Adapter::template make<T>(given[first].size() / channels_of(first));
      (*this)(given, Adapter::template write<T>(result));
      return result;
    };
    return [&]<std::size_t... I>(std::index_sequence<I...>) {
      return run(TensorAdapter<Tensors>::template read<T>(tensors, channels_of(static_cast<int>(I)))...);
    }
    (std::index_sequence_for<Tensors...>{});
  }

  /// A batch of calls through shared sweeps. A span that is the encoded input of several is encoded once.
  void run(std::span<const NetworkCall<T>> calls) const;
  void run(Workspace<T>& workspace, std::span<const NetworkCall<T>> calls) const;

  /// Encodes the encoded input (inputs().encoded) once, for many calls. control: asked before each sweep
  /// Errors  npt::Error for a network of one input
  void encode(std::span<const T> values, EncodedInput<T>& code, const Control& control = {}) const;
  EncodedInput<T> encode(std::span<const T> values) const;

  /// Runs the rest of the network. `others`: all inputs but the encoded one.
  /// Errors  npt::Error for a code of another engine, even one with the same weights
  void decode(const EncodedInput<T>& code, const Inputs<T>& others, std::span<T> result,
              const Control& control = {}) const;

 private:
  /// Vertices that a batch carries through its sweeps together, for each thread. More only grow the feature maps, whose
  /// fresh memory costs a first call more than barriers do; fewer leave threads idle at these.
  static constexpr std::size_t batch_vertices = 2048;

  Forward<T> forward(WorkspaceStorage<T>& memory) const;

  std::size_t channels_of(int input) const { return static_cast<std::size_t>(inputs()[input].channels); }
  const Input& encoded_input(const char* found) const;
  CallVertices check(const NetworkCall<T>& call, std::size_t number, std::size_t code_vertices = 0) const;
  /// Vertices of a checked call's result.
  std::size_t vertices_of(const NetworkCall<T>& call) const { return call.result.size() / 3; }

  std::size_t batch_size(std::span<const NetworkCall<T>> calls) const;

  void add_encoded(MeshBatch<T>& batch, std::span<const T> values, std::size_t vertices) const;
  /// The number of the call's encoded input among those of the batch.
  int code_of(MeshBatch<T>& batch, std::span<const T> values) const;

  void run_batch(WorkspaceStorage<T>& memory, std::span<const NetworkCall<T>> calls) const;

  std::shared_ptr<const PackedProgram<T>> packed_;
  RowTransforms<T> transforms_;
  Exec executor_;
  Pool<Workspace<T>> pool_;
};

}  // namespace engine
}  // namespace npt::inline NPT_ABI
