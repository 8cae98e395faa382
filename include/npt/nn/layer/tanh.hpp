/// Hyperbolic tangent with a scale: y = scale * tanh(x), elementwise.
/// The paper's output is tanh (scale 1, section 3.4); the released code uses 2 tanh. The scale is an attribute of the
/// network: a number in the weights' metadata under the name that the network gives it, not a learned tensor.
/// Shapes     x, y: [C, V]
/// Gradients  x
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/pointwise.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <array>

namespace npt::inline NPT_ABI {

struct ScaledTanh : kernel::Pointwise {
  static constexpr const char* name = "tanh";
  static constexpr std::array<bool, kernel::max_pointwise_parameters> per_channel{false};
  Parameter scale = Parameter::number(1.0);

  static constexpr void visit(auto& self, auto&& visitor) { visitor("scale", self.scale); }

  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> row(const kernel::PointwiseArgs<T>& args, int) {
    return simd::broadcast(args.parameters[0][0]);
  }
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> apply(simd::Batch<T> x, const simd::Batch<T>& scale, Nothing) {
    return scale * simd::tanh(x);
  }
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> vjp(const simd::Batch<T>& x, const simd::Batch<T>& dy,
                                              const simd::Batch<T>& scale, Nothing, simd::Batch<T>*) {
    const simd::Batch<T> t = simd::tanh(x);
    return scale * dy * (simd::broadcast(T(1)) - t * t);
  }
};

/// tanh without a scale, for networks of one's own.
struct Tanh : kernel::Pointwise {
  static constexpr const char* name = "tanh";
  static constexpr bool increasing = true;
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> apply(simd::Batch<T> x, Nothing, Nothing) {
    return simd::tanh(x);
  }
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> vjp(const simd::Batch<T>& x, const simd::Batch<T>& dy, Nothing, Nothing,
                                              simd::Batch<T>*) {
    const simd::Batch<T> t = simd::tanh(x);
    return dy * (simd::broadcast(T(1)) - t * t);
  }
};
/// The layer by name, x | tanh. A function, unlike relu: the C library has a global function of this name, and where
/// both are seen, as after `using namespace npt`, functions are overloads of each other while a constant would be an
/// ambiguity.
constexpr Tanh tanh() { return {}; }

}  // namespace npt::inline NPT_ABI
