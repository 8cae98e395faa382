/// Kernels, engine and tape on tiny shapes, compiled for themselves under the address and undefined-behaviour
/// sanitizers, in every build: a build of everything under sanitizers leaves the compiled kernels unchecked, since each
/// of their accesses would be. Shapes around a panel and a group, where a kernel that reads too far does so.
#include <doctest/doctest.h>

#include <npt/base/thread_executor.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/train/gradients.hpp>

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "support/nets.hpp"

namespace {

using Net = npt::PoseTransferNet<16>;

npt::Model<Net> model() {
  npt::Model<Net> m;
  npt::randomise(m, 5);
  return m;
}

/// Half the sum of squares of the network's results, as its tape computes them.
template <class Gradients>
double loss(Gradients& gradients, const npt::Model<Net>& at, std::span<const npt::NetworkCall<float>> calls) {
  gradients.load(at.buffer());
  gradients.forward(calls);
  double sum = 0;
  for (const auto& call : calls)
    for (const float x : call.result) sum += 0.5 * static_cast<double>(x) * static_cast<double>(x);
  return sum;
}

double norm(std::span<const float> values) {
  double sum = 0;
  for (const float x : values) sum += static_cast<double>(x) * static_cast<double>(x);
  return std::sqrt(sum);
}

/// A forward pass by the engine, and a step of training that the loss must follow.
void check_step(std::size_t vertices, npt::Precision precision, double tolerance) {
  CAPTURE(vertices);
  const npt::ThreadExecutor two(2);
  const auto pose = support::random_points<float>(vertices, 1), identity = support::random_points<float>(vertices, 2);
  std::vector<float> expected(identity.size()), result(identity.size()), other(identity.size());
  npt::Model<Net> at = model();
  npt::Engine(at, two, precision)({pose, identity}, expected);

  npt::Gradients<Net, float, npt::ThreadExecutor> gradients(two);
  gradients.set_precision(precision);
  const std::vector<npt::NetworkCall<float>> calls{{{pose, identity}, result}, {{identity, pose}, other}};
  const double before = loss(gradients, at, calls);
  for (std::size_t i = 0; i < result.size(); ++i) other[i] = result[i] - expected[i];
  CHECK(norm(other) <= tolerance * norm(expected));

  loss(gradients, at, calls);
  npt::Model<Net> slope;
  gradients.backward(std::vector<std::span<const float>>{result, other}, slope.buffer());
  const double length = norm(slope.buffer());
  REQUIRE(length > 0);
  const double step = 0.01 * before / (length * length);  // 1 % of the loss, where it is straight
  for (std::size_t i = 0; i < slope.buffer().size(); ++i)
    at.buffer()[i] -= static_cast<float>(step) * slope.buffer()[i];
  const double fall = (before - loss(gradients, at, calls)) / (0.01 * before);
  CHECK(fall > 0.5);
  CHECK(fall < 1.5);
}

}  // namespace

TEST_CASE("a forward pass and a training step in fp32") {
  for (const std::size_t vertices : {2U, 17U, 95U, 97U, 193U}) check_step(vertices, npt::Precision::native, 1e-4);
}

TEST_CASE("a forward pass and a training step in bfloat16, where the processor has it") {
  if (!npt::Engine<Net>::supports(npt::Precision::bf16)) return;
  for (const std::size_t vertices : {33U, 97U}) check_step(vertices, npt::Precision::bf16, 0.1);
}
