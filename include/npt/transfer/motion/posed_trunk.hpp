/// A trunk's rings in a pose, and where points are around them.
///   PosedTrunk trunk(shape, bound);
///   trunk.set(worlds);
///   if (const std::optional<TrunkPlace> place = trunk.find(hand)) ... place->outside, place->normal
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/transfer/motion/body_shape.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

struct TrunkPlace {
  double along = 0;    ///< 0 at the lowest ring, 1 at the highest
  double angle = 0;    ///< from the body's left over its front
  double outside = 0;  ///< the distance from the surface; negative inside
  double share = 0;    ///< of the way from the axis to the surface
  Vec3d normal{};      ///< of the surface
};

class PosedTrunk {
 public:
  /// Keeps a reference. bound: [joints] where the skin was bound
  PosedTrunk(const BodyShape& shape, const std::vector<Affine>& bound) : shape_(shape), rings_(shape.rings.size()) {
    for (const BodyRing& ring : shape.rings) inverse_bound_.push_back(inverse(bound[ring.joint]));
  }

  void set(const std::vector<Affine>& worlds) {
    for (std::size_t i = 0; i < rings_.size(); ++i) {
      const Affine way = worlds[shape_.rings[i].joint] * inverse_bound_[i];
      const Matrix3 axes = way.linear * shape_.frame;
      rings_[i] = {way(shape_.rings[i].centre), normalised(axes.columns()[0]), normalised(axes.columns()[1]),
                   normalised(axes.columns()[2])};
    }
  }

  /// Nothing above and below the trunk.
  std::optional<TrunkPlace> find(Vec3d p) const {
    for (std::size_t i = 0; i + 1 < rings_.size(); ++i) {
      const double below = dot(p - rings_[i].centre, rings_[i].up),
                   above = dot(p - rings_[i + 1].centre, rings_[i + 1].up);
      if (below < 0 || above >= 0) continue;
      const double t = below / (below - above);
      const Placed ring = between(i, t);
      const double x = dot(p - ring.centre, ring.left), z = dot(p - ring.centre, ring.forward), r = std::hypot(x, z);
      // Far away another pair of rings may hold the point, too: only the surroundings count.
      const double angle = std::atan2(z, x), radius = radius_at(i, t, angle);
      if (r > 4 * radius || r == 0 || radius == 0) continue;
      const double step = std::numbers::pi / ring_sectors;
      const double slope = (radius_at(i, t, angle + step) - radius_at(i, t, angle - step)) / (2 * step);
      const Vec3d out = (ring.left * x + ring.forward * z) / r, around = (ring.forward * x - ring.left * z) / r;
      const Vec3d gradient = out - around * (slope / std::max(r, 0.5 * radius));
      const double size = length(gradient);
      const double along = (static_cast<double>(i) + t) / static_cast<double>(rings_.size() - 1);
      return TrunkPlace{along, angle, (r - radius) / size, r / radius, gradient / size};
    }
    return std::nullopt;
  }

  /// The point at such a place.
  Vec3d point(const TrunkPlace& place, double outside) const {
    const double whole = place.along * static_cast<double>(rings_.size() - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(std::max(whole, 0.0)), rings_.size() - 2);
    const double t = whole - static_cast<double>(i);
    const Placed ring = between(i, t);
    const Vec3d out = ring.left * std::cos(place.angle) + ring.forward * std::sin(place.angle);
    return ring.centre + out * (radius_at(i, t, place.angle) + outside);
  }

 private:
  struct Placed {
    Vec3d centre, left, up, forward;
  };
  Placed between(std::size_t i, double t) const {
    const Placed &a = rings_[i], &b = rings_[i + 1];
    const auto mean = [t](Vec3d x, Vec3d y) { return x * (1 - t) + y * t; };
    return {mean(a.centre, b.centre), normalised(mean(a.left, b.left)), normalised(mean(a.up, b.up)),
            normalised(mean(a.forward, b.forward))};
  }
  double radius_at(std::size_t i, double t, double angle) const {
    double sector = angle / (2 * std::numbers::pi) * ring_sectors;
    sector -= std::floor(sector / ring_sectors) * ring_sectors;
    const auto first = static_cast<std::size_t>(sector) % ring_sectors;
    const std::size_t second = (first + 1) % ring_sectors;
    const double share = sector - std::floor(sector);
    const auto of = [&](const BodyRing& ring) { return ring.radii[first] * (1 - share) + ring.radii[second] * share; };
    return of(shape_.rings[i]) * (1 - t) + of(shape_.rings[i + 1]) * t;
  }

  const BodyShape& shape_;
  std::vector<Affine> inverse_bound_;
  std::vector<Placed> rings_;
};

}  // namespace internal

}  // namespace npt::inline NPT_ABI
