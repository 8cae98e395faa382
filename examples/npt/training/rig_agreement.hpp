/// How well a body that was made of a rig follows the rig: in the poses of its clips, how far its vertices are from
/// where the rig's own skin has them, when the means of both lie on each other.
/// Shapes    shares of the body's greatest extent at rest; means over the rig's vertices
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/config.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/pose.hpp>
#include <training/body_from_rig.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

struct RigAgreement {
  std::size_t frames = 0;
  double mean = 0, worst = 0;  ///< over frames
};

namespace rig::internal {

inline void centre(std::vector<Vec3d>& points) {
  Vec3d mean;
  for (const Vec3d p : points) mean += p;
  mean = mean / static_cast<double>(points.size());
  for (Vec3d& p : points) p -= mean;
}

inline double extent_of(std::span<const float> xyz) {
  double result = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    float low = xyz[k], high = low;
    for (std::size_t i = k; i < xyz.size(); i += 3) low = std::min(low, xyz[i]), high = std::max(high, xyz[i]);
    result = std::max(result, static_cast<double>(high - low));
  }
  return result;
}

}  // namespace rig::internal

/// made: of this rig, with its clips at this rate.
inline RigAgreement rig_agreement(const Rig& rig, const PlannedBody& made, double frame_rate) {
  RigAgreement result;
  const double extent = rig::internal::extent_of(made.body->tables().v_template);
  std::vector<float> xyz(3 * made.body->vertex_count());
  std::vector<Vec3d> own(rig.positions.size()), posed(rig.positions.size());
  for (std::size_t c = 0; c < made.clips.size(); ++c) {
    const std::vector<double> times = frame_times(rig.scene.clips[c], frame_rate);
    for (std::size_t f = 0; f < times.size(); ++f) {
      const std::vector<Affine> motions = rig.motions(&rig.scene.clips[c], times[f]);
      made.body->posed({}, made.clips[c][f], xyz);
      for (std::size_t v = 0; v < own.size(); ++v) {
        const Affine moved = blended_motion(rig.weights.columns_of(v), rig.weights.values_of(v), motions);
        own[v] = made.facing * moved(rig.positions[v].as<double>()) * made.metres;
        posed[v] = Vec3f{xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]}.as<double>();
      }
      rig::internal::centre(own), rig::internal::centre(posed);
      double sum = 0;
      for (std::size_t v = 0; v < own.size(); ++v) sum += length(own[v] - posed[v]);
      sum /= static_cast<double>(own.size()) * extent;
      result.mean += sum, result.worst = std::max(result.worst, sum), ++result.frames;
    }
  }
  if (result.frames > 0) result.mean /= static_cast<double>(result.frames);
  return result;
}

}  // namespace npt::inline NPT_ABI
