/// A run of a pose transfer network, by the names of its inputs.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/engine/network_call.hpp>
#include <npt/nn/graph/graph.hpp>

#include <span>
#include <string_view>

namespace npt::inline NPT_ABI {

/// A mesh in the pose and the one that is to take it on, on borrowed memory: [Vp, 3] and [V, 3] coordinates in, [V, 3]
/// out, row major.
template <class T = float>
struct TransferPair {
  std::span<const T> pose;
  std::span<const T> identity;
  std::span<T> result;

  operator NetworkCall<T>() const { return {{pose, identity}, result}; }
};

/// Whether a network transfers poses: it takes the pose, which it can encode by itself, and the identity.
constexpr bool transfers_poses(const graph::InputList& inputs) {
  const auto is = [&inputs](int i, std::string_view name) { return inputs[i].name == name && inputs[i].channels == 3; };
  return inputs.count == 2 && inputs.encoded == 0 && is(0, "pose") && is(1, "identity");
}

}  // namespace npt::inline NPT_ABI
