/// What an engine is apart from its network's type: calls, checks, workspaces. Compiled once a scalar and executor,
/// however many networks a program has.
#pragma once

#include <npt/base/control.hpp>
#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/pool.hpp>
#include <npt/base/tensor_adapter.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/forward.hpp>
#include <npt/nn/engine/network_call.hpp>
#include <npt/nn/engine/packed_program.hpp>
#include <npt/nn/engine/row_transforms.hpp>
#include <npt/nn/engine/workspace.hpp>
#include <npt/nn/graph/graph.hpp>
#include <npt/nn/graph/program.hpp>

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

namespace npt::inline NPT_ABI {

namespace engine {

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
inline constexpr bool pairs_compiled = std::is_same_v<T, float>&& simd::has_bf16;

/// Whether engines of this build on this machine multiply in a precision.
template <class T>
bool supports(Precision precision) {
  switch (precision) {
    case Precision::native:
    case Precision::automatic:
      return true;
    case Precision::bf16:
      return pairs_compiled<T>;
    case Precision::bf16x2:
    case Precision::bf16x3:
      return std::is_same_v<T, float> && simd::has_matrix_registers();
  }
  return false;
}

/// What runs in a precision.
/// Errors  npt::Error where this build or machine can't multiply in it
template <class T>
const CompiledProgram<T>& program_for(const CompiledNetwork<T>& network, Precision precision) {
  if (!supports<T>(precision))
    throw Error(
        {.file = "precision",
         .found = std::string(name_of(precision)) + " in an engine compiled for " NPT_ISA_NAME,
         .expected =
             precision == Precision::bf16
                 ? "a float engine compiled with AVX512_BF16, or the native precision"
                 : "a float engine compiled with AMX, a processor and a system that have it, or another precision"});
  const bool pairs = pairs_compiled<T> && precision == Precision::bf16 && !simd::has_matrix_registers();
  return pairs ? network.pairs : network.plain;
}

/// The calls of Engine (nn/engine/engine.hpp), which says what they promise.
template <class T, class Exec>
class Core {
 public:
  using Scalar = T;

  // Long members are not inlined: each unit with an engine would compile all that they call, also where they are
  // instantiated elsewhere (NPT_PREBUILT).
  NPT_NOINLINE Core(const CompiledNetwork<T>& network, std::span<const T> parameters, Precision precision,
                    Exec executor)
      : Core(*program_for(network, precision).program, parameters, resolve<T>(precision, *network.plain.program),
             program_for(network, precision).transforms, std::move(executor)) {}
  NPT_NOINLINE Core(const graph::Program& program, std::span<const T> parameters, Precision precision,
                    RowTransforms<T> transforms, Exec executor)
      : packed_(std::make_unique<PackedProgram<T>>(program, parameters, precision)),
        transforms_(transforms),
        executor_(std::move(executor)) {}

  Precision precision() const { return packed_->precision(); }
  const Exec& executor() const { return executor_; }

  /// The network's inputs, in the order in which they are given.
  const graph::InputList& inputs() const { return packed_->program().inputs; }

  /// Inputs [V, channels] -> result [V, 3].
  void operator()(const Inputs<T>& inputs, std::span<T> result) const {
    const NetworkCall<T> call{inputs, result};
    run({&call, 1});
  }
  void operator()(Workspace<T>& workspace, const Inputs<T>& inputs, std::span<T> result) const {
    const NetworkCall<T> call{inputs, result};
    run(workspace, {&call, 1});
  }

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
  void run(std::span<const NetworkCall<T>> calls) const {
    const auto lease = pool_.lease();
    run(*lease, calls);
  }
  NPT_NOINLINE void run(Workspace<T>& workspace, std::span<const NetworkCall<T>> calls) const {
    for (std::size_t i = 0; i < calls.size(); ++i) check(calls[i], calls.size() == 1 ? only_call : i);
    while (!calls.empty()) {
      const std::size_t count = batch_size(calls);
      run_batch(workspace.storage_, calls.first(count));
      calls = calls.subspan(count);
    }
  }

  /// Encodes the encoded input (inputs().encoded) once, for many calls. control: asked before each sweep
  /// Errors  npt::Error for a network of one input
  NPT_NOINLINE void encode(std::span<const T> values, EncodedInput<T>& code, const Control& control = {}) const {
    const std::size_t vertices = count_vertices(encoded_input("a network"), values.size());
    const auto lease = pool_.lease();
    WorkspaceStorage<T>& memory = lease->storage_;
    memory.encoded.clear();
    add_encoded(memory.encoded, values, vertices);
    code.vertices_ = 0;  // should anything be thrown
    forward(memory).encode(code.storage_, executor_, control);
    code.vertices_ = static_cast<int>(vertices);
    code.program_ = packed_->id();
  }
  EncodedInput<T> encode(std::span<const T> values) const {
    EncodedInput<T> code;
    encode(values, code);
    return code;
  }

  /// Runs the rest of the network. `others`: all inputs but the encoded one.
  /// Errors  npt::Error for a code of another engine, even one with the same weights
  NPT_NOINLINE void decode(const EncodedInput<T>& code, const Inputs<T>& others, std::span<T> result,
                           const Control& control = {}) const {
    const Input& input = encoded_input("a code");
    if (code.vertices_ == 0)
      throw Error({.file = input.name, .found = "an empty code", .expected = "one made by encode"});
    if (code.program_ != packed_->id())
      throw Error(
          {.file = input.name, .found = "a code that another engine made", .expected = "one made by this engine"});
    const CallVertices vertices =
        check(NetworkCall<T>{others, result}, only_call, static_cast<std::size_t>(code.vertices_));
    const auto lease = pool_.lease();
    WorkspaceStorage<T>& memory = lease->storage_;
    memory.main.clear();
    BatchMesh<T> mesh{.result = result.data(), .vertices = static_cast<int>(vertices.result)};
    for (int i = 0, place = 0; i < inputs().count; ++i)
      if (i != inputs().encoded) mesh.inputs[static_cast<std::size_t>(i)] = others[place++].data();
    memory.main.add(mesh);
    forward(memory).decode(code.storage_, executor_, control);
  }

 private:
  /// Vertices that a batch carries through its sweeps together. More would only grow the feature maps past the caches;
  /// fewer leave threads idle at barriers.
  static constexpr std::size_t batch_vertices = 16384;

  Forward<T> forward(WorkspaceStorage<T>& memory) const { return Forward<T>(*packed_, transforms_, memory); }

  std::size_t channels_of(int input) const { return static_cast<std::size_t>(inputs()[input].channels); }
  const Input& encoded_input(const char* found) const {
    if (inputs().encoded < 0) throw Error({.file = inputs()[0].name, .found = found, .expected = "several inputs"});
    return inputs()[inputs().encoded];
  }
  CallVertices check(const NetworkCall<T>& call, std::size_t number, std::size_t code_vertices = 0) const {
    return check_call(inputs(), packed_->program().paired, call, number, code_vertices);
  }
  /// Vertices of a checked call's result.
  std::size_t vertices_of(const NetworkCall<T>& call) const { return call.result.size() / 3; }

  std::size_t batch_size(std::span<const NetworkCall<T>> calls) const {
    std::size_t count = 0;
    std::size_t vertices = 0;
    while (count < calls.size() && (count == 0 || vertices + vertices_of(calls[count]) <= batch_vertices))
      vertices += vertices_of(calls[count++]);
    return count;
  }

  void add_encoded(MeshBatch<T>& batch, std::span<const T> values, std::size_t vertices) const {
    BatchMesh<T> mesh{.vertices = static_cast<int>(vertices)};
    mesh.inputs[static_cast<std::size_t>(inputs().encoded)] = values.data();
    batch.add(mesh);
  }
  /// The number of the call's encoded input among those of the batch.
  int code_of(MeshBatch<T>& batch, std::span<const T> values) const {
    const std::size_t vertices = values.size() / channels_of(inputs().encoded);
    const int known = static_cast<int>(batch.meshes.size());
    for (int code = 0; code < known; ++code) {
      const BatchMesh<T>& mesh = batch.meshes[static_cast<std::size_t>(code)];
      if (mesh.inputs[static_cast<std::size_t>(inputs().encoded)] == values.data() &&
          mesh.vertices == static_cast<int>(vertices))
        return code;
    }
    add_encoded(batch, values, vertices);
    return known;
  }

  void run_batch(WorkspaceStorage<T>& memory, std::span<const NetworkCall<T>> calls) const {
    memory.encoded.clear();
    memory.main.clear();
    for (const NetworkCall<T>& call : calls) {
      BatchMesh<T> mesh{.result = call.result.data(), .vertices = static_cast<int>(vertices_of(call))};
      for (int i = 0; i < inputs().count; ++i)
        if (i == inputs().encoded)
          mesh.code = code_of(memory.encoded, call.inputs[i]);
        else
          mesh.inputs[static_cast<std::size_t>(i)] = call.inputs[i].data();
      memory.main.add(mesh);
    }
    Forward<T> pass = forward(memory);
    if (inputs().encoded >= 0) pass.encode(memory.code, executor_);
    if (memory.encoded.meshes.size() == calls.size())
      pass.decode_and_consume(memory.code, executor_);
    else
      pass.decode(memory.code, executor_);
  }

  std::unique_ptr<PackedProgram<T>> packed_;
  RowTransforms<T> transforms_;
  Exec executor_;
  Pool<Workspace<T>> pool_;
};

}  // namespace engine
}  // namespace npt::inline NPT_ABI
