/// A cheap comparison of many poses of a body with a mesh, to find where a fit should start: some 250 points of each with their
/// normals, each point against all of the other's.
///   sketch(x) = sum_i a_i min_k D(v_i, q_k) + 1/K sum_k min_i D(v_i, q_k),  D = |v - q|^2 + 0.01 (1 - cosine of the normals),
/// cut off at (0.3 m)^2
/// Units     square metres
/// Numerics  float inside; about 40 us a call with 16 lanes
#pragma once

#include <npt/config.hpp>
#include <npt/core/vec3.hpp>
#include <npt/fit/body_level.hpp>
#include <npt/fit/differentiable_body.hpp>
#include <npt/fit/fit_target.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

class BodySketch {
 public:
  /// Vertices that a level for sketches should have.
  static constexpr std::size_t vertices = 250;

  /// Both must outlive this.
  BodySketch(const BodyLevel& level, const FitTarget& target)
      : level_(level), target_(target), points_(level.body().vertex_count()) {
    count_ = std::min(padded, target.samples().size());
    samples_.assign(6 * padded, 0.0F);
    for (std::size_t k = 0; k < padded; ++k) {
      const FitTarget::Sample& s = target.samples()[k < count_ ? k : 0];
      const Vec3f p = (s.point - target.centroid()).as<float>(), n = s.normal.as<float>();
      const std::array<float, 6> values{p.x, p.y, p.z, n.x, n.y, n.z};
      for (std::size_t i = 0; i < 6; ++i) samples_[i * padded + k] = values[i];
    }
  }

  /// Sets the translation so that both surfaces have the same centre of mass, and compares. x: [3 + 3 J + S]
  double operator()(std::vector<double>& x) {
    const DifferentiableBody& body = level_.body();
    x[0] = x[1] = x[2] = 0;
    body.forward(x, state_, points_);
    Vec3d centre;
    for (std::size_t i = 0; i < points_.size(); ++i) centre += points_[i] * level_.probes()[i].area;
    const Vec3d shift = target_.centroid() - centre;
    x[0] = shift.x, x[1] = shift.y, x[2] = shift.z;
    std::array<float, padded> nearest;
    nearest.fill(cut_off);
    double sum = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vec3f p = (points_[i] - centre).as<float>();
      const Vec3f n = normalised(body.carried(i, level_.probes()[i].normal, state_)).as<float>();
      sum += level_.probes()[i].area * static_cast<double>(compare(p, n, nearest));
    }
    double back = 0;
    for (std::size_t k = 0; k < count_; ++k) back += static_cast<double>(nearest[k]);
    return sum + back / static_cast<double>(count_);
  }

 private:
  static constexpr std::size_t padded = 256, lanes = 16;
  static constexpr float cut_off = 0.09F;

  /// The least D of one point of the body; `nearest` holds the least of each sample.
  float compare(Vec3f p, Vec3f n, std::array<float, padded>& nearest) const {
    std::array<float, lanes> least;
    least.fill(cut_off);
    const float* s = samples_.data();
    for (std::size_t from = 0; from < padded; from += lanes)
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        const std::size_t k = from + lane;
        const float x = s[k] - p.x, y = s[padded + k] - p.y, z = s[2 * padded + k] - p.z;
        const float facing = s[3 * padded + k] * n.x + s[4 * padded + k] * n.y + s[5 * padded + k] * n.z;
        const float square = x * x + y * y + z * z + 0.01F * (1 - facing);
        least[lane] = square < least[lane] ? square : least[lane];
        nearest[k] = square < nearest[k] ? square : nearest[k];
      }
    return *std::min_element(least.begin(), least.end());
  }

  const BodyLevel& level_;
  const FitTarget& target_;
  std::size_t count_ = 0;
  std::vector<float> samples_;  ///< x, y, z of points and of normals, each [padded]; the first repeated behind count_
  DifferentiableBody::State state_;
  std::vector<Vec3d> points_;
};

}  // namespace npt::inline NPT_ABI
