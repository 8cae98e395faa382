/// What an engine is apart from its network's type: calls, checks, workspaces. Compiled once a scalar and executor,
/// however many networks a program has.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/pool.hpp>
#include <npt/base/tensor_adapter.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/forward.hpp>
#include <npt/nn/engine/packed_program.hpp>
#include <npt/nn/engine/row_transforms.hpp>
#include <npt/nn/engine/transfer_pair.hpp>
#include <npt/nn/engine/workspace.hpp>

#include <cstddef>
#include <memory>
#include <span>
#include <string>
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
  /// Bytes of packed weights.
  std::size_t weight_bytes() const { return packed_->bytes(); }

  /// pose [Vp, 3], identity [V, 3] -> result [V, 3].
  void operator()(std::span<const T> pose, std::span<const T> identity, std::span<T> result) const {
    const TransferPair<T> pair{pose, identity, result};
    run({&pair, 1});
  }
  void operator()(Workspace<T>& workspace, std::span<const T> pose, std::span<const T> identity,
                  std::span<T> result) const {
    const TransferPair<T> pair{pose, identity, result};
    run(workspace, {&pair, 1});
  }

  /// pose [Vp, 3], identity [V, 3] -> [V, 3], a new one, as tensors of the host's (adapt/).
  template <HostTensor P, HostTensor I>
  auto operator()(const P& pose, const I& identity) const {
    const auto pose_points = TensorAdapter<P>::template read<T>(pose);
    const auto identity_points = TensorAdapter<I>::template read<T>(identity);
    auto result = TensorAdapter<I>::template make<T>(identity_points.span().size() / 3);
    (*this)(pose_points.span(), identity_points.span(), TensorAdapter<I>::template write<T>(result));
    return result;
  }

  /// A batch of transfers through shared sweeps. A pose span that occurs in several pairs is encoded once.
  void run(std::span<const TransferPair<T>> pairs) const {
    const auto lease = pool_.lease();
    run(*lease, pairs);
  }
  NPT_NOINLINE void run(Workspace<T>& workspace, std::span<const TransferPair<T>> pairs) const {
    for (std::size_t i = 0; i < pairs.size(); ++i) check_pair(pairs[i], i, pairs.size(), packed_->program().paired);
    while (!pairs.empty()) {
      const std::size_t count = batch_size(pairs);
      run_batch(workspace.storage_, pairs.first(count));
      pairs = pairs.subspan(count);
    }
  }

  /// Encodes a pose mesh once, for many identities.
  NPT_NOINLINE void encode(std::span<const T> pose, PoseCode<T>& code) const {
    check_coordinates(pose.size(), "pose");
    const auto lease = pool_.lease();
    WorkspaceStorage<T>& memory = lease->storage_;
    memory.pose.clear();
    memory.pose.add({.coordinates = pose, .result = {}});
    code.vertices_ = 0;  // should anything be thrown
    forward(memory).encode(code.storage_, executor_);
    code.vertices_ = static_cast<int>(pose.size() / 3);
    code.program_ = packed_->id();
  }
  PoseCode<T> encode(std::span<const T> pose) const {
    PoseCode<T> code;
    encode(pose, code);
    return code;
  }

  /// Gives an encoded pose to an identity. Errors: npt::Error for a code of another engine, even one with the same
  /// weights.
  NPT_NOINLINE void decode(const PoseCode<T>& code, std::span<const T> identity, std::span<T> result) const {
    check_coordinates(identity.size(), "identity");
    check_result(identity.size(), result.size());
    if (code.vertices_ == 0) throw Error({.file = "pose", .found = "an empty code", .expected = "one made by encode"});
    if (code.program_ != packed_->id())
      throw Error({.file = "pose", .found = "a code that another engine made", .expected = "one made by this engine"});
    check_pairing(packed_->program().paired, static_cast<std::size_t>(code.vertices_), identity.size() / 3);
    const auto lease = pool_.lease();
    WorkspaceStorage<T>& memory = lease->storage_;
    memory.identity.clear();
    memory.identity.add({.coordinates = identity, .result = result});
    forward(memory).decode(code.storage_, executor_);
  }

 private:
  /// Vertices that a batch carries through its sweeps together. More would only grow the feature maps past the caches;
  /// fewer leave threads idle at barriers.
  static constexpr std::size_t batch_vertices = 16384;

  Forward<T> forward(WorkspaceStorage<T>& memory) const { return Forward<T>(*packed_, transforms_, memory); }

  static std::size_t batch_size(std::span<const TransferPair<T>> pairs) {
    std::size_t count = 0;
    std::size_t vertices = 0;
    while (count < pairs.size() && (count == 0 || vertices + pairs[count].identity.size() / 3 <= batch_vertices))
      vertices += pairs[count++].identity.size() / 3;
    return count;
  }

  void run_batch(WorkspaceStorage<T>& memory, std::span<const TransferPair<T>> pairs) const {
    const auto same_pose = [](std::span<const T> a, std::span<const T> b) {
      return a.data() == b.data() && a.size() == b.size();
    };
    memory.pose.clear();
    memory.identity.clear();
    for (const TransferPair<T>& pair : pairs) {
      int code = 0;
      const int poses = static_cast<int>(memory.pose.meshes.size());
      while (code < poses && !same_pose(memory.pose.meshes[static_cast<std::size_t>(code)].coordinates, pair.pose))
        ++code;
      if (code == poses) memory.pose.add({.coordinates = pair.pose, .result = {}});
      memory.identity.add({.coordinates = pair.identity, .result = pair.result, .code = code});
    }
    Forward<T> pass = forward(memory);
    pass.encode(memory.code, executor_);
    if (memory.pose.meshes.size() == pairs.size())
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
