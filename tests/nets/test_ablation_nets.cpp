// The ablations against plain loops in double, and their gradients against finite differences.
#include <doctest/doctest.h>

#include <npt/nets/ablation_nets.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/train/gradient_check.hpp>
#include <npt/nn/weights/weights_file.hpp>

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "support/nets.hpp"

namespace {

using Map = std::vector<std::vector<double>>;  // [channels][V]

template <class Model>
Map conv(Model& model, const std::string& name, const Map& x) {
  std::vector<double> weight, bias;
  model.for_each_tensor([&](const std::string& tensor, const npt::Parameter&, std::span<const double> values) {
    if (tensor == name + ".weight") weight.assign(values.begin(), values.end());
    if (tensor == name + ".bias") bias.assign(values.begin(), values.end());
  });
  REQUIRE(!bias.empty());
  Map y(bias.size(), std::vector<double>(x[0].size()));
  for (std::size_t r = 0; r < y.size(); ++r)
    for (std::size_t v = 0; v < x[0].size(); ++v) {
      double sum = bias[r];
      for (std::size_t c = 0; c < x.size(); ++c) sum += weight[r * x.size() + c] * x[c][v];
      y[r][v] = sum;
    }
  return y;
}

Map norm(Map x) {
  for (auto& row : x) {
    double mean = 0, square = 0;
    for (const double a : row) mean += a / static_cast<double>(row.size());
    for (const double a : row) square += (a - mean) * (a - mean) / static_cast<double>(row.size());
    for (double& a : row) a = (a - mean) / std::sqrt(square + 1e-5);
  }
  return x;
}

Map rectify(Map x) {
  for (auto& row : x)
    for (double& a : row) a = a > 0 ? a : 0;
  return x;
}

Map points(const std::vector<double>& xyz) {
  Map x(3, std::vector<double>(xyz.size() / 3));
  for (std::size_t i = 0; i < xyz.size(); ++i) x[i % 3][i / 3] = xyz[i];
  return x;
}

template <class Net, class Decoder>
double error_of(Decoder&& decoder) {
  npt::Model<Net, double> model;
  npt::randomise(model, 4);
  const std::vector<double> pose = support::random_points<double>(37, 1),
                            identity = support::random_points<double>(37, 2);
  std::vector<double> result(identity.size());
  npt::Engine(model, 1)({pose, identity}, result);
  Map f = points(pose);
  for (const char* name : {"encoder.conv1", "encoder.conv2", "encoder.conv3"}) f = rectify(norm(conv(model, name, f)));
  for (const auto& row : points(identity)) f.push_back(row);
  const Map out = decoder(model, f);
  double worst = 0;
  for (std::size_t i = 0; i < result.size(); ++i)
    worst = std::max(worst, std::abs(std::tanh(out[i % 3][i / 3]) - result[i]));
  return worst;
}

}  // namespace

TEST_CASE("without SPAdaIN: plain residual blocks") {
  const double error = error_of<npt::PlainNet<13>>([](auto& model, Map x) {
    for (const char* number : {"1", "2", "3"}) {
      const std::string block = std::string("decoder.block") + number;
      x = conv(model, std::string("decoder.conv") + number, x);
      Map y = rectify(conv(model, block + ".conv1", norm(x)));
      y = rectify(conv(model, block + ".conv2", norm(y)));
      const Map side = rectify(conv(model, block + ".conv_res", norm(x)));
      for (std::size_t c = 0; c < y.size(); ++c)
        for (std::size_t v = 0; v < y[c].size(); ++v) y[c][v] += side[c][v];
      x = y;
    }
    return conv(model, "decoder.conv4", x);
  });
  CHECK(error < 1e-12);
}

TEST_CASE("concat1: convolutions only") {
  const double error = error_of<npt::ConcatNet<13>>([](auto& model, Map x) {
    for (const char* number : {"1", "2", "3"}) x = rectify(norm(conv(model, std::string("decoder.conv") + number, x)));
    return conv(model, "decoder.conv4", x);
  });
  CHECK(error < 1e-12);
}

TEST_CASE("ablations have right gradients") {
  for (const npt::GradientReport& report :
       {npt::check_gradients<npt::PlainNet<8>>(), npt::check_gradients<npt::ConcatNet<8>>()}) {
    CAPTURE(report.where);
    CHECK(report.worst < 1e-6);
  }
}

TEST_CASE("weights of an ablation are no other network's") {
  CHECK(npt::variant_metadata<npt::PlainNet<8>>().at("net") == "without-spadain");
  CHECK(npt::variant_metadata<npt::ConcatNet<8>>().at("net") == "concat1");
}
