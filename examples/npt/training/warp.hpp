/// A smooth random change of a resting body's shape, as samples for a network that reads meshes have it: regions that
/// are larger or smaller, and shifted ones, most of them alike on both sides. So few characters stand for many: round
/// bellies, heads without a neck, thick arms, humps.
///   x' = x + sum_k g_k(x) (grow_k (x - centre_k) + shift_k),  g_k(x) = exp(-|x - centre_k|^2 / (2 radius_k^2))
/// Units     metres; a point moves by 0.03 in the mean
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

namespace data {

class Warp {
 public:
  /// None.
  Warp() = default;

  /// Up to three regions about points that `point(random)` draws, each with its mirror image in nine of ten cases.
  /// Numerics  a single region leaves a fifth of each length at least. Several may fold: about one of 10,000 points of
  ///           a body lies where they do
  template <class Point>
  Warp(Random& random, const Point& point) {
    const std::size_t count = 1 + random.below(3);
    for (std::size_t k = 0; k < count; ++k) {
      Region r;
      r.centre = point(random);
      r.radius = static_cast<float>(std::exp(random.uniform(std::log(0.08), std::log(0.4))));
      r.grow = random.uniform() < 0.75 ? static_cast<float>(random.uniform(-0.4, 1.2)) : 0;
      if (random.uniform() < 0.5) {
        const Vec3d towards = normalised(Vec3d{random.normal(), random.normal(), random.normal()});
        r.shift = towards.as<float>() * (r.radius * static_cast<float>(random.uniform(0, 0.6)));
      }
      regions_.push_back(r);
      if (random.uniform() >= 0.9) continue;
      r.centre.x = -r.centre.x, r.shift.x = -r.shift.x;
      // Two that cover each other are one.
      if (std::abs(r.centre.x) < r.radius) {
        regions_.back().centre.x = regions_.back().shift.x = 0;
        continue;
      }
      regions_.push_back(r);
    }
  }

  bool any() const noexcept { return !regions_.empty(); }

  /// Where a point goes.
  Vec3f operator()(Vec3f p) const {
    Vec3f result = p;
    for (const Region& r : regions_) {
      const Vec3f off = p - r.centre;
      result += (off * r.grow + r.shift) * r.near(off);
    }
    return result;
  }

  /// Where a short edge at p goes.
  Vec3f carried(Vec3f p, Vec3f edge) const {
    Vec3f result = edge;
    for (const Region& r : regions_) {
      const Vec3f off = p - r.centre;
      const float near = r.near(off), slope = -near * dot(off, edge) / (r.radius * r.radius);
      result += edge * (r.grow * near) + (off * r.grow + r.shift) * slope;
    }
    return result;
  }

 private:
  struct Region {
    Vec3f centre, shift;
    float radius = 0, grow = 0;

    float near(Vec3f off) const { return std::exp(-0.5F * dot(off, off) / (radius * radius)); }
  };
  std::vector<Region> regions_;
};

}  // namespace data

}  // namespace npt::inline NPT_ABI
