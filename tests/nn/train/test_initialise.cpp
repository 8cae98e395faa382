#include <doctest/doctest.h>

#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/train/initialise.hpp>

#include <cmath>
#include <map>
#include <string>
#include <vector>

namespace {

using SmallNet = npt::PoseTransferNet<61>;

struct Moments {
  double mean = 0, deviation = 0, largest = 0;
  std::size_t count = 0;
};

/// Moments of each tensor.
std::map<std::string, Moments> moments(npt::Initialisation kind, std::uint64_t seed = 5) {
  npt::Model<SmallNet> model;
  npt::initialise<float>(model.parameters(), model.buffer(), kind, seed);
  std::map<std::string, Moments> result;
  model.for_each_tensor([&](const std::string& name, const npt::Parameter&, std::span<const float> values) {
    Moments& m = result[name];
    m.count = values.size();
    for (const float x : values) {
      m.mean += static_cast<double>(x) / static_cast<double>(m.count);
      m.largest = std::max(m.largest, std::abs(static_cast<double>(x)));
    }
    for (const float x : values)
      m.deviation += std::pow(static_cast<double>(x) - m.mean, 2) / static_cast<double>(m.count);
    m.deviation = std::sqrt(m.deviation);
  });
  model.for_each_attribute([](const std::string&, float value) { CHECK(value == 1.0F); });
  return result;
}

}  // namespace

TEST_CASE("small weights: N(0, 0.02), biases N(0, 0.1)") {
  for (const auto& entry : moments(npt::Initialisation::small)) {
    const std::string& name = entry.first;
    const auto& m = entry.second;
    CAPTURE(name);
    const bool weight = name.ends_with(".weight");
    const double expected = weight ? 0.02 : 0.1, tolerance = 4 * expected / std::sqrt(static_cast<double>(m.count));
    CHECK(std::abs(m.mean) < tolerance);
    if (m.count > 30) CHECK(std::abs(m.deviation - expected) < tolerance);
  }
}

TEST_CASE("released weights: N(0, 0.02), biases uniform in 1 / sqrt(inputs)") {
  auto all = moments(npt::Initialisation::released);
  CHECK(std::abs(all["decoder.conv1.weight"].deviation - 0.02) < 0.002);
  CHECK(all["decoder.conv1.bias"].largest <= 1 / std::sqrt(64.0));
  CHECK(all["decoder.conv1.bias"].largest > 0.8 / std::sqrt(64.0));
  CHECK(all["encoder.conv1.bias"].largest <= 1 / std::sqrt(3.0));
  CHECK(all["encoder.conv1.bias"].largest > 0.8 / std::sqrt(3.0));
}

TEST_CASE("He's weights by the inputs; SPAdaIN starts near instance norm") {
  auto all = moments(npt::Initialisation::he);
  CHECK(std::abs(all["decoder.conv1.weight"].deviation - std::sqrt(2.0 / 64)) < 0.02);
  CHECK(std::abs(all["encoder.conv2.weight"].deviation - std::sqrt(2.0 / 64)) < 0.02);
  CHECK(all["decoder.conv1.bias"].largest == 0);
  const Moments gamma = all["decoder.spadain_block1.spadain2.conv_weight.bias"];
  CHECK(gamma.mean == 1);
  CHECK(gamma.deviation == 0);
  CHECK(all["decoder.spadain_block1.spadain2.conv_bias.bias"].largest == 0);
  CHECK(std::abs(all["decoder.spadain_block1.spadain2.conv_weight.weight"].deviation - 0.5 / std::sqrt(3.0)) < 0.1);
  CHECK(std::abs(all["decoder.spadain_block1.conv2.weight"].deviation - std::sqrt(2.0 / 64)) < 0.02);
}

TEST_CASE("the seed decides") {
  const auto values = [](std::uint64_t seed) {
    npt::Model<SmallNet> model;
    npt::initialise<float>(model.parameters(), model.buffer(), npt::Initialisation::small, seed);
    return std::vector<float>(model.buffer().begin(), model.buffer().end());
  };
  CHECK(values(1) == values(1));
  CHECK(values(1) != values(2));
}

TEST_CASE("initialisations by name") {
  for (const char* name : {"small", "released", "he"})
    CHECK(to_string(npt::parse_initialisation(name)) == std::string(name));
  CHECK_THROWS_WITH(npt::parse_initialisation("big", "--init"), "--init: found 'big', expected small, released or he");
}
