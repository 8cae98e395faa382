/// SPAdaIN residual block (Wang et al., CVPR 2020, Fig. 3, Table 3).
///   y = unit2(unit1(x)) + unit3(x)      unit(h) = ReLU(conv(SPAdaIN(h, p)))    paper: ConvRelu
///                                       unit(h) = conv(ReLU(SPAdaIN(h, p)))    released code: ReluConv
/// Shapes     x, y: [C, V]   p: [3, V], the condition: in the paper the identity mesh
/// Gradients  every parameter, x, p
#pragma once

#include <npt/config.hpp>
#include <npt/nn/layer/conv1x1.hpp>
#include <npt/nn/layer/relu.hpp>
#include <npt/nn/layer/spadain.hpp>

namespace npt::inline NPT_ABI {

/// Order inside a unit as the paper's text and Table 3 have it.
struct ConvRelu {
  static constexpr const char* name = "conv_relu";
  static constexpr auto unit(auto x, auto condition, const auto& spadain, const auto& conv) {
    return spadain(x, condition) | conv | relu;
  }
};

/// Order inside a unit as the released code has it.
struct ReluConv {
  static constexpr const char* name = "relu_conv";
  static constexpr auto unit(auto x, auto condition, const auto& spadain, const auto& conv) {
    return spadain(x, condition) | relu | conv;
  }
};

template <int C, class Order = ConvRelu, Norm Normalise = Norm::instance>
struct ResBlock {
  SPAdaIN<C, 3, Normalise> spadain1, spadain2, spadain_res;
  Conv1x1<C, C> conv1, conv2, conv_res;

  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("spadain1", self.spadain1);
    visitor("conv1", self.conv1);
    visitor("spadain2", self.spadain2);
    visitor("conv2", self.conv2);
    visitor("spadain_res", self.spadain_res);
    visitor("conv_res", self.conv_res);
  }

  constexpr auto operator()(auto x, auto condition) const {
    const auto main = Order::unit(Order::unit(x, condition, spadain1, conv1), condition, spadain2, conv2);
    return main + Order::unit(x, condition, spadain_res, conv_res);
  }
};

}  // namespace npt::inline NPT_ABI
