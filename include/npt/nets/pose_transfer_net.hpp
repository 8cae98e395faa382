/// The pose transfer network (Wang et al., CVPR 2020, section 3, Tables 3-5, Fig. 4; compact feature: supplement C.2,
/// D.5).
/// Encoder  on the pose mesh: three 1x1 convolutions with instance norm and ReLU, 3 -> 64 -> 128 -> Bottleneck channels
/// Decoder  the feature and the identity mesh's coordinates, concatenated, through three SPAdaIN residual blocks of
///          widths W = Bottleneck + 3, W / 2 and W / 4, each conditioned on the identity mesh, to 3 coordinates and
/// tanh
/// Shapes   pose: [3, Vp]   identity: [3, V]   result: [3, V]; Vp = V unless the feature is pooled
/// Weights  names of the authors' public state dict
#pragma once

#include <npt/config.hpp>
#include <npt/nets/network_names.hpp>
#include <npt/nn/graph/expression.hpp>
#include <npt/nn/graph/graph.hpp>
#include <npt/nn/layer/conv1x1.hpp>
#include <npt/nn/layer/instance_norm.hpp>
#include <npt/nn/layer/max_pool.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/layer/relu.hpp>
#include <npt/nn/layer/res_block.hpp>
#include <npt/nn/layer/tanh.hpp>

#include <map>
#include <string>

namespace npt::inline NPT_ABI {

/// The pose feature of every vertex meets the identity vertex at the same position (the paper's main network).
struct PerVertex {
  static constexpr const char* name = "per-vertex";
  static constexpr Norm first_block_norm = Norm::instance;
  static constexpr auto apply(auto feature) { return feature; }
};

/// The feature's maximum over the pose mesh's vertices meets every identity vertex (the compact feature): any vertex
/// counts. The first block then doesn't normalise, since the constant feature would vanish.
struct Pooled {
  static constexpr const char* name = "pooled";
  static constexpr Norm first_block_norm = Norm::none;
  static constexpr auto apply(auto feature) { return feature | max_pool; }
};

namespace internal {

/// Entries of its weights' metadata that name a variant; `net`: of the ablations. Not inlined: called once a network.
NPT_NOINLINE inline std::map<std::string, std::string> variant_entries(const char* order, const char* feature,
                                                                       int bottleneck, const char* net = nullptr) {
  std::map<std::string, std::string> entries{
      {"order", order}, {"feature", feature}, {"bottleneck", std::to_string(bottleneck)}};
  if (net != nullptr) entries["net"] = net;
  return entries;
}

}  // namespace internal

template <int Bottleneck, class UnitOrder, class PoseFeature>
struct PoseTransferNet {
  static constexpr int bottleneck = Bottleneck;
  using Order = UnitOrder;
  using Feature = PoseFeature;
  static constexpr Input inputs[] = {{"pose", 3}, {"identity", 3}};
  static constexpr int W = Bottleneck + 3;

  /// Entries of its weights' metadata.
  static std::map<std::string, std::string> variant() {
    return internal::variant_entries(Order::name, Feature::name, Bottleneck);
  }

  Conv1x1<3, 64> e1;
  Conv1x1<64, 128> e2;
  Conv1x1<128, Bottleneck> e3;
  Conv1x1<W, W> d1;
  ResBlock<W, Order, Feature::first_block_norm> b1;
  Conv1x1<W, W / 2> d2;
  ResBlock<W / 2, Order> b2;
  Conv1x1<W / 2, W / 4> d3;
  ResBlock<W / 4, Order> b3;
  Conv1x1<W / 4, 3> d4;
  ScaledTanh output;

  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("encoder.conv1", self.e1);
    visitor("encoder.conv2", self.e2);
    visitor("encoder.conv3", self.e3);
    visitor("decoder.conv1", self.d1);
    visitor("decoder.spadain_block1", self.b1);
    visitor("decoder.conv2", self.d2);
    visitor("decoder.spadain_block2", self.b2);
    visitor("decoder.conv3", self.d3);
    visitor("decoder.spadain_block3", self.b3);
    visitor("decoder.conv4", self.d4);
    visitor("output_scale", self.output.scale);
  }

  constexpr auto operator()(auto pose, auto identity) const {
    const auto f = pose | e1 | instance_norm | relu | e2 | instance_norm | relu | e3 | instance_norm | relu;
    const auto h1 = b1(cat(Feature::apply(f), identity) | d1, identity);
    const auto h2 = b2(h1 | d2, identity);
    const auto h3 = b3(h2 | d3, identity);
    return h3 | d4 | output;
  }
};

}  // namespace npt::inline NPT_ABI
