/// An activation with parameters, y = a relu(x) + b tanh(x): one compiled loop for activations of several kinds.
/// Gradients  a, b, x
#pragma once

#include <npt/nn/kernel/pointwise.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <array>

namespace random_networks {

struct Blend : npt::kernel::Pointwise {
  static constexpr const char* name = "blend";
  static constexpr bool increasing = true;  // as long as neither is negative
  static constexpr std::array<bool, npt::kernel::max_pointwise_parameters> per_channel{false, false};
  npt::Parameter relu{1};
  npt::Parameter tanh{1};
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("relu", self.relu);
    visitor("tanh", self.tanh);
  }

  template <class T>
  struct Row {
    npt::simd::Batch<T> relu, tanh;
  };
  template <class T>
  static NPT_ALWAYS_INLINE Row<T> row(const npt::kernel::PointwiseArgs<T>& args, int) {
    return {npt::simd::broadcast(args.parameters[0][0]), npt::simd::broadcast(args.parameters[1][0])};
  }
  template <class T>
  static NPT_ALWAYS_INLINE npt::simd::Batch<T> apply(npt::simd::Batch<T> x, const Row<T>& row, Nothing) {
    return npt::simd::fma(row.tanh, npt::simd::tanh(x), row.relu * npt::simd::relu(x));
  }
  static constexpr int sums_per_channel = 2;
  template <class T>
  static NPT_ALWAYS_INLINE npt::simd::Batch<T> vjp(const npt::simd::Batch<T>& x, const npt::simd::Batch<T>& dy,
                                                   const Row<T>& row, Nothing, npt::simd::Batch<T>* sums) {
    const npt::simd::Batch<T> t = npt::simd::tanh(x);
    sums[0] = npt::simd::fma(dy, npt::simd::relu(x), sums[0]);
    sums[1] = npt::simd::fma(dy, t, sums[1]);
    return npt::simd::fma(row.relu, npt::simd::zero_where_not_positive(x, dy),
                          row.tanh * dy * (npt::simd::broadcast(T(1)) - t * t));
  }
};

}  // namespace random_networks
