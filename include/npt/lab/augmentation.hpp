/// What a sample's meshes go through before they are normalised: turning, growing, noise.
/// Shapes    xyz: [V, 3], row major, in the meshes' unit
#pragma once

#include <npt/base/random.hpp>
#include <npt/config.hpp>
#include <npt/lab/transfer_sample.hpp>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

namespace npt::inline NPT_ABI::data {

/// Turns a mesh about the y axis and scales it.
struct Placement {
  double cosine = 1, sine = 0, scale = 1;

  bool is_identity() const { return cosine == 1 && sine == 0 && scale == 1; }

  void apply(std::span<float> xyz) const {
    if (is_identity()) return;
    for (std::size_t i = 0; i < xyz.size(); i += 3) {
      const double x = static_cast<double>(xyz[i]), z = static_cast<double>(xyz[i + 2]);
      xyz[i] = static_cast<float>((cosine * x + sine * z) * scale);
      xyz[i + 1] = static_cast<float>(static_cast<double>(xyz[i + 1]) * scale);
      xyz[i + 2] = static_cast<float>((cosine * z - sine * x) * scale);
    }
  }
};

/// Where the three meshes of a sample are placed.
struct Placements {
  Placement identity, pose, truth;
};

inline Placements draw_placements(const SampleOptions& options, Random& random) {
  const auto draw = [&](Placement& p) {
    const double angle = random.uniform(-options.yaw, options.yaw) * (std::numbers::pi / 180);
    if (options.yaw != 0) p.cosine = std::cos(angle), p.sine = std::sin(angle);
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
