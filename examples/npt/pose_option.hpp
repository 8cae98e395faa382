/// The names of pose distributions in options.
#pragma once

#include <npt/body/pose_sampler.hpp>

#include <string_view>

namespace program {

/// "wide" and "natural"; anything else: the paper's.
inline npt::PoseDistribution pose_distribution(std::string_view name) {
  if (name == "wide") return npt::PoseDistribution::wide;
  return name == "natural" ? npt::PoseDistribution::natural : npt::PoseDistribution::paper;
}

}  // namespace program
