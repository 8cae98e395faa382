/// A recorded network in plain loops, forwards and backwards, straight from its graph: no lowering, no fusion, no SIMD,
/// derivatives by hand. What engines and tapes are compared with.
#pragma once

#include <npt/nn/graph/expression.hpp>
#include <npt/nn/layer/instance_norm.hpp>
#include <npt/nn/layer/relu.hpp>
#include <npt/nn/layer/spadain.hpp>
#include <npt/nn/layer/tanh.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include "blend.hpp"

namespace random_networks {

/// Nearest bfloat16, ties to even.
inline double rounded_to_bf16(double x) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(x));
  return static_cast<double>(std::bit_cast<float>((bits + 0x7FFFU + ((bits >> 16) & 1U)) & 0xFFFF0000U));
}

/// Computes in `S`: double to compare with, float to learn what rounding alone does to a network.
template <class S>
class PlainLoops {
 public:
  /// `bf16`: the factors of convolutions' products are rounded to bfloat16.
  PlainLoops(const npt::graph::Graph& graph, std::span<const double> parameters, bool bf16 = false)
      : graph_(graph), parameters_(parameters.begin(), parameters.end()), bf16_(bf16) {}

  /// The inputs, [V, channels] each -> [V, 3]
  std::vector<S> forward(std::span<const std::vector<double>> inputs) {
    const auto nodes = static_cast<std::size_t>(graph_.count);
    values_.assign(nodes, {});
    vertices_.assign(nodes, 0);
    pooled_.assign(nodes, false);
    kink_ = std::numeric_limits<double>::infinity();
    for (int i = 0; i < graph_.inputs.count; ++i) read(i, inputs[index(i)]);
    for (int n = graph_.inputs.count; n < graph_.count; ++n) compute(n);
    const auto out = static_cast<std::size_t>(graph_.output);
    std::vector<S> result(3 * vertices_[out]);
    for (std::size_t v = 0; v < vertices_[out]; ++v)
      for (std::size_t c = 0; c < 3; ++c) result[3 * v + c] = at(graph_.output, c, v);
    return result;
  }

  /// Distance of the last forward's values from the places where the network has no derivative.
  double kink() const { return kink_; }

  struct Gradients {
    std::vector<S> parameters;
    std::vector<std::vector<S>> inputs;
  };
  /// From the gradient of the last forward's result, [V, 3].
  Gradients backward(std::span<const double> result_gradient) {
    gradients_.clear();
    for (const auto& value : values_) gradients_.emplace_back(value.size(), S(0));
    Gradients found;
    found.parameters.assign(parameters_.size(), S(0));
    parameter_gradients_ = found.parameters;
    const auto out = static_cast<std::size_t>(graph_.output);
    for (std::size_t v = 0; v < vertices_[out]; ++v)
      for (std::size_t c = 0; c < 3; ++c)
        gradients_[out][c * vertices_[out] + v] = static_cast<S>(result_gradient[3 * v + c]);
    for (int n = graph_.count - 1; n >= graph_.inputs.count; --n) differentiate(n);
    found.parameters = parameter_gradients_;
    for (int i = 0; i < graph_.inputs.count; ++i) found.inputs.push_back(written(i));
    return found;
  }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }
  /// Value of a channel at a vertex; that of a pooled node is the same at every vertex.
  S& at(int n, std::size_t c, std::size_t v) {
    return values_[index(n)][pooled_[index(n)] ? c : c * vertices_[index(n)] + v];
  }
  S& gradient_at(int n, std::size_t c, std::size_t v) {
    return gradients_[index(n)][pooled_[index(n)] ? c : c * vertices_[index(n)] + v];
  }
  std::size_t channels(int n) const { return index(graph_[n].channels); }

  void read(int n, std::span<const double> points) {
    const std::size_t width = channels(n), count = vertices_[index(n)] = points.size() / width;
    values_[index(n)].resize(points.size());
    for (std::size_t v = 0; v < count; ++v)
      for (std::size_t c = 0; c < width; ++c) at(n, c, v) = static_cast<S>(points[width * v + c]);
  }
  std::vector<S> written(int n) {
    std::vector<S> points(gradients_[index(n)].size());
    const std::size_t width = channels(n);
    for (std::size_t v = 0; v < vertices_[index(n)]; ++v)
      for (std::size_t c = 0; c < width; ++c) points[width * v + c] = gradient_at(n, c, v);
    return points;
  }

  S factor(S x) const { return bf16_ ? static_cast<S>(rounded_to_bf16(static_cast<double>(x))) : x; }
  S parameter(int offset, std::size_t i = 0) const { return parameters_[index(offset) + i]; }
  S& parameter_gradient(int offset, std::size_t i = 0) { return parameter_gradients_[index(offset) + i]; }

  void near_kink(S distance) {
    if (distance == S(0)) return;  // of exact zeros, such as a relu's: no rounding moves them
    kink_ = std::min(kink_, static_cast<double>(std::abs(distance)));
  }

  void compute(int n) {
    using npt::graph::NodeKind, npt::graph::operation_id;
    const npt::graph::Node& node = graph_[n];
    const int a = node.first, b = node.second;
    pooled_[index(n)] = node.kind == NodeKind::max_pool || (pooled_[index(a)] && (b < 0 || pooled_[index(b)]));
    const std::size_t count = pooled_[index(n)]             ? 1
                              : pooled_[index(a)] && b >= 0 ? vertices_[index(b)]
                                                            : vertices_[index(a)];
    vertices_[index(n)] = count;
    values_[index(n)].assign(channels(n) * count, S(0));
    for (std::size_t c = 0; c < channels(n); ++c) {
      if (node.kind == NodeKind::max_pool) {
        pool(n, c);
        continue;
      }
      if (node.kind == NodeKind::pointwise && node.operation == operation_id<npt::InstanceNorm>) {
        normalise(n, c);
        continue;
      }
      for (std::size_t v = 0; v < count; ++v) {
        S& y = at(n, c, v);
        switch (node.kind) {
          case NodeKind::conv:
            y = parameter(node.bias, c);
            for (std::size_t i = 0; i < channels(a); ++i)
              y += factor(parameter(node.weight, c * channels(a) + i)) * factor(at(a, i, v));
            break;
          case NodeKind::sum:
            y = at(a, c, v) + at(b, c, v);
            break;
          case NodeKind::cat:
            y = c < channels(a) ? at(a, c, v) : at(b, c - channels(a), v);
            break;
          default:
            y = apply(node, c, v);
        }
      }
    }
  }

  /// Gamma or beta, by its first parameter, of a modulation.
  S modulation(const npt::graph::Node& node, std::size_t which, std::size_t c, std::size_t v) {
    S sum = parameter(node.parameters[which + 1], c);
    const std::size_t conditions = channels(node.second);
    for (std::size_t i = 0; i < conditions; ++i)
      sum += parameter(node.parameters[which], c * conditions + i) * at(node.second, i, v);
    return sum;
  }

  S apply(const npt::graph::Node& node, std::size_t c, std::size_t v) {
    using npt::graph::operation_id;
    const S x = at(node.first, c, v);
    if (node.operation == operation_id<npt::Relu>) {
      near_kink(x);
      return x > 0 ? x : S(0);
    }
    if (node.operation == operation_id<npt::Tanh>) return std::tanh(x);
    if (node.operation == operation_id<npt::ScaledTanh>) return parameter(node.parameters[0]) * std::tanh(x);
    if (node.operation == operation_id<Blend>) {
      near_kink(x);
      return parameter(node.parameters[0]) * (x > 0 ? x : S(0)) + parameter(node.parameters[1]) * std::tanh(x);
    }
    if (node.second < 0) throw std::logic_error("an operation that the plain loops don't know");
    return modulation(node, 0, c, v) * x + modulation(node, 2, c, v);
  }

  struct Moments {
    S mean = 0, deviation = 0;
  };
  Moments moments(int n, std::size_t c) {
    const std::size_t count = vertices_[index(n)];
    Moments m;
    for (std::size_t v = 0; v < count; ++v) m.mean += at(n, c, v) / static_cast<S>(count);
    S variance = 0;
    for (std::size_t v = 0; v < count; ++v)
      variance += (at(n, c, v) - m.mean) * (at(n, c, v) - m.mean) / static_cast<S>(count);
    m.deviation = std::sqrt(variance + S(1e-5));
    return m;
  }
  void normalise(int n, std::size_t c) {
    const Moments m = moments(graph_[n].first, c);
    for (std::size_t v = 0; v < vertices_[index(n)]; ++v)
      at(n, c, v) = (at(graph_[n].first, c, v) - m.mean) / m.deviation;
  }
  std::size_t largest(int n, std::size_t c) {
    std::size_t best = 0;
    for (std::size_t v = 1; v < vertices_[index(n)]; ++v)
      if (at(n, c, v) > at(n, c, best)) best = v;
    return best;
  }
  void pool(int n, std::size_t c) {
    const int a = graph_[n].first;
    const std::size_t best = largest(a, c);
    at(n, c, 0) = at(a, c, best);
    for (std::size_t v = 0; v < vertices_[index(a)]; ++v)
      if (v != best) near_kink(at(a, c, best) - at(a, c, v));
  }

  void differentiate(int n) {
    using npt::graph::NodeKind, npt::graph::operation_id;
    const npt::graph::Node& node = graph_[n];
    const int a = node.first, b = node.second;
    const std::size_t count = vertices_[index(n)];
    for (std::size_t c = 0; c < channels(n); ++c) {
      if (node.kind == NodeKind::max_pool) {
        gradient_at(a, c, largest(a, c)) += gradient_at(n, c, 0);
        continue;
      }
      if (node.kind == NodeKind::pointwise && node.operation == operation_id<npt::InstanceNorm>) {
        const Moments m = moments(a, c);
        S mean = 0, product = 0;
        for (std::size_t v = 0; v < count; ++v) {
          mean += gradient_at(n, c, v) / static_cast<S>(count);
          product += gradient_at(n, c, v) * at(n, c, v) / static_cast<S>(count);
        }
        for (std::size_t v = 0; v < count; ++v)
          gradient_at(a, c, v) += (gradient_at(n, c, v) - mean - at(n, c, v) * product) / m.deviation;
        continue;
      }
      for (std::size_t v = 0; v < count; ++v) {
        const S dy = gradient_at(n, c, v);
        switch (node.kind) {
          case NodeKind::conv:
            parameter_gradient(node.bias, c) += dy;
            for (std::size_t i = 0; i < channels(a); ++i) {
              parameter_gradient(node.weight, c * channels(a) + i) += dy * at(a, i, v);
              gradient_at(a, i, v) += dy * parameter(node.weight, c * channels(a) + i);
            }
            break;
          case NodeKind::sum:
            gradient_at(a, c, v) += dy;
            gradient_at(b, c, v) += dy;
            break;
          case NodeKind::cat:
            (c < channels(a) ? gradient_at(a, c, v) : gradient_at(b, c - channels(a), v)) += dy;
            break;
          default:
            differentiate(node, c, v, dy);
        }
      }
    }
  }

  void differentiate(const npt::graph::Node& node, std::size_t c, std::size_t v, S dy) {
    using npt::graph::operation_id;
    const S x = at(node.first, c, v);
    S& dx = gradient_at(node.first, c, v);
    const S t = std::tanh(x);
    if (node.operation == operation_id<npt::Relu>) {
      if (x > 0) dx += dy;
    } else if (node.operation == operation_id<npt::Tanh>) {
      dx += dy * (1 - t * t);
    } else if (node.operation == operation_id<npt::ScaledTanh>) {
      dx += parameter(node.parameters[0]) * dy * (1 - t * t);  // the scale is an attribute and isn't learned
    } else if (node.operation == operation_id<Blend>) {
      dx += dy * (parameter(node.parameters[0]) * (x > 0 ? S(1) : S(0)) + parameter(node.parameters[1]) * (1 - t * t));
      parameter_gradient(node.parameters[0]) += dy * (x > 0 ? x : S(0));
      parameter_gradient(node.parameters[1]) += dy * t;
    } else {
      const std::size_t conditions = channels(node.second);
      dx += dy * modulation(node, 0, c, v);
      parameter_gradient(node.parameters[1], c) += dy * x;
      parameter_gradient(node.parameters[3], c) += dy;
      for (std::size_t i = 0; i < conditions; ++i) {
        const S p = at(node.second, i, v);
        parameter_gradient(node.parameters[0], c * conditions + i) += dy * x * p;
        parameter_gradient(node.parameters[2], c * conditions + i) += dy * p;
        gradient_at(node.second, i, v) += dy * (x * parameter(node.parameters[0], c * conditions + i) +
                                                parameter(node.parameters[2], c * conditions + i));
      }
    }
  }

  const npt::graph::Graph& graph_;
  std::vector<S> parameters_;
  bool bf16_;
  std::vector<std::vector<S>> values_, gradients_;
  std::vector<S> parameter_gradients_;
  std::vector<std::size_t> vertices_;
  std::vector<bool> pooled_;
  double kink_ = 0;
};

}  // namespace random_networks
