/// No call of PoseTransfer allocates once its sizes were seen.
#include <doctest/doctest.h>

#include <npt/transfer/pose_transfer.hpp>
#if __has_include(<Eigen/SparseCholesky>)
#include <npt/transfer/detail_refiner.hpp>
#endif

#include <vector>

#include "support/allocations.hpp"
#include "support/bumpy_sphere.hpp"
#include "support/needs.hpp"

namespace {

/// Every call that writes into memory of the caller's. Preparing an identity for refinement factors a matrix, and may
/// allocate.
template <class Net>
long allocations_of_warm_calls(const npt::TransferOptions& options) {
  npt::Model<Net> model;
  npt::randomise(model, 8);
  const npt::PoseTransfer transfer(model, options, 1);
  const npt::Mesh identity = support::bumpy_sphere(9, 14, 0.2, true), pose = support::bumpy_sphere(9, 14, 0.4),
                  far = support::bumpy_sphere(6, 11, 0.3);
  const auto ti = npt::triangulate(identity), tp = npt::triangulate(pose), tf = npt::triangulate(far);
  std::vector<float> result(identity.coordinates().size());
  npt::Character prepared = transfer.character(identity);
  npt::Pose posed;
  npt::PoseChoice choice;
  const auto everything = [&] {
    for (const npt::MeshView& p : {npt::MeshView{pose.coordinates(), tp}, npt::MeshView{far.coordinates(), tf}}) {
      if (options.refinement == nullptr) {
        transfer(npt::MeshView{identity.coordinates(), ti}, p, result);
        transfer.prepare({identity.coordinates(), ti}, prepared);
      }
      transfer.apply(prepared, p, result);
      transfer.choose_points(p, 140, choice);
      transfer.prepare(p, choice, posed);
      transfer.apply(prepared, posed, result);
    }
  };
  everything();
  everything();
  const long before = support::allocations.load();
  everything();
  return support::allocations.load() - before;
}

using Paired = npt::PoseTransferNet<16>;
using Pooled = npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>;

}  // namespace

TEST_CASE("a warm call into the caller's memory allocates nothing" *
          support::Needs(support::counts_malloc, "malloc for itself, which sanitizers take")) {
  CHECK(allocations_of_warm_calls<Paired>({}) == 0);
  CHECK(allocations_of_warm_calls<Paired>({.network = {.pairings = 2, .mirror = true, .invariant = true}}) == 0);
  CHECK(allocations_of_warm_calls<Pooled>({}) == 0);
#if __has_include(<Eigen/SparseCholesky>)
  CHECK(allocations_of_warm_calls<Paired>({.refinement = npt::detail_refinement}) == 0);
#endif
}
