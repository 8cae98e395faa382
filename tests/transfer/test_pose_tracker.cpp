#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/transfer/pose_tracker.hpp>

#include <algorithm>
#include <cstring>
#include <vector>

#include "support/bumpy_sphere.hpp"

namespace {

using Net = npt::PoseTransferNet<16>;

npt::PoseTransfer random_transfer(const npt::TransferOptions& options) {
  npt::Model<Net> model;
  npt::randomise(model, 8);
  return npt::PoseTransfer(model, options, 1);
}

}  // namespace

TEST_CASE("frames of a sequence share their random choices; other faces begin another sequence") {
  const npt::Mesh identity = support::bumpy_sphere(9, 14, 0.2), first = support::bumpy_sphere(6, 11, 0.4),
                  other = support::bumpy_sphere(5, 8, 0.4);
  // Areas and the order of coordinates change.
  npt::Mesh second = first;
  for (npt::Vec3f& p : second.positions) p = {p.x + 0.3F * p.y, p.y + std::max(0.0F, p.x - 3), p.z - 0.2F * p.x};
  for (const bool invariant : {false, true}) {
    const auto transfer = random_transfer({.network = {.pairings = 2, .invariant = invariant}, .seed = 2});
    const npt::Character character = transfer.character(identity);
    npt::PoseTracker tracker(transfer);
    const auto frame = [&](const npt::Mesh& mesh) {
      const auto triangles = npt::triangulate(mesh);
      std::vector<float> result(identity.coordinates().size());
      transfer.apply(character, tracker.next({mesh.coordinates(), triangles}, identity.vertex_count()), result);
      return result;
    };
    const auto alone = [&](const npt::Mesh& mesh) {
      const npt::Mesh result = transfer(identity, mesh);
      return std::vector<float>(result.coordinates().begin(), result.coordinates().end());
    };
    const auto a = frame(first), b = frame(second);
    CHECK(a == alone(first));
    CHECK(b != alone(second));
    CHECK(frame(first) == a);
    CHECK(frame(second) == b);
    // Other faces: chosen anew.
    CHECK(frame(other) == alone(other));
    CHECK(frame(second) == alone(second));
    frame(first);
    tracker.restart();
    CHECK(frame(second) == alone(second));
  }
}
