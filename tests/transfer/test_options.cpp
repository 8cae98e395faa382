#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/transfer/options.hpp>

#include <cmath>
#include <vector>

#include "transfer/shipped.hpp"

namespace {

npt::PoseTransfer open_with(const npt::TransferOptions& options) {
  return npt::PoseTransfer::open(shipped::weights(), options, 1);
}

/// Root mean square distance of vertices.
double distance(const npt::Mesh& a, const npt::Mesh& b) {
  double sum = 0;
  for (std::size_t v = 0; v < a.vertex_count(); ++v) {
    const npt::Vec3d d = (a.positions[v] - b.positions[v]).as<double>();
    sum += dot(d, d);
  }
  return std::sqrt(sum / static_cast<double>(a.vertex_count()));
}

}  // namespace

TEST_CASE("body estimation is the default, and the warnings' threshold lies above the recognition's") {
  const npt::TransferOptions options;
  CHECK(options.method == npt::Method::automatic);
  CHECK(options.body.quality == npt::Quality::balanced);
  CHECK(options.body.least_confidence == npt::least_confidence);
  CHECK(options.body.high_confidence == npt::high_confidence);
  CHECK(options.body.least_confidence < options.body.high_confidence);
}

TEST_CASE("fast, balanced and best estimates all come to 2 cm") {
  // The mannequin is one body in two poses: the result is the other mesh.
  const npt::Mesh a = shipped::person(0.1F), b = shipped::person(1.0F);
  const npt::Mesh balanced = shipped::human()(a, b);
  CHECK(distance(balanced, b) < 0.02);
  for (const npt::Quality quality : {npt::Quality::fast, npt::Quality::best}) {
    const npt::Mesh result = open_with({.body = {.quality = quality}})(a, b);
    CHECK(distance(result, b) < 0.02);
  }
}

TEST_CASE("thresholds say what is recognised and what is warned of") {
  const npt::Mesh mesh = shipped::person(1.0F);
  const auto careful = open_with({.body = {.high_confidence = 1.01}});
  const npt::Pose doubted = careful.pose(mesh);
  CHECK(doubted.recognised());
  REQUIRE(doubted.warnings().size() == 1);
  CHECK(doubted.warnings()[0] == npt::Warning{.code = npt::WarningCode::low_confidence,
                                              .mesh = npt::MeshRole::pose,
                                              .value = doubted.confidence().value(),
                                              .remedy = npt::Remedy::look_at_result,
                                              .kind = &npt::people_plan().words()});
  const npt::Pose refused = open_with({.body = {.least_confidence = 1.01}}).pose(mesh);
  CHECK_FALSE(refused.recognised());
  CHECK(refused.confidence() == doubted.confidence());
  CHECK(refused.warnings().contains(npt::WarningCode::not_recognised));
}

TEST_CASE("the body method takes whatever the mesh is; the network's estimates no body") {
  const auto network = open_with({.method = npt::Method::network});
  CHECK_FALSE(network.has_body());
  CHECK_FALSE(network.pose(shipped::person(1.0F)).confidence());
  const auto body = open_with({.method = npt::Method::body, .body = {.least_confidence = 1.01}});
  CHECK(body.pose(shipped::person(1.0F)).recognised());
}
