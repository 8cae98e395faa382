/// The four-legged template's own shape directions: displacement fields for one standard deviation each, for what
/// proportions can't make.
///   0 withers (hump)   1 belly sagging   2 wool   3 depth of the muzzle
///   4 crest of the neck   5 neck set higher   6 back sloping down behind   7 forehead
/// Plausible within three standard deviations of each.
/// Shapes    [V, 3, 8]
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/shape.hpp>
#include <npt/body/mannequin/surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <sculpt/quadruped/anatomy.hpp>
#include <vector>

namespace sculpt::quadruped {

inline constexpr std::size_t shape_count = 8;

// Bulges: centre, half widths, amount.
inline constexpr npt::anatomy::Bulge withers[] = {{{0, 0.740, 0.190}, {0.160, 0.200, 0.240}, 1.0}};
inline constexpr npt::anatomy::Bulge belly[] = {{{0, 0.430, -0.060}, {0.220, 0.200, 0.260}, 1.0}};
inline constexpr npt::anatomy::Bulge forehead[] = {{{0, 0.930, 0.720}, {0.085, 0.080, 0.085}, 1.0}};

/// One vertex's displacements. q = (|x|, y, z) with outward normal n, as on the left half.
inline std::array<Vec3d, shape_count> shape_displacements(Vec3d q, Vec3d n) {
  using npt::anatomy::ramp;
  using npt::anatomy::total;
  const Vec3d in_neck = q - neck_frame.origin, in_head = q - head_frame.origin;
  const double t_neck = dot(in_neck, neck_frame.axis), v_neck = dot(in_neck, neck_frame.v);
  const double t_head = dot(in_head, head_frame.axis), v_head = dot(in_head, head_frame.v);
  // Where the head begins, and the neck: both lie above the trunk's front. Ears are the head's.
  const double ear = ramp(dot(q - ear_base, npt::normalised(ear_axis)), -0.030, 0.000) * ramp(q.z, 0.50, 0.56);
  const double head = std::max(ramp(q.z - 0.2 * (q.y - 0.89), 0.580, 0.660) * ramp(q.y, 0.62, 0.70), ear);
  const double neck = ramp(t_neck, 0.00, 0.20) * ramp(q.y - 0.4 * (0.50 - q.z), 0.46, 0.60);
  const double muzzle = head * ramp(t_head, 0.085, 0.165);
  // Wool ends at elbow and stifle, before the face, and at the tail's root.
  const double trunk = ramp(q.y, 0.30, 0.46) * ramp(q.z, -0.500, -0.425) * (1.0 - head);
  // It is thinner inside the legs, which would touch.
  const double outside = n.x < 0.0 ? 1.0 + 0.7 * n.x : 1.0;
  // Leaning backs lift all that stands on them; soles stay.
  const double along = std::clamp(q.z, -0.40, 0.32);

  return {
      Vec3d{0, 0.034 * total(withers, q) * ramp(q.y, 0.60, 0.74), 0},
      Vec3d{0.15 * n.x, -1.0, 0} * (0.032 * total(belly, q) * std::max(0.2 - n.y, 0.0)),
      n * (0.014 * trunk * outside),
      Vec3d{q.x * 0.06, 0, 0} * muzzle + head_frame.v * (0.12 * (v_head + 0.020) * muzzle),
      neck_frame.v * (0.13 * v_neck * neck * (1.0 - head)) + n * (0.004 * neck * (1.0 - head)),
      Vec3d{0, 0.026, -0.010} * std::max(ramp(t_neck, -0.05, 0.24) * ramp(q.y - 0.4 * (0.50 - q.z), 0.42, 0.62), head),
      Vec3d{0, 0.075 * along * ramp(q.y, 0.0, 0.50), 0},
      (n + Vec3d{0, 0.5, 0.3}) * (0.007 * total(forehead, q) * head)};
}

inline std::vector<float> shapedirs(const npt::anatomy::Surface& surface) {
  // Normals of the masses alone: growing along those of the finished surface would fold its grooves.
  const npt::anatomy::BlendedLofts figure = masses();
  std::vector<float> dirs(surface.positions.size() * 3 * shape_count);
  for (std::size_t v = 0; v < surface.positions.size(); ++v) {
    const Vec3d p = surface.positions[v], q{std::abs(p.x), p.y, p.z};
    Vec3d n = npt::normalised(npt::anatomy::gradient(figure, q));
    if (p.x == 0.0) n.x = 0.0;
    const auto moves = shape_displacements(q, n);
    for (std::size_t s = 0; s < shape_count; ++s) {
      const Vec3d move = npt::anatomy::rounded(moves[s]);
      const std::array<double, 3> xyz{p.x < 0.0 ? -move.x : move.x, move.y, move.z};
      for (std::size_t k = 0; k < 3; ++k)
        dirs[(3 * v + k) * shape_count + s] = static_cast<float>(p.x == 0.0 && k == 0 ? 0.0 : xyz[k]);
    }
  }
  return dirs;
}

}  // namespace sculpt::quadruped
