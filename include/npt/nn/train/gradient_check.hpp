/// Checks gradients against finite differences, in double: for whoever writes a layer (nn/tape/chain_backward.hpp says
/// what a layer gives).
///
///   const auto report = npt::check_layer<MyLayer<8>, 8>();          // a layer, between two convolutions
///   const auto report = npt::check_gradients<MyNet>();              // a network
///   report.worst < 1e-6, report.where
///
/// The loss is a random linear function of the result; entries of every parameter and of all inputs are moved.
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/base/random.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/engine/network_call.hpp>
#include <npt/nn/graph/graph.hpp>
#include <npt/nn/layer/conv1x1.hpp>
#include <npt/nn/train/gradients.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct GradientReport {
  double worst = 0;         ///< largest difference, relative to the largest entry of its tensor's gradient
  std::string where;        ///< the tensor and entry that has it
  std::size_t entries = 0;  ///< that were compared
};

namespace internal {

/// d f / d x at x by central differences: of several step sizes the two neighbours that agree best. Where a kink lies
/// within the larger steps, those disagree; where steps are too small for the rounding, these do.
template <class F>
double difference_quotient(double& x, F&& f) {
  const double at = x;
  const auto quotient = [&](double h) {
    x = at + h;
    const double up = f();
    x = at - h;
    const double down = f();
    x = at;
    return (up - down) / (2 * h);
  };
  double h = 1.6e-4 * std::max(1.0, std::abs(at));
  double last = quotient(h), best = last, least = -1;
  for (int i = 0; i < 7; ++i) {
    h /= 4;
    const double next = quotient(h);
    const double doubt = std::abs(next - last);
    if (least < 0 || doubt < least) {
      least = doubt;
      best = (next + last) / 2;
    }
    if (doubt < 1e-9 * std::abs(next)) break;
    last = next;
  }
  return best;
}

}  // namespace internal

struct GradientCheckOptions {
  int vertices = 37;               ///< of all inputs, which are random numbers
  std::uint64_t seed = 1;          ///< of inputs, loss and, if no model is given, weights
  std::size_t most_entries = 100;  ///< of each tensor, spread over it
};

namespace internal {

/// check_gradients without the network's type. `tensors` lie in `parameters`, and in `gradient`, which gets theirs.
inline GradientReport check_gradients(tape::GradientCore<double, DefaultExecutor>& gradients,
                                      const std::vector<NamedParameter>& tensors, std::span<double> parameters,
                                      std::span<double> gradient, const GradientCheckOptions& options) {
  const int vertices = options.vertices;
  const auto points = [&](std::uint64_t stream, int channels) {
    Random random(options.seed, stream);
    std::vector<double> values(static_cast<std::size_t>(channels) * static_cast<std::size_t>(vertices));
    for (double& x : values) x = random.uniform(-1, 1);
    return values;
  };
  const graph::InputList& inputs = gradients.tape().inputs;
  const auto input_count = static_cast<std::size_t>(inputs.count);
  std::vector<std::vector<double>> given(input_count), to_inputs(input_count);
  std::vector<double> result(3 * static_cast<std::size_t>(vertices));
  NetworkCall<double> call{.inputs = {}, .result = result};
  for (std::size_t i = 0; i < input_count; ++i) {
    given[i] = points(1 + i, inputs[static_cast<int>(i)].channels);
    to_inputs[i].resize(given[i].size());
    call.inputs.push_back(given[i]);
  }
  const std::vector<double> factors = points(1 + input_count, 3);
  const auto loss = [&] {
    gradients.load(parameters);
    gradients.forward({&call, 1});
    double sum = 0;
    for (std::size_t i = 0; i < result.size(); ++i) sum += factors[i] * result[i];
    return sum;
  };

  const std::span<const double> from(factors);
  const std::vector<std::span<double>> input_spans(to_inputs.begin(), to_inputs.end());
  tape::BatchGradients<double> wanted{.result = {&from, 1}, .parameters = gradient};
  for (std::size_t i = 0; i < input_count; ++i) wanted.inputs[i] = {&input_spans[i], 1};
  loss();
  gradients.backward(wanted);

  GradientReport report;
  double largest_of_all = 0;
  const auto compare = [&](const std::string& name, std::span<double> values, std::span<const double> found) {
    double largest = 1e-3 * largest_of_all;  // a tensor whose gradient vanishes is compared with the others'
    for (const double g : found) largest = std::max(largest, std::abs(g));
    const std::size_t count = std::min(values.size(), options.most_entries);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = k * values.size() / count;
      const double expected = difference_quotient(values[i], loss);
      const double scale = std::max(largest, std::abs(expected));
      const double error = scale == 0 ? 0 : std::abs(found[i] - expected) / scale;
      ++report.entries;
      if (error <= report.worst) continue;
      report.worst = error;
      report.where =
          name + "[" + std::to_string(i) + "]: " + std::to_string(found[i]) + " instead of " + std::to_string(expected);
    }
  };
  for (const double g : gradient) largest_of_all = std::max(largest_of_all, std::abs(g));
  for (const NamedParameter& p : tensors) {
    const auto first = static_cast<std::size_t>(p.parameter.offset),
               size = static_cast<std::size_t>(p.parameter.size());
    if (!p.parameter.attribute) compare(p.name, parameters.subspan(first, size), gradient.subspan(first, size));
  }
  for (std::size_t i = 0; i < input_count; ++i) compare(inputs[static_cast<int>(i)].name, given[i], to_inputs[i]);
  return report;
}

}  // namespace internal

/// Compares the gradients of `model`.
template <class Net>
GradientReport check_gradients(Model<Net, double> model, const GradientCheckOptions& options = {}) {
  Gradients<Net, double> gradients(1);
  Model<Net, double> gradient;
  return internal::check_gradients(gradients, model.parameters(), model.buffer(), gradient.buffer(), options);
}

/// Checks a network with npt::randomise's weights.
template <class Net>
GradientReport check_gradients(const GradientCheckOptions& options = {}) {
  Model<Net, double> model;
  randomise(model, options.seed);
  return check_gradients(std::move(model), options);
}

/// A layer of `Channels` channels between two convolutions; a conditioned one, called as layer(x, condition), gets the
/// second input.
template <class Layer, int Channels>
struct LayerProbe {
  static constexpr Input inputs[] = {{"points", 3}, {"condition", 3}};
  Conv1x1<3, Channels> in;
  Layer layer;
  Conv1x1<Channels + 3, 3> out;

  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("in", self.in);
    if constexpr (requires { Layer::visit(self.layer, visitor); }) visitor("layer", self.layer);
    visitor("out", self.out);
  }
  constexpr auto operator()(auto points, auto condition) const {
    const auto x = points | in;
    if constexpr (requires { layer(x, condition); })
      return cat(layer(x, condition), condition) | out;
    else
      return cat(x | layer, condition) | out;
  }
};

template <class Layer, int Channels>
GradientReport check_layer(const GradientCheckOptions& options = {}) {
  return check_gradients<LayerProbe<Layer, Channels>>(options);
}

}  // namespace npt::inline NPT_ABI
