/// Instance normalisation of each channel of each mesh over its vertices, without parameters.
///   y[c, v] = (x[c, v] - mean_c) / sqrt(var_c + eps)
/// Shapes     x, y: [C, V]
/// Numerics   biased variance, eps = 1e-5; moments merged in a fixed order; with V = 1 every y is 0; NaN in, NaN out
///            the mean is subtracted before the scaling: folding both into one multiply-add loses digits where the mean
///            is large beside the deviation
/// Gradients  x
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/pointwise.hpp>

namespace npt::inline NPT_ABI {

struct InstanceNorm : kernel::Pointwise {
  static constexpr const char* name = "instance_norm";
  static constexpr bool normalises = true;
  static constexpr bool increasing = true;
  template <class T>
  struct Row {
    simd::Batch<T> mean, inverse_deviation;
  };
  template <class T>
  static NPT_ALWAYS_INLINE Row<T> row(const kernel::PointwiseArgs<T>& args, int c) {
    return {simd::broadcast(args.mean[c]), simd::broadcast(args.inverse_deviation[c])};
  }
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> apply(simd::Batch<T> x, const Row<T>& row, Nothing) {
    return (x - row.mean) * row.inverse_deviation;
  }
};
inline constexpr InstanceNorm instance_norm{};

}  // namespace npt::inline NPT_ABI
