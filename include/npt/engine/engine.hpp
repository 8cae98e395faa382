/// The engine: a network with packed weights, ready to run. What host applications hold.
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/engine/core.hpp>
#include <npt/engine/model.hpp>
#include <npt/engine/row_transforms.hpp>
#include <npt/graph/lower.hpp>
#include <npt/parallel/default_executor.hpp>
#include <npt/parallel/executor.hpp>

#include <span>
#include <string>
#include <type_traits>
#include <utility>

namespace npt::inline NPT_ABI {

/// A network ready to run, in the network's own coordinates: meshes centred, scaled and turned as in its training,
/// vertices paired at random. PoseTransfer (transfer/pose_transfer.hpp) does that for meshes as they come and is the
/// front door.
/// Shapes     pose: [Vp, 3]   identity, result: [V, 3], row major; Vp = V where the network pairs vertices
/// Threads    all members are const and may be called by any number of threads at a time; each running call uses one
///            workspace, the caller's or one from a pool inside
/// Memory     weights are packed once, the model isn't needed afterwards; a call whose shapes were seen before
///            allocates nothing
/// Numerics   within 1e-5 relative of a double reference in fp32; the same bits for any number of threads, any batch,
///            and for encode + decode; NaN in gives NaN out
/// Precision  fp32's error by the fastest unit unless told otherwise; bf16 where the processor multiplies it: about
///            1e-2 relative (docs/performance.md)
/// Errors     npt::Error on sizes that are not three a vertex, empty meshes, a pose code of another engine, and unequal
///            vertex counts where the network pairs vertices (every feature but the pooled one)
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
      : engine::Core<T, Exec>(program_for(precision), values, engine::resolve<T>(precision, program()),
                              transforms_for(precision), std::move(executor)) {}

  /// The program that runs: the network's, lowered.
  static constexpr const graph::Program& program() { return graph::program_of<Net>; }
  /// Whether both meshes must have equally many vertices.
  static constexpr bool pairs_vertices() { return graph::program_of<Net>.paired; }
  /// Whether this build on this machine can multiply in a precision. bf16 needs a float engine compiled for
  /// AVX512_BF16, the others one compiled for AMX, and a system that lets it be used.
  static bool supports(Precision precision) {
    switch (precision) {
      case Precision::native:
      case Precision::automatic:
        return true;
      case Precision::bf16:
        return pairs_compiled;
      case Precision::bf16x2:
      case Precision::bf16x3:
        return std::is_same_v<T, float> && simd::has_matrix_registers();
    }
    return false;
  }

 private:
  static constexpr bool pairs_compiled = std::is_same_v<T, float> && simd::has_bf16;
  /// Whether products run on pairs of bfloat16 values in AVX-512 registers.
  static bool on_pairs(Precision precision) { return precision == Precision::bf16 && !simd::has_matrix_registers(); }

  static const graph::Program& program_for(Precision precision) {
    if (!supports(precision))
      throw Error(
          {.file = "precision",
           .found = std::string(name_of(precision)) + " in an engine compiled for " NPT_ISA_NAME,
           .expected =
               precision == Precision::bf16
                   ? "a float engine compiled with AVX512_BF16, or the native precision"
                   : "a float engine compiled with AMX, a processor and a system that have it, or another precision"});
    if constexpr (pairs_compiled) {
      static_assert(graph::bf16_program_of<Net>.signature_count == graph::program_of<Net>.signature_count);
      if (on_pairs(precision)) return graph::bf16_program_of<Net>;
    }
    return graph::program_of<Net>;
  }

  static engine::RowTransforms<T> transforms_for([[maybe_unused]] Precision precision) {
    constexpr auto& plain = engine::row_transforms<T, Net>;
    if constexpr (pairs_compiled)
      if (on_pairs(precision)) return {engine::row_transforms<T, Net, kernel::Product::bf16_pairs>, plain};
    return {plain, plain};
  }
};

template <class Net, class T>
Engine(const Model<Net, T>&, int, Precision = Precision::automatic) -> Engine<Net, T, DefaultExecutor>;
template <class Net, class T>
Engine(const Model<Net, T>&) -> Engine<Net, T, DefaultExecutor>;
template <class Net, class T, Executor Exec>
Engine(const Model<Net, T>&, Exec, Precision = Precision::automatic) -> Engine<Net, T, Exec>;

#ifdef NPT_PREBUILT
extern template class engine::Core<float, DefaultExecutor>;
extern template class engine::Core<double, DefaultExecutor>;
#endif

}  // namespace npt::inline NPT_ABI
