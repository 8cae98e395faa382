/// Checks gradients against finite differences, in double: for whoever writes a layer (nn/tape/chain_backward.hpp says
/// what a layer gives).
///
///   const auto report = npt::check_layer<MyLayer<8>, 8>();          // a layer, between two convolutions
///   const auto report = npt::check_gradients<MyNet>();              // a network
///   report.worst < 1e-6, report.where
///
/// The loss is a random linear function of the result; entries of every parameter and of both meshes are moved.
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/base/random.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/model.hpp>
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
  int vertices = 37;               ///< of both meshes, which are random points
  std::uint64_t seed = 1;          ///< of meshes, loss and, if no model is given, weights
  std::size_t most_entries = 100;  ///< of each tensor, spread over it
};

namespace internal {

/// check_gradients without the network's type. `tensors` lie in `parameters`, and in `gradient`, which gets theirs.
inline GradientReport check_gradients(tape::GradientCore<double, DefaultExecutor>& gradients,
                                      const std::vector<NamedParameter>& tensors, std::span<double> parameters,
                                      std::span<double> gradient, const GradientCheckOptions& options) {
  const int vertices = options.vertices;
  const auto points = [&](std::uint64_t stream) {
    Random random(options.seed, stream);
    std::vector<double> xyz(3 * static_cast<std::size_t>(vertices));
    for (double& x : xyz) x = random.uniform(-1, 1);
    return xyz;
  };
  std::vector<double> pose = points(1), identity = points(2), result(pose.size());
  const std::vector<double> factors = points(3);
  const TransferPair<double> pair{pose, identity, result};
  const auto loss = [&] {
    gradients.load(parameters);
    gradients.forward({&pair, 1});
    double sum = 0;
    for (std::size_t i = 0; i < result.size(); ++i) sum += factors[i] * result[i];
    return sum;
  };

  std::vector<double> to_pose(pose.size()), to_identity(identity.size());
  const std::span<const double> from(factors);
  const std::span<double> pose_span(to_pose), identity_span(to_identity);
  loss();
  gradients.backward(
      {.result = {&from, 1}, .parameters = gradient, .pose = {&pose_span, 1}, .identity = {&identity_span, 1}});

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
  compare("pose", pose, to_pose);
  compare("identity", identity, to_identity);
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
/// identity.
template <class Layer, int Channels>
struct LayerProbe {
  Conv1x1<3, Channels> in;
  Layer layer;
  Conv1x1<Channels + 3, 3> out;

  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("in", self.in);
    if constexpr (requires { Layer::visit(self.layer, visitor); }) visitor("layer", self.layer);
    visitor("out", self.out);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    const auto x = pose | in;
    if constexpr (requires { layer(x, identity); })
      return cat(layer(x, identity), identity) | out;
    else
      return cat(x | layer, identity) | out;
  }
};

template <class Layer, int Channels>
GradientReport check_layer(const GradientCheckOptions& options = {}) {
  return check_gradients<LayerProbe<Layer, Channels>>(options);
}

}  // namespace npt::inline NPT_ABI
