/// The register tile at every height and several K, in the first-level cache; Eigen on the same product.
#include <support/common.hpp>

#include <npt/nn/kernel/micro_kernel.hpp>

#include <Eigen/Core>

#include <algorithm>

namespace {

namespace kernel = npt::kernel;
using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int width = kernel::panel_width<float>;

/// weights [K][rows], operand [K][width], bias [rows].
struct Case {
  Case(int rows_, int k_)
      : rows(rows_),
        k(k_),
        weights(bench::random_buffer(static_cast<std::size_t>(rows_ * k_), 1)),
        operand(bench::random_buffer(static_cast<std::size_t>(k_ * width), 2)),
        bias(bench::random_buffer(static_cast<std::size_t>(rows_), 3)),
        tile(static_cast<std::size_t>(rows_ * width)) {}

  double flops() const { return 2.0 * rows * k * width; }
  /// found(r, v) against the plain sum.
  template <class Found>
  double error(Found&& found) const {
    bench::Difference difference;
    for (int r = 0; r < rows; ++r)
      for (int v = 0; v < width; ++v) {
        double sum = bias.data()[r];
        for (int i = 0; i < k; ++i) sum += double{weights.data()[i * rows + r]} * double{operand.data()[i * width + v]};
        difference.add(found(r, v), sum);
      }
    return difference.relative();
  }

  int rows, k;
  npt::AlignedBuffer<float> weights, operand, bias, tile;
};

void micro_kernel(benchmark::State& state) {
  Case c(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const auto run = [&] {
    kernel::micro_kernel_of<float>(c.rows)(c.k, c.weights.data(), c.operand.data(), c.bias.data(), c.tile.data());
  };
  run();
  if (!bench::verified(state, c.error([&](int r, int v) { return c.tile.data()[r * width + v]; }))) return;
  bench::time_flops(state, c.flops(), run);
}

void eigen(benchmark::State& state) {
  Case c(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  Matrix weights(c.rows, c.k), operand(c.k, width), tile(c.rows, width);
  Eigen::VectorXf bias(c.rows);
  for (int r = 0; r < c.rows; ++r) {
    bias(r) = c.bias.data()[r];
    for (int i = 0; i < c.k; ++i) weights(r, i) = c.weights.data()[i * c.rows + r];
  }
  std::copy_n(c.operand.data(), c.k * width, operand.data());
  const auto run = [&] {
    tile.noalias() = weights * operand;
    tile.colwise() += bias;
  };
  run();
  if (!bench::verified(state, c.error([&](int r, int v) { return tile(r, v); }))) return;
  bench::time_flops(state, c.flops(), run);
}

void heights(benchmark::internal::Benchmark* b) {
  b->ArgNames({"rows", "K"});
  for (int rows = 1; rows <= kernel::max_tile_rows; ++rows) b->Args({rows, 256});
  for (const int k : {3, 64, 128, 513, 1027}) b->Args({kernel::max_tile_rows, k});
}
BENCHMARK(micro_kernel)->Apply(heights);
BENCHMARK(eigen)->ArgNames({"rows", "K"})->Args({kernel::max_tile_rows, 256})->Args({kernel::max_tile_rows, 1027});

}  // namespace
