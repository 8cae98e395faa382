#include <doctest/doctest.h>

#include <npt/nets/ablation_nets.hpp>
#include <npt/nets/correspondence_net.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nets/transfer_pair.hpp>
#include <npt/nn/graph/lower.hpp>

#include <vector>

namespace {

/// The right names, but the identity is what could be encoded.
struct Turned {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 4> encode;
  npt::Conv1x1<7, 3> join;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("encode", self.encode);
    visitor("join", self.join);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    return cat(identity | encode | npt::max_pool, pose) | join;
  }
};

template <class Net>
constexpr bool transfers_by_type = npt::transfers_poses(npt::graph::program_of<Net>.inputs);

}  // namespace

TEST_CASE("networks of a pose and an identity transfer poses, others don't") {
  CHECK(transfers_by_type<npt::PoseTransferNet<8>>);
  CHECK(transfers_by_type<npt::PoseTransferNet<8, npt::ReluConv, npt::Pooled>>);
  CHECK(transfers_by_type<npt::PlainNet<8>>);
  CHECK(transfers_by_type<npt::ConcatNet<8>>);
  CHECK_FALSE(transfers_by_type<npt::CorrespondenceNet<8>>);
  CHECK_FALSE(transfers_by_type<Turned>);
}

TEST_CASE("a pair becomes a call with the inputs in the network's order") {
  const std::vector<float> pose(9), identity(6);
  std::vector<float> result(6);
  const npt::NetworkCall<float> call = npt::TransferPair<float>{.pose = pose, .identity = identity, .result = result};
  REQUIRE(call.inputs.size() == 2);
  CHECK(call.inputs[0].data() == pose.data());
  CHECK(call.inputs[1].size() == 6);
  CHECK(call.result.data() == result.data());
}
