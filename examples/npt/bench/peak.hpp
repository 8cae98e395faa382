/// What the processor can do at most, measured now: the yardstick for every kernel.
#pragma once

#include <npt/nn/simd/amx.hpp>
#include <npt/nn/simd/batch.hpp>
#include <npt/nn/simd/bf16.hpp>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace bench {

inline double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

namespace internal {

/// Independent multiply-adds in registers, enough to cover their latency. Returns operations done.
template <class T, bool Bf16>
NPT_NOINLINE double multiply_add_loop(long rounds, T* sink) {
#if defined(__AVX512F__) || defined(__aarch64__)
  constexpr int chains = 24;
#else
  constexpr int chains = 12;
#endif
  using B = npt::simd::Batch<T>;
  B sum[chains];
  npt::simd::unroll<chains>([&](auto i) NPT_LAMBDA_INLINE { sum[i] = npt::simd::broadcast(static_cast<T>(i)); });
  const B factor = npt::simd::broadcast(sink[0]), term = npt::simd::broadcast(sink[1]);
  for (long r = 0; r < rounds; ++r) {
    npt::simd::unroll<chains>([&](auto i) NPT_LAMBDA_INLINE {
      if constexpr (Bf16)
        sum[i] = npt::simd::dot_bf16(factor, term, sum[i]);
      else
        sum[i] = npt::simd::fma(sum[i], factor, term);
    });
  }
  B total = sum[0];
  npt::simd::unroll<chains>([&](auto i) NPT_LAMBDA_INLINE { total += sum[i]; });
  sink[0] = npt::simd::reduce_add(total);
  return 2.0 * chains * npt::simd::lanes<T> * (Bf16 ? 2 : 1) * static_cast<double>(rounds);
}

#if NPT_HAS_AMX
/// The same with products of matrix registers, both operands in registers.
NPT_NOINLINE inline double matrix_multiply_loop(long rounds) {
  const npt::simd::MatrixRegisters registers;
  _tile_zero(0);
  _tile_zero(1);
  _tile_zero(2);
  _tile_zero(3);
  _tile_zero(4);
  _tile_zero(5);
  _tile_zero(6);
  _tile_zero(7);
  for (long r = 0; r < rounds; ++r) {
    _tile_dpbf16ps(0, 4, 6);
    _tile_dpbf16ps(1, 4, 7);
    _tile_dpbf16ps(2, 5, 6);
    _tile_dpbf16ps(3, 5, 7);
  }
  return 2.0 * 4 * 16 * 16 * 32 * static_cast<double>(rounds);
}
#else
inline double matrix_multiply_loop(long) { return 0; }
#endif

}  // namespace internal

namespace internal {

/// GFLOP/s of loop(sink), which returns the operations that it did, on `threads` threads at the same time over about
/// `seconds`.
template <class Loop>
double measure_rate(int threads, double seconds, Loop&& loop) {
  std::atomic<int> ready{0};
  std::vector<double> operations(static_cast<std::size_t>(threads)), spans(operations.size());
  const auto work = [&](std::size_t t) {
    ++ready;
    while (ready.load() < threads) std::this_thread::yield();
    const double start = seconds_now();
    do operations[t] += loop();
    while (seconds_now() - start < seconds);
    spans[t] = seconds_now() - start;
  };
  std::vector<std::thread> others;
  for (std::size_t t = 1; t < operations.size(); ++t) others.emplace_back(work, t);
  work(0);
  for (std::thread& thread : others) thread.join();
  double rate = 0;
  for (std::size_t t = 0; t < operations.size(); ++t) rate += operations[t] / spans[t];
  return rate * 1e-9;
}

}  // namespace internal

/// Multiply-adds in registers.
template <class T = float, bool Bf16 = false>
double measure_peak(int threads, double seconds = 0.05) {
  return internal::measure_rate(threads, seconds, [] {
    alignas(64) volatile T source[2] = {T(0.999), T(1e-3)};  // not known to the compiler
    T sink[2] = {source[0], source[1]};
    return internal::multiply_add_loop<T, Bf16>(20000, sink);
  });
}

/// Products of matrix registers (AMX), of bfloat16 values.
inline double measure_matrix_peak(int threads, double seconds = 0.05) {
  return internal::measure_rate(threads, seconds, [] { return internal::matrix_multiply_loop(20000); });
}

}  // namespace bench
