/// A network with values for its parameters, whole; and random values.
#pragma once

#include <npt/base/random.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/model_class.hpp>
#include <npt/nn/graph/lower.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Net, class T>
constexpr const Net& Model<Net, T>::network() {
  return graph::bound_network<Net>;
}

// Not inlined, as Engine::compiled().
template <class Net, class T>
NPT_NOINLINE const std::vector<NamedParameter>& Model<Net, T>::parameters() {
  static const std::vector<NamedParameter> list = list_parameters(network());
  return list;
}
template <class Net, class T>
NPT_NOINLINE std::size_t Model<Net, T>::buffer_size() {
  return static_cast<std::size_t>(parameter_buffer_size(network()));
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
