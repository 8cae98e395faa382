/// Mean and deviation of each channel over a mesh: gathered group by group while tiles are in the cache, merged once;
/// Eigen and plain xtensor over the whole [C, V] matrix, in two passes as the library's definition is.
#include <support/common.hpp>

#include <npt/nn/kernel/moments.hpp>

#include <Eigen/Core>
#include <xtensor/xeval.hpp>
#include <xtensor/xmath.hpp>
#include <xtensor/xtensor.hpp>

#include <cmath>

namespace {

namespace kernel = npt::kernel;
using Array = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Column = Eigen::ArrayXf;

/// Values far from zero beside their deviation: what an uncentred sum of squares gets wrong.
struct Case {
  Case(int channels_, int vertices_)
      : channels(channels_),
        vertices(vertices_),
        groups(kernel::group_count(vertices_)),
        tiles(bench::random_buffer(kernel::tile_size(channels_) * static_cast<std::size_t>(groups), 1)) {
    for (float& x : tiles.span()) x = 30 + 0.1F * x;
  }
  float at(int c, int v) const { return tiles.data()[bench::tile_index(channels, c, v)]; }

  /// inverse(c) against 1 / sqrt(variance + eps) by its definition.
  template <class Inverse>
  double error(Inverse&& inverse) const {
    bench::Difference difference;
    for (int c = 0; c < channels; ++c) {
      double mean = 0, variance = 0;
      for (int v = 0; v < vertices; ++v) mean += double{at(c, v)} / vertices;
      for (int v = 0; v < vertices; ++v) variance += (double{at(c, v)} - mean) * (double{at(c, v)} - mean) / vertices;
      difference.add(inverse(c), 1 / std::sqrt(variance + kernel::norm_epsilon));
    }
    return difference.relative();
  }

  int channels, vertices, groups;
  npt::AlignedBuffer<float> tiles;
};

Case case_of(const benchmark::State& state) {
  return {static_cast<int>(state.range(0)), static_cast<int>(state.range(1))};
}

/// The library's two steps, and the memory that they work in.
class Steps {
 public:
  explicit Steps(const Case& c)
      : case_(c),
        channels_(static_cast<std::size_t>(c.channels)),
        means_(channels_ * static_cast<std::size_t>(c.groups)),
        squares_(means_.size()),
        mean_(channels_),
        inverse_(channels_),
        sums_(2 * channels_) {}

  void gather() {
    for (int g = 0; g < case_.groups; ++g)
      kernel::gather_moments(case_.tiles.data() + kernel::tile_size(case_.channels) * static_cast<std::size_t>(g),
                             kernel::panel_stride<float>(case_.channels),
                             std::min(kernel::group_width, case_.vertices - g * kernel::group_width), case_.channels,
                             means_.data() + channels_ * static_cast<std::size_t>(g),
                             squares_.data() + channels_ * static_cast<std::size_t>(g));
  }
  void merge() {
    kernel::merge_moments(means_.data(), squares_.data(), case_.vertices, case_.channels, sums_.data(), mean_.data(),
                          inverse_.data());
  }
  double error() const {
    return case_.error([&](int c) { return inverse_.data()[c]; });
  }

 private:
  const Case& case_;
  std::size_t channels_;
  npt::AlignedBuffer<float> means_, squares_, mean_, inverse_;
  npt::AlignedBuffer<double> sums_;
};

void moments(benchmark::State& state) {
  const Case c = case_of(state);
  Steps steps(c);
  const auto run = [&] {
    steps.gather();
    steps.merge();
  };
  run();
  if (!bench::verified(state, steps.error())) return;
  bench::time_values(state, double{1} * c.channels * c.vertices, run);
}

void merge(benchmark::State& state) {
  const Case c = case_of(state);
  Steps steps(c);
  steps.gather();
  const auto run = [&] { steps.merge(); };
  run();
  if (!bench::verified(state, steps.error())) return;
  bench::time_values(state, c.channels, run);
}

void eigen(benchmark::State& state) {
  const Case c = case_of(state);
  Array x(c.channels, c.vertices);
  for (int r = 0; r < c.channels; ++r)
    for (int v = 0; v < c.vertices; ++v) x(r, v) = c.at(r, v);
  Column mean, inverse;
  const auto run = [&] {
    mean = x.rowwise().mean();
    inverse = ((x.colwise() - mean).square().rowwise().mean() + 1e-5F).rsqrt();
  };
  run();
  if (!bench::verified(state, c.error([&](int i) { return inverse(i); }), 1e-4)) return;
  bench::time_values(state, double{1} * c.channels * c.vertices, run);
}

void xtensor(benchmark::State& state) {
  const Case c = case_of(state);
  const std::array<std::size_t, 2> shape{static_cast<std::size_t>(c.channels), static_cast<std::size_t>(c.vertices)};
  xt::xtensor<float, 2> x(shape);
  for (int r = 0; r < c.channels; ++r)
    for (int v = 0; v < c.vertices; ++v) x(static_cast<std::size_t>(r), static_cast<std::size_t>(v)) = c.at(r, v);
  xt::xtensor<float, 1> inverse;
  const auto run = [&] {
    const xt::xtensor<float, 2> mean = xt::mean(x, {1}, xt::keep_dims);
    const xt::xtensor<float, 1> variance = xt::mean(xt::square(x - mean), {1});
    inverse = 1.0F / xt::sqrt(variance + 1e-5F);
  };
  run();
  if (!bench::verified(state, c.error([&](int i) { return inverse(static_cast<std::size_t>(i)); }), 1e-2)) return;
  bench::time_values(state, double{1} * c.channels * c.vertices, run);
}

void sizes(benchmark::internal::Benchmark* b) {
  b->ArgNames({"channels", "vertices"})->Unit(benchmark::kMicrosecond);
  for (const int channels : {1027, 256}) b->Args({channels, bench::paper_vertices});
}
BENCHMARK(moments)->Apply(sizes);
BENCHMARK(merge)->Apply(sizes);
BENCHMARK(eigen)->Apply(sizes);
BENCHMARK(xtensor)->Apply(sizes);

}  // namespace
