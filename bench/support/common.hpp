/// What the benchmarks share: random input, the comparison before the clock starts, and rates beside the peak.
#pragma once

#include <bench/peak.hpp>

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/kernel/panel.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <time.h>

namespace bench {

/// Vertices of SMPL's mesh: what the paper works with.
inline constexpr int paper_vertices = 6890;

/// Uniform in [-1, 1).
inline void fill(std::span<float> values, std::uint64_t stream) {
  npt::Random random(7, stream);
  for (float& x : values) x = static_cast<float>(random.uniform(-1, 1));
}

inline npt::AlignedBuffer<float> random_buffer(std::size_t size, std::uint64_t stream) {
  npt::AlignedBuffer<float> buffer(size);
  fill(buffer.span(), stream);
  return buffer;
}

/// Where channel c of vertex v stands in a mesh's tiles of C channels, group after group.
inline std::size_t tile_index(int channels, int c, int v) {
  namespace kernel = npt::kernel;
  constexpr int width = kernel::panel_width<float>;
  const int in_group = v % kernel::group_width;
  return kernel::tile_size(channels) * static_cast<std::size_t>(v / kernel::group_width) +
         kernel::panel_stride<float>(channels) * static_cast<std::size_t>(in_group / width) +
         static_cast<std::size_t>(c * width + in_group % width);
}

/// Norm of the difference over norm of the expected values.
class Difference {
 public:
  void add(float found, double expected) {
    const double d = static_cast<double>(found) - expected;
    difference_ += d * d;
    norm_ += expected * expected;
  }
  double relative() const { return std::sqrt(difference_ / norm_); }

 private:
  double difference_ = 0, norm_ = 0;
};

/// Whether any comparison of this process failed; main returns 1 then.
inline bool any_failed = false;

/// To be called before the timed loop, as `if (!verified(...)) return;`.
inline bool verified(benchmark::State& state, double error, double bound = 1e-5) {
  state.counters["error"] = error;
  if (error < bound) return true;
  any_failed = true;
  state.SkipWithError(("wrong result: relative error " + std::to_string(error)).c_str());
  return false;
}

namespace internal {

/// Processor time of this thread: what others do on a busy machine doesn't count.
inline double thread_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// The peak of one thread by its processor time, in GFLOP/s.
inline double thread_peak() {
  alignas(64) volatile float source[2] = {0.999F, 1e-3F};  // not known to the compiler
  float sink[2] = {source[0], source[1]};
  double operations = 0;
  const double start = thread_seconds();
  do {
    sink[0] = source[0];
    operations += multiply_add_loop<float, false>(20000, sink);
  } while (thread_seconds() - start < 0.03);
  return 1e-9 * operations / (thread_seconds() - start);
}

/// Seconds of one call of `run` in the timed loop.
template <class Run>
double time_loop(benchmark::State& state, Run&& run, int threads) {
  const auto clock = threads == 1 ? &thread_seconds : &seconds_now;
  const double start = clock();
  for (auto _ : state) {
    run();
    benchmark::ClobberMemory();
  }
  return (clock() - start) / static_cast<double>(state.iterations());
}

}  // namespace internal

/// Times `run`; reports GFLOP/s, the peak measured right afterwards on as many threads, and the share of it. With
/// several threads the benchmark must be registered with UseRealTime.
template <class Run>
void time_flops(benchmark::State& state, double flops, Run&& run, int threads = 1) {
  const double rate = 1e-9 * flops / internal::time_loop(state, run, threads);
  const double peak = threads == 1 ? internal::thread_peak() : measure_peak<float>(threads);
  state.counters["GFLOP/s"] = rate;
  state.counters["peak"] = peak;
  state.counters["share_%"] = 100 * rate / peak;
}

/// Times `run`; reports the values that it writes a second, in 10^9.
template <class Run>
void time_values(benchmark::State& state, double values, Run&& run) {
  state.counters["Gvalue/s"] = 1e-9 * values / internal::time_loop(state, run, 1);
}

}  // namespace bench
