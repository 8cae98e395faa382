/// The mannequin's ten shape directions: displacement fields for one standard deviation each.
///   0 stature            1 weight         2 muscles   3 shoulder breadth   4 hip breadth
///   5 legs against trunk   6 arm length   7 belly     8 chest              9 head size
/// Plausible within three standard deviations of each; within four the surface still keeps an inside.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/anatomy.hpp>
#include <npt/body/mannequin/skin.hpp>
#include <npt/body/mannequin/surface.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI::anatomy {

inline constexpr std::size_t mannequin_shape_count = 10;

/// A value at a place of an axis; between two of them the value runs smoothly.
struct Mark {
  double at, value;
};

NPT_INLINE double between_marks(std::span<const Mark> marks, double x) {
  double value = marks.front().value;
  for (std::size_t i = 0; i + 1 < marks.size(); ++i)
    value += (marks[i + 1].value - marks[i].value) * ramp(x, marks[i].at, marks[i + 1].at);
  return value;
}

/// How thick the layer under the skin grows with weight, from the soles up, and along the arm.
inline constexpr Mark fat_by_height[] = {{0.00, 0.04}, {0.10, 0.08}, {0.20, 0.18}, {0.36, 0.34}, {0.48, 0.28},
                                         {0.62, 0.60}, {0.80, 0.90}, {0.95, 1.00}, {1.05, 1.00}, {1.20, 0.85},
                                         {1.35, 0.60}, {1.44, 0.42}, {1.50, 0.34}, {1.57, 0.24}, {1.63, 0.08}};
inline constexpr Mark fat_by_reach[] = {{0.15, 0.60}, {0.30, 0.38}, {0.455, 0.26},
                                        {0.53, 0.28}, {0.70, 0.08}, {0.80, 0.04}};

/// Bulges with half widths in x, y and z: `amount` at the centre, none at the rim.
struct Bulge {
  Vec3d centre, radius;
  double amount;
};

NPT_INLINE double total(std::span<const Bulge> bulges, Vec3d q) {
  double sum = 0.0;
  for (const Bulge& b : bulges) {
    const Vec3d d{(q.x - b.centre.x) / b.radius.x, (q.y - b.centre.y) / b.radius.y, (q.z - b.centre.z) / b.radius.z};
    const double rest = std::max(1.0 - dot(d, d), 0.0);
    sum += b.amount * rest * rest;
  }
  return sum;
}

inline constexpr Bulge muscles[] = {
    {{0.205, 1.420, -0.010}, {0.120, 0.100, 0.110}, 0.85},  // deltoid
    {{0.085, 1.310, 0.090}, {0.110, 0.100, 0.090}, 0.80},   // pectoral
    {{0.090, 1.455, -0.040}, {0.110, 0.070, 0.080}, 0.80},  // trapezius
    {{0.145, 1.280, -0.060}, {0.090, 0.150, 0.120}, 1.00},  // latissimus
    {{0.325, 1.405, 0.000}, {0.130, 0.090, 0.100}, 0.60},   // biceps, triceps
    {{0.520, 1.405, 0.000}, {0.120, 0.080, 0.080}, 0.60},   // forearm
    {{0.105, 0.680, 0.030}, {0.130, 0.200, 0.130}, 0.80},   // quadriceps
    {{0.085, 0.900, -0.100}, {0.110, 0.110, 0.100}, 0.50},  // gluteus
    {{0.107, 0.370, -0.040}, {0.090, 0.130, 0.090}, 0.75},  // calf
    {{0.040, 1.500, -0.010}, {0.070, 0.080, 0.090}, 0.50},  // neck
    {{0.140, 1.080, 0.000}, {0.090, 0.110, 0.130}, -0.35},  // waist
};
inline constexpr Bulge belly[] = {{{0.040, 1.040, 0.080}, {0.200, 0.190, 0.160}, 1.0}};
inline constexpr Bulge chest[] = {{{0.078, 1.280, 0.105}, {0.095, 0.110, 0.110}, 1.0},
                                  {{0.000, 1.300, 0.060}, {0.220, 0.160, 0.160}, 0.3}};

/// One vertex's ten displacements. q = (|x|, y, z) with outward normal n, as on the left half.
NPT_INLINE std::array<Vec3d, mannequin_shape_count> shape_displacements(Vec3d q, Vec3d n) {
  const double on_arm = ramp(q.x, 0.14, 0.21) * ramp(q.y, 1.15, 1.30);
  // An arm moves with the height of its own axis: its thickness stays.
  const double y = q.y + (1.405 - q.y) * on_arm;

  double fat = between_marks(fat_by_height, q.y);
  fat += (between_marks(fat_by_reach, q.x) - fat) * on_arm;
  // Between the thighs there is little space, least at the crotch.
  if (n.x < 0.0) fat *= 1.0 + 0.5 * n.x * ramp(0.95 - q.y, 0.0, 0.10);
  fat *= ramp(length(q - Vec3d{0, 0.795, -0.020}), -0.03, 0.11);

  // Broad shoulders lengthen the reach less than the trunk: the length of the arms is another direction.
  const double reach = std::clamp(q.x - 0.19, 0.0, 0.71 - 0.19) * on_arm;
  const double shoulders = (1.0 - 1.5 * reach) * ramp(q.x, 0.02, 0.17) * ramp(q.y, 1.10, 1.36) *
                           (1.0 - ramp(q.y, 1.45, 1.50) * (1.0 - on_arm));
  const Mark hip_marks[] = {{0.05, 0.30}, {0.50, 0.45}, {0.80, 1.00}, {0.98, 1.00}, {1.14, 0.00}};
  const double hips = ramp(q.x, 0.0, 0.11) * between_marks(hip_marks, q.y) * (1.0 - on_arm);
  const double legs = std::min(y - origin.y, 0.0), trunk = std::clamp(y - origin.y, 0.0, 1.46 - origin.y);
  const double skull = ramp(q.y + 0.45 * q.z, 1.47, 1.56);

  return {(q - origin) * 0.038,
          n * (0.0105 * fat),
          n * (0.0075 * total(muscles, q)),
          Vec3d{0.010 * shoulders, 0, 0},
          Vec3d{0.009 * hips, 0, 0},
          Vec3d{0, 0.034 * legs - 0.048 * trunk, 0},
          Vec3d{0.036 * reach, 0, 0},
          Vec3d{0.25 * n.x, -0.10, 1.0} * (0.012 * total(belly, q) * std::max(n.z + 0.3, 0.0) / 1.3),
          Vec3d{0.10, -0.15, 1.0} * (0.0085 * total(chest, q) * std::max(n.z + 0.2, 0.0) / 1.2),
          (q - Vec3d{0, 1.53, -0.005}) * (0.030 * skull)};
}

/// [V, 3, 10]
NPT_INLINE std::vector<float> mannequin_shapedirs(const Surface& surface) {
  // Normals of the masses alone: growing along those of the finished surface would fold its grooves.
  const BlendedLofts figure = masses();
  std::vector<float> dirs(surface.positions.size() * 3 * mannequin_shape_count);
  for (std::size_t v = 0; v < surface.positions.size(); ++v) {
    const Vec3d p = surface.positions[v], q{std::abs(p.x), p.y, p.z};
    Vec3d n = normalised(gradient(figure, q));
    if (p.x == 0.0) n.x = 0.0;
    const auto moves = shape_displacements(q, n);
    for (std::size_t s = 0; s < mannequin_shape_count; ++s) {
      // Rounded like the positions, so that every compiler makes the same bits.
      const Vec3d move = rounded(moves[s]);
      const std::array<double, 3> xyz{p.x < 0.0 ? -move.x : move.x, move.y, move.z};
      for (std::size_t k = 0; k < 3; ++k)
        dirs[(3 * v + k) * mannequin_shape_count + s] = static_cast<float>(p.x == 0.0 && k == 0 ? 0.0 : xyz[k]);
    }
  }
  return dirs;
}

}  // namespace npt::inline NPT_ABI::anatomy
