/// What stands for a network behind functions, and lists of networks: enough to open weights. Networks themselves, and
/// what makes these of them, are in network_list.hpp.
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors_class.hpp>
#include <npt/nets/network_names.hpp>
#include <npt/nn/engine/core_class.hpp>
#include <npt/nn/engine/precision.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/weights/weights.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// Network types as a type. A host that needs few of them names its own list:
/// PoseTransfer::open<NetworkList<...>>(...).
template <class... Nets>
struct NetworkList {
  /// Calls `f.template operator()<Net>()` for each.
  template <class F>
  static void for_each(F&& f) {
    (f.template operator()<Nets>(), ...);
  }
};

namespace internal {

template <class... Lists>
struct JoinedLists;
template <class... Nets>
struct JoinedLists<NetworkList<Nets...>> {
  using type = NetworkList<Nets...>;
};
template <class... A, class... B, class... Rest>
struct JoinedLists<NetworkList<A...>, NetworkList<B...>, Rest...> : JoinedLists<NetworkList<A..., B...>, Rest...> {};

/// The paper's network in both unit orders and with both features, and its ablations.
template <int Bottleneck>
using NetworksOfBottleneck =
    NetworkList<PoseTransferNet<Bottleneck, ConvRelu, PerVertex>, PoseTransferNet<Bottleneck, ConvRelu, Pooled>,
                PoseTransferNet<Bottleneck, ReluConv, PerVertex>, PoseTransferNet<Bottleneck, ReluConv, Pooled>,
                PlainNet<Bottleneck>, ConcatNet<Bottleneck>>;

}  // namespace internal

/// Correspondence networks (estimate/correspondence_estimator.hpp).
using CorrespondenceNetworks = NetworkList<CorrespondenceNet<>>;

/// Every network that npt ships weights for or trains: those that transfer poses, of five bottlenecks, both layer
/// orders, both features, with the ablations; and the correspondence network.
using AllNetworks =
    typename internal::JoinedLists<internal::NetworksOfBottleneck<1024>, internal::NetworksOfBottleneck<512>,
                                   internal::NetworksOfBottleneck<256>, internal::NetworksOfBottleneck<128>,
                                   internal::NetworksOfBottleneck<64>, CorrespondenceNetworks>::type;

/// A network behind functions: what differs between the types of a list.
template <class Exec>
struct NetworkType {
  Metadata variant;                                    ///< what names it in weights files
  const graph::Program* program = nullptr;             ///< what runs
  const std::vector<NamedParameter>* parameters = {};  ///< its tensors and attributes
  std::size_t buffer_size = 0;                         ///< elements of a buffer laid out as Model::buffer()
  /// An engine on these values, a buffer laid out as Model::buffer().
  engine::Core<float, Exec> (*pack)(std::span<const float> values, Exec executor, Precision precision) = nullptr;
};

/// A network type's entry.
template <class Net, class Exec>
NetworkType<Exec> network_type();

/// The entries of a list of networks, in its order.
template <class Networks, class Exec>
const std::vector<NetworkType<Exec>>& network_types() {
  static const std::vector<NetworkType<Exec>> list = [] {
    std::vector<NetworkType<Exec>> types;
    Networks::for_each([&types]<class Net>() { types.push_back(network_type<Net, Exec>()); });
    return types;
  }();
  return list;
}

namespace internal {

/// The number of the variant that the file is of.
/// Errors    npt::Error that names what the file says and what the list has
template <class = void>
std::size_t find_variant(const SafetensorsFile& file, const Metadata& assume,
                         const std::vector<const Metadata*>& variants);

}  // namespace internal

/// The entry of the list that a weights file is of. `assume`: what the file doesn't say of itself.
/// Errors    npt::Error that names what the file says and what the list has
template <class Networks, class Exec>
const NetworkType<Exec>& find_network(const SafetensorsFile& file, const Metadata& assume = {}) {
  const std::vector<NetworkType<Exec>>& types = network_types<Networks, Exec>();
  std::vector<const Metadata*> variants;
  variants.reserve(types.size());
  for (const NetworkType<Exec>& type : types) variants.push_back(&type.variant);
  return types[internal::find_variant(file, assume, variants)];
}

#ifdef NPT_COMPILED
extern template const std::vector<NetworkType<DefaultExecutor>>& network_types<AllNetworks, DefaultExecutor>();
#endif

}  // namespace npt::inline NPT_ABI
