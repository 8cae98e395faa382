/// A network that reads a mesh: for points of its surface, where on the resting template each belongs.
/// Encoder  points and normals through three 1x1 convolutions with instance norm and ReLU, 6 -> 64 -> 128 -> C
/// Decoder  three residual blocks conditioned on the points (SPAdaIN), of widths C, C and C / 2, to 3 coordinates and
///          tanh. Points know of each other by the norms alone, which take away what is the same at all of them.
/// Shapes   points: [3, n] centred, with a root mean square radius of reading_radius; normals: [3, n], unit or zero;
///          result: [3, n], half the canonical coordinates in metres
/// Source   layers of Wang et al., CVPR 2020
#pragma once

#include <npt/config.hpp>
#include <npt/nets/network_names.hpp>
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

template <int C>
struct CorrespondenceNet {
  static constexpr int width = C;
  static constexpr Input inputs[] = {{"points", 3}, {"normals", 3}};

  /// Entries of its weights' metadata.
  static std::map<std::string, std::string> variant() {
    return {{"net", "correspondence"}, {"width", std::to_string(C)}};
  }

  Conv1x1<6, 64> e1;
  Conv1x1<64, 128> e2;
  Conv1x1<128, C> e3;
  Conv1x1<C + 6, C> d1;
  ResBlock<C> b1;
  Conv1x1<C, C> d2;
  ResBlock<C> b2;
  Conv1x1<C, C / 2> d3;
  ResBlock<C / 2> b3;
  Conv1x1<C / 2, 3> d4;
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

  constexpr auto operator()(auto points, auto normals) const {
    const auto input = cat(points, normals);
    const auto f = input | e1 | instance_norm | relu | e2 | instance_norm | relu | e3 | instance_norm | relu;
    const auto h1 = b1(cat(f, input) | d1, points);
    const auto h2 = b2(h1 | d2, points);
    const auto h3 = b3(h2 | d3, points);
    return h3 | d4 | output;
  }
};

}  // namespace npt::inline NPT_ABI
