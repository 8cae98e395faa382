#include <doctest/doctest.h>

#include <npt/estimate/confidence.hpp>
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
  npt::ConfidenceModel model;
  model.weights = {-1, -2, 3};
  CHECK(model({3, 0}) == doctest::Approx(0.5));
  CHECK(model({2, 0}) == doctest::Approx(1 / (1 + std::exp(-1.0))));
  CHECK(model({2, 0.5}) == doctest::Approx(0.5));
  CHECK(model({-1e3, 0}) == 1);
  CHECK(model({1e3, 0}) == doctest::Approx(0));
}

TEST_CASE("a network's file says the weights, in words or not at all") {
  const scratch::Folder folder;
  const npt::ConfidenceModel model = model_of(folder / "a.safetensors", "1 2 -9.5");
  CHECK(model.weights.front() == 1);
  CHECK(model.weights.back() == -9.5);
  for (const char* text : {"1 2", "1 2 three", "1 2 3 4", "1 2 inf", ""}) {
    INFO(text);
    CHECK_THROWS_WITH_AS(model_of(folder / "b.safetensors", text),
                         doctest::Contains("b.safetensors: metadata confidence"), npt::Error);
  }
  npt::TensorList tensors;
  tensors.write(folder / "c.safetensors");
  CHECK(npt::ConfidenceModel::of(npt::SafetensorsFile::read(folder / "c.safetensors")).weights ==
        npt::ConfidenceModel().weights);
}

TEST_CASE("weights that say nothing are judged as the shipped ones") {
  const npt::SafetensorsFile shipped =
      npt::SafetensorsFile::read(std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights/human.safetensors");
  const npt::ConfidenceModel said = npt::ConfidenceModel::of(shipped.part("correspondence/"));
  for (std::size_t i = 0; i < said.weights.size(); ++i)
    CHECK(said.weights[i] == doctest::Approx(npt::ConfidenceModel().weights[i]).epsilon(1e-3));
  REQUIRE(shipped.find_metadata("correspondence/confidence") != nullptr);
}
