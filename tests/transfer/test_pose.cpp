#include <doctest/doctest.h>

#include <npt/transfer/pose.hpp>

#include "transfer/shipped.hpp"

TEST_CASE("a pose says what was estimated for it") {
  const npt::Pose& pose = shipped::pose();
  CHECK(pose.prepared());
  CHECK(pose.recognised());
  CHECK(pose.domain() == "human");
  CHECK(pose.confidence().value() > 0.85);
  CHECK(pose.warnings().empty());
  CHECK(pose.identity_vertices() == 0);
  REQUIRE(pose.joints());
  CHECK(pose.joints()->axis_angles.size() == 72);
  CHECK(pose.joints()->axis_angles[3 * 4] == doctest::Approx(1).epsilon(0.2));  // the bent knee
  CHECK_FALSE(npt::Pose().prepared());
  CHECK_FALSE(npt::Pose().joints());
}

TEST_CASE("a pose that isn't recognised says so, and no character takes it") {
  const npt::Pose ball = shipped::human().pose(shipped::ball());
  CHECK_FALSE(ball.recognised());
  CHECK_FALSE(ball.joints());
  CHECK(ball.warnings().contains(npt::WarningCode::not_recognised));
  CHECK(shipped::error_of([&] { ball.expect_recognised(); }).code == npt::ErrorCode::not_recognised);
  CHECK(shipped::error_of([&] { (void)shipped::human().apply(shipped::character(), ball); }).code ==
        npt::ErrorCode::not_recognised);
  CHECK_NOTHROW(shipped::pose().expect_recognised());
}

TEST_CASE("a pose without a surface is the network's, encoded at once or when a character asks") {
  const auto transfer = npt::PoseTransfer::open(shipped::weights(), {.seed = 3}, 1);
  const npt::Character hero = transfer.character(shipped::person(0.1F));
  const npt::Mesh person = shipped::person(1.0F);
  const npt::MeshView points{person.coordinates(), {}, "points"};
  const npt::Pose encoded = transfer.pose(points, hero.vertex_count()), late = transfer.pose(points);
  CHECK_FALSE(encoded.recognised());
  CHECK(encoded.warnings().contains(npt::WarningCode::no_surface));
  CHECK(encoded.identity_vertices() == hero.vertex_count());
  CHECK(late.identity_vertices() == 0);
  const npt::Result a = transfer.apply(hero, encoded), b = transfer.apply(hero, late);
  CHECK(a.method == npt::Method::network);
  CHECK(shipped::numbers(a.mesh.coordinates()) == shipped::numbers(b.mesh.coordinates()));
  CHECK(a.warnings.size() == b.warnings.size());
}

TEST_CASE("a pose in another unit says so where the network is asked, and not where the unit was given") {
  npt::Mesh centimetres = shipped::ball();
  for (npt::Vec3f& p : centimetres.positions) p = p * 50.0F;
  const auto says_unit = [&](const npt::TransferOptions& options, std::size_t identity_vertices) {
    const auto transfer = npt::PoseTransfer::open(shipped::weights(), options, 1);
    const npt::Pose pose = transfer.pose(centimetres, identity_vertices);
    return pose.warnings().contains(npt::WarningCode::unit_assumed);
  };
  CHECK(says_unit({}, 0));
  CHECK(says_unit({}, 600));
  CHECK_FALSE(says_unit({.import = {.unit = 0.01}}, 600));
}
