/// Gradients of the networks that the program has compiled in. training_networks.cpp and networks.cpp are the only
/// files of the program that are compiled for their types.
#pragma once

#include "networks.hpp"

#include <npt/nn/train/gradients.hpp>

namespace program {

using FloatGradients = npt::tape::GradientCore<float, npt::DefaultExecutor>;
using DoubleGradients = npt::tape::GradientCore<double, npt::DefaultExecutor>;

struct TrainableNetwork {
  npt::Metadata variant;
  FloatGradients (*gradients)(int threads) = nullptr;
  DoubleGradients (*double_gradients)(int threads) = nullptr;
};

/// The network of that variant, or nullptr.
const TrainableNetwork* find_trainable(const Variant& variant);

}  // namespace program
