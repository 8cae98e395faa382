#include <doctest/doctest.h>

#include <npt/estimate/body_estimate.hpp>

#include <vector>

TEST_CASE("confidence: distance counts less where the reader tells people, shapes that nobody has count against") {
  npt::BodyEstimate reading;
  CHECK(reading.confidence() == 0);
  reading.fit.body.axis_angles.assign(72, 0.0F);
  reading.fit.body.betas.assign(26, 1.0F);
  reading.fit.mesh_explained = reading.fit.body_explained = 0.9;
  reading.fit.correspondence_residual = 0.08;
  reading.fit.relative_distance = 0.005;
  CHECK(reading.confidence() == doctest::Approx(0.9));
  reading.fit.relative_distance = 0.0165;  // a robot
  CHECK(reading.confidence() == doctest::Approx(0.9 * 0.35));
  reading.told = true;
  CHECK(reading.confidence() > 0.6);
  CHECK(reading.confidence() < 0.85);
  reading.fit.correspondence_residual = 0.18;  // and its parts don't agree
  CHECK(reading.confidence() < 0.6);
  reading.fit.correspondence_residual = 0.08;
  reading.disagreement = 0.06;  // nor what is read from several sides
  CHECK(reading.confidence() < 0.6);
  reading.fit.mesh_explained = reading.fit.body_explained = 0.98;  // but the body lies in it
  CHECK(reading.confidence() > 0.6);
  reading.fit.mesh_explained = reading.fit.body_explained = 0.9;
  reading.disagreement = 0;
  reading.fit.relative_distance = 0.005;
  CHECK(reading.warnings().empty());
  reading.fit.body.betas.assign(26, 4.5F);
  CHECK(reading.confidence() > 0.85);
  CHECK(reading.warnings() == std::vector{npt::WarningCode::unusual_proportions});
  reading.fit.body.betas.assign(26, 8.0F);
  CHECK(reading.confidence() == 0);
}

TEST_CASE("a body of usual shape that lies close is one, however it was read") {
  npt::BodyEstimate reading;
  reading.told = true;
  reading.fit.body.axis_angles.assign(72, 0.0F);
  reading.fit.body.betas.assign(26, 3.0F);
  reading.fit.mesh_explained = reading.fit.body_explained = 0.945;
  reading.fit.correspondence_residual = 0.17;
  reading.disagreement = 0.12;
  reading.fit.relative_distance = 0.011;  // a knight who rolls
  CHECK(reading.confidence() > 0.6);
  CHECK(reading.confidence() < 0.85);
  reading.fit.body.betas.assign(26, 5.5F);  // a thing
  CHECK(reading.confidence() < 0.6);
  reading.fit.body.betas.assign(26, 3.0F);
  reading.fit.relative_distance = 0.013;
  CHECK(reading.confidence() == 0);
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
