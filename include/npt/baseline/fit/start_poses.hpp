/// Where a fit may start from: poses of the limbs on a coarse grid, directions of the body, and a cheap comparison of a
/// posed body with a mesh that chooses among them. Poses are axis angles for SMPL's 24 joints.
/// The grid knows nothing of any data set: it covers what shoulders, elbows, hips and knees can do, in steps of about
/// 40 degrees, which is what a search finds its way home from.
#pragma once

#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/fit/fit_target.hpp>
#include <npt/body/body_level.hpp>
#include <npt/body/differentiable_body.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace npt::inline NPT_ABI {

/// Axis angles of some joints of a body; the others stay as they are.
struct LimbPose {
  std::array<std::size_t, 5> joints{};  ///< from the trunk outwards
  std::array<Vec3d, 5> axis_angles;
};

/// The poses of each of the four limbs: left and right arm, left and right leg. Only shoulders and elbows, hips and
/// knees vary; the limb's other joints are straight.
inline std::array<std::vector<LimbPose>, 4> limb_poses() {
  using enum SmplJoint;
  constexpr double degree = std::numbers::pi / 180.0;
  std::array<std::vector<LimbPose>, 4> limbs;
  for (const double side : {1.0, -1.0}) {
    const bool left = side > 0;
    const auto joints = [left](SmplJoint a, SmplJoint b) { return joint_index(left ? a : b); };
    const std::array<std::size_t, 5> arm{joints(left_collar, right_collar), joints(left_shoulder, right_shoulder),
                                         joints(left_elbow, right_elbow), joints(left_wrist, right_wrist),
                                         joints(left_hand, right_hand)};
    for (const double forward : {0.0, 40.0, 80.0, -35.0})
      for (const double down : {0.0, 40.0, 80.0, -40.0})
        for (const double bend : {0.0, 55.0, 110.0})
          limbs[left ? 0 : 1].push_back(
              {arm, {Vec3d{}, Vec3d{0, -forward, -down} * (side * degree), Vec3d{0, -bend, 0} * (side * degree)}});
    const std::array<std::size_t, 5> leg{joints(left_hip, right_hip), joints(left_knee, right_knee),
                                         joints(left_ankle, right_ankle), joints(left_foot, right_foot),
                                         joints(left_foot, right_foot)};
    for (const double forward : {0.0, 35.0, 70.0, 105.0, -25.0})
      for (const double apart : {0.0, 25.0, 50.0})
        for (const double bend : {0.0, 50.0, 100.0})
          limbs[left ? 2 : 3].push_back({leg, {Vec3d{-forward, 0, side * apart} * degree, Vec3d{bend, 0, 0} * degree}});
  }
  return limbs;
}

/// Axis angles of a body that has been turned about its own vertical axis, y, and then laid or stood so that this axis
/// points elsewhere. All directions of one `up` stand together, [6][yaws]: y first, then z, -z, x, -x, -y.
inline std::vector<Vec3d> start_directions(int yaws) {
  const double h = std::sqrt(0.5);
  const std::array<Quaternion, 6> ups{{{}, {h, 0, 0, h}, {-h, 0, 0, h}, {0, 0, -h, h}, {0, 0, h, h}, {1, 0, 0, 0}}};
  std::vector<Vec3d> result;
  for (const Quaternion& up : ups)
    for (int i = 0; i < yaws; ++i) {
      const double half = std::numbers::pi * i / yaws;
      result.push_back(axis_angle(up * Quaternion{0, std::sin(half), 0, std::cos(half)}));
    }
  return result;
}

/// Compares many poses of a body with a mesh: some 250 points of each with their normals, each point against all of the
/// other's.
///   sketch(x) = sum_i a_i min_k D(v_i, q_k) + 1/K sum_k min_i D(v_i, q_k),  D = |v - q|^2 + 0.01 (1 - cosine of the
///   normals),
/// cut off at (0.3 m)^2
/// Units     square metres
/// Numerics  float inside; about 40 us a call with 16 lanes
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
