/// The gradient of a network: what training, and anything else that differentiates through a network, holds.
///
///   npt::Gradients<Net> gradients(threads);
///   gradients.load(model.buffer());                  // after every change of the weights
///   gradients.forward(calls);                        // results to call.result
///   gradients.backward(result_gradients, gradient);  // dL / d result in, dL / d parameters out
///
/// Exact up to rounding, for every network that can be composed; a layer without a vjp is a compile error.
/// Thread safety  one call at a time; inside, the executor's threads work
/// Memory         about 35 KB a vertex for the paper's network; a warm step allocates nothing
/// Numerics       the same bits for any number of threads
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/tape/chain_loops.hpp>
#include <npt/nn/tape/gradient_core.hpp>
#include <npt/nn/tape/lower.hpp>

#include <cstddef>
#include <utility>

namespace npt::inline NPT_ABI {

template <class Net, class T = float, class Exec = DefaultExecutor>
class Gradients : public tape::GradientCore<T, Exec> {
 public:
  using Network = Net;

  /// `threads` as for Engine.
  explicit Gradients(int threads = 0) : Gradients(Exec(threads)) {}
  explicit Gradients(Exec executor)
      : tape::GradientCore<T, Exec>(tape::tape_of<Net>,
                                    static_cast<std::size_t>(parameter_buffer_size(graph::bound_network<Net>)),
                                    tape::chain_loops<T, Net>, std::move(executor)) {}
};

#ifdef NPT_COMPILED
extern template class tape::GradientCore<float, DefaultExecutor>;
extern template class tape::GradientCore<double, DefaultExecutor>;
#endif

}  // namespace npt::inline NPT_ABI
