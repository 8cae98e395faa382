/// The networks that the paper compares its own with (section 4.3, Table 2): the same encoder, decoders with parts left
/// out. The paper says no more of them than their names; what we chose stands beside each.
/// Shapes  pose, identity, result: [3, V]
#pragma once

#include <npt/config.hpp>
#include <npt/nets/network_names.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/graph/expression.hpp>
#include <npt/nn/graph/graph.hpp>
#include <npt/nn/layer/conv1x1.hpp>
#include <npt/nn/layer/instance_norm.hpp>
#include <npt/nn/layer/relu.hpp>
#include <npt/nn/layer/res_block.hpp>
#include <npt/nn/layer/tanh.hpp>

#include <map>
#include <string>

namespace npt::inline NPT_ABI {

/// A residual block that doesn't know the identity: ResBlock with instance norm in the place of SPAdaIN.
/// Shapes  x, y: [C, V]
template <int C>
struct PlainResBlock {
  Conv1x1<C, C> conv1, conv2, conv_res;

  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("conv1", self.conv1);
    visitor("conv2", self.conv2);
    visitor("conv_res", self.conv_res);
  }

  constexpr auto operator()(auto x) const {
    return (x | instance_norm | conv1 | relu | instance_norm | conv2 | relu) + (x | instance_norm | conv_res | relu);
  }
};

/// "w/o SPAdaIN": plain residual blocks. The identity's coordinates enter once, at the concatenation.
template <int Bottleneck>
struct PlainNet {
  static constexpr const char* name = "without-spadain";
  static constexpr int bottleneck = Bottleneck;
  using Order = ConvRelu;
  using Feature = PerVertex;
  static constexpr Input inputs[] = {{"pose", 3}, {"identity", 3}};
  static constexpr int W = Bottleneck + 3;

  static std::map<std::string, std::string> variant() {
    return internal::variant_entries(Order::name, Feature::name, Bottleneck, name);
  }

  Conv1x1<3, 64> e1;
  Conv1x1<64, 128> e2;
  Conv1x1<128, Bottleneck> e3;
  Conv1x1<W, W> d1;
  PlainResBlock<W> b1;
  Conv1x1<W, W / 2> d2;
  PlainResBlock<W / 2> b2;
  Conv1x1<W / 2, W / 4> d3;
  PlainResBlock<W / 4> b3;
  Conv1x1<W / 4, 3> d4;
  ScaledTanh output;

  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("encoder.conv1", self.e1);
    visitor("encoder.conv2", self.e2);
    visitor("encoder.conv3", self.e3);
    visitor("decoder.conv1", self.d1);
    visitor("decoder.block1", self.b1);
    visitor("decoder.conv2", self.d2);
    visitor("decoder.block2", self.b2);
    visitor("decoder.conv3", self.d3);
    visitor("decoder.block3", self.b3);
    visitor("decoder.conv4", self.d4);
    visitor("output_scale", self.output.scale);
  }

  constexpr auto operator()(auto pose, auto identity) const {
    const auto f = pose | e1 | instance_norm | relu | e2 | instance_norm | relu | e3 | instance_norm | relu;
    return b3(b2(b1(cat(f, identity) | d1) | d2) | d3) | d4 | output;
  }
};

/// "concat1": a decoder of 1x1 convolutions only, each with instance norm and ReLU as in the encoder.
template <int Bottleneck>
struct ConcatNet {
  static constexpr const char* name = "concat1";
  static constexpr int bottleneck = Bottleneck;
  using Order = ConvRelu;
  using Feature = PerVertex;
  static constexpr Input inputs[] = {{"pose", 3}, {"identity", 3}};
  static constexpr int W = Bottleneck + 3;

  static std::map<std::string, std::string> variant() {
    return internal::variant_entries(Order::name, Feature::name, Bottleneck, name);
  }

  Conv1x1<3, 64> e1;
  Conv1x1<64, 128> e2;
  Conv1x1<128, Bottleneck> e3;
  Conv1x1<W, W> d1;
  Conv1x1<W, W / 2> d2;
  Conv1x1<W / 2, W / 4> d3;
  Conv1x1<W / 4, 3> d4;
  ScaledTanh output;

  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("encoder.conv1", self.e1);
    visitor("encoder.conv2", self.e2);
    visitor("encoder.conv3", self.e3);
    visitor("decoder.conv1", self.d1);
    visitor("decoder.conv2", self.d2);
    visitor("decoder.conv3", self.d3);
    visitor("decoder.conv4", self.d4);
    visitor("output_scale", self.output.scale);
  }

  constexpr auto operator()(auto pose, auto identity) const {
    const auto f = pose | e1 | instance_norm | relu | e2 | instance_norm | relu | e3 | instance_norm | relu;
    return cat(f, identity) | d1 | instance_norm | relu | d2 | instance_norm | relu | d3 | instance_norm | relu | d4 |
           output;
  }
};

}  // namespace npt::inline NPT_ABI
