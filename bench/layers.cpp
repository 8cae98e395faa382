/// Layers over a whole mesh of 6890 vertices on one thread: convolutions of the paper's widths, the maximum over
/// vertices, and the residual block; Eigen on the same. (Norms, modulation and activations cost a pass of their own
/// nowhere in the library: see pointwise.cpp and moments.cpp.)
#include <support/common.hpp>
#include <support/eigen_net.hpp>
#include <support/nets.hpp>

#include <npt/nn/kernel/micro_kernel.hpp>
#include <npt/nn/kernel/moments.hpp>
#include <npt/nn/kernel/packed_weights.hpp>

#include <Eigen/Core>

#include <algorithm>

namespace {

namespace kernel = npt::kernel;

constexpr int vertices = bench::paper_vertices;
const int groups = kernel::group_count(vertices);

/// weights [rows][columns] times a mesh's tiles.
struct Convolution {
  Convolution(int rows_, int columns_)
      : rows(rows_),
        columns(columns_),
        weights(bench::random_buffer(static_cast<std::size_t>(rows_ * columns_), 1)),
        bias(bench::random_buffer(static_cast<std::size_t>(rows_), 2)),
        x(bench::random_buffer(kernel::tile_size(columns_) * static_cast<std::size_t>(groups), 3)) {}

  double flops() const { return 2.0 * rows * columns * vertices; }
  /// found(r, v) against the plain sum, at entries drawn at random.
  template <class Found>
  double error(Found&& found) const {
    npt::Random random(11);
    bench::Difference difference;
    for (int i = 0; i < 2000; ++i) {
      const int r = static_cast<int>(random.below(static_cast<std::uint32_t>(rows)));
      const int v = static_cast<int>(random.below(vertices));
      double sum = double{bias.data()[r]};
      for (int k = 0; k < columns; ++k)
        sum += double{weights.data()[r * columns + k]} * double{x.data()[bench::tile_index(columns, k, v)]};
      difference.add(found(r, v), sum);
    }
    return difference.relative();
  }

  int rows, columns;
  npt::AlignedBuffer<float> weights, bias, x;
};

void conv1x1(benchmark::State& state) {
  const Convolution c(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const kernel::PackedWeights<float> packed(
      c.rows, c.columns, [&](int r, int k) { return c.weights.data()[r * c.columns + k]; },
      [&](int r) { return c.bias.data()[r]; });
  npt::AlignedBuffer<float> y(kernel::tile_size(c.rows) * static_cast<std::size_t>(groups));
  const auto run = [&] {
    for (int g = 0; g < groups; ++g) {
      const int panels = kernel::used_panels<float>(std::min(kernel::group_width, vertices - g * kernel::group_width));
      const float* operand = c.x.data() + kernel::tile_size(c.columns) * static_cast<std::size_t>(g);
      float* product = y.data() + kernel::tile_size(c.rows) * static_cast<std::size_t>(g);
      for (int b = 0; b < packed.blocks().count; ++b)
        for (int p = 0; p < panels; ++p)
          kernel::micro_kernel_of<float>(packed.blocks().rows(b))(
              c.columns, packed.block(b),
              operand + kernel::panel_stride<float>(c.columns) * static_cast<std::size_t>(p),
              packed.bias() + packed.blocks().first_row(b),
              product + kernel::panel_stride<float>(c.rows) * static_cast<std::size_t>(p) +
                  packed.blocks().first_row(b) * kernel::panel_width<float>);
    }
  };
  run();
  if (!bench::verified(state, c.error([&](int r, int v) { return y.data()[bench::tile_index(c.rows, r, v)]; }))) return;
  bench::time_flops(state, c.flops(), run);
}

void conv1x1_eigen(benchmark::State& state) {
  const Convolution c(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const bench::EigenMatrix weights = Eigen::Map<const bench::EigenMatrix>(c.weights.data(), c.rows, c.columns);
  const Eigen::VectorXf bias = Eigen::Map<const Eigen::VectorXf>(c.bias.data(), c.rows);
  bench::EigenMatrix x(c.columns, vertices), y(c.rows, vertices);
  for (int k = 0; k < c.columns; ++k)
    for (int v = 0; v < vertices; ++v) x(k, v) = c.x.data()[bench::tile_index(c.columns, k, v)];
  const auto run = [&] {
    y.noalias() = weights * x;
    y.colwise() += bias;
  };
  run();
  if (!bench::verified(state, c.error([&](int r, int v) { return y(r, v); }))) return;
  bench::time_flops(state, c.flops(), run);
}

double maxima_error(int channels, const npt::AlignedBuffer<float>& x, const float* found) {
  bench::Difference difference;
  for (int c = 0; c < channels; ++c) {
    double most = double{x.data()[bench::tile_index(channels, c, 0)]};
    for (int v = 1; v < vertices; ++v) most = std::max(most, double{x.data()[bench::tile_index(channels, c, v)]});
    difference.add(found[c], most);
  }
  return difference.relative();
}

void max_pool(benchmark::State& state) {
  const int channels = static_cast<int>(state.range(0));
  const auto count = static_cast<std::size_t>(channels);
  const auto x = bench::random_buffer(kernel::tile_size(channels) * static_cast<std::size_t>(groups), 1);
  npt::AlignedBuffer<float> by_group(count * static_cast<std::size_t>(groups)), maxima(count);
  const auto run = [&] {
    for (int g = 0; g < groups; ++g)
      kernel::gather_maxima(x.data() + kernel::tile_size(channels) * static_cast<std::size_t>(g),
                            kernel::panel_stride<float>(channels),
                            std::min(kernel::group_width, vertices - g * kernel::group_width), channels,
                            by_group.data() + count * static_cast<std::size_t>(g));
    std::copy_n(by_group.data(), count, maxima.data());
    for (int g = 1; g < groups; ++g)
      for (std::size_t c = 0; c < count; ++c)
        maxima.data()[c] = std::max(maxima.data()[c], by_group.data()[count * static_cast<std::size_t>(g) + c]);
  };
  run();
  if (!bench::verified(state, maxima_error(channels, x, maxima.data()), 1e-12)) return;
  bench::time_values(state, double{1} * channels * vertices, run);
}

void max_pool_eigen(benchmark::State& state) {
  const int channels = static_cast<int>(state.range(0));
  const auto tiles = bench::random_buffer(kernel::tile_size(channels) * static_cast<std::size_t>(groups), 1);
  bench::EigenMatrix x(channels, vertices);
  for (int c = 0; c < channels; ++c)
    for (int v = 0; v < vertices; ++v) x(c, v) = tiles.data()[bench::tile_index(channels, c, v)];
  Eigen::VectorXf maxima = x.rowwise().maxCoeff();
  if (!bench::verified(state, maxima_error(channels, tiles, maxima.data()), 1e-12)) return;
  bench::time_values(state, double{1} * channels * vertices, [&] { maxima = x.rowwise().maxCoeff(); });
}

/// A block between convolutions from and to coordinates, which are under 1 % of its work.
template <int C>
struct BlockNet {
  static constexpr npt::Input inputs[] = {{"points", 3}};
  npt::Conv1x1<3, C> in;
  npt::ResBlock<C> block;
  npt::Conv1x1<C, 3> out;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("in", self.in);
    visitor("block", self.block);
    visitor("out", self.out);
  }
  constexpr auto operator()(auto points) const { return block(points | in, points) | out; }
};

/// The block in double, and the points that it is given.
template <int C>
struct BlockCase {
  BlockCase() : points(support::random_points<float>(vertices, 5)) {
    npt::randomise(model, 9);
    const reference::Weights weights = support::weights_of(model);
    const reference::Map identity = support::to_map(points);
    expected = reference::conv(
        weights, "out",
        reference::block(weights, "block", reference::conv(weights, "in", identity), identity, {}, true));
  }
  static const BlockCase& get() {
    static const BlockCase c;
    return c;
  }
  double flops() const { return 2 * npt::graph::program_of<BlockNet<C>>.multiply_adds * vertices; }

  npt::Model<BlockNet<C>> model;
  std::vector<float> points;
  reference::Map expected;
};

template <int C>
void res_block(benchmark::State& state) {
  const BlockCase<C>& c = BlockCase<C>::get();
  const npt::Engine engine(c.model, npt::SerialExecutor());
  std::vector<float> result(c.points.size());
  engine({c.points}, result);
  if (!bench::verified(state, support::relative_error(result, c.expected))) return;
  bench::time_flops(state, c.flops(), [&] { engine({c.points}, result); });
}

template <int C>
void res_block_eigen(benchmark::State& state) {
  const BlockCase<C>& c = BlockCase<C>::get();
  const bench::EigenNet net(support::weights_of(c.model));
  const bench::EigenMatrix identity = bench::to_eigen(support::to_map(c.points));
  bench::EigenMatrix y;
  const auto run = [&] { y = net.conv("out", net.block("block", net.conv("in", identity), identity)); };
  run();
  bench::Difference difference;
  for (int axis = 0; axis < 3; ++axis)
    for (int v = 0; v < vertices; ++v)
      difference.add(y(axis, v), c.expected.row(static_cast<std::size_t>(axis))[static_cast<std::size_t>(v)]);
  if (!bench::verified(state, difference.relative(), 1e-4)) return;
  bench::time_flops(state, c.flops(), run);
}

void shapes(benchmark::internal::Benchmark* b) {
  b->ArgNames({"rows", "columns"})->Unit(benchmark::kMillisecond);
  for (const auto& [rows, columns] : {std::pair{64, 3},
                                      {128, 64},
                                      {1024, 128},
                                      {1027, 1027},
                                      {513, 1027},
                                      {513, 513},
                                      {256, 513},
                                      {256, 256},
                                      {3, 256}})
    b->Args({rows, columns});
}
BENCHMARK(conv1x1)->Apply(shapes);
BENCHMARK(conv1x1_eigen)->Apply(shapes);
BENCHMARK(max_pool)->ArgName("channels")->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK(max_pool_eigen)->ArgName("channels")->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK(res_block<1027>)->Unit(benchmark::kMillisecond);
BENCHMARK(res_block_eigen<1027>)->Unit(benchmark::kMillisecond);
BENCHMARK(res_block<256>)->Unit(benchmark::kMillisecond);
BENCHMARK(res_block_eigen<256>)->Unit(benchmark::kMillisecond);

}  // namespace
