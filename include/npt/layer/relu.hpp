/// Rectified linear unit: y = max(0, x), elementwise; NaN in gives NaN out.
#pragma once

#include <npt/config.hpp>
#include <npt/kernel/pointwise.hpp>

namespace npt::inline NPT_ABI {

struct Relu : kernel::Pointwise {
  static constexpr const char* name = "relu";
  static constexpr bool increasing = true;
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> apply(simd::Batch<T> x, Nothing, Nothing) {
    return simd::relu(x);
  }
};
inline constexpr Relu relu{};

}  // namespace npt::inline NPT_ABI
