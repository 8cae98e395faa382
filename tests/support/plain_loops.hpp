/// Any network in plain double loops: its operator() called with maps of numbers instead of expressions.
#pragma once

#include <npt/nn/engine/model.hpp>
#include <npt/nn/layer/conv1x1.hpp>
#include <npt/nn/layer/instance_norm.hpp>
#include <npt/nn/layer/max_pool.hpp>
#include <npt/nn/layer/relu.hpp>
#include <npt/nn/layer/spadain.hpp>
#include <npt/nn/layer/tanh.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "support/reference_net.hpp"

namespace plain {

/// [C, V], or [C, 1] behind max_pool.
struct Value {
  reference::Map map;
  const double* parameters;  ///< a parameter buffer, Model::buffer()
};

inline Value convolve(const Value& x, int rows, const double* weights, const double* bias) {
  Value y{{static_cast<std::size_t>(rows), x.map.vertices}, x.parameters};
  for (std::size_t o = 0; o < y.map.channels; ++o)
    for (std::size_t v = 0; v < x.map.vertices; ++v) {
      double sum = bias[o];
      for (std::size_t i = 0; i < x.map.channels; ++i) sum += weights[o * x.map.channels + i] * x.map.row(i)[v];
      y.map.row(o)[v] = sum;
    }
  return y;
}

template <int Cin, int Cout>
Value operator|(const Value& x, const npt::Conv1x1<Cin, Cout>& conv) {
  return convolve(x, Cout, x.parameters + conv.weight.offset, x.parameters + conv.bias.offset);
}
inline Value operator|(Value x, const npt::InstanceNorm&) {
  x.map = reference::instance_norm(std::move(x.map));
  return x;
}
inline Value operator|(Value x, const npt::Relu&) {
  x.map = reference::relu(std::move(x.map));
  return x;
}
inline Value operator|(Value x, const npt::Tanh&) {
  for (double& value : x.map.values) value = std::tanh(value);
  return x;
}
inline Value operator|(const Value& x, npt::Tanh (*layer)()) { return x | layer(); }
inline Value operator|(Value x, const npt::ScaledTanh& layer) {
  for (double& value : x.map.values) value = x.parameters[layer.scale.offset] * std::tanh(value);
  return x;
}
inline Value operator|(const Value& x, npt::MaxPool) {
  Value y{{x.map.channels, 1}, x.parameters};
  for (std::size_t c = 0; c < x.map.channels; ++c)
    y.map.row(c)[0] = *std::max_element(x.map.row(c), x.map.row(c) + x.map.vertices);
  return y;
}
inline Value operator+(Value a, const Value& b) {
  for (std::size_t i = 0; i < a.map.values.size(); ++i) a.map.values[i] += b.map.values[i];
  return a;
}
inline Value cat(const Value& a, const Value& b) {
  Value y{{a.map.channels + b.map.channels, std::max(a.map.vertices, b.map.vertices)}, a.parameters};
  const auto copy = [&y](const reference::Map& from, std::size_t first) {
    for (std::size_t c = 0; c < from.channels; ++c)
      for (std::size_t v = 0; v < y.map.vertices; ++v) y.map.row(first + c)[v] = from.row(c)[v % from.vertices];
  };
  copy(a.map, 0);
  copy(b.map, a.map.channels);
  return y;
}
/// SPAdaIN's modulation.
template <int C, int Cond, npt::Norm Normalise>
Value conditioned(Value x, const npt::SPAdaIN<C, Cond, Normalise>& layer, const Value& condition) {
  const Value gamma = condition | layer.gamma, beta = condition | layer.beta;
  for (std::size_t i = 0; i < x.map.values.size(); ++i)
    x.map.values[i] = gamma.map.values[i] * x.map.values[i] + beta.map.values[i];
  return x;
}

/// The inputs, [channels, V] each -> [3, V].
template <class Net, class... Maps>
reference::Map forward(const npt::Model<Net, double>& model, const Maps&... inputs) {
  const double* parameters = model.buffer().data();
  return npt::Model<Net, double>::network()(Value{inputs, parameters}...).map;
}

}  // namespace plain
