/// The networks that the program has compiled in, behind functions: five bottlenecks, both unit orders, both features.
/// networks.cpp and training_networks.cpp are the only files of the program that are compiled for their types.
#pragma once

#include <npt/engine/core.hpp>
#include <npt/parallel/tbb_executor.hpp>
#include <npt/weights/weights_file.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace program {

using FloatEngine = npt::engine::Core<float, npt::TbbExecutor>;
using DoubleEngine = npt::engine::Core<double, npt::TbbExecutor>;

/// What names one of the networks.
struct Variant {
  int bottleneck = 1024;
  std::string order = "conv_relu";
  std::string feature = "per-vertex";
  std::string net = "full";  ///< full: the paper's; without-spadain, concat1: its ablations

  bool operator==(const Variant&) const = default;
  std::string text() const {
    return (net == "full" ? "" : net + ", ") + "bottleneck " + std::to_string(bottleneck) + ", " + order + ", " +
           feature;
  }
};

inline constexpr int bottlenecks[] = {1024, 512, 256, 128, 64};

struct Network {
  Variant variant;
  const npt::graph::Program* program = nullptr;
  std::size_t parameters = 0;
  npt::Metadata metadata;                                ///< that names the variant in weights files
  std::vector<npt::NamedParameter> (*list)() = nullptr;  ///< its parameters
  std::size_t buffer_size = 0;                           ///< of all their values

  std::string (*explain)() = nullptr;
  /// Checks the file against the network, as npt::load does.
  FloatEngine (*from_file)(const npt::SafetensorsFile& file, const npt::Metadata& assume, int threads) = nullptr;
  /// `values`: a buffer of buffer_size.
  FloatEngine (*from_values)(std::span<const float> values, int threads) = nullptr;
  /// With npt::randomise's weights; the same in both scalars.
  FloatEngine (*from_seed)(std::uint64_t seed, int threads, npt::Precision precision) = nullptr;
  DoubleEngine (*double_from_seed)(std::uint64_t seed, int threads) = nullptr;
};

const std::vector<Network>& networks();

/// The network of that variant, or nullptr.
const Network* find_network(const Variant& variant);

}  // namespace program
