#include "training_networks.hpp"

#include <npt/net/pose_transfer_net.hpp>
#include <npt/train/gradients.hpp>

#include <algorithm>
#include <vector>

namespace program {

namespace {

template <class Net>
TrainableNetwork trainable() {
  TrainableNetwork n;
  n.variant = {Net::bottleneck, Net::Order::name, Net::Feature::name};
  n.gradients = [](int threads) -> FloatGradients { return npt::Gradients<Net>(threads); };
  n.double_gradients = [](int threads) -> DoubleGradients { return npt::Gradients<Net, double>(threads); };
  return n;
}

template <int B>
void add(std::vector<TrainableNetwork>& list) {
  list.push_back(trainable<npt::PoseTransferNet<B, npt::ConvRelu, npt::PerVertex>>());
  list.push_back(trainable<npt::PoseTransferNet<B, npt::ConvRelu, npt::Pooled>>());
  list.push_back(trainable<npt::PoseTransferNet<B, npt::ReluConv, npt::PerVertex>>());
  list.push_back(trainable<npt::PoseTransferNet<B, npt::ReluConv, npt::Pooled>>());
}

const std::vector<TrainableNetwork>& trainable_networks() {
  static const std::vector<TrainableNetwork> list = [] {
    std::vector<TrainableNetwork> all;
    add<1024>(all);
    add<512>(all);
    add<256>(all);
    add<128>(all);
    add<64>(all);
    return all;
  }();
  return list;
}

}  // namespace

const TrainableNetwork* find_trainable(const Variant& variant) {
  const auto found = std::ranges::find(trainable_networks(), variant, &TrainableNetwork::variant);
  return found == trainable_networks().end() ? nullptr : &*found;
}

}  // namespace program
