// A layer of one's own: a pointwise operation with a learned parameter for each channel, checked against plain loops,
// and its gradient, checked against finite differences.
//
//   custom_layer [--vertices V]
//
// The layer is PReLU, y = max(x, 0) + slope_c min(x, 0) (He et al., 2015). It says what it does to one register of
// values, and how a gradient comes back through it; the library compiles both into the loops around the matrix
// products, so that the layer costs no pass over memory, in use or in training.
#include <npt/base/random.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/graph/explain.hpp>
#include <npt/nn/train/gradient_check.hpp>
#include <npt/npt.hpp>

#include <CLI/CLI.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

template <int C>
struct PRelu : npt::kernel::Pointwise {
  static constexpr const char* name = "prelu";  // what explain calls it
  static constexpr int channels = C;            // piping another number of channels into it does not compile
  npt::Parameter slope{C};

  static constexpr void visit(auto& self, auto&& visitor) { visitor("slope", self.slope); }

  /// What a channel needs, in registers before the loop over vertices. args.parameters are the tensors in visit's
  /// order.
  template <class T>
  static npt::simd::Batch<T> row(const npt::kernel::PointwiseArgs<T>& args, int c) {
    return npt::simd::broadcast(args.parameters[0][c]);
  }
  /// One register of vertices of one channel. relu keeps NaN, and so does the layer.
  template <class T>
  static npt::simd::Batch<T> apply(npt::simd::Batch<T> x, const npt::simd::Batch<T>& slope, Nothing) {
    const npt::simd::Batch<T> positive = npt::simd::relu(x);
    return npt::simd::fma(slope, x - positive, positive);
  }

  /// Training: the gradient of each slope is one sum over the vertices. vjp adds this register's share and returns
  /// dL/dx.
  static constexpr int sums_per_channel = 1;
  template <class T>
  static npt::simd::Batch<T> vjp(const npt::simd::Batch<T>& x, const npt::simd::Batch<T>& dy,
                                 const npt::simd::Batch<T>& slope, Nothing, npt::simd::Batch<T>* sums) {
    const npt::simd::Batch<T> above = npt::simd::zero_where_not_positive(x, dy);
    const npt::simd::Batch<T> below = dy - above;
    sums[0] = npt::simd::fma(below, x, sums[0]);
    return npt::simd::fma(slope, below, above);
  }
};

/// A network that uses it.
struct PReluNet {
  static constexpr npt::Input inputs[] = {{"points", 3}};
  npt::Conv1x1<3, 37> in;
  PRelu<37> prelu;
  npt::Conv1x1<37, 3> out;

  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("in", self.in);
    visitor("prelu", self.prelu);
    visitor("out", self.out);
  }
  constexpr auto operator()(auto points) const { return points | in | prelu | out; }
};

/// The same network by its definition.
std::vector<double> plain_loops(const npt::Model<PReluNet, double>& model, const std::vector<double>& points) {
  const PReluNet& net = model.network();
  const auto weight_in = model.values(net.in.weight), bias_in = model.values(net.in.bias),
             slope = model.values(net.prelu.slope), weight_out = model.values(net.out.weight),
             bias_out = model.values(net.out.bias);
  std::vector<double> result(points.size());
  for (std::size_t v = 0; v < points.size() / 3; ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) result[3 * v + axis] = bias_out[axis];
    for (std::size_t c = 0; c < slope.size(); ++c) {
      double h = bias_in[c];
      for (std::size_t i = 0; i < 3; ++i) h += weight_in[3 * c + i] * points[3 * v + i];
      h = std::fmax(h, 0) + slope[c] * std::fmin(h, 0);
      for (std::size_t axis = 0; axis < 3; ++axis) result[3 * v + axis] += weight_out[axis * slope.size() + c] * h;
    }
  }
  return result;
}

void run(int vertices) {
  std::puts("A network with the layer, lowered:\n");
  std::fputs(npt::explain<PReluNet>().c_str(), stdout);

  // Models and engines in double serve for checks like this one; float is the default.
  npt::Model<PReluNet, double> model;
  npt::randomise(model, 1);
  npt::Random random(2);
  std::vector<double> points(3 * static_cast<std::size_t>(vertices));
  for (double& x : points) x = random.uniform(-1, 1);

  const npt::Engine engine(model);
  std::vector<double> result(points.size());
  const auto start = std::chrono::steady_clock::now();
  engine({points}, result);
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();

  const std::vector<double> expected = plain_loops(model, points);
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < result.size(); ++i) {
    difference += (result[i] - expected[i]) * (result[i] - expected[i]);
    norm += expected[i] * expected[i];
  }
  const double error = std::sqrt(difference / norm);
  std::printf("\n%d vertices in %.2f ms; relative difference from plain loops in double: %.1e.\n", vertices, ms, error);
  if (!(error < 1e-13)) throw std::runtime_error("the layer is wrong");

  const npt::GradientReport report = npt::check_gradients(model);
  std::printf("%zu entries of its gradient differ from finite differences by at most %.1e (%s).\n", report.entries,
              report.worst, report.where.c_str());
  if (!(report.worst < 1e-6)) throw std::runtime_error("the layer's gradient is wrong");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A pointwise layer of one's own and its gradient, checked");
  int vertices = 6890;
  app.add_option("--vertices", vertices, "Vertices")->check(CLI::Range(1, 1000000))->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(vertices);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "custom_layer: %s\n", e.what());
    return 1;
  }
}
