/// The figure that the mannequin's surface is made from: its masses, finished with strokes (soft dents and bulges), as
/// a sculptor first builds masses and then models their surface. f(p) < 0 inside, > 0 outside.
/// Numerics  only + - * / and sqrt, so that compilers and mathematics libraries agree up to rounding
/// Source    stroke kernel: Wyvill et al., "Data structure for soft objects", The Visual Computer 1986
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/anatomy.hpp>
#include <npt/body/mannequin/loft.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace sculpt {

using npt::Vec3d;

/// Moves the surface outwards by up to `amount` around the segment from `a` to `b`, fading to nothing at `radius`
/// (for each axis). Negative amounts dent.
struct Stroke {
  Vec3d a, b;
  Vec3d radius;
  double amount;
};

/// A stroke made ready for many evaluations.
class StrokeField {
 public:
  explicit StrokeField(const Stroke& s)
      : start_(s.a),
        along_(s.b - s.a),
        scale_{1.0 / s.radius.x, 1.0 / s.radius.y, 1.0 / s.radius.z},
        amount_(s.amount) {
    const double n = dot(along_, along_);
    along_over_square_ = n > 0.0 ? along_ / n : Vec3d{};
    low_ = {std::min(s.a.x, s.b.x) - s.radius.x, std::min(s.a.y, s.b.y) - s.radius.y,
            std::min(s.a.z, s.b.z) - s.radius.z};
    high_ = {std::max(s.a.x, s.b.x) + s.radius.x, std::max(s.a.y, s.b.y) + s.radius.y,
             std::max(s.a.z, s.b.z) + s.radius.z};
  }

  /// It begins in the plane of symmetry.
  bool from_middle() const { return start_.x == 0.0; }

  double operator()(Vec3d p) const {
    if (p.y < low_.y || p.y > high_.y || p.x < low_.x || p.x > high_.x || p.z < low_.z || p.z > high_.z) return 0.0;
    const Vec3d d = p - start_ - along_ * std::clamp(dot(p - start_, along_over_square_), 0.0, 1.0);
    const Vec3d q{d.x * scale_.x, d.y * scale_.y, d.z * scale_.z};
    const double rest = std::max(1.0 - dot(q, q), 0.0);
    return amount_ * rest * rest * rest;
  }

 private:
  Vec3d start_, along_, along_over_square_, scale_, low_, high_;
  double amount_;
};

/// Masses and the strokes on them, both mirrored in x.
class Figure {
 public:
  Figure(npt::anatomy::BlendedLofts masses, std::span<const Stroke> strokes)
      : masses_(std::move(masses)), strokes_(strokes.begin(), strokes.end()) {}

  double operator()(Vec3d p) const {
    const Vec3d mirrored{-p.x, p.y, p.z};
    double f = masses_(p);
    for (const StrokeField& stroke : strokes_) {
      // A stroke that starts in the middle goes on in its own mirror image; one beside it meets its image.
      if (stroke.from_middle()) {
        f -= stroke({std::abs(p.x), p.y, p.z});
      } else {
        f -= stroke(p) + stroke(mirrored);
      }
    }
    return f;
  }

 private:
  npt::anatomy::BlendedLofts masses_;
  std::vector<StrokeField> strokes_;
};

// Strokes, region by region: from, to, radius in x, y and z, amount.
inline constexpr Stroke strokes[] = {
    // Chest: pectorals, sternum, the edge of the ribs.
    {{0.070, 1.305, 0.100}, {0.095, 1.315, 0.090}, {0.095, 0.075, 0.070}, 0.018},
    {{0.040, 1.236, 0.122}, {0.120, 1.252, 0.105}, {0.045, 0.036, 0.050}, -0.0045},
    {{0.000, 1.350, 0.095}, {0.000, 1.265, 0.115}, {0.036, 0.045, 0.055}, -0.007},
    // Belly: the white line, navel, flanks.
    {{0.000, 1.210, 0.110}, {0.000, 1.090, 0.100}, {0.032, 0.050, 0.050}, -0.004},
    {{0.000, 1.054, 0.104}, {0.000, 1.050, 0.104}, {0.015, 0.015, 0.024}, -0.008},
    {{0.135, 1.030, 0.030}, {0.125, 1.010, 0.060}, {0.060, 0.060, 0.070}, 0.004},
    // Back: spine, its long muscles, shoulder blades, latissimus.
    {{0.000, 1.390, -0.125}, {0.000, 1.000, -0.090}, {0.045, 0.050, 0.060}, -0.010},
    {{0.038, 1.150, -0.090}, {0.036, 1.020, -0.090}, {0.032, 0.060, 0.040}, 0.007},
    {{0.085, 1.360, -0.115}, {0.100, 1.310, -0.112}, {0.060, 0.050, 0.050}, 0.010},
    {{0.140, 1.300, -0.050}, {0.135, 1.230, -0.040}, {0.050, 0.080, 0.070}, 0.012},
    // Buttocks and the fold under them.
    {{0.072, 0.915, -0.095}, {0.086, 0.872, -0.090}, {0.105, 0.105, 0.110}, 0.030},
    {{0.055, 0.806, -0.100}, {0.105, 0.803, -0.090}, {0.050, 0.030, 0.050}, -0.003},
    {{0.000, 0.945, -0.115}, {0.000, 0.850, -0.110}, {0.048, 0.055, 0.080}, -0.016},
    // Shoulder: trapezius, clavicle, pit of the neck, deltoid.
    {{0.040, 1.480, -0.030}, {0.140, 1.440, -0.025}, {0.050, 0.045, 0.050}, 0.020},
    {{0.018, 1.428, 0.045}, {0.160, 1.447, 0.012}, {0.026, 0.022, 0.032}, 0.007},
    {{0.000, 1.440, 0.050}, {0.000, 1.436, 0.050}, {0.028, 0.028, 0.034}, -0.007},
    {{0.185, 1.425, -0.010}, {0.225, 1.415, -0.008}, {0.075, 0.070, 0.085}, 0.016},
    // Arm: biceps, triceps, elbow, forearm.
    {{0.300, 1.408, 0.040}, {0.370, 1.406, 0.038}, {0.070, 0.040, 0.040}, 0.008},
    {{0.270, 1.403, -0.050}, {0.340, 1.403, -0.048}, {0.070, 0.045, 0.040}, 0.008},
    {{0.450, 1.405, -0.045}, {0.458, 1.405, -0.045}, {0.028, 0.022, 0.024}, 0.006},
    {{0.490, 1.420, 0.030}, {0.540, 1.415, 0.032}, {0.060, 0.030, 0.034}, 0.006},
    // Hand: balls of the thumb and of the little finger.
    {{0.740, 1.390, 0.022}, {0.758, 1.390, 0.026}, {0.030, 0.020, 0.022}, 0.007},
    {{0.735, 1.390, -0.024}, {0.765, 1.390, -0.027}, {0.030, 0.020, 0.022}, 0.004},
    // Thigh: outer and inner head of the quadriceps, the tensor; knee cap and its hollows.
    {{0.160, 0.740, 0.020}, {0.150, 0.600, 0.030}, {0.045, 0.100, 0.070}, 0.008},
    {{0.075, 0.560, 0.045}, {0.080, 0.540, 0.045}, {0.036, 0.050, 0.040}, 0.008},
    {{0.107, 0.496, 0.052}, {0.107, 0.480, 0.050}, {0.032, 0.030, 0.034}, 0.009},
    {{0.107, 0.440, 0.042}, {0.107, 0.435, 0.042}, {0.022, 0.022, 0.026}, 0.004},
    // Calf: inner head lower and fuller than the outer one; shin; ankles.
    {{0.082, 0.400, -0.055}, {0.085, 0.350, -0.058}, {0.046, 0.080, 0.050}, 0.011},
    {{0.135, 0.410, -0.055}, {0.133, 0.370, -0.056}, {0.040, 0.080, 0.048}, 0.008},
    {{0.142, 0.075, -0.030}, {0.142, 0.073, -0.030}, {0.022, 0.026, 0.026}, 0.008},
    {{0.083, 0.088, -0.022}, {0.083, 0.086, -0.022}, {0.022, 0.026, 0.026}, 0.007},
    // Foot: the inner arch.
    {{0.092, 0.000, 0.030}, {0.094, 0.000, 0.060}, {0.030, 0.026, 0.060}, -0.010},
    // Neck: sternomastoid.
    {{0.052, 1.565, -0.012}, {0.016, 1.440, 0.036}, {0.022, 0.030, 0.024}, 0.006},
    // Ear: the shell.
    {{0.083, 1.629, 0.002}, {0.081, 1.621, 0.004}, {0.014, 0.014, 0.011}, -0.0040},
    // Face: brow, sockets, eyeballs, nose, cheekbones, muzzle, mouth, chin, jaw angle, temples.
    {{0.008, 1.662, 0.096}, {0.046, 1.664, 0.080}, {0.024, 0.016, 0.028}, 0.0060},
    {{0.031, 1.641, 0.095}, {0.036, 1.640, 0.090}, {0.026, 0.022, 0.036}, -0.0120},
    {{0.032, 1.640, 0.083}, {0.034, 1.640, 0.082}, {0.020, 0.016, 0.024}, 0.0075},
    {{0.000, 1.652, 0.098}, {0.000, 1.608, 0.116}, {0.016, 0.020, 0.030}, 0.0150},
    {{0.000, 1.606, 0.114}, {0.000, 1.600, 0.113}, {0.019, 0.016, 0.026}, 0.0095},
    {{0.012, 1.602, 0.103}, {0.014, 1.600, 0.101}, {0.014, 0.013, 0.018}, 0.0065},
    {{0.048, 1.618, 0.074}, {0.060, 1.624, 0.054}, {0.034, 0.028, 0.036}, 0.0060},
    {{0.050, 1.578, 0.066}, {0.048, 1.566, 0.066}, {0.028, 0.028, 0.032}, -0.0025},
    {{0.000, 1.576, 0.094}, {0.010, 1.572, 0.092}, {0.040, 0.034, 0.034}, 0.0045},
    {{0.000, 1.580, 0.101}, {0.016, 1.577, 0.096}, {0.015, 0.0115, 0.020}, 0.0050},
    {{0.000, 1.561, 0.099}, {0.013, 1.563, 0.095}, {0.016, 0.0125, 0.020}, 0.0060},
    {{0.000, 1.5705, 0.106}, {0.023, 1.5705, 0.097}, {0.012, 0.0095, 0.020}, -0.0045},
    {{0.000, 1.548, 0.100}, {0.012, 1.548, 0.097}, {0.026, 0.012, 0.020}, -0.0045},
    {{0.000, 1.533, 0.094}, {0.008, 1.533, 0.092}, {0.028, 0.022, 0.026}, 0.0085},
    {{0.048, 1.556, 0.012}, {0.052, 1.562, 0.004}, {0.030, 0.032, 0.034}, 0.0060},
    {{0.072, 1.662, 0.052}, {0.072, 1.652, 0.048}, {0.026, 0.034, 0.034}, -0.0040},
};

inline Figure mannequin_figure() { return {npt::anatomy::masses(), strokes}; }

}  // namespace sculpt
