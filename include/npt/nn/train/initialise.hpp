/// Weights to start a training from. Works on the list of named parameters, so that it compiles once for all networks.
/// Shapes    buffer: a model's buffer (Model::buffer()); convolutions are [Cout, Cin, 1], biases [C]
/// Numerics  each tensor draws from a stream of its own: the same values whatever else the network has
/// Source    small: the authors' public code draws weights from N(0, 0.02). he: He et al., ICCV 2015, for layers
///           followed by ReLU
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/config.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace npt::inline NPT_ABI {

enum class Initialisation {
  small,     ///< weights N(0, 0.02^2), biases N(0, 0.1^2): trains best of what was tried (docs/training.md)
  released,  ///< weights N(0, 0.02^2), biases uniform in +-1 / sqrt(Cin), PyTorch's default, which that code leaves
  he,  ///< weights N(0, 2 / Cin), biases 0; SPAdaIN near plain instance norm: gamma's bias 1, weights N(0, 0.25 / Cin)
};

constexpr const char* to_string(Initialisation i) noexcept {
  return i == Initialisation::small ? "small" : i == Initialisation::released ? "released" : "he";
}

/// Reads "small", "released" or "he". `where` names the argument in the error.
inline Initialisation parse_initialisation(std::string_view text, const std::string& where = "initialisation") {
  for (const Initialisation i : {Initialisation::small, Initialisation::released, Initialisation::he})
    if (text == to_string(i)) return i;
  throw Error({.file = where, .found = "'" + std::string(text) + "'", .expected = "small, released or he"});
}

namespace train::internal {

inline bool has_part(std::string_view name, std::string_view part) {
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find('.', begin), name.size());
    if (name.substr(begin, end - begin) == part) return true;
    begin = end + 1;
  }
  return false;
}

/// The inputs of the convolution that a tensor belongs to: a bias stands beside the weights that precede it.
inline int fan_in_of(std::span<const NamedParameter> parameters, std::size_t i) {
  const Parameter& p = parameters[i].parameter;
  if (p.rank == 3) return p.dims[1];
  if (i > 0 && parameters[i - 1].parameter.rank == 3) return parameters[i - 1].parameter.dims[1];
  return 1;
}

}  // namespace train::internal

/// Fills all learned tensors; attributes keep their values.
template <class T>
void initialise(std::span<const NamedParameter> parameters, std::span<T> buffer, Initialisation kind,
                std::uint64_t seed) {
  std::uint64_t stream = 0;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto& [name, p] = parameters[i];
    if (p.attribute) continue;
    Random random(seed, stream++);
    const double fan_in = train::internal::fan_in_of(parameters, i);
    const bool weight = p.rank == 3;
    const bool gamma = train::internal::has_part(name, "conv_weight");
    const bool modulation = gamma || train::internal::has_part(name, "conv_bias");
    const auto draw = [&]() -> double {
      switch (kind) {
        case Initialisation::small:
          return (weight ? 0.02 : 0.1) * random.normal();
        case Initialisation::released:
          return weight ? 0.02 * random.normal() : random.uniform(-1, 1) / std::sqrt(fan_in);
        case Initialisation::he:
          break;
      }
      if (!weight) return gamma ? 1.0 : 0.0;
      return std::sqrt((modulation ? 0.25 : 2.0) / fan_in) * random.normal();
    };
    const auto values = buffer.subspan(static_cast<std::size_t>(p.offset), static_cast<std::size_t>(p.size()));
    for (T& value : values) value = static_cast<T>(draw());
  }
}

}  // namespace npt::inline NPT_ABI
