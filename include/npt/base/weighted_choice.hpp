/// A choice among things with weights, each as likely as its weight says.
#pragma once

#include <npt/base/random.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

/// Numbers things from 0 in the order in which they are added.
class WeightedChoice {
 public:
  /// Keeps its memory.
  void clear() { sums_.clear(); }
  void reserve(std::size_t count) { sums_.reserve(count); }
  /// Requires  a weight that is not negative
  void add(double weight) { sums_.push_back(total() + weight); }

  std::size_t size() const noexcept { return sums_.size(); }
  double weight(std::size_t i) const { return i == 0 ? sums_[0] : sums_[i] - sums_[i - 1]; }
  /// The sum of all weights.
  double total() const noexcept { return sums_.empty() ? 0 : sums_.back(); }

  /// The first whose sum of weights, with those before it, is above `target`; the last where none is.
  /// Requires  at least one thing; so do the draws
  std::size_t at(double target) const {
    NPT_ASSERT(!sums_.empty());
    const double* const last = sums_.data() + sums_.size() - 1;
    return static_cast<std::size_t>(std::upper_bound(sums_.data(), last, target) - sums_.data());
  }
  std::size_t operator()(Random& random) const { return at(random.uniform() * total()); }

 private:
  std::vector<double> sums_;  ///< of the weights up to each
};

}  // namespace npt::inline NPT_ABI
