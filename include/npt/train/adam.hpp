/// Adam (Kingma and Ba, ICLR 2015, algorithm 1): the optimiser of the paper, whose learning rate is 5e-5.
///   m = beta1 m + (1 - beta1) g        v = beta2 v + (1 - beta2) g^2
///   x -= rate * (m / (1 - beta1^t)) / (sqrt(v / (1 - beta2^t)) + epsilon)
/// Elementwise and without sums: the same bits for any number of threads.
#pragma once

#include <npt/config.hpp>
#include <npt/core/aligned.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace npt::inline NPT_ABI {

struct AdamOptions {
  double beta1 = 0.9;
  double beta2 = 0.999;
  double epsilon = 1e-8;
};

/// The paper's constant learning rate.
inline constexpr double paper_learning_rate = 5e-5;

template <class T>
class Adam {
 public:
  explicit Adam(std::size_t size, const AdamOptions& options = {}) : options_(options), mean_(size), square_(size) {}

  /// One step with the given rate. Parameters whose gradient is zero from the start never move.
  void step(std::span<T> parameters, std::span<const T> gradient, double rate) {
    NPT_ASSERT(parameters.size() == mean_.size() && gradient.size() == mean_.size());
    ++steps_;
    const auto t = static_cast<double>(steps_);
    const T b1 = static_cast<T>(options_.beta1), b2 = static_cast<T>(options_.beta2);
    const T scale = static_cast<T>(rate / (1 - std::pow(options_.beta1, t)));
    const T root = static_cast<T>(1 / std::sqrt(1 - std::pow(options_.beta2, t)));
    const T epsilon = static_cast<T>(options_.epsilon);
    T* NPT_RESTRICT x = parameters.data();
    T* NPT_RESTRICT m = mean_.data();
    T* NPT_RESTRICT v = square_.data();
    const T* NPT_RESTRICT g = gradient.data();
    for (std::size_t i = 0; i < mean_.size(); ++i) {
      m[i] = b1 * m[i] + (1 - b1) * g[i];
      v[i] = b2 * v[i] + (1 - b2) * g[i] * g[i];
      x[i] -= scale * m[i] / (std::sqrt(v[i]) * root + epsilon);
    }
  }

  /// Steps taken, and the running means: what a checkpoint keeps beside the parameters.
  std::uint64_t steps() const { return steps_; }
  void set_steps(std::uint64_t steps) { steps_ = steps; }
  std::span<T> mean() { return mean_.span(); }
  std::span<const T> mean() const { return mean_.span(); }
  std::span<T> square() { return square_.span(); }
  std::span<const T> square() const { return square_.span(); }

 private:
  AdamOptions options_;
  std::uint64_t steps_ = 0;
  AlignedBuffer<T> mean_, square_;
};

}  // namespace npt::inline NPT_ABI
