#include <npt/base/default_executor.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/nets/network_list.hpp>
#include <npt/nn/weights/weights_file.hpp>
#include <npt/transfer/pose_transfer.hpp>

namespace npt::inline NPT_ABI {

template class BasicSafetensorsFile<>;
template Metadata load_values(const SafetensorsFile&, const Metadata&, const std::vector<NamedParameter>&,
                              std::span<float>, const Metadata&);
template std::size_t internal::find_variant(const SafetensorsFile&, const Metadata&,
                                            const std::vector<const Metadata*>&);
template const std::vector<NetworkType<DefaultExecutor>>& network_types<AllNetworks, DefaultExecutor>();
template class NetworkTransfer<DefaultExecutor>;
template class BasicCharacter<>;
template class BasicPoseTransfer<DefaultExecutor>;

}  // namespace npt::inline NPT_ABI
