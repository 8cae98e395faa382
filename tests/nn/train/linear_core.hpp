/// The smallest thing that a Trainer can train, written out by hand: result = A identity + B mean(pose) + c, each
/// vertex by itself. It has the interface of tape::GradientCore.
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/train/sample.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace support {

class LinearCore {
 public:
  explicit LinearCore(int threads = 1) : executor_(threads) {}

  /// A, B and c at 64-byte boundaries, and a number that isn't learned.
  static const std::vector<npt::NamedParameter>& parameters() {
    static const std::vector<npt::NamedParameter> list = [] {
      const auto at = [](npt::Parameter p, int offset) {
        p.offset = offset;
        return p;
      };
      return std::vector<npt::NamedParameter>{{"a.weight", at(npt::Parameter(3, 3, 1), 0)},
                                              {"b.weight", at(npt::Parameter(3, 3, 1), 16)},
                                              {"c.bias", at(npt::Parameter(3), 32)},
                                              {"scale", at(npt::Parameter::number(2), 48)}};
    }();
    return list;
  }
  static constexpr std::size_t size = 64;

  const npt::DefaultExecutor& executor() const { return executor_; }
  void load(std::span<const float> parameters) { values_.assign(parameters.begin(), parameters.end()); }

  void forward(std::span<const npt::NetworkCall<float>> calls) {
    calls_.assign(calls.begin(), calls.end());
    for (const auto& call : calls_) {
      const auto mean = mean_of(call.inputs[0]);
      for (std::size_t i = 0; i < call.inputs[1].size(); ++i) {
        const std::size_t row = i % 3;
        float sum = values_[32 + row];
        for (std::size_t k = 0; k < 3; ++k)
          sum += values_[3 * row + k] * call.inputs[1][i - row + k] + values_[16 + 3 * row + k] * mean[k];
        call.result[i] = sum;
      }
    }
  }

  void backward(std::span<const std::span<const float>> result_gradients, std::span<float> gradient) {
    std::fill(gradient.begin(), gradient.end(), 0.0F);
    gradient[48] = gradient[63] = 123;  // places that hold nothing learned: nobody may look at them
    for (std::size_t n = 0; n < calls_.size(); ++n) {
      const auto mean = mean_of(calls_[n].inputs[0]);
      for (std::size_t i = 0; i < result_gradients[n].size(); ++i) {
        const std::size_t row = i % 3;
        const float d = result_gradients[n][i];
        gradient[32 + row] += d;
        for (std::size_t k = 0; k < 3; ++k) {
          gradient[3 * row + k] += d * calls_[n].inputs[1][i - row + k];
          gradient[16 + 3 * row + k] += d * mean[k];
        }
      }
    }
  }

 private:
  static std::array<float, 3> mean_of(std::span<const float> xyz) {
    std::array<float, 3> mean{};
    for (std::size_t i = 0; i < xyz.size(); ++i) mean[i % 3] += xyz[i] * 3 / static_cast<float>(xyz.size());
    return mean;
  }

  npt::DefaultExecutor executor_;
  std::vector<float> values_;
  std::vector<npt::NetworkCall<float>> calls_;
};

/// Random points; the truth is what LinearCore can learn exactly.
class LinearSource final : public npt::SampleSource {
 public:
  explicit LinearSource(std::size_t vertices, std::uint64_t seed = 1) : vertices_(vertices), seed_(seed) {}

  void fill(std::uint64_t step, std::uint64_t index, npt::Sample& sample) const override {
    npt::Random random(seed_, step << 20 | index);
    sample.inputs.assign(2, std::vector<float>(3 * vertices_));
    for (std::vector<float>& input : sample.inputs)
      for (float& x : input) x = static_cast<float>(random.uniform(-1, 1));
    const std::vector<float>&pose = sample.inputs[0], &identity = sample.inputs[1];
    sample.truth.resize(identity.size());
    float shift = 0;
    for (std::size_t i = 0; i < pose.size(); i += 3) shift += pose[i] / static_cast<float>(vertices_);
    for (std::size_t i = 0; i < sample.truth.size(); i += 3) {
      sample.truth[i] = 0.5F * identity[i + 1] + shift;
      sample.truth[i + 1] = -identity[i] + 0.25F;
      sample.truth[i + 2] = identity[i + 2];
    }
    sample.edges = {{0, 1}, {1, 2}};
    sample.triangles = {{0, 1, 2}};
    sample.reference = 1;
    sample.scale = 2;
  }
  std::size_t max_vertices() const override { return vertices_; }
  bool equal_counts() const override { return true; }

 private:
  std::size_t vertices_;
  std::uint64_t seed_;
};

}  // namespace support
