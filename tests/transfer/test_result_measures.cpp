#include <doctest/doctest.h>

#include <npt/mesh/triangles.hpp>
#include <npt/transfer/pose_transfer.hpp>
#include <npt/transfer/result_measures.hpp>
#include <npt/transfer/result_meter.hpp>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "mesh/shapes.hpp"
#include "transfer/shipped.hpp"

namespace {

/// A ball of radius 1 at x = 0 and one of radius 0.5 at x: the small one has a fifth of the area.
npt::Mesh balls(double x) {
  shapes::Surface both = shapes::sphere(20, 30), small = both;
  for (npt::Vec3d& p : small.points) p = p * 0.5 + npt::Vec3d{x, 0, 0};
  both.add(small);
  return shapes::mesh_of(both.points, both.triangles);
}

npt::ResultMeasures measured(const npt::Mesh& identity, const npt::Mesh& result, bool inward = false) {
  std::vector<npt::Triangle> triangles = npt::triangulate(identity);
  if (inward)
    for (npt::Triangle& t : triangles) std::swap(t[1], t[2]);
  return npt::ResultMeter({identity.coordinates(), triangles, ""}).measure(result.coordinates());
}

npt::PoseTransfer measuring(npt::Method method, int threads = 1) {
  return npt::PoseTransfer::open(shipped::weights(), {.method = method, .measure = true}, threads);
}

}  // namespace

TEST_CASE("a part that has come to lie inside another one penetrates it by its share of the area") {
  for (const bool inward : {false, true}) {
    CHECK(measured(balls(3), balls(0), inward).penetration == doctest::Approx(0.2).epsilon(0.05));
    CHECK(measured(balls(3), balls(2), inward).penetration == 0);
    CHECK(measured(balls(0), balls(0.1), inward).penetration == 0);  // it was there before
    CHECK(measured(balls(0), balls(3), inward).penetration == 0);
  }
  // Half of the small ball, and what the large one loses to it: a cap with a height of 1 / 8.
  CHECK(measured(balls(3), balls(1)).penetration == doctest::Approx(0.2 * 0.375 + 0.8 / 16).epsilon(0.15));
  CHECK(measured(balls(3), balls(3)).stretch.largest == doctest::Approx(1));
  npt::Mesh broken = balls(3);
  broken.positions[5].x = std::numeric_limits<float>::quiet_NaN();
  CHECK(std::isnan(measured(balls(3), broken).penetration));
}

TEST_CASE("results are measured where options ask for it, with the same bits for any number of threads") {
  const npt::Mesh identity = shipped::person(0.1F), pose = shipped::person(1.0F, -1.0F);
  CHECK_FALSE(shipped::human().apply(shipped::character(), shipped::pose()).measures.has_value());
  const npt::PoseTransfer transfer = measuring(npt::Method::automatic);
  const npt::Character hero = transfer.character(identity);
  const npt::Pose taken = transfer.pose(pose);
  const npt::Result result = transfer.apply(hero, taken);
  REQUIRE(result.measures.has_value());
  const npt::ResultMeasures& measures = *result.measures;
  // The mannequin itself, skinned into that pose: 1.37, 1.67 and 0.
  CHECK(measures.stretch.common == doctest::Approx(1.29).epsilon(0.02));
  CHECK(measures.stretch.largest == doctest::Approx(1.34).epsilon(0.02));
  CHECK(measures.penetration < 0.005);
  CHECK(measures.identity_coverage.value() > 0.99);
  CHECK(measures.pose_coverage.value() > 0.99);
  // A part of the result that is moved away is torn off there.
  npt::Mesh torn = result.mesh;
  for (npt::Vec3f& p : torn.positions)
    if (p.x > 0.5F) p.x += 1;
  CHECK(transfer.measure(hero, taken, torn.coordinates()).stretch.largest > 20);

  for (const int threads : {2, 7}) {
    const npt::PoseTransfer other = measuring(npt::Method::automatic, threads);
    const shipped::Viewed of_identity(identity), of_pose(pose);
    std::vector<float> positions(identity.coordinates().size());
    npt::TransferReport report;
    const npt::TransferJob job{of_identity, of_pose, positions, &report};
    other.run({&job, 1});
    REQUIRE(report.measures.has_value());
    CHECK(report.measures->stretch.common == measures.stretch.common);
    CHECK(report.measures->stretch.largest == measures.stretch.largest);
    CHECK(report.measures->stretch.vertex == measures.stretch.vertex);
    CHECK(report.measures->penetration == measures.penetration);
    CHECK(report.measures->identity_coverage == measures.identity_coverage);
    CHECK(report.measures->pose_coverage == measures.pose_coverage);
  }
}

TEST_CASE("what the network makes is measured too, without coverage, also into the identity's memory") {
  const npt::PoseTransfer transfer = measuring(npt::Method::network);
  npt::Mesh identity = shipped::person(0.1F);
  const shipped::Viewed of_pose(shipped::person(1.0F));
  const npt::Character hero = transfer.character(identity);
  const npt::Pose taken = transfer.pose(of_pose.view(), identity.vertex_count());
  const npt::Result result = transfer.apply(hero, taken);
  REQUIRE(result.measures.has_value());
  CHECK(result.measures->stretch.common > 1.1);
  CHECK_FALSE(result.measures->identity_coverage.has_value());
  CHECK_FALSE(result.measures->pose_coverage.has_value());
  const std::vector<npt::Triangle> triangles = npt::triangulate(identity);
  npt::TransferReport report;
  const npt::TransferJob job{{identity.coordinates(), triangles, ""}, of_pose, identity.coordinates(), &report};
  transfer.run({&job, 1});
  REQUIRE(report.measures.has_value());
  CHECK(report.measures->stretch.common == result.measures->stretch.common);
  // Points alone have nothing to be measured.
  const npt::Mesh points = shipped::person(0.1F);
  const npt::Character cloud = transfer.character(npt::MeshView{points.coordinates(), {}, "cloud"});
  CHECK_FALSE(transfer.apply(cloud, taken).measures.has_value());
  const auto error = shipped::error_of([&] { (void)transfer.measure(cloud, taken, points.coordinates()); });
  CHECK(error.file == "cloud");
  CHECK(error.found == "no surface");
}
