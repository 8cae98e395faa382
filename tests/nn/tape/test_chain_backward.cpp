#include <doctest/doctest.h>

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/kernel/moments.hpp>
#include <npt/nn/layer/instance_norm.hpp>
#include <npt/nn/layer/relu.hpp>
#include <npt/nn/layer/tanh.hpp>
#include <npt/nn/tape/chain_backward.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace kernel = npt::kernel;
namespace tape = npt::tape;

namespace {

constexpr int valid_vertices = 41, row_count = 3;

std::size_t at(int r, int v) {
  return kernel::panel_stride<double>(row_count) * static_cast<std::size_t>(v / kernel::panel_width<double>) +
         static_cast<std::size_t>(r * kernel::panel_width<double> + v % kernel::panel_width<double>);
}

/// Values for the group's vertices, zero behind them.
npt::AlignedBuffer<double> random_tile(std::uint64_t seed) {
  npt::AlignedBuffer<double> tile(kernel::tile_size(row_count));
  npt::Random random(seed);
  for (int r = 0; r < row_count; ++r)
    for (int v = 0; v < kernel::group_width; ++v) tile[at(r, v)] = v < valid_vertices ? random.uniform(-2, 2) : 0;
  return tile;
}

struct Norm {
  std::array<double, row_count> mean{}, squares{}, inverse_deviation{};
  explicit Norm(const npt::AlignedBuffer<double>& x) {
    kernel::gather_moments(x.data(), kernel::panel_stride<double>(row_count), valid_vertices, row_count, mean.data(),
                           squares.data());
    for (int r = 0; r < row_count; ++r) {
      const auto c = static_cast<std::size_t>(r);
      inverse_deviation[c] = 1 / std::sqrt(squares[c] / valid_vertices + kernel::norm_epsilon);
    }
  }
};

/// sum over r, v of weight * tanh(norm(x)), and its derivative by one value.
double loss(const npt::AlignedBuffer<double>& x, const npt::AlignedBuffer<double>& weight) {
  const Norm norm(x);
  double sum = 0;
  for (int r = 0; r < row_count; ++r)
    for (int v = 0; v < valid_vertices; ++v) {
      const auto c = static_cast<std::size_t>(r);
      sum += weight[at(r, v)] * std::tanh((x[at(r, v)] - norm.mean[c]) * norm.inverse_deviation[c]);
    }
  return sum;
}

/// All rows of a tile, from the gradient behind its layers to the one in front of them.
tape::BackwardRange<double> whole_tile(const npt::AlignedBuffer<double>& x, const npt::AlignedBuffer<double>& upstream,
                                       npt::AlignedBuffer<double>& downstream,
                                       const kernel::PointwiseArgs<double>* args) {
  const std::size_t stride = kernel::panel_stride<double>(row_count);
  return {.values = x.data(),
          .values_stride = stride,
          .upstream = upstream.data(),
          .upstream_stride = stride,
          .downstream = downstream.data(),
          .downstream_stride = stride,
          .adds = false,
          .valid = valid_vertices,
          .first_channel = 0,
          .rows = row_count,
          .args = args,
          .parameter_sums = nullptr,
          .norm_sums = {nullptr, nullptr},
          .other = {}};
}

}  // namespace

TEST_CASE("a chain without a norm goes back by its layers' derivatives, and adds where it is told to") {
  const auto x = random_tile(1), dy = random_tile(2);
  npt::AlignedBuffer<double> dx(kernel::tile_size(row_count));
  const std::array<kernel::PointwiseArgs<double>, 2> args{};
  tape::BackwardRange<double> range = whole_tile(x, dy, dx, args.data());
  for (const double times : {1.0, 2.0}) {
    tape::backward_rows<double, npt::Relu, npt::Tanh>(range);
    for (int r = 0; r < row_count; ++r)
      for (int v = 0; v < valid_vertices; ++v) {
        const double t = std::tanh(std::max(0.0, x[at(r, v)]));
        const double expected = x[at(r, v)] > 0 ? dy[at(r, v)] * (1 - t * t) : 0;
        REQUIRE(std::abs(dx[at(r, v)] - times * expected) < 1e-12);
      }
    range.adds = true;
  }
}

TEST_CASE("a chain with a norm goes back in two steps, between which the sums over the vertices are known") {
  auto x = random_tile(3);
  const auto weight = random_tile(4);
  const Norm norm(x);
  npt::AlignedBuffer<double> behind(kernel::tile_size(row_count)), dx(kernel::tile_size(row_count));
  std::array<kernel::PointwiseArgs<double>, 2> args{};
  args[0].mean = norm.mean.data();
  args[0].inverse_deviation = norm.inverse_deviation.data();
  std::array<double, row_count> gradient{}, product{};
  tape::BackwardRange<double> range = whole_tile(x, weight, behind, args.data());
  range.norm_sums[0] = gradient.data();
  range.norm_sums[1] = product.data();
  tape::backward_rows<double, npt::InstanceNorm, npt::Tanh>(range);
  for (std::size_t c = 0; c < row_count; ++c) {
    gradient[c] /= valid_vertices;
    product[c] /= valid_vertices;
  }
  range.upstream = behind.data();
  range.downstream = dx.data();
  range.args = nullptr;  // no layers in front of the norm
  tape::finish_rows<double>(
      {.rows = range, .norm = {norm.mean.data(), norm.inverse_deviation.data(), gradient.data(), product.data()}});
  for (int r = 0; r < row_count; ++r)
    for (const int v : {0, 17, valid_vertices - 1}) {
      constexpr double h = 1e-5;
      double& value = x[at(r, v)];
      const double before = value;
      value = before + h;
      const double up = loss(x, weight);
      value = before - h;
      const double down = loss(x, weight);
      value = before;
      CHECK(std::abs(dx[at(r, v)] - (up - down) / (2 * h)) < 1e-8);
    }
}
