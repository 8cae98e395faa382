/// The networks that the program has compiled in, behind functions. networks.cpp and training_networks.cpp are the only
/// files of the program that are compiled for their types.
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/nets/correspondence_net.hpp>
#include <npt/nets/network_list.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace program {

using PoseTransfer = npt::BasicPoseTransfer<npt::DefaultExecutor>;
using NetworkType = npt::NetworkType<npt::DefaultExecutor>;
using FloatEngine = npt::engine::Core<float, npt::DefaultExecutor>;
using DoubleEngine = npt::engine::Core<double, npt::DefaultExecutor>;

/// What names one of the networks in the program's options.
struct Variant {
  int bottleneck = 1024;
  std::string order = "conv_relu";
  std::string feature = "per-vertex";
  /// full: the paper's; without-spadain, concat1: its ablations; correspondence: where points belong on a resting body, of which there is one
  std::string net = "full";

  /// As weights files say it.
  npt::Metadata metadata() const {
    if (net == "correspondence") return npt::variant_metadata<npt::CorrespondenceNet<>>();
    npt::Metadata metadata{{"bottleneck", std::to_string(bottleneck)}, {"order", order}, {"feature", feature}};
    if (net != "full") metadata["net"] = net;
    return metadata;
  }
  std::string text() const { return npt::variant_name(metadata()); }
};

/// The network of that variant, or nullptr.
const NetworkType* find_network(const Variant& variant);

/// An engine with npt::randomise's weights; the same in both scalars.
FloatEngine random_engine(const NetworkType& network, std::uint64_t seed, int threads, npt::Precision precision);
DoubleEngine random_double_engine(const NetworkType& network, std::uint64_t seed, int threads);

/// npt::explain of the network.
std::string explain(const NetworkType& network);

/// Learned parameters of the network.
std::size_t parameter_count(const NetworkType& network);

}  // namespace program
