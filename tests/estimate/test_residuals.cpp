#include <doctest/doctest.h>

#include <npt/body/skeleton.hpp>
#include <npt/estimate/residuals.hpp>

#include <cmath>
#include <cstddef>
#include <string>

namespace {

/// Of a person.
npt::EstimateResiduals usual_residuals() {
  npt::EstimateResiduals residuals{.correspondences = 0.03, .surface = 0.006, .pose = 0.8, .shape = 20};
  residuals.joints.assign(24, {0.03, 0.006});
  return residuals;
}

}  // namespace

TEST_CASE("each residual adds to the energy and to its own feature alone") {
  const npt::EstimateResiduals usual = usual_residuals();
  const auto only_grows = [&](const char* name, const auto& change, double energy) {
    npt::EstimateResiduals worse = usual;
    change(worse);
    INFO(name);
    CHECK(worse.energy() - usual.energy() == doctest::Approx(energy));
    for (std::size_t i = 0; i < npt::EstimateResiduals::feature_count; ++i)
      if (std::string(name) == npt::EstimateResiduals::names[i])
        CHECK(worse.features()[i] > usual.features()[i] + 0.1);
      else
        CHECK(worse.features()[i] == usual.features()[i]);
  };
  only_grows(
      "correspondences", [](auto& r) { r.correspondences = 0.07; }, std::log(2));
  only_grows(
      "surface", [](auto& r) { r.surface = 0.013; }, 2 * std::log(2));
  only_grows(
      "pose", [](auto& r) { r.pose = 1.7; }, std::log(2));
  only_grows(
      "shape", [](auto& r) { r.shape = 400; }, 0);
  only_grows(
      "torn", [](auto& r) { r.torn = 0.01; }, std::log(2));
}

TEST_CASE("a joint has features of its own") {
  npt::EstimateResiduals residuals = usual_residuals();
  const std::size_t knee = npt::joint_index(npt::SmplJoint::left_knee);
  residuals.joints[knee] = {0.19, 0.029};
  CHECK(residuals.joint_features(knee)[0] == doctest::Approx(std::log(0.2)));
  CHECK(residuals.joint_features(knee)[1] == doctest::Approx(std::log(0.03)));
  CHECK(residuals.joint_features(knee + 1)[0] == doctest::Approx(std::log(0.04)));
  CHECK(residuals.joint_features(knee + 1)[1] == doctest::Approx(std::log(0.007)));
}
