/// The engine: a network with packed weights, ready to run. What host applications hold.
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/tensor_adapter.hpp>
#include <npt/engine/forward.hpp>
#include <npt/engine/model.hpp>
#include <npt/engine/packed_program.hpp>
#include <npt/engine/row_transforms.hpp>
#include <npt/engine/workspace.hpp>
#include <npt/graph/lower.hpp>
#include <npt/parallel/executor.hpp>
#include <npt/parallel/tbb_executor.hpp>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// One transfer of a batch, on borrowed memory: [Vp, 3] and [V, 3] coordinates in, [V, 3] out, row major.
template <class T = float>
struct TransferPair {
  std::span<const T> pose;
  std::span<const T> identity;
  std::span<T> result;
};

/// A network ready to run, in the network's own coordinates (transfer/ maps meshes to and from them).
///
/// Thread safety  All members are const and may be called by any number of threads at a time. Each running call uses
/// one workspace,
///                the caller's or one from a pool inside.
/// Memory         Weights are packed once; the model isn't needed afterwards. A call whose shapes were seen before
/// allocates nothing. Numerics       within 1e-5 relative of a double reference in fp32; the same bits for any number
/// of threads, any batch, and for
///                encode + decode. NaN in gives NaN out.
/// Precision      bf16 where the processor multiplies it: twice the rate, about 1e-2 relative (docs/performance.md)
/// Errors         npt::Error on sizes that are not three a vertex, empty meshes, and unequal vertex counts where the
/// network
///                pairs vertices (every feature but the pooled one).
template <class Net, class T = float, class Exec = TbbExecutor>
class Engine {
 public:
  using Network = Net;
  using Scalar = T;

  /// `threads` 0: as many as the process may use.
  explicit Engine(const Model<Net, T>& model, int threads = 0, Precision precision = Precision::native)
      : Engine(model, Exec(threads), precision) {}
  Engine(const Model<Net, T>& model, Exec executor, Precision precision = Precision::native)
      : packed_(std::make_unique<engine::PackedProgram<T>>(program_for(precision), model.buffer(), precision)),
        executor_(std::move(executor)),
        pool_(std::make_unique<Pool>()) {}

  /// The program that runs: the network's, lowered.
  static constexpr const graph::Program& program() { return graph::program_of<Net>; }
  /// Whether both meshes must have equally many vertices.
  static constexpr bool pairs_vertices() { return graph::program_of<Net>.paired; }

  /// Whether this build can multiply in a precision. bf16 needs fp32 engines compiled for AVX512_BF16.
  static constexpr bool supports(Precision precision) {
    return precision == Precision::native || (std::is_same_v<T, float> && simd::has_bf16);
  }
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

  /// The same on the host's tensors: returns a new one.
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
    const Lease lease(*pool_);
    run(*lease.workspace, pairs);
  }
  void run(Workspace<T>& workspace, std::span<const TransferPair<T>> pairs) const {
    for (std::size_t i = 0; i < pairs.size(); ++i) check(pairs[i], i, pairs.size());
    while (!pairs.empty()) {
      const std::size_t count = chunk_size(pairs);
      run_chunk(workspace.storage_, pairs.first(count));
      pairs = pairs.subspan(count);
    }
  }

  /// Encodes a pose mesh once, for many identities.
  void encode(std::span<const T> pose, PoseCode<T>& code) const {
    check_coordinates(pose.size(), "pose");
    const Lease lease(*pool_);
    engine::WorkspaceStorage<T>& memory = lease.workspace->storage_;
    memory.pose.clear();
    memory.pose.add({.coordinates = pose, .result = {}});
    forward(memory).encode(code.storage_, executor_);
    code.vertices_ = static_cast<int>(pose.size() / 3);
  }
  PoseCode<T> encode(std::span<const T> pose) const {
    PoseCode<T> code;
    encode(pose, code);
    return code;
  }

  /// Gives an encoded pose to an identity.
  void decode(const PoseCode<T>& code, std::span<const T> identity, std::span<T> result) const {
    check_coordinates(identity.size(), "identity");
    check_result(identity.size(), result.size());
    check_pairing(static_cast<std::size_t>(code.vertices_), identity.size() / 3);
    const Lease lease(*pool_);
    engine::WorkspaceStorage<T>& memory = lease.workspace->storage_;
    memory.identity.clear();
    memory.identity.add({.coordinates = identity, .result = result});
    forward(memory).decode(code.storage_, executor_);
  }

 private:
  /// Vertices that a batch carries through its sweeps together. More would only grow the feature maps past the caches;
  /// fewer leave threads idle at barriers.
  static constexpr std::size_t chunk_vertices = 16384;

  struct Pool {
    std::mutex mutex;
    std::vector<std::unique_ptr<Workspace<T>>> free;
  };
  /// A workspace for the duration of a call.
  struct Lease {
    explicit Lease(Pool& from) : pool(from) {
      const std::lock_guard lock(pool.mutex);
      if (!pool.free.empty()) {
        workspace = std::move(pool.free.back());
        pool.free.pop_back();
      } else {
        workspace = std::make_unique<Workspace<T>>();
      }
    }
    ~Lease() {
      const std::lock_guard lock(pool.mutex);
      pool.free.push_back(std::move(workspace));
    }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    Pool& pool;
    std::unique_ptr<Workspace<T>> workspace;
  };

  engine::Forward<T> forward(engine::WorkspaceStorage<T>& memory) const {
    constexpr auto& plain = engine::row_transforms<T, Net>;
    if constexpr (supports(Precision::bf16))
      if (precision() == Precision::bf16)
        return engine::Forward<T>(*packed_, {engine::row_transforms<T, Net, kernel::Product::bf16_pairs>, plain},
                                  memory);
    return engine::Forward<T>(*packed_, {plain, plain}, memory);
  }

  static const graph::Program& program_for(Precision precision) {
    if (!supports(precision))
      throw Error({.file = "precision",
                   .found = "bf16 in an engine compiled for " NPT_ISA_NAME,
                   .expected = "a float engine compiled with AVX512_BF16, or the native precision"});
    if constexpr (supports(Precision::bf16)) {
      static_assert(graph::bf16_program_of<Net>.signature_count == graph::program_of<Net>.signature_count);
      if (precision == Precision::bf16) return graph::bf16_program_of<Net>;
    }
    return graph::program_of<Net>;
  }

  // Names are composed only where an error is thrown: a warm call allocates nothing.
  static std::string name_of(const char* what, std::size_t pair) {
    return pair == single ? what : std::string(what) + " of pair " + std::to_string(pair);
  }
  static void check_coordinates(std::size_t size, const char* what, std::size_t pair = single) {
    if (size == 0) throw Error({.file = name_of(what, pair), .found = "no vertices", .expected = "at least one"});
    if (size % 3 != 0)
      throw Error({.file = name_of(what, pair),
                   .found = std::to_string(size) + " numbers",
                   .expected = "three for each vertex"});
    if (size / 3 > max_vertices)
      throw Error({.file = name_of(what, pair),
                   .found = std::to_string(size / 3) + " vertices",
                   .expected = "at most " + std::to_string(max_vertices)});
  }
  static void check_result(std::size_t identity, std::size_t result, std::size_t pair = single) {
    if (identity != result)
      throw Error({.file = name_of("result", pair),
                   .found = std::to_string(result) + " numbers",
                   .expected = std::to_string(identity) + ", as many as the identity has"});
  }
  static void check_pairing(std::size_t pose, std::size_t identity, std::size_t pair = single) {
    if (pose == 0) throw Error({.file = "pose", .found = "an empty code", .expected = "one made by encode"});
    if (pairs_vertices() && pose != identity)
      throw Error({.file = name_of("pose", pair),
                   .found = std::to_string(pose) + " vertices",
                   .expected = std::to_string(identity) +
                               ", as many as the identity has: this network pairs vertices (resample the pose mesh, or "
                               "use a network with the pooled feature)"});
  }
  static void check(const TransferPair<T>& pair, std::size_t i, std::size_t count) {
    const std::size_t number = count == 1 ? single : i;
    check_coordinates(pair.pose.size(), "pose", number);
    check_coordinates(pair.identity.size(), "identity", number);
    check_result(pair.identity.size(), pair.result.size(), number);
    check_pairing(pair.pose.size() / 3, pair.identity.size() / 3, number);
  }

  static std::size_t chunk_size(std::span<const TransferPair<T>> pairs) {
    std::size_t count = 0;
    std::size_t vertices = 0;
    while (count < pairs.size() && (count == 0 || vertices + pairs[count].identity.size() / 3 <= chunk_vertices))
      vertices += pairs[count++].identity.size() / 3;
    return count;
  }

  void run_chunk(engine::WorkspaceStorage<T>& memory, std::span<const TransferPair<T>> pairs) const {
    const auto same_pose = [](std::span<const T> a, std::span<const T> b) {
      return a.data() == b.data() && a.size() == b.size();
    };
    memory.pose.clear();
    memory.identity.clear();
    for (const TransferPair<T>& pair : pairs) {
      int code = 0;
      const int poses = static_cast<int>(memory.pose.instances.size());
      while (code < poses && !same_pose(memory.pose.instances[static_cast<std::size_t>(code)].coordinates, pair.pose))
        ++code;
      if (code == poses) memory.pose.add({.coordinates = pair.pose, .result = {}});
      memory.identity.add({.coordinates = pair.identity, .result = pair.result, .code = code});
    }
    engine::Forward<T> pass = forward(memory);
    pass.encode(memory.code, executor_);
    if (memory.pose.instances.size() == pairs.size())
      pass.decode_and_spend(memory.code, executor_);
    else
      pass.decode(memory.code, executor_);
  }

  static constexpr std::size_t max_vertices = std::size_t{1} << 28;
  static constexpr std::size_t single = static_cast<std::size_t>(-1);  ///< not one of several pairs

  std::unique_ptr<engine::PackedProgram<T>> packed_;
  Exec executor_;
  std::unique_ptr<Pool> pool_;
};

template <class Net, class T>
Engine(const Model<Net, T>&, int, Precision = Precision::native) -> Engine<Net, T, TbbExecutor>;
template <class Net, class T>
Engine(const Model<Net, T>&) -> Engine<Net, T, TbbExecutor>;
template <class Net, class T, Executor Exec>
Engine(const Model<Net, T>&, Exec, Precision = Precision::native) -> Engine<Net, T, Exec>;

}  // namespace npt::inline NPT_ABI
