/// A network with values for its parameters.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/config.hpp>
#include <npt/nn/graph/lower.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// Parameters of a network: all learned tensors in one buffer on 64-byte boundaries. Copyable. Fresh ones are zero,
/// attributes (such as the output's scale) have their default.
template <class Net, class T = float>
class Model {
 public:
  using Network = Net;
  using Scalar = T;

  Model() : values_(static_cast<std::size_t>(parameter_buffer_size(network()))) {
    for_each_parameter(network(), [this](const Parameter& p) {
      if (p.attribute) values_[static_cast<std::size_t>(p.offset)] = static_cast<T>(p.initial);
    });
  }

  /// The network's layers, with their parameters' places.
  static constexpr const Net& network() { return graph::bound_network<Net>; }

  /// The buffer with everything, padding included.
  std::span<T> buffer() { return values_.span(); }
  std::span<const T> buffer() const { return values_.span(); }

  /// The values of one tensor, row major.
  std::span<T> values(const Parameter& p) { return slice(values_.span(), p); }
  std::span<const T> values(const Parameter& p) const { return slice(values_.span(), p); }

  /// All parameters with their names; the order is that of the network's declaration.
  static const std::vector<NamedParameter>& parameters() {
    static const std::vector<NamedParameter> list = list_parameters(network());
    return list;
  }

  /// Calls f(name, parameter, values) for every learned tensor, under the names of the public state dict.
  template <class F>
  void for_each_tensor(F&& f) {
    for (const NamedParameter& p : parameters())
      if (!p.parameter.attribute) f(p.name, p.parameter, values(p.parameter));
  }
  template <class F>
  void for_each_tensor(F&& f) const {
    for (const NamedParameter& p : parameters())
      if (!p.parameter.attribute) f(p.name, p.parameter, values(p.parameter));
  }
  /// Calls f(name, value) for every attribute.
  template <class F>
  void for_each_attribute(F&& f) {
    for (const NamedParameter& p : parameters())
      if (p.parameter.attribute) f(p.name, values(p.parameter)[0]);
  }
  template <class F>
  void for_each_attribute(F&& f) const {
    for (const NamedParameter& p : parameters())
      if (p.parameter.attribute) f(p.name, values(p.parameter)[0]);
  }

 private:
  template <class Span>
  static Span slice(Span all, const Parameter& p) {
    return all.subspan(static_cast<std::size_t>(p.offset), static_cast<std::size_t>(p.size()));
  }

  AlignedBuffer<T> values_;
};

/// Attributes at their defaults, into a buffer laid out as Model::buffer().
template <class T>
void set_attributes(const std::vector<NamedParameter>& parameters, std::span<T> buffer) {
  for (const auto& [name, p] : parameters)
    if (p.attribute) buffer[static_cast<std::size_t>(p.offset)] = static_cast<T>(p.initial);
}

/// Seeded random weights, into a buffer laid out as Model::buffer(): N(0, 1 / Cin) for weights and N(0, 0.1^2) for
/// biases, each tensor from a stream of its own. Good for tests and timing; training has its own initialisations.
template <class T>
void randomise_values(const std::vector<NamedParameter>& parameters, std::span<T> buffer, std::uint64_t seed) {
  std::uint64_t stream = 0;
  for (const auto& [name, p] : parameters) {
    if (p.attribute) continue;
    const auto values = buffer.subspan(static_cast<std::size_t>(p.offset), static_cast<std::size_t>(p.size()));
    Random random(seed, stream++);
    const double deviation = p.rank == 3 ? 1.0 / std::sqrt(static_cast<double>(p.dims[1])) : 0.1;
    for (T& value : values) value = static_cast<T>(deviation * random.normal());
  }
}

/// Gives a model seeded random weights, as randomise_values draws them; attributes stay as they are.
template <class Net, class T>
void randomise(Model<Net, T>& model, std::uint64_t seed) {
  randomise_values(model.parameters(), model.buffer(), seed);
}

}  // namespace npt::inline NPT_ABI
