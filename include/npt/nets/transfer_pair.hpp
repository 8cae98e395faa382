/// A run of a pose transfer network, by the names of its inputs.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/engine/network_call.hpp>
#include <npt/nn/graph/inputs.hpp>

#include <span>

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
  return inputs.are({{"pose", 3}, {"identity", 3}}) && inputs.encoded == 0;
}

}  // namespace npt::inline NPT_ABI
