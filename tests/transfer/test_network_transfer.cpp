#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/transfer/network_transfer.hpp>

#include <vector>

#include "support/bumpy_sphere.hpp"

namespace {

using Paired = npt::PoseTransferNet<16>;

npt::NetworkTransfer<npt::DefaultExecutor> random_transfer(const npt::TransferOptions& options) {
  npt::Model<Paired> model;
  npt::randomise(model, 8);
  return {npt::network_type<Paired, npt::DefaultExecutor>(),
          model.buffer(),
          {},
          "the model",
          options,
          npt::DefaultExecutor(1)};
}

}  // namespace

TEST_CASE("step by step or in a batch: the same bits") {
  const npt::Mesh identity = support::bumpy_sphere(9, 14, 0.2), pose = support::bumpy_sphere(9, 14, 0.4);
  const auto transfer = random_transfer({.network = {.pairings = 2, .mirror = true}});
  CHECK(transfer.run_count() == 4);
  CHECK(transfer.description() == "bottleneck 16, conv_relu, per-vertex, 2 pairings, mirrored");
  npt::NetworkIdentity prepared;
  npt::PoseChoice choice;
  npt::NetworkPose code;
  std::vector<float> steps(identity.coordinates().size()), batch(steps.size());
  transfer.prepare_identity({.xyz = identity.coordinates()}, prepared);
  transfer.choose({.xyz = pose.coordinates()}, identity.vertex_count(), choice);
  transfer.encode({.xyz = pose.coordinates()}, choice, code);
  transfer.decode(prepared, code, steps);
  const npt::TransferJob job{{.xyz = identity.coordinates()}, {.xyz = pose.coordinates()}, batch};
  transfer.run({&job, 1});
  CHECK(steps == batch);
}

TEST_CASE("points that were chosen for other options are refused") {
  const npt::Mesh pose = support::bumpy_sphere(9, 14, 0.4);
  npt::PoseChoice choice;
  random_transfer({.network = {.pairings = 3}}).choose({.xyz = pose.coordinates()}, pose.vertex_count(), choice);
  CHECK_THROWS_WITH_AS(random_transfer({.network = {.pairings = 2}}).expect_chosen(choice),
                       doctest::Contains("3 pairings"), npt::Error);
}
