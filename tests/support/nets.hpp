/// Random networks and inputs, and the comparison with the reference.
#pragma once

#include <npt/base/random.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/engine.hpp>

#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "support/reference_net.hpp"

namespace support {

/// [V, 3] coordinates, uniform in the cube [-1, 1]^3.
template <class T>
std::vector<T> random_points(std::size_t vertices, std::uint64_t seed) {
  npt::Random random(seed, 77);
  std::vector<T> points(3 * vertices);
  for (T& x : points) x = static_cast<T>(random.uniform(-1, 1));
  return points;
}

/// [V, 3] -> [3, V] in double.
template <class T>
reference::Map to_map(const std::vector<T>& points) {
  reference::Map map(3, points.size() / 3);
  for (std::size_t v = 0; v < map.vertices; ++v)
    for (std::size_t axis = 0; axis < 3; ++axis) map.row(axis)[v] = static_cast<double>(points[3 * v + axis]);
  return map;
}

template <class Net, class T>
reference::Weights weights_of(const npt::Model<Net, T>& model) {
  reference::Weights weights;
  model.for_each_tensor([&](const std::string& name, const npt::Parameter&, std::span<const T> values) {
    weights[name].assign(values.begin(), values.end());
  });
  return weights;
}

template <class Net, class T>
void set_output_scale(npt::Model<Net, T>& model, double scale) {
  model.for_each_attribute([&](const std::string&, T& value) { value = static_cast<T>(scale); });
}

/// Norm of the difference over norm of the reference.
template <class T>
double relative_error(const std::vector<T>& points, const reference::Map& expected) {
  double difference = 0, norm = 0;
  for (std::size_t v = 0; v < expected.vertices; ++v)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double e = expected.row(axis)[v];
      const double d = static_cast<double>(points[3 * v + axis]) - e;
      difference += d * d;
      norm += e * e;
    }
  return std::sqrt(difference / norm);
}

template <class Net>
reference::Variant variant_of(double output_scale) {
  return {.relu_conv = std::is_same_v<typename Net::Order, npt::ReluConv>,
          .pooled = std::is_same_v<typename Net::Feature, npt::Pooled>,
          .output_scale = output_scale};
}

}  // namespace support
