/// Rectified linear unit: y = max(0, x), elementwise.
/// Shapes     x, y: [C, V]
/// Numerics   NaN in gives NaN out
/// Gradients  x: 0 at x = 0
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/pointwise.hpp>

namespace npt::inline NPT_ABI {

struct Relu : kernel::Pointwise {
  static constexpr const char* name = "relu";
  static constexpr bool increasing = true;
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> apply(simd::Batch<T> x, Nothing, Nothing) {
    return simd::relu(x);
  }
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> vjp(const simd::Batch<T>& x, const simd::Batch<T>& dy, Nothing, Nothing,
                                              simd::Batch<T>*) {
    return simd::zero_where_not_positive(x, dy);
  }
};
inline constexpr Relu relu{};

}  // namespace npt::inline NPT_ABI
