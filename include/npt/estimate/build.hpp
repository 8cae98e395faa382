/// Whose build a mesh has, by the distance that its surface keeps from the fitted body: the mannequin's own meshes keep
/// 0.001, other models' bodies and dressed people 0.006 to 0.008, a stylised man 0.011. Corrections that were learned
/// from people count for people, and not for the mannequin, which needs none.
#pragma once

#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>

#include <algorithm>

namespace npt::inline NPT_ABI {

/// 0 up to `from`, 1 from `to` on, linear between.
constexpr double rising(double x, double from, double to) { return std::clamp((x - from) / (to - from), 0.0, 1.0); }

/// How far a bend of so many radians is no posture at rest any more, from 0 to 1.
constexpr double beyond_rest(double bend) { return rising(bend, 0.35, 0.5); }

/// How far the build is another one than the mannequin's, from 0 to 1.
NPT_INLINE double unlike_mannequin(const BodyEstimate& estimate) {
  return rising(estimate.fit.relative_distance, 0.002, 0.005);
}
/// How far the build is nobody's, from 0 to 1.
NPT_INLINE double unlike_people(const BodyEstimate& estimate) {
  return rising(estimate.fit.relative_distance, 0.0085, 0.0105);
}

}  // namespace npt::inline NPT_ABI
