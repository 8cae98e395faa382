/// The names of the networks, for who needs no more of them.
#pragma once

#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

// Of pose_transfer_net.hpp, ablation_nets.hpp and correspondence_net.hpp, which say what they are.
struct ConvRelu;
struct ReluConv;
struct PerVertex;
struct Pooled;
template <int Bottleneck = 1024, class UnitOrder = ConvRelu, class PoseFeature = PerVertex>
struct PoseTransferNet;
template <int Bottleneck = 1024>
struct PlainNet;
template <int Bottleneck = 1024>
struct ConcatNet;
template <int C = 256>
struct CorrespondenceNet;

}  // namespace npt::inline NPT_ABI
