#include <doctest/doctest.h>

#include <npt/estimate/confidence.hpp>
#include <npt/estimate/residuals.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_list.hpp>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>

#include "io/scratch.hpp"

namespace {

npt::ConfidenceModel model_of(const std::filesystem::path& file, const std::string& text) {
  npt::TensorList tensors;
  tensors.add_text("confidence_weights", text);
  tensors.write(file);
  return npt::ConfidenceModel::of(npt::SafetensorsFile::read(file));
}

}  // namespace

TEST_CASE("a probability of features, which falls as any of them grows") {
  const npt::LogisticModel<2> model{{-1, -2, 3}};
  CHECK(model({3, 0}) == doctest::Approx(0.5));
  CHECK(model({2, 0}) == doctest::Approx(1 / (1 + std::exp(-1.0))));
  CHECK(model({2, 0.5}) == doctest::Approx(0.5));
  CHECK(model({-1e3, 0}) == 1);
  CHECK(model({1e3, 0}) == doctest::Approx(0));
}

TEST_CASE("a joint's confidence falls with what speaks against it") {
  npt::EstimateResiduals residuals{.correspondences = 0.03, .surface = 0.006, .pose = 0.8, .shape = 20};
  residuals.joints.assign(24, {0.03, 0.006});
  residuals.joints[4].correspondences = 0.3, residuals.joints[7].surface = 0.03;
  const npt::ConfidenceModel model;
  const double before = model(residuals);
  const auto all = model.of_joints(residuals);
  CHECK(all[4] < all[5]);
  CHECK(all[7] < all[5]);
  CHECK(!model.doubts_joint(residuals));
  residuals.joints[4] = {0.5, 0.2};
  CHECK(model.of_joints(residuals)[4] < 0.5);
  CHECK(model.doubts_joint(residuals));
  residuals.correspondences = 0.2, residuals.surface = 0.02;
  CHECK(model.of_joints(residuals)[5] < all[5]);
  CHECK(model(residuals) < before);
}

TEST_CASE("a network's file says the weights, in words or not at all") {
  const scratch::Folder folder;
  const npt::ConfidenceModel model = model_of(folder / "a.safetensors", "1 2 3 4 -9.5");
  CHECK(model.estimate.weights.front() == 1);
  CHECK(model.estimate.weights.back() == -9.5);
  for (const char* text : {"1 2 3 4", "1 2 3 4 five", "1 2 3 4 5 6", "1 2 3 4 inf", ""}) {
    INFO(text);
    CHECK_THROWS_WITH_AS(model_of(folder / "b.safetensors", text),
                         doctest::Contains("b.safetensors: metadata confidence_weights"), npt::Error);
  }
  npt::TensorList tensors;
  tensors.write(folder / "c.safetensors");
  CHECK(npt::ConfidenceModel::of(npt::SafetensorsFile::read(folder / "c.safetensors")).estimate.weights ==
        npt::ConfidenceModel().estimate.weights);
}

TEST_CASE("weights that say nothing are judged as the shipped ones") {
  const npt::SafetensorsFile shipped =
      npt::SafetensorsFile::read(std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights/human.safetensors");
  const npt::ConfidenceModel said = npt::ConfidenceModel::of(shipped.part("correspondence/")), own;
  for (std::size_t i = 0; i < said.estimate.weights.size(); ++i)
    CHECK(said.estimate.weights[i] == doctest::Approx(own.estimate.weights[i]).epsilon(1e-3));
  for (std::size_t i = 0; i < said.joint.weights.size(); ++i)
    CHECK(said.joint.weights[i] == doctest::Approx(own.joint.weights[i]).epsilon(1e-3));
  for (const char* key : {"correspondence/confidence_weights", "correspondence/confidence_joint_weights"})
    REQUIRE(shipped.find_metadata(key) != nullptr);
}
