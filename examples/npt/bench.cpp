/// npt bench: verifies the engine on fresh random input, then times it beside the processor's peak.
#include "bench_train.hpp"
#include "bench_transfer.hpp"
#include "networks.hpp"
#include "precision_option.hpp"
#include "report.hpp"
#include "subcommand.hpp"

#include <bench/peak.hpp>
#include <host/host.hpp>

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/kernel/micro_kernel.hpp>
#include <npt/nn/kernel/packed_weights.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bench_command {

struct Options {
  int vertices = 6890, bottleneck = 1024, threads = 0, batch = 1, repeats = 9;
  int rows = 1027, columns = 1027;
  std::string order = "conv_relu", feature = "per-vertex", precision = "auto";
  std::optional<std::uint64_t> seed;
  bool json = false;
};

/// What a benchmark reports.
struct Result {
  std::string name;
  std::string products;                ///< what they were computed in: the precision, or what `auto` chose
  std::vector<double> seconds, peaks;  ///< of each repeat
  double operations = 0;               ///< of one repeat, by the plain algorithm's count
  double error = 0;                    ///< norm of the difference over norm of the double reference
  double memory_mb = 0;                ///< largest resident set of a process that only does this

  static double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  }
  double gflops() const { return 1e-9 * operations / median(seconds); }

  void print(const Options& o, std::uint64_t seed) const {
    const double least = *std::min_element(seconds.begin(), seconds.end());
    const double peak = median(peaks);
    if (o.json) {
      std::printf(
          "{\"bench\": \"%s\", \"isa\": \"%s\", \"threads\": %d, \"vertices\": %d, \"batch\": %d, \"precision\": "
          "\"%s\", \"products\": \"%s\", "
          "\"seed\": %llu, \"seconds_min\": %.6g, \"seconds_median\": %.6g, \"gflops\": %.5g, \"peak_gflops\": %.5g, "
          "\"share\": %.4g, \"error\": %.3g, \"peak_memory_mb\": %.1f}\n",
          name.c_str(), npt::compiled_isa(), o.threads, o.vertices, o.batch, o.precision.c_str(), products.c_str(),
          static_cast<unsigned long long>(seed), least, median(seconds), gflops(), peak, gflops() / peak, error,
          memory_mb);
      return;
    }
    std::printf("%s, %d vertices, batch %d, %s, %d thread%s, %s\n", name.c_str(), o.vertices, o.batch,
                program::precision_text(o.precision, products).c_str(), o.threads, o.threads == 1 ? "" : "s",
                npt::compiled_isa());
    std::printf("error          %.2e relative to the double reference (seed %llu)\n", error,
                static_cast<unsigned long long>(seed));
    std::printf("seconds        %.4f min, %.4f median of %zu\n", least, median(seconds), seconds.size());
    std::printf("GFLOP/s        %.0f by the plain algorithm's count\n", gflops());
    std::printf("peak GFLOP/s   %.0f in this process; share %.1f %%\n", peak, 100 * gflops() / peak);
    if (memory_mb > 0) std::printf("memory         %.1f MB at most\n", memory_mb);
  }
};

template <class T>
double relative_difference(const std::vector<T>& found, const std::vector<double>& expected) {
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double d = static_cast<double>(found[i]) - expected[i];
    difference += d * d;
    norm += expected[i] * expected[i];
  }
  return std::sqrt(difference / norm);
}

template <class T>
std::vector<T> random_points(int vertices, std::uint64_t seed, std::uint64_t stream) {
  npt::Random random(seed, stream);
  std::vector<T> points(3 * static_cast<std::size_t>(vertices));
  // Rounded to float for both precisions, so that they see the same numbers.
  for (T& x : points) x = static_cast<T>(static_cast<float>(random.uniform(-1, 1)));
  return points;
}

/// Of the unit that multiplies, divided by the products that a precision takes for one; for `auto`, which promises
/// fp32's error, of fp32's unit.
double peak_of(const Options& o) {
  const npt::Precision precision = program::precision_from(o.precision);
  if (precision == npt::Precision::automatic) return bench::measure_peak<float>(o.threads);
  const int parts = npt::parts_of(precision);
  if (parts == 0) return bench::measure_peak<float>(o.threads);
  if (!npt::simd::has_matrix_registers()) return bench::measure_peak<float, true>(o.threads);
  return bench::measure_matrix_peak(o.threads) / (parts * (parts + 1) / 2);
}

/// Times `run` and the peak in turn, so that both see the same machine.
void time_beside_peak(const Options& o, Result& result, const std::function<void()>& run) {
  run();  // warm
  for (int i = 0; i < o.repeats; ++i) {
    const double start = bench::seconds_now();
    run();
    result.seconds.push_back(bench::seconds_now() - start);
    result.peaks.push_back(peak_of(o));
  }
}

void bench_forward(const program::NetworkType& network, const Options& o, std::uint64_t seed) {
  const npt::Precision precision = program::precision_from(o.precision);
  const std::vector<float> pose = random_points<float>(o.vertices, seed, 1001);
  const std::vector<float> identity = random_points<float>(o.vertices, seed, 1002);
  Result result{.name = "forward, " + npt::variant_name(network.variant), .products = {}, .seconds = {}, .peaks = {}};
  const host::Apart apart = host::run_apart([&]() -> std::vector<double> {
    const auto engine = program::random_engine(network, seed, o.threads, precision);
    std::vector<float> out(identity.size());
    engine({pose, identity}, out);
    return {};
  });
  result.memory_mb = apart.done ? apart.memory_mb : 0;

  const auto engine = program::random_engine(network, seed, o.threads, precision);
  result.products = program::products_text(engine.precision());
  const auto batch = static_cast<std::size_t>(o.batch);
  std::vector<std::vector<float>> poses, identities, results(batch, std::vector<float>(identity.size()));
  std::vector<npt::NetworkCall<float>> calls;
  for (std::size_t i = 0; i < batch; ++i) {
    poses.push_back(i == 0 ? pose : random_points<float>(o.vertices, seed, 2000 + i));
    identities.push_back(i == 0 ? identity : random_points<float>(o.vertices, seed, 3000 + i));
  }
  for (std::size_t i = 0; i < batch; ++i) calls.push_back({{poses[i], identities[i]}, results[i]});
  engine.run(calls);
  std::vector<double> expected(identity.size());
  program::random_double_engine(network, seed, o.threads)(
      {random_points<double>(o.vertices, seed, 1001), random_points<double>(o.vertices, seed, 1002)}, expected);
  result.error = relative_difference(results[0], expected);
  const double bound = precision == npt::Precision::bf16 ? 5e-2 : precision == npt::Precision::bf16x2 ? 1e-3 : 1e-5;
  if (!(result.error < bound))
    throw npt::Error({.file = "bench forward",
                      .found = "an error of " + std::to_string(result.error),
                      .expected = "less than " + std::to_string(bound) + " before timing"});
  result.operations = 2 * network.program->multiply_adds * o.vertices * o.batch;
  time_beside_peak(o, result, [&] { engine.run(calls); });
  result.print(o, seed);
}

/// One convolution's matrix product, rows x columns weights on packed tiles, without prologue or epilogue.
void bench_gemm(Options o, std::uint64_t seed) {
  o.precision = "fp32";
  namespace kernel = npt::kernel;
  npt::Random random(seed, 5);
  const auto size = static_cast<std::size_t>(o.rows) * static_cast<std::size_t>(o.columns);
  std::vector<float> weights(size);
  for (float& w : weights) w = static_cast<float>(random.uniform(-1, 1));
  const kernel::PackedWeights<float> packed(
      o.rows, o.columns,
      [&](int r, int k) {
        return weights[static_cast<std::size_t>(r) * static_cast<std::size_t>(o.columns) + static_cast<std::size_t>(k)];
      },
      [](int) { return 0.0F; });
  const int groups = kernel::group_count(o.vertices);
  const std::size_t in_tile = kernel::tile_size(o.columns), out_tile = kernel::tile_size(o.rows);
  npt::AlignedBuffer<float> in(in_tile * static_cast<std::size_t>(groups)),
      out(out_tile * static_cast<std::size_t>(groups));
  for (float& x : in.span()) x = static_cast<float>(random.uniform(-1, 1));
  const npt::DefaultExecutor executor(o.threads);
  const auto run = [&] {
    executor.for_each(groups, [&](int g, int) {
      const int rest = o.vertices - g * kernel::group_width;
      const int panels = kernel::used_panels<float>(std::min(rest, kernel::group_width));
      const float* operand = in.data() + in_tile * static_cast<std::size_t>(g);
      float* product = out.data() + out_tile * static_cast<std::size_t>(g);
      for (int b = 0; b < packed.blocks().count; ++b)
        for (int p = 0; p < panels; ++p)
          kernel::micro_kernel_of<float>(packed.blocks().rows(b))(
              o.columns, packed.block(b),
              operand + kernel::panel_stride<float>(o.columns) * static_cast<std::size_t>(p),
              packed.bias() + packed.blocks().first_row(b),
              product + kernel::panel_stride<float>(o.rows) * static_cast<std::size_t>(p) +
                  packed.blocks().first_row(b) * kernel::panel_width<float>);
    });
  };
  run();
  Result result{.name = "gemm " + std::to_string(o.rows) + " x " + std::to_string(o.columns),
                .products = "fp32",
                .seconds = {},
                .peaks = {}};
  std::vector<float> found;
  std::vector<double> expected;
  for (int i = 0; i < 2000; ++i) {  // entries drawn at random
    const auto r = random.below(static_cast<std::uint32_t>(o.rows)),
               v = random.below(static_cast<std::uint32_t>(o.vertices));
    const auto width = static_cast<std::size_t>(kernel::panel_width<float>);
    const std::size_t g = v / kernel::group_width, p = v % kernel::group_width / width, lane = v % width;
    const float* x = in.data() + in_tile * g + kernel::panel_stride<float>(o.columns) * p + lane;
    double sum = 0;
    for (int k = 0; k < o.columns; ++k)
      sum += static_cast<double>(weights[r * static_cast<std::size_t>(o.columns) + static_cast<std::size_t>(k)]) *
             static_cast<double>(x[static_cast<std::size_t>(k) * width]);
    expected.push_back(sum);
    found.push_back(out[out_tile * g + kernel::panel_stride<float>(o.rows) * p + r * width + lane]);
  }
  result.error = relative_difference(found, expected);
  if (!(result.error < 1e-5))
    throw npt::Error({.file = "bench gemm",
                      .found = "an error of " + std::to_string(result.error),
                      .expected = "less than 1e-5 before timing"});
  result.operations = 2.0 * static_cast<double>(size) * o.vertices;
  time_beside_peak(o, result, run);
  result.print(o, seed);
}

std::uint64_t seed_of(const Options& o) {
  // Fresh input for each run, unless a run is to be repeated.
  return o.seed.value_or(static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count()));
}

void add_common(CLI::App& command, const std::shared_ptr<Options>& o) {
  command.add_option("--vertices", o->vertices, "Give both meshes this many vertices")
      ->check(CLI::Range(1, 10000000))
      ->capture_default_str();
  command.add_option("--threads", o->threads, "Use this many threads; 0: all that the process may use")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  command.add_option("--repeats", o->repeats, "Time this many runs")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command.add_option("--seed", o->seed, "Draw the input from this seed (default: another one each time)")
      ->check(program::whole_number());
  command.add_flag("--json", o->json, "Print one line of JSON");
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  command.require_subcommand(1);
  CLI::App* forward = command.add_subcommand("forward", "Time one pass of the network");
  add_common(*forward, o);
  forward->add_option("--bottleneck", o->bottleneck, "Give the pose feature this many channels")
      ->check(CLI::IsMember({1024, 512, 256, 128, 64}))
      ->capture_default_str();
  forward->add_option("--order", o->order, "Order layers as the paper (conv_relu) or its code (relu_conv)")
      ->check(CLI::IsMember({"conv_relu", "relu_conv"}))
      ->capture_default_str();
  forward->add_option("--feature", o->feature, "Use this pose feature")
      ->check(CLI::IsMember({"per-vertex", "pooled"}))
      ->capture_default_str();
  forward->add_option("--batch", o->batch, "Pass this many pairs in one call")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  program::add_precision_option(*forward, o->precision);
  const auto threads = [o] {
    if (o->threads == 0) o->threads = npt::DefaultExecutor().slots();
  };
  forward->callback([o, threads] {
    threads();
    bench_forward(*program::find_network({o->bottleneck, o->order, o->feature}), *o, seed_of(*o));
  });
  CLI::App* gemm = command.add_subcommand("gemm", "Time one matrix product");
  add_common(*gemm, o);
  gemm->add_option("--rows", o->rows, "Compute this many output channels")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  gemm->add_option("--columns", o->columns, "Read this many input channels")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  gemm->callback([o, threads] {
    threads();
    bench_gemm(*o, seed_of(*o));
  });
  program::add_bench_train(command);
  program::add_bench_transfer(command);
}

const program::Subcommand registered("bench", "Measure speed, beside the processor's peak", add);

}  // namespace bench_command
