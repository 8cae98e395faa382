#include <doctest/doctest.h>

#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/build.hpp>

TEST_CASE("the mannequin, people and stylised characters keep distances of their own from the body") {
  npt::BodyEstimate estimate;
  const auto at = [&](double distance) -> const npt::BodyEstimate& {
    estimate.fit.relative_distance = distance;
    return estimate;
  };
  CHECK(npt::unlike_mannequin(at(0.001)) == 0);
  CHECK(npt::unlike_mannequin(at(0.0035)) == doctest::Approx(0.5));
  CHECK(npt::unlike_mannequin(at(0.007)) == 1);
  CHECK(npt::unlike_people(at(0.007)) == 0);
  CHECK(npt::unlike_people(at(0.0095)) == doctest::Approx(0.5));
  CHECK(npt::unlike_people(at(0.011)) == 1);
}
