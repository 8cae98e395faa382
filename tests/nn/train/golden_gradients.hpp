/// The gradient of the whole network against an independent implementation in double precision, which wrote the golden
/// files.
#pragma once

#include <doctest/doctest.h>

#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/train/gradients.hpp>
#include <npt/nn/weights/weights_file.hpp>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "support/golden.hpp"
#include "support/nets.hpp"

namespace golden_gradients {

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

/// Cosine of the angle between two vectors that come in parts.
class Angle {
 public:
  template <class T>
  void add(std::span<const T> values, const std::vector<double>& expected) {
    REQUIRE(values.size() == expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double x = static_cast<double>(values[i]);
      product_ += x * expected[i];
      square_ += x * x;
      expected_square_ += expected[i] * expected[i];
    }
  }
  double cosine() const { return product_ / std::sqrt(square_ * expected_square_); }

 private:
  double product_ = 0, square_ = 0, expected_square_ = 0;
};

/// What is asked of gradients: agreement, or, of a precision in which a small network's single numbers mean little, the
/// direction.
struct Measure {
  double tolerance = 0;  ///< largest difference over the largest value of a tensor; of results only beside a cosine
  double cosine = -2;    ///< least, of the angle between the whole gradient and the expected one; -2: not asked for
  double cosine_of_tensor = 0;  ///< and of each tensor with a value above a tenth of the largest
};

template <class Net, class T>
void check_golden(const std::string& name, const Measure& measure, npt::Precision precision = npt::Precision::native) {
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
  std::vector<npt::NetworkCall<T>> calls;
  std::vector<std::span<const T>> result_gradients;
  std::vector<std::span<T>> to_pose, to_identity;
  for (std::size_t n = 0; n < meshes; ++n) {
    calls.push_back({{poses[n], identities[n]}, results[n]});
    result_gradients.emplace_back(from[n]);
    to_pose.emplace_back(pose_gradients[n]);
    to_identity.emplace_back(identity_gradients[n]);
  }
  npt::Gradients<Net, T> gradients(2);
  gradients.set_precision(precision);
  gradients.load(model.buffer());
  npt::Model<Net, T> gradient;
  for (int repeat = 0; repeat < 2; ++repeat) {  // the second time in memory that holds something
    gradients.forward(calls);
    gradients.backward({.result = result_gradients, .parameters = gradient.buffer(), .inputs = {to_pose, to_identity}});
  }
  // Gradients that are exactly zero come out of PyTorch as rounding: they are compared with a part of the largest of
  // all.
  double largest = 0;
  for (const auto& p : model.parameters())
    if (!p.parameter.attribute)
      for (const double g : npt::to_double(golden.at("grad." + p.name))) largest = std::max(largest, std::abs(g));
  Angle whole;
  const auto compare = [&](std::span<const T> values, const std::vector<double>& expected, double floor) {
    if (measure.cosine < -1) {
      CHECK(difference(values, expected, floor) < measure.tolerance);
      return;
    }
    Angle angle;
    angle.add(values, expected);
    double most = 0;
    for (const double g : expected) most = std::max(most, std::abs(g));
    if (most > 0.1 * largest) CHECK(angle.cosine() > measure.cosine_of_tensor);
  };
  gradient.for_each_tensor([&](const std::string& tensor, const npt::Parameter&, std::span<const T> values) {
    CAPTURE(tensor);
    const std::vector<double> expected = npt::to_double(golden.at("grad." + tensor));
    compare(values, expected, 1e-3 * largest);
    whole.add(values, expected);
  });
  if (measure.cosine >= -1) CHECK(whole.cosine() > measure.cosine);
  for (std::size_t n = 0; n < meshes; ++n) {
    CHECK(support::relative_error(results[n], support::to_map(support::mesh_of<double>(golden.at("output"), n))) <
          measure.tolerance);
    compare(pose_gradients[n], support::mesh_of<double>(golden.at("grad.pose"), n), 0);
    compare(identity_gradients[n], support::mesh_of<double>(golden.at("grad.identity"), n), 0);
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

}  // namespace golden_gradients
