/// Mean and biased variance of each channel over the vertices, gathered while tiles are written.
///
/// Each group contributes its mean and its sum of squared differences from that mean; the groups are merged in
/// index order in double (Chan, Golub, LeVeque: "Updating formulae and a pairwise algorithm", 1979). Both are fixed
/// orders: the result has the same bits for any number of threads. E[x^2] - m^2 in fp32 was wrong by 80 % for mean 30,
/// deviation 0.01.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/simd/batch.hpp>

#include <array>
#include <cmath>
#include <cstddef>

namespace npt::inline NPT_ABI::kernel {

/// eps of instance normalisation (the paper's network uses PyTorch's default).
inline constexpr double norm_epsilon = 1e-5;

namespace internal {

/// gather_moments for four rows of a whole group at once: one waits for its sums while others add.
template <class T>
NPT_ALWAYS_INLINE void gather_four(const T* rows_begin, std::size_t stride, T* mean, T* squares) {
  constexpr int lanes = simd::lanes<T>;
  const auto value = [&](auto r, auto i) NPT_LAMBDA_INLINE {
    return simd::load(rows_begin + r * panel_width<T> + stride * static_cast<std::size_t>(i / panel_registers) +
                      i % panel_registers * lanes);
  };
  const auto zero = simd::broadcast(T(0));
  std::array<simd::Batch<T>, 4> sum{zero, zero, zero, zero}, square{zero, zero, zero, zero};
  simd::unroll<group_width / lanes>(
      [&](auto i) NPT_LAMBDA_INLINE { simd::unroll<4>([&](auto r) NPT_LAMBDA_INLINE { sum[r] += value(r, i); }); });
  const std::array<T, 4> sums = simd::reduce_add<T>(sum);
  simd::unroll<4>([&](auto r) NPT_LAMBDA_INLINE {
    mean[r] = sums[r] * (T(1) / static_cast<T>(group_width));
    sum[r] = simd::broadcast(mean[r]);
  });
  simd::unroll<group_width / lanes>([&](auto i) NPT_LAMBDA_INLINE {
    simd::unroll<4>([&](auto r) NPT_LAMBDA_INLINE {
      const simd::Batch<T> d = value(r, i) - sum[r];
      square[r] = simd::fma(d, d, square[r]);
    });
  });
  const std::array<T, 4> all = simd::reduce_add<T>(square);
  simd::unroll<4>([&](auto r) NPT_LAMBDA_INLINE { squares[r] = all[r]; });
}

}  // namespace internal

/// The rows' values in one group: `valid` vertices in `panels` panels, `stride` elements apart.
/// Writes mean[r] and squares[r] = sum of (x - mean)^2 for r < rows.
template <class T>
void gather_moments(const T* rows_begin, std::size_t stride, int valid, int rows, T* mean, T* squares) {
  constexpr int lanes = simd::lanes<T>;
  using B = simd::Batch<T>;
  int r = 0;
  if (valid == group_width)
    for (; r + 4 <= rows; r += 4)
      internal::gather_four<T>(rows_begin + static_cast<std::size_t>(r) * panel_width<T>, stride, mean + r,
                               squares + r);
  const B zero = simd::broadcast(T(0));
  const int full = valid / lanes;
  const int rest = valid % lanes;
  const auto at = [&](const T* row, int i) NPT_LAMBDA_INLINE {
    return row + stride * static_cast<std::size_t>(i / panel_registers) + (i % panel_registers) * lanes;
  };
  for (; r < rows; ++r) {
    const T* row = rows_begin + static_cast<std::size_t>(r) * panel_width<T>;
    B sum = zero;
    for (int i = 0; i < full; ++i) sum += simd::load(at(row, i));
    if (rest != 0) sum += simd::keep_first(simd::load(at(row, full)), 0, rest, zero);
    const T m = simd::reduce_add(sum) / static_cast<T>(valid);
    const B centre = simd::broadcast(m);
    B square = zero;
    for (int i = 0; i < full; ++i) {
      const B d = simd::load(at(row, i)) - centre;
      square = simd::fma(d, d, square);
    }
    if (rest != 0) {
      const B d = simd::keep_first(simd::load(at(row, full)) - centre, 0, rest, zero);
      square = simd::fma(d, d, square);
    }
    mean[r] = m;
    squares[r] = simd::reduce_add(square);
  }
}

#ifdef NPT_COMPILED
extern template void gather_moments(const float*, std::size_t, int, int, float*, float*);
extern template void gather_moments(const double*, std::size_t, int, int, double*, double*);
#endif

/// The larger of two values; NaN from either stays.
template <class T>
T larger_or_nan(T a, T b) {
  return a >= b || a != a ? a : b;
}

/// The largest of the `valid` values of each row; NaN where a row holds one.
template <class T>
void gather_maxima(const T* rows_begin, std::size_t stride, int valid, int rows, T* maximum) {
  constexpr int lanes = simd::lanes<T>;
  using B = simd::Batch<T>;
  for (int r = 0; r < rows; ++r) {
    const T* row = rows_begin + static_cast<std::size_t>(r) * panel_width<T>;
    const B first = simd::broadcast(row[0]);
    B m = first;
    for (int i = 0; i * lanes < valid; ++i) {
      const B x =
          simd::load(row + stride * static_cast<std::size_t>(i / panel_registers) + (i % panel_registers) * lanes);
      m = simd::running_max(m, simd::keep_first(x, i * lanes, valid, first));
    }
    alignas(simd_alignment) T lane[static_cast<std::size_t>(lanes)];
    simd::store(lane, m);
    T best = lane[0];
    for (int i = 1; i < lanes; ++i) best = larger_or_nan(best, lane[i]);
    maximum[r] = best;
  }
}

/// Merges per-group moments [groups][C] into mean[C] and inverse_deviation[C] = 1 / sqrt(variance + eps).
/// `sums` is scratch of 2 C doubles. Requires vertices >= 1.
template <class T>
void merge_moments(const T* group_mean, const T* group_squares, int vertices, int channels, double* sums, T* mean,
                   T* inverse_deviation) {
  double* NPT_RESTRICT m = sums;
  double* NPT_RESTRICT s = sums + channels;
  for (int c = 0; c < channels; ++c) m[c] = s[c] = 0;
  for (int g = 0, before = 0; before < vertices; ++g) {
    const int here = vertices - before < group_width ? vertices - before : group_width;
    const double share = static_cast<double>(here) / (before + here);
    const double cross = static_cast<double>(before) * share;
    const T* NPT_RESTRICT gm = group_mean + static_cast<std::size_t>(g) * static_cast<std::size_t>(channels);
    const T* NPT_RESTRICT gs = group_squares + static_cast<std::size_t>(g) * static_cast<std::size_t>(channels);
    for (int c = 0; c < channels; ++c) {
      const double d = static_cast<double>(gm[c]) - m[c];
      m[c] += d * share;
      s[c] += static_cast<double>(gs[c]) + d * d * cross;
    }
    before += here;
  }
  for (int c = 0; c < channels; ++c) {
    mean[c] = static_cast<T>(m[c]);
    inverse_deviation[c] = static_cast<T>(1.0 / std::sqrt(s[c] / vertices + norm_epsilon));
  }
}

}  // namespace npt::inline NPT_ABI::kernel
