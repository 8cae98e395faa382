#include <doctest/doctest.h>

#include <npt/body/people_plan.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/estimate/body_estimate.hpp>

#include <vector>

namespace {

/// Of a person who was read well.
npt::BodyEstimate usual_estimate() {
  npt::BodyEstimate estimate;
  estimate.fit.body.axis_angles.assign(72, 0.0F);
  estimate.fit.body.betas.assign(26, 1.0F);
  estimate.fit.mesh_explained = 0.98;
  estimate.fit.relative_distance = 0.005;
  estimate.fit.part_distances.assign(24, 0.005);
  estimate.joint_confidence.assign(24, 0.9);
  return estimate;
}

}  // namespace

TEST_CASE(
    "limbs whose joints are more likely wrong than right are told of, and odd proportions below high confidence") {
  npt::BodyEstimate estimate = usual_estimate();
  estimate.fit.body.betas.assign(26, 4.5F);
  estimate.confidence = 0.9;
  CHECK(estimate.warnings(npt::people_plan()).empty());
  estimate.joint_confidence[npt::joint_index(npt::SmplJoint::left_elbow)] = 0.45;
  CHECK(estimate.warnings(npt::people_plan()) == std::vector{npt::WarningCode::arms_uncertain});
  estimate.confidence = 0.7;
  CHECK(estimate.warnings(npt::people_plan()) ==
        std::vector{npt::WarningCode::arms_uncertain, npt::WarningCode::unusual_proportions});
}

TEST_CASE("a limb that keeps a greater distance than the others is in doubt") {
  npt::BodyEstimate estimate = usual_estimate();
  const std::vector<npt::LimbPair> pairs = npt::people_plan().limb_pairs();
  CHECK_FALSE(estimate.doubtful(pairs[1]));
  estimate.fit.part_distances[npt::joint_index(npt::SmplJoint::left_elbow)] = 0.02;
  CHECK(estimate.doubtful(pairs[1]));
  CHECK_FALSE(estimate.doubtful(pairs[0]));
}

TEST_CASE("vertices in the body's coordinates: about the centre, in metres; a mesh without a body is refused") {
  npt::BodyEstimate reading;
  reading.centre = {10, 20, -30};
  reading.metres = 0.01;
  const std::vector<float> xyz{10, 20, -30, 110, 20, -30};
  const std::vector<npt::Vec3d> points = reading.points_of({.xyz = xyz});
  REQUIRE(points.size() == 2);
  CHECK(length(points[0]) < 1e-12);
  CHECK(length(points[1] - npt::Vec3d{1, 0, 0}) < 1e-12);
  CHECK_THROWS_WITH_AS(npt::expect_body(reading, "cube"), doctest::Contains("no body can lie"), npt::Error);
}
