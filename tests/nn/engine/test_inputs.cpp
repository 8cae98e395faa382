// Networks of one, two and three inputs, with several channels: sizes, codes, and what an engine says of wrong ones.
#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/nn/engine/network_call.hpp>
#include <npt/nn/graph/explain.hpp>

#include <algorithm>
#include <string>
#include <vector>

#include "support/nets.hpp"

namespace {

/// One input, of five channels.
struct OneWideInput {
  static constexpr npt::Input inputs[] = {{"features", 5}};
  npt::Conv1x1<5, 3> only;
  static constexpr void visit(auto& self, auto&& visitor) { visitor("only", self.only); }
  constexpr auto operator()(auto features) const { return features | only; }
};

/// The second of three inputs is read through a maximum, and so has vertices of its own.
struct CloudInTheMiddle {
  static constexpr npt::Input inputs[] = {{"points", 3}, {"cloud", 4}, {"weight", 1}};
  npt::Conv1x1<4, 9> encode;
  npt::Conv1x1<13, 3> join;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("encode", self.encode);
    visitor("join", self.join);
  }
  constexpr auto operator()(auto points, auto cloud, auto weight) const {
    return cat(cat(points, weight), cloud | encode | npt::max_pool) | join;
  }
};

template <class Net>
npt::Model<Net, double> model_of_inputs() {
  npt::Model<Net, double> model;
  npt::randomise(model, 3);
  return model;
}

std::vector<double> values_of(std::size_t count, std::uint64_t seed) {
  std::vector<double> values = support::random_points<double>((count + 2) / 3, seed);
  values.resize(count);
  return values;
}

template <class F>
std::string error_text(F&& f) {
  try {
    f();
  } catch (const npt::Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("a network of one input has nothing to encode") {
  const auto model = model_of_inputs<OneWideInput>();
  const npt::Engine engine(model, 1);
  const std::vector<double> features = values_of(5 * 130, 1);
  std::vector<double> result(3 * 130);
  engine({features}, result);
  const std::span<const double> weight = model.values(model.network().only.weight),
                                bias = model.values(model.network().only.bias);
  for (std::size_t v = 0; v < 130; ++v)
    for (std::size_t r = 0; r < 3; ++r) {
      double sum = bias[r];
      for (std::size_t c = 0; c < 5; ++c) sum += weight[5 * r + c] * features[5 * v + c];
      REQUIRE(result[3 * v + r] == doctest::Approx(sum).epsilon(1e-12));
    }
  CHECK(engine.inputs().encoded == -1);
  CHECK_FALSE(engine.pairs_vertices());
  CHECK(error_text([&] { engine.encode(features); }) == "features: found a network, expected several inputs");
  CHECK(error_text([&] { engine({std::span(features).first(9)}, result); }) ==
        "features: found 9 numbers, expected 5 for each vertex");
  CHECK(npt::explain<OneWideInput>().find("Inputs: features [V, 5].") != std::string::npos);
}

TEST_CASE("the input that is read through a maximum is encoded, wherever it stands") {
  const auto model = model_of_inputs<CloudInTheMiddle>();
  const npt::Engine engine(model, 1);
  const std::vector<double> points = values_of(3 * 200, 1), cloud = values_of(4 * 77, 2), weight = values_of(200, 3);
  std::vector<double> result(points.size()), decoded(points.size());
  engine({points, cloud, weight}, result);
  CHECK(engine.inputs().encoded == 1);
  const npt::EncodedInput<double> code = engine.encode(cloud);
  CHECK(code.vertices() == 77);
  engine.decode(code, {points, weight}, decoded);
  CHECK(decoded == result);
  // As a batch, of which two calls share the cloud.
  std::vector<double> first(points.size()), second(points.size()), shifted = points;
  std::rotate(shifted.begin(), shifted.begin() + 3, shifted.end());
  const std::vector<npt::NetworkCall<double>> calls{{{points, cloud, weight}, first},
                                                    {{shifted, cloud, weight}, second}};
  engine.run(calls);
  CHECK(first == result);
  CHECK(second != result);
  CHECK(npt::explain<CloudInTheMiddle>().find("1 of them encode cloud") != std::string::npos);
  CHECK(npt::explain<CloudInTheMiddle>().find("No vertex of cloud meets one of the others") != std::string::npos);
}

TEST_CASE("what doesn't fit a network's inputs is said by their names") {
  const npt::Engine engine(model_of_inputs<CloudInTheMiddle>(), 1);
  const std::vector<double> points = values_of(30, 1), cloud = values_of(20, 2), weight = values_of(10, 3);
  std::vector<double> result(points.size());
  const auto message = [&](const npt::Inputs<double>& inputs) { return error_text([&] { engine(inputs, result); }); };
  CHECK(message({points, cloud, weight}) == "no error");
  CHECK(message({points, cloud}) == "inputs: found 2, expected points, cloud, weight");
  CHECK(message({points, cloud, weight, weight, weight, weight, weight, weight, weight}) ==
        "inputs: found 9, expected points, cloud, weight");
  CHECK(message({points, cloud, {}}) == "weight: found no vertices, expected at least one");
  CHECK(message({points, cloud, points}) ==
        "weight: found 30 vertices, expected 10, as many as points has: this network reads both vertex by vertex");
  const npt::EncodedInput<double> code = engine.encode(cloud);
  CHECK(error_text([&] { engine.decode(code, {points}, result); }) == "inputs: found 1, expected points, weight");
}
