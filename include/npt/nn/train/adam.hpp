/// Adam (Kingma and Ba, ICLR 2015, algorithm 1): the optimiser of the paper, whose learning rate is 5e-5.
///   m = beta1 m + (1 - beta1) g        v = beta2 v + (1 - beta2) g^2
///   x -= rate * (m / (1 - beta1^t)) / (sqrt(v / (1 - beta2^t)) + epsilon)
/// Elementwise and without sums: the same bits for any number of threads.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/simd/batch.hpp>

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
    begin_step(rate);
    update(parameters, gradient, 0, parameters.size());
  }

  /// A step in pieces: begin_step(), then update() for every element once, in any pieces and on any threads. The
  /// gradient is multiplied by `gradient_scale`, which clipping makes smaller than 1.
  void begin_step(double rate) {
    ++steps_;
    const auto t = static_cast<double>(steps_);
    scale_ = static_cast<T>(rate / (1 - std::pow(options_.beta1, t)));
    root_ = static_cast<T>(1 / std::sqrt(1 - std::pow(options_.beta2, t)));
  }
  void update(std::span<T> parameters, std::span<const T> gradient, std::size_t first, std::size_t last,
              double gradient_scale = 1) {
    NPT_ASSERT(parameters.size() == mean_.size() && gradient.size() == mean_.size() && last <= mean_.size());
    using B = simd::Batch<T>;
    const T b1 = static_cast<T>(options_.beta1), b2 = static_cast<T>(options_.beta2);
    const T c1 = static_cast<T>(1 - options_.beta1), c2 = static_cast<T>(1 - options_.beta2);
    const T epsilon = static_cast<T>(options_.epsilon), shrink = static_cast<T>(gradient_scale);
    T* NPT_RESTRICT x = parameters.data();
    T* NPT_RESTRICT m = mean_.data();
    T* NPT_RESTRICT v = square_.data();
    const T* NPT_RESTRICT g = gradient.data();
    constexpr std::size_t width = simd::lanes<T>;
    std::size_t i = first;
    // By hand: compilers leave a loop with std::sqrt, which may set errno, without vectors.
    for (; i + width <= last; i += width) {
      const B gradient_i = simd::load_unaligned(g + i) * B(shrink);
      const B mean = B(b1) * simd::load_unaligned(m + i) + B(c1) * gradient_i;
      const B square = B(b2) * simd::load_unaligned(v + i) + B(c2) * gradient_i * gradient_i;
      simd::store_unaligned(m + i, mean);
      simd::store_unaligned(v + i, square);
      simd::store_unaligned(
          x + i, simd::load_unaligned(x + i) - B(scale_) * mean / (simd::sqrt(square) * B(root_) + B(epsilon)));
    }
    for (; i < last; ++i) {
      const T gradient_i = g[i] * shrink;
      m[i] = b1 * m[i] + c1 * gradient_i;
      v[i] = b2 * v[i] + c2 * gradient_i * gradient_i;
      x[i] -= scale_ * m[i] / (std::sqrt(v[i]) * root_ + epsilon);
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
  T scale_ = 0, root_ = 0;  ///< of the running step
  AlignedBuffer<T> mean_, square_;
};

}  // namespace npt::inline NPT_ABI
