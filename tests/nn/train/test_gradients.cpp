// The gradient of the whole network against an independent implementation in double precision.
#include <doctest/doctest.h>

#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/train/gradients.hpp>

#include <algorithm>
#include <span>
#include <vector>

#include "nn/train/golden_gradients.hpp"
#include "support/nets.hpp"

using namespace golden_gradients;

TEST_CASE("golden gradients in double") {
  for_each_case([]<class Net>(const Net&, const char* name) { check_golden<Net, double>(name, {.tolerance = 1e-10}); });
}

TEST_CASE("golden gradients in fp32") {
  for_each_case([]<class Net>(const Net&, const char* name) { check_golden<Net, float>(name, {.tolerance = 1e-4}); });
}

TEST_CASE("gradients in a precision that this machine or scalar lacks are refused") {
  using Net = npt::PoseTransferNet<16>;
  if (!npt::simd::has_matrix_registers())
    CHECK_THROWS_AS(npt::Gradients<Net>(1).set_precision(npt::Precision::bf16x3), npt::Error);
  CHECK_THROWS_AS((npt::Gradients<Net, double>(1).set_precision(npt::Precision::bf16x3)), npt::Error);
}

TEST_CASE("gradients of a batch with more than 16 chunks are the same bits for any number of threads") {
  using Net = npt::PoseTransferNet<2>;
  npt::Model<Net> model;
  npt::randomise(model, 3);
  const auto pose = support::random_points<float>(50000, 1), identity = support::random_points<float>(50000, 2);
  std::vector<float> first(identity.size()), second(identity.size());
  const std::vector<npt::NetworkCall<float>> calls{{{pose, identity}, first}, {{identity, pose}, second}};
  const std::vector<std::span<const float>> from{pose, identity};
  std::vector<npt::Model<Net>> found(3);
  for (int run = 0; run < 3; ++run) {
    npt::Gradients<Net> gradients(run == 0 ? 1 : 7 * run);
    gradients.load(model.buffer());
    gradients.forward(calls);
    gradients.backward(from, found[static_cast<std::size_t>(run)].buffer());
  }
  CHECK(std::ranges::equal(found[0].buffer(), found[1].buffer()));
  CHECK(std::ranges::equal(found[0].buffer(), found[2].buffer()));
}

TEST_CASE("wrong sizes are errors that name the call") {
  using Net = npt::PoseTransferNet<2>;
  npt::Gradients<Net> gradients(1);
  gradients.load(npt::Model<Net>().buffer());
  std::vector<float> points(9), others(12), result(9);
  const std::vector<npt::NetworkCall<float>> calls{{{points, points}, result}, {{others, points}, result}};
  CHECK_THROWS_WITH_AS(
      gradients.forward(calls),
      "pose of call 1: found 4 vertices, expected 3, as many as identity has: this network reads both vertex by vertex",
      npt::Error);
  // Never read: only its size is.
  const std::span<const float> many(points.data(), 3 * (npt::engine::max_vertices + 1));
  const std::vector<npt::NetworkCall<float>> huge{{{many, many}, {result.data(), many.size()}}};
  CHECK_THROWS_WITH_AS(gradients.forward(huge), "pose: found 268435457 vertices, expected at most 268435456",
                       npt::Error);
}
