#include <doctest/doctest.h>

#include <npt/base/as_span.hpp>
#include <npt/base/rotation.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/estimate/body_estimate.hpp>

#include <cstddef>
#include <numbers>
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

TEST_CASE("the angles without direction are the same however the mesh is turned by right angles") {
  const npt::Matrix3 leaning = npt::rotation_matrix({0.2, 0.7, -0.3});
  const auto angles_of = [](const npt::Matrix3& root) {
    npt::BodyEstimate estimate = usual_estimate();
    npt::set_joint_rotation(npt::as_span(estimate.fit.body.axis_angles), 0, root);
    npt::set_joint_rotation(npt::as_span(estimate.fit.body.axis_angles), 5, npt::rotation_matrix({0.1, 0.2, 0.3}));
    return estimate.angles_without_direction();
  };
  const std::vector<npt::Vec3d> plain = angles_of(leaning);
  CHECK(length(plain[0]) > 0.2);
  CHECK(length(plain[5] - npt::Vec3d{0.1, 0.2, 0.3}) < 1e-6);
  constexpr double right_angle = std::numbers::pi / 2;
  for (const npt::Vec3d axis : {npt::Vec3d{1, 0, 0}, {0, 1, 0}, {0, 0, 1}})
    for (const double turn : {right_angle, 2 * right_angle}) {
      const std::vector<npt::Vec3d> turned = angles_of(npt::rotation_matrix(axis * turn) * leaning);
      for (std::size_t j = 0; j < plain.size(); ++j) CHECK(length(turned[j] - plain[j]) < 1e-5);
    }
}
