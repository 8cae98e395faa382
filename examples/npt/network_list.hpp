/// The networks that the program has compiled in. Only what is compiled for their types includes this.
#pragma once

#include "networks.hpp"

#include <npt/net/ablation_nets.hpp>
#include <npt/net/pose_transfer_net.hpp>

#include <string>
#include <utility>

namespace program {

/// What names a network in options and metadata: the ablations say it, the paper's network needs no name.
template <class Net>
Variant variant_of() {
  Variant variant{Net::bottleneck, Net::Order::name, Net::Feature::name};
  if constexpr (requires { Net::name; }) variant.net = Net::name;
  return variant;
}

/// Calls f.template operator()<Net>() for each.
template <class F>
void for_each_network(F&& f) {
  const auto add = [&f]<int B>() {
    f.template operator()<npt::PoseTransferNet<B, npt::ConvRelu, npt::PerVertex>>();
    f.template operator()<npt::PoseTransferNet<B, npt::ConvRelu, npt::Pooled>>();
    f.template operator()<npt::PoseTransferNet<B, npt::ReluConv, npt::PerVertex>>();
    f.template operator()<npt::PoseTransferNet<B, npt::ReluConv, npt::Pooled>>();
    f.template operator()<npt::PlainNet<B>>();
    f.template operator()<npt::ConcatNet<B>>();
  };
  [&]<int... I>(std::integer_sequence<int, I...>) { (add.template operator()<bottlenecks[I]>(), ...); }
  (std::make_integer_sequence<int, static_cast<int>(std::size(bottlenecks))>{});
}

}  // namespace program
