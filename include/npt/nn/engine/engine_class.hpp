/// The engine: a network with packed weights, ready to run. What host applications hold. engine.hpp has the members
/// that know the network's type.
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/base/executor.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/core_class.hpp>
#include <npt/nn/engine/model_class.hpp>
#include <npt/nn/engine/precision.hpp>

#include <span>
#include <utility>

namespace npt::inline NPT_ABI {

/// A network ready to run, on numbers as it was trained with. PoseTransfer (transfer/pose_transfer.hpp) makes these of
/// meshes.
///   engine({points, normals}, result);
/// Shapes     inputs: [V, channels] each, in the order of Net::inputs   result: [V, 3], row major. One input, which is
///            encoded before the others, may have vertices of its own where the network reads only maxima of it
/// Threads    all members are const and may be called by any number of threads at a time; each running call uses one
///            workspace, the caller's or one from a pool inside
/// Memory     weights are packed once, the model isn't needed afterwards; a call whose shapes were seen before
///            allocates nothing
/// Numerics   within 1e-5 relative of a double reference in fp32; the same bits for any number of threads, any batch,
///            and for encode + decode; NaN in gives NaN out
/// Precision  fp32's error by the fastest unit unless told otherwise; bf16 where the processor multiplies it: about
///            1e-2 relative (docs/performance.md)
/// Errors     npt::Error on sizes that are not so many channels a vertex, empty inputs, another number of inputs, a
///            code of another engine, and unequal vertex counts where the network reads inputs vertex by vertex
template <class Net, class T = float, class Exec = DefaultExecutor>
class Engine : public engine::Core<T, Exec> {
 public:
  using Network = Net;

  /// `threads` 0: as many as the process may use; without oneTBB the default executor is serial and takes 0 or 1.
  explicit Engine(const Model<Net, T>& model, int threads = 0, Precision precision = Precision::automatic)
      : Engine(model, Exec(threads), precision) {}
  Engine(const Model<Net, T>& model, Exec executor, Precision precision = Precision::automatic)
      : Engine(model.buffer(), std::move(executor), precision) {}
  /// `values`: laid out as Model::buffer().
  Engine(std::span<const T> values, Exec executor, Precision precision = Precision::automatic)
      : engine::Core<T, Exec>(compiled(), values, precision, std::move(executor)) {}

  /// The program that runs: the network's, lowered.
  static constexpr const graph::Program& program();
  /// Whether all inputs must have equally many vertices.
  static constexpr bool pairs_vertices();
  /// Whether this build on this machine can multiply in a precision. bf16 needs a float engine compiled for
  /// AVX512_BF16, the others one compiled for AMX, and a system that lets it be used.
  static bool supports(Precision precision) { return engine::supports<T>(precision); }

 private:
  static const engine::CompiledNetwork<T>& compiled();
};

template <class Net, class T>
Engine(const Model<Net, T>&, int, Precision = Precision::automatic) -> Engine<Net, T, DefaultExecutor>;
template <class Net, class T>
Engine(const Model<Net, T>&) -> Engine<Net, T, DefaultExecutor>;
template <class Net, class T, Executor Exec>
Engine(const Model<Net, T>&, Exec, Precision = Precision::automatic) -> Engine<Net, T, Exec>;

#ifdef NPT_COMPILED
extern template class engine::Core<float, DefaultExecutor>;
extern template class engine::Core<double, DefaultExecutor>;
#endif

}  // namespace npt::inline NPT_ABI
