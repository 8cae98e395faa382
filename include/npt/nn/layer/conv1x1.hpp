/// 1x1 convolution: a matrix product over the channels, the same at every vertex.
///   y[o, v] = bias[o] + sum over i of weight[o, i] * x[i, v]
/// Shapes     x: [Cin, V]   y: [Cout, V]   weight: [Cout, Cin, 1]   bias: [Cout]
/// Gradients  weight, bias, x
#pragma once

#include <npt/config.hpp>
#include <npt/nn/layer/parameter.hpp>

namespace npt::inline NPT_ABI {

template <int Cin, int Cout>
struct Conv1x1 {
  static_assert(Cin > 0 && Cout > 0, "npt: a convolution needs at least one channel on each side");

  Parameter weight{Cout, Cin, 1};
  Parameter bias{Cout};

  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("weight", self.weight);
    visitor("bias", self.bias);
  }
};

}  // namespace npt::inline NPT_ABI
