/// The pointwise chains of the paper's network, as a stage applies them while it reads or writes a tile of 96 vertices;
/// Eigen and plain xtensor on the same channels in row-major matrices. And tanh alone, beside the C library's.
#include <support/common.hpp>

#include <npt/nn/kernel/pointwise.hpp>
#include <npt/nn/layer/instance_norm.hpp>
#include <npt/nn/layer/relu.hpp>
#include <npt/nn/layer/spadain.hpp>
#include <npt/nn/layer/tanh.hpp>

#include <Eigen/Core>
#include <xtensor/xmath.hpp>
#include <xtensor/xnoalias.hpp>
#include <xtensor/xtensor.hpp>

#include <algorithm>
#include <cmath>

namespace {

namespace kernel = npt::kernel;
using Array = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Column = Eigen::ArrayXf;
using Tensor = xt::xtensor<float, 2>;

constexpr int width = kernel::group_width;  // vertices of a tile

/// What each operation needs and does, by its definition, in double.
struct Case {
  explicit Case(int channels_)
      : channels(channels_),
        x(bench::random_buffer(kernel::tile_size(channels_), 1)),
        y(kernel::tile_size(channels_)),
        other(bench::random_buffer(kernel::tile_size(channels_), 2)),
        condition(bench::random_buffer(kernel::tile_size(3), 3)),
        mean(bench::random_buffer(count(), 4)),
        inverse(bench::random_buffer(count(), 5)),
        gamma(bench::random_buffer(3 * count(), 6)),
        gamma_bias(bench::random_buffer(count(), 7)),
        beta(bench::random_buffer(3 * count(), 8)),
        beta_bias(bench::random_buffer(count(), 9)),
        scale(bench::random_buffer(1, 10)) {}

  std::size_t count() const { return static_cast<std::size_t>(channels); }
  double in(const npt::AlignedBuffer<float>& tile, int c, int v) const {
    return double{tile.data()[bench::tile_index(channels, c, v)]};
  }
  double coordinate(int axis, int v) const { return double{condition.data()[bench::tile_index(3, axis, v)]}; }

  // Arguments of the operation, and its value, by type.
  kernel::PointwiseArgs<float> args(npt::InstanceNorm) const {
    kernel::PointwiseArgs<float> a;
    a.mean = mean.data();
    a.inverse_deviation = inverse.data();
    return a;
  }
  double value(npt::InstanceNorm, double h, int c, int) const {
    return (h - double{mean.data()[c]}) * double{inverse.data()[c]};
  }
  kernel::PointwiseArgs<float> args(npt::Modulate<3>) const {
    return {.parameters = {gamma.data(), gamma_bias.data(), beta.data(), beta_bias.data()},
            .other = condition.data(),
            .other_channels = 3};
  }
  double value(npt::Modulate<3>, double h, int c, int v) const {
    double g = gamma_bias.data()[c], b = beta_bias.data()[c];
    for (int axis = 0; axis < 3; ++axis) {
      g += double{gamma.data()[3 * c + axis]} * coordinate(axis, v);
      b += double{beta.data()[3 * c + axis]} * coordinate(axis, v);
    }
    return g * h + b;
  }
  kernel::PointwiseArgs<float> args(npt::Relu) const { return {}; }
  double value(npt::Relu, double h, int, int) const { return h < 0 ? 0 : h; }
  kernel::PointwiseArgs<float> args(kernel::AddTile) const {
    return {.parameters = {}, .other = other.data(), .other_channels = channels};
  }
  double value(kernel::AddTile, double h, int c, int v) const { return h + in(other, c, v); }
  kernel::PointwiseArgs<float> args(npt::ScaledTanh) const { return {.parameters = {scale.data()}}; }
  double value(npt::ScaledTanh, double h, int, int) const { return double{scale.data()[0]} * std::tanh(h); }

  /// found(c, v) against the chain applied by its definition.
  template <class... Ops, class Found>
  double error(Found&& found) const {
    bench::Difference difference;
    for (int c = 0; c < channels; ++c)
      for (int v = 0; v < width; ++v) {
        double h = in(x, c, v);
        ((h = value(Ops{}, h, c, v)), ...);
        difference.add(found(c, v), h);
      }
    return difference.relative();
  }

  int channels;
  npt::AlignedBuffer<float> x, y, other, condition, mean, inverse, gamma, gamma_bias, beta, beta_bias, scale;
};

template <class... Ops>
void chain(benchmark::State& state) {
  Case c(static_cast<int>(state.range(0)));
  const std::array<kernel::PointwiseArgs<float>, sizeof...(Ops) + 1> args{c.args(Ops{})...};
  const kernel::RowRange<float> range{.from = c.x.data(),
                                      .to = c.y.data(),
                                      .from_stride = kernel::panel_stride<float>(c.channels),
                                      .to_stride = kernel::panel_stride<float>(c.channels),
                                      .first_panel = 0,
                                      .panels = kernel::group_panels<float>,
                                      .first_channel = 0,
                                      .rows = c.channels,
                                      .args = args.data()};
  kernel::transform_rows<float, Ops...>(range);
  if (!bench::verified(state,
                       c.error<Ops...>([&](int r, int v) { return c.y.data()[bench::tile_index(c.channels, r, v)]; })))
    return;
  bench::time_values(state, width * c.channels, [&] { kernel::transform_rows<float, Ops...>(range); });
}

/// The same operands as Eigen arrays.
struct EigenCase {
  explicit EigenCase(const Case& c)
      : x(c.channels, width),
        y(c.channels, width),
        condition(3, width),
        mean(Eigen::Map<const Column>(c.mean.data(), c.channels)),
        inverse(Eigen::Map<const Column>(c.inverse.data(), c.channels)),
        gamma(Eigen::Map<const Array>(c.gamma.data(), c.channels, 3)),
        beta(Eigen::Map<const Array>(c.beta.data(), c.channels, 3)),
        gamma_bias(Eigen::Map<const Column>(c.gamma_bias.data(), c.channels)),
        beta_bias(Eigen::Map<const Column>(c.beta_bias.data(), c.channels)) {
    for (int v = 0; v < width; ++v) {
      for (int r = 0; r < c.channels; ++r) x(r, v) = static_cast<float>(c.in(c.x, r, v));
      for (int axis = 0; axis < 3; ++axis) condition(axis, v) = static_cast<float>(c.coordinate(axis, v));
    }
  }
  void norm_relu() { y = ((x.colwise() - mean).colwise() * inverse).cwiseMax(0.0F); }
  /// gamma and beta are materialised, as matrix products: that is how one writes it with Eigen.
  void norm_modulate() {
    g = (gamma.matrix() * condition.matrix()).array().colwise() + gamma_bias;
    b = (beta.matrix() * condition.matrix()).array().colwise() + beta_bias;
    y = g * ((x.colwise() - mean).colwise() * inverse) + b;
  }
  Array x, y, condition, g, b;
  Column mean, inverse;
  Array gamma, beta;
  Column gamma_bias, beta_bias;
};

template <class... Ops, class Run>
void run_eigen(benchmark::State& state, Run&& run) {
  const Case c(static_cast<int>(state.range(0)));
  EigenCase e(c);
  run(e);
  if (!bench::verified(state, c.error<Ops...>([&](int r, int v) { return e.y(r, v); }))) return;
  bench::time_values(state, width * c.channels, [&] { run(e); });
}
void eigen_norm_relu(benchmark::State& state) {
  run_eigen<npt::InstanceNorm, npt::Relu>(state, [](EigenCase& e) { e.norm_relu(); });
}
void eigen_norm_modulate(benchmark::State& state) {
  run_eigen<npt::InstanceNorm, npt::Modulate<3>>(state, [](EigenCase& e) { e.norm_modulate(); });
}

/// The same operands as xtensor tensors: [C, V], [C, 1] and [1, V], which broadcast.
struct XtensorCase {
  static std::array<std::size_t, 2> shape(std::size_t rows, std::size_t columns) { return {rows, columns}; }
  static Tensor column(const float* values, std::size_t rows, std::size_t stride = 1) {
    Tensor t(shape(rows, 1));
    for (std::size_t r = 0; r < rows; ++r) t(r, 0) = values[r * stride];
    return t;
  }
  explicit XtensorCase(const Case& c)
      : x(shape(c.count(), width)),
        y(shape(c.count(), width)),
        mean(column(c.mean.data(), c.count())),
        inverse(column(c.inverse.data(), c.count())),
        gamma_bias(column(c.gamma_bias.data(), c.count())),
        beta_bias(column(c.beta_bias.data(), c.count())) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      gamma[axis] = column(c.gamma.data() + axis, c.count(), 3);
      beta[axis] = column(c.beta.data() + axis, c.count(), 3);
      p[axis] = Tensor(shape(1, width));
      for (int v = 0; v < width; ++v)
        p[axis](0, static_cast<std::size_t>(v)) = static_cast<float>(c.coordinate(static_cast<int>(axis), v));
    }
    for (int r = 0; r < c.channels; ++r)
      for (int v = 0; v < width; ++v)
        x(static_cast<std::size_t>(r), static_cast<std::size_t>(v)) = static_cast<float>(c.in(c.x, r, v));
  }
  void norm_relu() { xt::noalias(y) = xt::maximum((x - mean) * inverse, 0.0F); }
  void norm_modulate() {
    xt::noalias(y) = (gamma[0] * p[0] + gamma[1] * p[1] + gamma[2] * p[2] + gamma_bias) * ((x - mean) * inverse) +
                     (beta[0] * p[0] + beta[1] * p[1] + beta[2] * p[2] + beta_bias);
  }
  Tensor x, y, mean, inverse, gamma_bias, beta_bias;
  std::array<Tensor, 3> gamma, beta, p;
};

template <class... Ops, class Run>
void run_xtensor(benchmark::State& state, Run&& run) {
  const Case c(static_cast<int>(state.range(0)));
  XtensorCase e(c);
  run(e);
  if (!bench::verified(state, c.error<Ops...>([&](int r, int v) {
        return e.y(static_cast<std::size_t>(r), static_cast<std::size_t>(v));
      })))
    return;
  bench::time_values(state, width * c.channels, [&] { run(e); });
}
void xtensor_norm_relu(benchmark::State& state) {
  run_xtensor<npt::InstanceNorm, npt::Relu>(state, [](XtensorCase& e) { e.norm_relu(); });
}
void xtensor_norm_modulate(benchmark::State& state) {
  run_xtensor<npt::InstanceNorm, npt::Modulate<3>>(state, [](XtensorCase& e) { e.norm_modulate(); });
}

/// tanh over an array; f(from, to, n) computes it.
template <class F>
void run_tanh(benchmark::State& state, F&& f) {
  const auto n = static_cast<std::size_t>(state.range(0));
  npt::AlignedBuffer<float> x = bench::random_buffer(n, 1), y(n);
  for (float& value : x.span()) value *= 3;
  f(x.data(), y.data(), n);
  bench::Difference difference;
  for (std::size_t i = 0; i < n; ++i) difference.add(y.data()[i], std::tanh(double{x.data()[i]}));
  if (!bench::verified(state, difference.relative(), 1e-6)) return;
  bench::time_values(state, static_cast<double>(n), [&] { f(x.data(), y.data(), n); });
}
void tanh_npt(benchmark::State& state) {
  run_tanh(state, [](const float* x, float* y, std::size_t n) {
    for (std::size_t i = 0; i < n; i += npt::simd::lanes<float>)
      npt::simd::store(y + i, npt::simd::tanh(npt::simd::load(x + i)));
  });
}
void tanh_eigen(benchmark::State& state) {
  run_tanh(state, [](const float* x, float* y, std::size_t n) {
    const auto size = static_cast<Eigen::Index>(n);
    Eigen::Map<Column>(y, size) = Eigen::Map<const Column>(x, size).tanh();
  });
}
void tanh_c_library(benchmark::State& state) {
  run_tanh(state, [](const float* x, float* y, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) y[i] = std::tanh(x[i]);
  });
}

void widths(benchmark::internal::Benchmark* b) { b->ArgName("channels")->Arg(1027)->Arg(513)->Arg(256); }

BENCHMARK(chain<>)->Name("prologue/copy")->Apply(widths);
BENCHMARK(chain<npt::InstanceNorm, npt::Relu>)->Name("prologue/norm_relu")->Apply(widths);
BENCHMARK(eigen_norm_relu)->Name("eigen/norm_relu")->Apply(widths);
BENCHMARK(xtensor_norm_relu)->Name("xtensor/norm_relu")->Apply(widths);
BENCHMARK(chain<npt::InstanceNorm, npt::Modulate<3>>)->Name("prologue/norm_modulate")->Apply(widths);
BENCHMARK(eigen_norm_modulate)->Name("eigen/norm_modulate")->Apply(widths);
BENCHMARK(xtensor_norm_modulate)->Name("xtensor/norm_modulate")->Apply(widths);
BENCHMARK(chain<npt::InstanceNorm, npt::Modulate<3>, npt::Relu>)->Name("prologue/norm_modulate_relu")->Apply(widths);
BENCHMARK(chain<npt::Modulate<3>>)->Name("prologue/modulate")->Apply(widths);
BENCHMARK(chain<npt::Modulate<3>, npt::Relu>)->Name("prologue/modulate_relu")->Apply(widths);
BENCHMARK(chain<npt::Relu>)->Name("epilogue/relu")->Apply(widths);
BENCHMARK(chain<npt::Relu, kernel::AddTile>)->Name("epilogue/relu_add")->Apply(widths);
BENCHMARK(chain<npt::ScaledTanh>)->Name("epilogue/tanh")->ArgName("channels")->Arg(3);
BENCHMARK(tanh_npt)->Name("tanh/npt")->ArgName("values")->Arg(3 * 6912);
BENCHMARK(tanh_eigen)->Name("tanh/eigen")->ArgName("values")->Arg(3 * 6912);
BENCHMARK(tanh_c_library)->Name("tanh/c_library")->ArgName("values")->Arg(3 * 6912);

}  // namespace
