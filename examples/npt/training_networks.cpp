#include "training_networks.hpp"

#include <npt/nn/train/gradients.hpp>

#include <algorithm>
#include <vector>

namespace program {

namespace {

template <class Net>
TrainableNetwork trainable() {
  TrainableNetwork n;
  n.variant = npt::variant_metadata<Net>();
  n.gradients = [](int threads) -> FloatGradients { return npt::Gradients<Net>(threads); };
  n.double_gradients = [](int threads) -> DoubleGradients { return npt::Gradients<Net, double>(threads); };
  return n;
}

const std::vector<TrainableNetwork>& trainable_networks() {
  static const std::vector<TrainableNetwork> list = [] {
    std::vector<TrainableNetwork> all;
    npt::AllNetworks::for_each([&all]<class Net>() { all.push_back(trainable<Net>()); });
    return all;
  }();
  return list;
}

}  // namespace

const TrainableNetwork* find_trainable(const Variant& variant) {
  const auto found = std::ranges::find(trainable_networks(), variant.metadata(), &TrainableNetwork::variant);
  return found == trainable_networks().end() ? nullptr : &*found;
}

}  // namespace program
