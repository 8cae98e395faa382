#include <doctest/doctest.h>

#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/confidence.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace {

/// Of a person who was read well.
npt::BodyEstimate usual_estimate() {
  npt::BodyEstimate estimate;
  estimate.fit.body.axis_angles.assign(72, 0.0F);
  estimate.fit.body.betas.assign(26, 1.0F);
  estimate.fit.mesh_explained = estimate.fit.body_explained = 0.98;
  estimate.fit.correspondence_residual = 0.04;
  estimate.fit.relative_distance = 0.005;
  estimate.fit.part_distances.fill(0.005);
  estimate.contradiction = 0.03;
  return estimate;
}

}  // namespace

TEST_CASE("each feature grows with what speaks against an estimate") {
  const auto features = usual_estimate().features();
  const auto only_grows = [&](const char* name, const auto& change) {
    npt::BodyEstimate worse = usual_estimate();
    change(worse);
    const auto changed = worse.features();
    for (std::size_t i = 0; i < features.size(); ++i) {
      INFO(name << " " << npt::ConfidenceModel::names[i]);
      if (std::string(name) == npt::ConfidenceModel::names[i])
        CHECK(changed[i] > features[i] + 0.1);
      else
        CHECK(changed[i] == features[i]);
    }
  };
  only_grows("oddity", [](auto& e) { e.fit.body.betas.assign(26, 3.0F); });
  only_grows("contradiction", [](auto& e) { e.contradiction *= 2; });
}

TEST_CASE("limbs in doubt and odd proportions are told of where confidence isn't high") {
  npt::BodyEstimate estimate = usual_estimate();
  CHECK(estimate.likeness() > 0.9);
  estimate.fit.part_distances[npt::joint_index(npt::SmplJoint::left_elbow)] = 0.02;
  estimate.fit.body.betas.assign(26, 4.5F);
  estimate.confidence = 0.9;
  CHECK(estimate.warnings().empty());
  estimate.confidence = 0.7;
  CHECK(estimate.warnings() == std::vector{npt::WarningCode::arms_uncertain, npt::WarningCode::unusual_proportions});
  estimate.fit.body.betas.assign(26, 8.0F);
  CHECK(estimate.likeness() == 0);
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
