/// Learning rates over the course of a training.
#pragma once

#include <npt/config.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace npt::inline NPT_ABI {

/// The paper's: the same rate throughout.
struct ConstantRate {
  double rate;
  double operator()(double) const { return rate; }
};

/// Rises linearly over the first `warm_up` of the training and falls along half a cosine to `last * rate` at its end.
/// `progress` is the part of the training that is done, 0 .. 1.
struct CosineRate {
  double rate;
  double warm_up = 0.02;
  double last = 0.02;

  double operator()(double progress) const {
    const double p = std::clamp(progress, 0.0, 1.0);
    const double rise = warm_up > 0 ? std::min(1.0, p / warm_up) : 1.0;
    return rate * rise * (last + (1 - last) * 0.5 * (1 + std::cos(std::numbers::pi * p)));
  }
};

}  // namespace npt::inline NPT_ABI
