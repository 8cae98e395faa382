/// Clipping by the global norm (Pascanu et al., ICML 2013, algorithm 1): a gradient longer than the limit is shortened
/// to it, so that one unlucky batch can't throw the weights far away.
/// Numerics  squares are summed in double, in a fixed order: the same bits for any number of threads
#pragma once

#include <npt/base/executor.hpp>
#include <npt/config.hpp>
#include <npt/nn/train/slices.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// Sum of the squares, over 16 partial sums that fill vector registers.
template <class T>
double sum_of_squares(std::span<const T> x) {
  constexpr std::size_t width = 16;
  std::array<double, width> sums{};
  std::size_t i = 0;
  for (; i + width <= x.size(); i += width)
    for (std::size_t k = 0; k < width; ++k) sums[k] += static_cast<double>(x[i + k]) * static_cast<double>(x[i + k]);
  for (std::size_t k = 0; i < x.size(); ++i, ++k) sums[k] += static_cast<double>(x[i]) * static_cast<double>(x[i]);
  double sum = 0;
  for (const double s : sums) sum += s;
  return sum;
}

/// Norm of the gradient over all learned values. `partial`: memory for one number a slice, kept between calls.
template <class T, Executor Exec>
double gradient_norm(std::span<const T> gradient, std::span<const Slice> slices, const Exec& executor,
                     std::vector<double>& partial) {
  partial.resize(slices.size());
  executor.for_each(static_cast<int>(slices.size()), [&](int i, int) {
    const auto k = static_cast<std::size_t>(i);
    partial[k] = sum_of_squares(gradient.subspan(slices[k].first, slices[k].size()));
  });
  double sum = 0;
  for (const double s : partial) sum += s;
  return std::sqrt(sum);
}

/// The factor that brings a gradient of this norm to at most `limit`; exactly 1 where it is short enough. A limit of 0
/// clips nothing.
inline double clip_factor(double norm, double limit) { return limit > 0 && norm > limit ? limit / norm : 1.0; }

}  // namespace npt::inline NPT_ABI
