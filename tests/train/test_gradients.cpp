// The gradient of the whole network against an independent implementation in double precision.
#include <doctest/doctest.h>

#include <npt/net/pose_transfer_net.hpp>
#include <npt/train/gradients.hpp>
#include <npt/weights/weights_file.hpp>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "support/golden.hpp"
#include "support/needs.hpp"
#include "support/nets.hpp"

namespace {

/// Largest difference over largest value.
template <class T>
double difference(std::span<const T> values, const std::vector<double>& expected, double floor = 0) {
  REQUIRE(values.size() == expected.size());
  double worst = 0, largest = floor;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    worst = std::max(worst, std::abs(static_cast<double>(values[i]) - expected[i]));
    largest = std::max(largest, std::abs(expected[i]));
  }
  return largest == 0 ? worst : worst / largest;
}

template <class Net, class T>
void check_golden(const std::string& name, double tolerance, npt::Precision precision = npt::Precision::native,
                  double floor = 1e-3) {
  CAPTURE(name);
  CAPTURE(std::string(npt::name_of(precision)));
  npt::Model<Net, T> model;
  npt::load(model, support::golden_path(name + ".weights.safetensors"));
  const auto golden = npt::SafetensorsFile::read(support::golden_path(name + ".case.safetensors"));
  const std::size_t meshes = golden.at("output").shape[0];
  std::vector<std::vector<T>> poses, identities, results, from, pose_gradients, identity_gradients;
  for (std::size_t n = 0; n < meshes; ++n) {
    poses.push_back(support::mesh_of<T>(golden.at("pose"), n));
    identities.push_back(support::mesh_of<T>(golden.at("identity"), n));
    from.push_back(support::mesh_of<T>(golden.at("grad.output"), n));
    results.emplace_back(identities[n].size());
    pose_gradients.emplace_back(poses[n].size());
    identity_gradients.emplace_back(identities[n].size());
  }
  std::vector<npt::TransferPair<T>> pairs;
  std::vector<std::span<const T>> result_gradients;
  std::vector<std::span<T>> to_pose, to_identity;
  for (std::size_t n = 0; n < meshes; ++n) {
    pairs.push_back({poses[n], identities[n], results[n]});
    result_gradients.emplace_back(from[n]);
    to_pose.emplace_back(pose_gradients[n]);
    to_identity.emplace_back(identity_gradients[n]);
  }
  npt::Gradients<Net, T> gradients(2);
  gradients.set_precision(precision);
  gradients.load(model.buffer());
  npt::Model<Net, T> gradient;
  for (int repeat = 0; repeat < 2; ++repeat) {  // the second time in memory that holds something
    gradients.forward(pairs);
    gradients.backward(
        {.result = result_gradients, .parameters = gradient.buffer(), .pose = to_pose, .identity = to_identity});
  }
  // Gradients that are exactly zero come out of PyTorch as rounding: they are compared with a part of the largest of all.
  double largest = 0;
  for (const auto& p : model.parameters())
    if (!p.parameter.attribute)
      for (const double g : npt::to_double(golden.at("grad." + p.name))) largest = std::max(largest, std::abs(g));
  gradient.for_each_tensor([&](const std::string& tensor, const npt::Parameter&, std::span<const T> values) {
    CAPTURE(tensor);
    CHECK(difference(values, npt::to_double(golden.at("grad." + tensor)), floor * largest) < tolerance);
  });
  for (std::size_t n = 0; n < meshes; ++n) {
    CHECK(support::relative_error(results[n], support::to_map(support::mesh_of<double>(golden.at("output"), n))) <
          tolerance);
    CHECK(difference<T>(pose_gradients[n], support::mesh_of<double>(golden.at("grad.pose"), n)) < tolerance);
    CHECK(difference<T>(identity_gradients[n], support::mesh_of<double>(golden.at("grad.identity"), n)) < tolerance);
  }
  // Without the meshes' gradients, the parameters' are the same bits.
  npt::Model<Net, T> alone;
  gradients.backward(result_gradients, alone.buffer());
  CHECK(std::ranges::equal(alone.buffer(), gradient.buffer()));
}

/// Calls f(network, name of its case) for every golden case.
template <class F>
void for_each_case(F&& f) {
  f(npt::PoseTransferNet<16>{}, "paper_b16_v35");
  f(npt::PoseTransferNet<61>{}, "paper_b61_v99");
  f(npt::PoseTransferNet<16, npt::ReluConv>{}, "released_b16_v35");
  f(npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>{}, "pooled_b16_v35");
  f(npt::PoseTransferNet<29, npt::ReluConv, npt::Pooled>{}, "released_pooled_b29_v48");
}

}  // namespace

TEST_CASE("golden gradients in double") {
  for_each_case([]<class Net>(const Net&, const char* name) { check_golden<Net, double>(name, 1e-10); });
}

TEST_CASE("golden gradients in fp32") {
  for_each_case([]<class Net>(const Net&, const char* name) { check_golden<Net, float>(name, 1e-4); });
}

TEST_CASE("golden gradients on matrix registers" * support::needs_matrix_registers()) {
  for_each_case([]<class Net>(const Net&, const char* name) {
    check_golden<Net, float>(name, 1e-4, npt::Precision::bf16x3);
    check_golden<Net, float>(name, 1e-2, npt::Precision::bf16x2);
    check_golden<Net, float>(name, 0.85, npt::Precision::bf16);  // most 0.83, one bias of the case with 35 vertices
    check_golden<Net, float>(name, 0.6, npt::Precision::bf16, 0.1);
  });
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
  const std::vector<npt::TransferPair<float>> pairs{{pose, identity, first}, {identity, pose, second}};
  const std::vector<std::span<const float>> from{pose, identity};
  std::vector<npt::Model<Net>> found(3);
  for (int run = 0; run < 3; ++run) {
    npt::Gradients<Net> gradients(run == 0 ? 1 : 7 * run);
    gradients.load(model.buffer());
    gradients.forward(pairs);
    gradients.backward(from, found[static_cast<std::size_t>(run)].buffer());
  }
  CHECK(std::ranges::equal(found[0].buffer(), found[1].buffer()));
  CHECK(std::ranges::equal(found[0].buffer(), found[2].buffer()));
}

TEST_CASE("wrong sizes are errors that name the pair") {
  using Net = npt::PoseTransferNet<2>;
  npt::Gradients<Net> gradients(1);
  gradients.load(npt::Model<Net>().buffer());
  std::vector<float> points(9), others(12), result(9);
  const std::vector<npt::TransferPair<float>> pairs{{points, points, result}, {others, points, result}};
  CHECK_THROWS_WITH_AS(
      gradients.forward(pairs),
      "pose of pair 1: found 4 vertices, expected 3, as many as the identity has: this network pairs vertices "
      "(resample the pose mesh, or use a network with the pooled feature)",
      npt::Error);
  // Never read: only its size is.
  const std::span<const float> many(points.data(), 3 * (npt::engine::max_vertices + 1));
  const std::vector<npt::TransferPair<float>> huge{{many, many, {result.data(), many.size()}}};
  CHECK_THROWS_WITH_AS(gradients.forward(huge), "pose: found 268435457 vertices, expected at most 268435456",
                       npt::Error);
}
