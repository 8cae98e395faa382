/// Masses of a figure as an implicit surface: f(p) < 0 inside, > 0 outside, near the surface about the distance in
/// metres. Lofts (cross-sections along an axis) are blended into each other. Symmetric in x: lofts stand at x >= 0 and
/// are mirrored.
/// Numerics  only + - * / and sqrt, so that compilers and mathematics libraries agree up to rounding
/// Source    squircle sections: Fernandez Guasti, "Analytic geometry of some rectilinear figures", 1992
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::anatomy {

/// A cross-section at `t` on the loft's axis: its centre, its radii towards +u, -u, +v, -v, and how square it is
/// (0: ellipse, 1: rectangle).
struct Section {
  double t;
  double cu, cv;
  double up, um, vp, vm;
  double square;

  constexpr std::array<double, 7> values() const { return {cu, cv, up, um, vp, vm, square}; }
};

/// Where a loft stands: t = dot(p - origin, axis), likewise u and v; the three directions are orthonormal.
struct LocalFrame {
  Vec3d origin, axis, u, v;
};

/// The frame with the given axis whose u is as near as possible to `towards`.
NPT_INLINE LocalFrame make_frame(Vec3d origin, Vec3d axis, Vec3d towards) {
  const Vec3d a = normalised(axis);
  const Vec3d u = normalised(towards - a * dot(towards, a));
  return {origin, a, u, cross(a, u)};
}

NPT_INLINE_CLASS(class, Loft);
/// Cubic Hermite interpolation through sections (slopes by finite differences), closed by half ellipsoids at both ends.
template <class>
class BasicLoft {
 public:
  BasicLoft(LocalFrame frame, std::span<const Section> sections, double cap_start, double cap_end, double blend,
            bool paired)
      : frame_(frame), cap_start_(cap_start), cap_end_(cap_end), blend_(blend), paired_(paired) {
    const std::size_t n = sections.size();
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, n - 1);
      Knot knot{sections[i].t, sections[i].values(), {}};
      const auto low = sections[before].values(), high = sections[after].values();
      for (std::size_t k = 0; k < 7; ++k) {
        knot.slope[k] = (high[k] - low[k]) / (sections[after].t - sections[before].t);
      }
      knots_.push_back(knot);
    }
    bound();
  }

  double blend() const { return blend_; }
  /// It has a mirror image at x < 0.
  bool paired() const { return paired_; }

  /// A lower bound of the distance to the loft.
  double box_distance(Vec3d p) const {
    const double dx = std::max({low_.x - p.x, p.x - high_.x, 0.0}), dy = std::max({low_.y - p.y, p.y - high_.y, 0.0}),
                 dz = std::max({low_.z - p.z, p.z - high_.z, 0.0});
    return std::sqrt(dx * dx + dy * dy + dz * dz);
  }

  double operator()(Vec3d p) const {
    const Vec3d q = p - frame_.origin;
    const double t = dot(q, frame_.axis);
    const double inside = std::clamp(t, knots_.front().t, knots_.back().t);
    const std::array<double, 7> s = section(inside);
    const double du = dot(q, frame_.u) - s[0], dv = dot(q, frame_.v) - s[1], dt = t - inside;
    const double a = du / (du > 0 ? s[2] : s[3]), b = dv / (dv > 0 ? s[4] : s[5]);
    const double e = dt / (dt > 0 ? cap_end_ : cap_start_);
    const double sum = a * a + b * b, squareness = std::clamp(s[6], 0.0, 0.95);
    const double product = 2.0 * squareness * a * b;
    const double rho2 = 0.5 * (sum + std::sqrt(std::max(sum * sum - product * product, 0.0))) + e * e;
    const double rho = std::sqrt(rho2);
    // On the axis no direction is special: any radius will do there.
    if (rho < 1e-3) return -std::min(s[2], s[4]);
    return std::sqrt(du * du + dv * dv + dt * dt) * (1.0 - 1.0 / rho);
  }

 private:
  struct Knot {
    double t;
    std::array<double, 7> value, slope;
  };

  std::array<double, 7> section(double t) const {
    std::size_t i = 0;
    while (i + 2 < knots_.size() && t > knots_[i + 1].t) ++i;
    const Knot &a = knots_[i], &b = knots_[i + 1];
    const double h = b.t - a.t, x = (t - a.t) / h, y = 1.0 - x;
    const double h00 = (1.0 + 2.0 * x) * y * y, h10 = x * y * y * h, h01 = x * x * (3.0 - 2.0 * x),
                 h11 = -x * x * y * h;
    std::array<double, 7> result;
    for (std::size_t k = 0; k < 7; ++k)
      result[k] = h00 * a.value[k] + h10 * a.slope[k] + h01 * b.value[k] + h11 * b.slope[k];
    return result;
  }

  void bound() {
    low_ = {1e9, 1e9, 1e9};
    high_ = {-1e9, -1e9, -1e9};
    for (const Knot& k : knots_) {
      const double reach = 1.15 * std::max({k.value[2], k.value[3], k.value[4], k.value[5]});
      const Vec3d c = frame_.origin + frame_.axis * k.t + frame_.u * k.value[0] + frame_.v * k.value[1];
      const double r =
          reach + std::max(&k == &knots_.front() ? cap_start_ : 0.0, &k == &knots_.back() ? cap_end_ : 0.0);
      low_ = {std::min(low_.x, c.x - r), std::min(low_.y, c.y - r), std::min(low_.z, c.z - r)};
      high_ = {std::max(high_.x, c.x + r), std::max(high_.y, c.y + r), std::max(high_.z, c.z + r)};
    }
  }

  LocalFrame frame_;
  std::vector<Knot> knots_;
  double cap_start_, cap_end_, blend_;
  bool paired_;
  Vec3d low_, high_;
};

NPT_INLINE_CLASS(class, BlendedLofts);
/// The union of lofts and their mirror images, smooth where they meet.
template <class>
class BasicBlendedLofts {
 public:
  explicit BasicBlendedLofts(std::vector<Loft> lofts) : lofts_(std::move(lofts)) {}

  double operator()(Vec3d p) const {
    const Vec3d mirrored{-p.x, p.y, p.z};
    double f = 1e3;
    for (const Loft& loft : lofts_) {
      add(loft, p, f);
      if (loft.paired()) add(loft, mirrored, f);
    }
    return f;
  }

 private:
  /// f becomes the smooth minimum of f and the loft: they flow into each other over `blend` metres.
  static void add(const Loft& loft, Vec3d p, double& f) {
    const double k = loft.blend();
    if (loft.box_distance(p) > f + k) return;
    const double g = loft(p);
    const double h = std::max(k - std::abs(f - g), 0.0) / k;
    f = std::min(f, g) - h * h * h * k / 6.0;
  }

  std::vector<Loft> lofts_;
};

/// The gradient of an implicit surface, by differences along the four directions of a tetrahedron.
template <class Field>
Vec3d gradient(const Field& f, Vec3d p) {
  constexpr double h = 2e-4;
  const double a = f({p.x + h, p.y - h, p.z - h}), b = f({p.x - h, p.y - h, p.z + h}),
               c = f({p.x - h, p.y + h, p.z - h}), d = f({p.x + h, p.y + h, p.z + h});
  return Vec3d{a - b - c + d, c - a - b + d, b - a - c + d} / (4.0 * h);
}

}  // namespace npt::inline NPT_ABI::anatomy
