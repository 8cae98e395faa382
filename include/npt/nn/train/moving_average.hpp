/// An exponential moving average of the weights over the steps (Polyak and Juditsky, 1992; the exponential form as in
/// Tarvainen and Valpola, NIPS 2017): smoother than the last weights, and usually better on meshes not seen in
/// training.
///   a += (1 - d_t) * (x - a),  d_t = min(decay, (1 + t) / (10 + t)),  t = steps taken
/// The smaller decay of the first steps lets the average forget the initial weights.
/// Elementwise and without sums: the same bits for any number of threads.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace npt::inline NPT_ABI {

template <class T>
class MovingAverage {
 public:
  /// Starts at the weights themselves.
  MovingAverage(std::span<const T> parameters, double decay) : decay_(decay), values_(parameters.size()) {
    std::copy(parameters.begin(), parameters.end(), values_.span().begin());
  }

  double decay_at(std::uint64_t steps) const {
    const auto t = static_cast<double>(steps);
    return std::min(decay_, (1 + t) / (10 + t));
  }

  /// One step: begin_step(), then update() for every element once, in any pieces and on any threads.
  void begin_step() { weight_ = static_cast<T>(1 - decay_at(++steps_)); }
  void update(std::span<const T> parameters, std::size_t first, std::size_t last) {
    NPT_ASSERT(parameters.size() == values_.size() && last <= values_.size());
    T* NPT_RESTRICT a = values_.data();
    const T* NPT_RESTRICT x = parameters.data();
    const T weight = weight_;
    for (std::size_t i = first; i < last; ++i) a[i] += weight * (x[i] - a[i]);
  }
  void step(std::span<const T> parameters) {
    begin_step();
    update(parameters, 0, parameters.size());
  }

  /// What a checkpoint keeps.
  std::uint64_t steps() const { return steps_; }
  void set_steps(std::uint64_t steps) { steps_ = steps; }
  std::span<T> values() { return values_.span(); }
  std::span<const T> values() const { return values_.span(); }

 private:
  double decay_;
  T weight_ = 0;
  std::uint64_t steps_ = 0;
  AlignedBuffer<T> values_;
};

}  // namespace npt::inline NPT_ABI
