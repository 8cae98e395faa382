// Bodies in poses, and readings of them as a reader would give: right but for noise, with wild places and limbs taken
// for those of the other side.
#pragma once

#include <npt/base/random.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/part_motion.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/sampled_surface.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

namespace simulated {

using npt::Vec3d;

/// A body in a pose, at its own place.
struct Posed {
  std::vector<float> betas, pose;
  std::vector<Vec3d> points;  ///< [V]
};

/// Turns the root by `yaw` about y, after its own rotation.
inline void turn(std::span<float> pose, double yaw) {
  const npt::Matrix3 root = npt::rotation_matrix({pose[0], pose[1], pose[2]});
  const Vec3d a = npt::axis_angle(npt::rotation_matrix({0, yaw, 0}) * root);
  pose[0] = static_cast<float>(a.x), pose[1] = static_cast<float>(a.y), pose[2] = static_cast<float>(a.z);
}

inline std::vector<Vec3d> points_of(const npt::BodyModel& body, std::span<const float> betas,
                                    std::span<const float> pose) {
  std::vector<float> xyz(3 * body.vertex_count());
  body.posed(betas, pose, xyz);
  std::vector<Vec3d> points(body.vertex_count());
  for (std::size_t v = 0; v < points.size(); ++v) points[v] = {xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]};
  return points;
}

/// `library`: [N, 24, 3] axis angles; empty: poses drawn from wide ranges.
inline Posed draw(const npt::BodyModel& body, std::span<const float> library, npt::Random& random) {
  Posed posed;
  posed.betas = npt::sample_shape(random, std::min<std::size_t>(10, body.shape_count()));
  if (library.empty()) {
    const auto pose = npt::sample_pose(random, npt::PoseDistribution::wide);
    posed.pose.assign(pose.begin(), pose.end());
    for (float& a : posed.pose) a *= 0.7F;
  } else {
    const std::size_t at = 72 * std::size_t{random.below(static_cast<std::uint32_t>(library.size() / 72))};
    for (std::size_t i = 0; i < 72; ++i)
      posed.pose.push_back(library[at + i] + static_cast<float>(0.1 * random.normal()));
  }
  turn(posed.pose, random.uniform(-std::numbers::pi, std::numbers::pi));
  posed.points = points_of(body, posed.betas, posed.pose);
  return posed;
}

struct Noise {
  double place = 0.05;  ///< mean length of the error of a place
  double part = 0.02;   ///< standard deviation of what all places of a part have in common
  double wild = 0.1;    ///< share of places that are anywhere
  bool swap_one_arm = false, swap_arms = false, swap_legs = false;
};

/// places: [V] where each vertex belongs on the resting mannequin.
inline npt::Correspondences read(const npt::SampledSurface& surface, std::span<const Vec3d> points,
                                 std::span<const npt::Triangle> triangles, std::span<const Vec3d> places,
                                 const npt::SparseMatrix& weights, std::size_t count, const Noise& noise,
                                 npt::Random& random) {
  const npt::TriangleTree tree(points, triangles);
  const auto direction = [&random] {
    return npt::normalised(Vec3d{random.normal(), random.normal(), random.normal()});
  };
  std::vector<Vec3d> offsets(24);
  for (Vec3d& o : offsets) o = Vec3d{random.normal(), random.normal(), random.normal()} * noise.part;
  const npt::BodyModel& body = npt::mannequin();
  npt::Correspondences reading;
  for (std::size_t k = 0; k < count; ++k) {
    const npt::SampledSurface::Sample& s = surface.samples()[k];
    const npt::ClosestPoint c = tree.closest(s.point);
    npt::PointCorrespondence p;
    p.point = s.point;
    p.normal = s.normal;
    std::vector<double> skin(24);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t v = triangles[c.triangle][i];
      p.place += places[v] * c.weights[i];
      for (std::size_t e = weights.start[v]; e < weights.start[v + 1]; ++e)
        skin[weights.column[e]] += c.weights[i] * static_cast<double>(weights.value[e]);
    }
    const auto part = static_cast<std::size_t>(std::ranges::max_element(skin) - skin.begin());
    const bool arm = part >= 16 && part <= 23, leg = part == 1 || part == 2 || part == 4 || part == 5 || part == 7 ||
                                                     part == 8 || part == 10 || part == 11;
    if ((arm && noise.swap_arms) || (arm && p.place.x > 0 && noise.swap_one_arm) || (leg && noise.swap_legs))
      p.place.x = -p.place.x;
    p.spread = 0.04 * std::exp(0.4 * random.normal());
    p.place += direction() * (-std::log(1 - random.uniform()) * noise.place) + offsets[part];
    if (random.uniform() < noise.wild) {
      const std::size_t v = random.below(static_cast<std::uint32_t>(body.vertex_count()));
      const float* at = &body.tables().v_template[3 * v];
      p.place = {at[0], at[1], at[2]};
      p.spread *= random.uniform(1, 4);
    }
    reading.push_back(p);
  }
  return reading;
}

inline std::vector<Vec3d> mannequin_places() {
  const std::span<const float> xyz = npt::mannequin().tables().v_template;
  std::vector<Vec3d> places(xyz.size() / 3);
  for (std::size_t v = 0; v < places.size(); ++v) places[v] = {xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]};
  return places;
}

/// RMS over the model's vertices, in metres.
inline double error(const npt::BodyModel& model, const npt::BodyFit& fit, std::span<const Vec3d> truth) {
  const std::vector<Vec3d> points = points_of(model, fit.betas, fit.axis_angles);
  double sum = 0;
  for (std::size_t v = 0; v < truth.size(); ++v) {
    const Vec3d d = points[v] + fit.translation - truth[v];
    sum += dot(d, d);
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

}  // namespace simulated
