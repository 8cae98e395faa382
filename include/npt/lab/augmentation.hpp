/// What a sample's meshes go through before they are normalised: turning, growing, noise.
/// Shapes    xyz: [V, 3], row major, in the meshes' unit
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/base/similarity.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/lab/transfer_sample.hpp>
#include <npt/mesh/points.hpp>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

namespace npt::inline NPT_ABI::data {

/// Where the three meshes of a sample are placed: turned about the y axis, and scaled.
struct Placements {
  Similarity identity, pose, truth;
};

inline void place(const Similarity& placement, std::span<float> xyz) {
  if (placement == Similarity{}) return;
  for (std::size_t v = 0; v < xyz.size() / 3; ++v) {
    const Vec3f p = placement(point_at(xyz, v)).as<float>();
    xyz[3 * v] = p.x, xyz[3 * v + 1] = p.y, xyz[3 * v + 2] = p.z;
  }
}

inline Placements draw_placements(const SampleOptions& options, Random& random) {
  const auto draw = [&](Similarity& p) {
    const double angle = random.uniform(-options.yaw, options.yaw) * (std::numbers::pi / 180);
    const double c = std::cos(angle), s = std::sin(angle);
    if (options.yaw != 0) p.rotation = {{{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}}};
    const double growth = random.uniform();
    if (options.scale_low != 1 || options.scale_high != 1)
      p.scale = options.scale_low * std::pow(options.scale_high / options.scale_low, growth);
  };
  Placements placements;
  draw(placements.identity);
  draw(placements.pose);
  placements.truth = placements.pose;
  placements.truth.scale = placements.identity.scale;
  return placements;
}

/// Adds independent normal numbers of standard deviation `sigma` to every coordinate.
inline void add_noise(std::span<float> xyz, double sigma, Random& random) {
  // Box-Muller, both numbers of a pair: the logarithm is what it costs.
  for (std::size_t i = 0; i < xyz.size(); i += 2) {
    const double radius = sigma * std::sqrt(-2.0 * std::log(1.0 - random.uniform()));
    const double angle = 2.0 * std::numbers::pi * random.uniform();
    xyz[i] += static_cast<float>(radius * std::cos(angle));
    if (i + 1 < xyz.size()) xyz[i + 1] += static_cast<float>(radius * std::sin(angle));
  }
}

}  // namespace npt::inline NPT_ABI::data
