#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/npt.hpp>
#include <npt/transfer/body_method.hpp>
#include <npt/transfer/pose_sequence.hpp>

#include <filesystem>
#include <vector>

#include "support/bumpy_sphere.hpp"

namespace {

const std::filesystem::path weights_folder = std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights";

npt::PoseTransfer open_with(npt::Method method) {
  return npt::PoseTransfer::open(weights_folder / "human.safetensors", {.body = npt::body_method, .method = method}, 1);
}

npt::Mesh posed_person(float bend) {
  std::vector<float> pose(72, 0.0F);
  pose[3 * 4] = bend, pose[3 * 18 + 1] = -bend, pose[3 * 16 + 2] = -bend / 2;
  return npt::to_mesh(npt::mannequin(), std::vector<float>{0.5F}, pose);
}

}  // namespace

TEST_CASE("people go through bodies, things to the network, and the report says so") {
  const npt::PoseTransfer transfer = open_with(npt::Method::automatic);
  REQUIRE(transfer.has_body());
  const npt::Mesh a = posed_person(0.1F), b = posed_person(1.0F), ball = support::bumpy_sphere(20, 30, 0.2, true);
  const auto faces = npt::triangulate(a), of_ball = npt::triangulate(ball);
  std::vector<float> result(a.coordinates().size());
  npt::TransferReport report;
  const npt::TransferJob people{{a.coordinates(), faces, "a"}, {b.coordinates(), faces, "b"}, result, &report};
  transfer.run({&people, 1});
  CHECK(report.method == npt::Method::body);
  CHECK(report.read);
  CHECK(report.confidence() > 0.85);
  // The mannequin is one body in two poses: the result is the other mesh.
  double worst = 0;
  for (std::size_t i = 0; i < result.size(); ++i)
    worst = std::max(worst, static_cast<double>(std::abs(result[i] - b.coordinates()[i])));
  CHECK(worst < 0.05);
  const npt::TransferJob thing{{a.coordinates(), faces, "a"}, {ball.coordinates(), of_ball, "ball"}, result, &report};
  transfer.run({&thing, 1});
  CHECK(report.method == npt::Method::network);
  CHECK(report.pose_confidence < 0.6);
  CHECK(report.identity_confidence > 0.85);
}

TEST_CASE("what doesn't read as a person and comes out torn is refused, unless it is asked for") {
  const npt::Mesh ball = support::bumpy_sphere(20, 30, 0.2, true), person = posed_person(1.0F);
  CHECK_THROWS_WITH_AS((void)open_with(npt::Method::automatic)(ball, person), doctest::Contains("tore apart"),
                       npt::Error);
  CHECK_NOTHROW((void)open_with(npt::Method::network)(ball, person));
  CHECK_NOTHROW((void)npt::PoseTransfer::open(weights_folder / "human.safetensors",
                                              {.body = npt::body_method, .keep_distorted = true}, 1)(ball, person));
}

TEST_CASE("prepared meshes, a sequence's first frame and one call give the same bits, with any number of threads") {
  const npt::PoseTransfer transfer = open_with(npt::Method::automatic);
  const auto two = npt::PoseTransfer::open(weights_folder / "human.safetensors", {.body = npt::body_method}, 2);
  const npt::Mesh a = posed_person(0.1F), b = posed_person(1.0F);
  const auto faces = npt::triangulate(a);
  const npt::MeshView of_a{a.coordinates(), faces, "a"}, of_b{b.coordinates(), faces, "b"};
  std::vector<float> once(a.coordinates().size()), again(once.size());
  transfer(of_a, of_b, once);
  const npt::PreparedIdentity identity = transfer.prepare_identity(of_a);
  transfer(identity, transfer.prepare_pose(of_b, a.vertex_count()), again);
  CHECK(once == again);
  npt::PoseSequence sequence(transfer);
  npt::PreparedPose pose;
  sequence.prepare(of_b, a.vertex_count(), pose);
  transfer(identity, pose, again);
  CHECK(once == again);
  two(of_a, of_b, again);
  CHECK(once == again);
}

TEST_CASE("a method that was asked for is taken, and one that can't be had is an error") {
  CHECK_FALSE(open_with(npt::Method::network).has_body());
  CHECK_THROWS_AS(npt::PoseTransfer::open(weights_folder / "quadruped.safetensors",
                                          {.body = npt::body_method, .method = npt::Method::body}, 1),
                  npt::Error);
  CHECK_THROWS_AS(npt::PoseTransfer::open(weights_folder / "human.safetensors",
                                          {.body = npt::body_method, .reader = "/nowhere/reader.safetensors"}, 1),
                  npt::Error);
  // Animals have no reader: the network's, without a word.
  CHECK_FALSE(
      npt::PoseTransfer::open(weights_folder / "quadruped.safetensors", {.body = npt::body_method}, 1).has_body());
}

TEST_CASE("a unit that can't be told is no hindrance to the way through bodies") {
  const npt::PoseTransfer transfer = open_with(npt::Method::automatic);
  npt::Mesh a = posed_person(0.1F);
  const npt::Mesh b = posed_person(1.0F);
  for (npt::Vec3f& p : a.positions) p = p * 5.0F;
  const npt::Mesh result = transfer(a, b);
  float low = 1e9F, high = -1e9F;
  for (const npt::Vec3f p : result.positions) low = std::min(low, p.y), high = std::max(high, p.y);
  CHECK(high - low > 6);
}
