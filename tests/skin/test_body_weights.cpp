#include <doctest/doctest.h>

#include <estimate/people.hpp>

#include <npt/base/random.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/skin/body_weights.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using npt::Vec3d;

const npt::BodyKind& without_fingers() {
  static const npt::BodyKind kind = [] {
    npt::BodyKind own = *people::mannequins();
    own.hands.reset();
    return own;
  }();
  return kind;
}

std::vector<Vec3d> points_of(const npt::BodyFit& fit) {
  const npt::BodyModel& body = npt::mannequin();
  std::vector<float> xyz(3 * body.vertex_count());
  body.posed(fit.betas, fit.axis_angles, xyz);
  std::vector<Vec3d> points(body.vertex_count());
  for (std::size_t v = 0; v < points.size(); ++v)
    points[v] = npt::Vec3f{xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]}.as<double>() + fit.translation;
  return points;
}

npt::BodyFit random_fit(std::uint64_t seed) {
  npt::Random random(seed);
  npt::BodyFit fit;
  fit.translation = {1, 2, 3};
  fit.betas = npt::sample_shape(random, 10);
  const auto pose = npt::sample_pose(random);
  fit.axis_angles.assign(pose.begin(), pose.end());
  return fit;
}

/// RMS in metres of the mesh skinned into a pose, against the body in that pose.
double error(const npt::BodyFit& fit, const npt::SparseMatrix& weights, const std::vector<float>& pose) {
  npt::BodyFit other = fit;
  other.axis_angles = pose;
  const std::vector<Vec3d> from = points_of(fit), truth = points_of(other);
  const auto motions = npt::skeleton_motions(npt::mannequin(), fit, pose);
  double sum = 0;
  for (std::size_t v = 0; v < from.size(); ++v) {
    Vec3d p;
    for (std::size_t i = weights.start[v]; i < weights.start[v + 1]; ++i)
      p += motions[weights.column[i]](from[v]) * static_cast<double>(weights.value[i]);
    sum += dot(p - truth[v], p - truth[v]);
  }
  return std::sqrt(sum / static_cast<double>(from.size()));
}

}  // namespace

TEST_CASE("a body's own surface gets nearly its own weights") {
  const npt::BodyFit fit = random_fit(1);
  const npt::SparseMatrix weights =
      npt::body_weights(without_fingers(), fit, points_of(fit), npt::mannequin().triangles()).weights;
  REQUIRE(weights.rows == npt::mannequin().vertex_count());
  for (std::size_t v = 0; v < weights.rows; ++v) CHECK(std::abs(weights.row_sum(v) - 1) < 1e-5);
  CHECK(error(fit, weights, random_fit(2).axis_angles) < 0.008);
}

TEST_CASE("limbs that touch others keep their own weights") {
  npt::BodyFit fit = random_fit(1);
  std::fill(fit.axis_angles.begin(), fit.axis_angles.end(), 0.0F);
  // Arms down into the sides, and thighs together.
  fit.axis_angles[3 * npt::joint_index(npt::SmplJoint::left_shoulder) + 2] = -1.55F;
  fit.axis_angles[3 * npt::joint_index(npt::SmplJoint::right_shoulder) + 2] = 1.55F;
  fit.axis_angles[3 * npt::joint_index(npt::SmplJoint::left_hip) + 2] = -0.1F;
  fit.axis_angles[3 * npt::joint_index(npt::SmplJoint::right_hip) + 2] = 0.1F;
  // The mesh is a little thicker than the body that was fitted to it.
  std::vector<Vec3d> points = points_of(fit);
  const std::vector<Vec3d> normals = npt::area_vectors(points, npt::mannequin().triangles());
  for (std::size_t v = 0; v < points.size(); ++v) points[v] += npt::normalised(normals[v]) * 0.01;
  const npt::SparseMatrix weights =
      npt::body_weights(without_fingers(), fit, points, npt::mannequin().triangles()).weights;
  CHECK(error(fit, weights, random_fit(3).axis_angles) < 0.03);
}

TEST_CASE("a tail goes with what it hangs on, not with the legs that it hangs beside; a loose piece goes as a whole") {
  npt::BodyFit fit = random_fit(1);
  std::fill(fit.axis_angles.begin(), fit.axis_angles.end(), 0.0F);
  std::vector<Vec3d> points = points_of(fit);
  std::vector<npt::Triangle> triangles(npt::mannequin().triangles().begin(), npt::mannequin().triangles().end());
  const std::vector<Vec3d> joints = npt::mannequin().joints(fit.betas);
  const Vec3d pelvis = joints[0] + fit.translation;
  // The triangle farthest back near the pelvis' height carries the tail, a tube of three sides.
  std::size_t root = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vec3d own = points[triangles[t][0]], best = points[triangles[root][0]];
    const auto back = [&](Vec3d p) { return p.z + 10 * std::abs(p.y - pelvis.y + 0.05) + std::abs(p.x - pelvis.x); };
    if (back(own) < back(best)) root = t;
  }
  npt::Triangle ring = triangles[root];
  const std::size_t first = points.size();
  // 35 cm back, down along the legs, and forward to the left calf.
  const Vec3d calf = (joints[4] + joints[7]) * 0.5 + fit.translation - points[ring[0]];
  const std::array<Vec3d, 4> path{{{0, 0, 0}, {0, 0, -0.35}, {calf.x, calf.y, -0.3}, {calf.x, calf.y, calf.z - 0.07}}};
  for (std::size_t leg = 0; leg + 1 < path.size(); ++leg)
    for (int k = 1; k <= 12; ++k) {
      npt::Triangle next{};
      for (std::size_t i = 0; i < 3; ++i) {
        next[i] = static_cast<std::uint32_t>(points.size());
        const double along = k / 12.0;
        points.push_back(points[triangles[root][i]] + path[leg] * (1 - along) + path[leg + 1] * along);
      }
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        triangles.push_back({ring[i], ring[j], next[j]});
        triangles.push_back({ring[i], next[j], next[i]});
      }
      ring = next;
    }
  // A blade that nothing holds, from beside the left hand outwards.
  const auto blade = static_cast<std::uint32_t>(points.size());
  const Vec3d hand = joints[22] + fit.translation;
  points.insert(points.end(), {hand + Vec3d{0, 0.11, 0}, hand + Vec3d{0.5, 0.3, 0}, hand + Vec3d{-0.4, 0.4, 0}});
  triangles.push_back({blade, blade + 1, blade + 2});

  const npt::SparseMatrix weights = npt::body_weights(without_fingers(), fit, points, triangles).weights;
  const auto weight = [&weights](std::size_t v, auto... columns) {
    double sum = 0;
    for (std::size_t i = weights.start[v]; i < weights.start[v + 1]; ++i)
      if (((weights.column[i] == columns) || ...)) sum += static_cast<double>(weights.value[i]);
    return sum;
  };
  double below_knee = 0, trunk = 1;
  for (std::size_t v = first; v < blade; ++v) {
    below_knee = std::max(below_knee, weight(v, 4U, 5U, 7U, 8U));
    if (v >= first + 36) trunk = std::min(trunk, weight(v, 0U, 3U));
  }
  CHECK(below_knee == 0);
  CHECK(trunk > 0.5);
  for (std::uint32_t v = blade; v < blade + 3; ++v) CHECK(weight(v, 20U, 22U) > 0.9);
}

TEST_CASE("a badge on a thigh stays there where a hand was fitted wrongly before it") {
  npt::BodyFit fit = random_fit(1);
  std::ranges::fill(fit.axis_angles, 0.0F);
  std::vector<Vec3d> points = points_of(fit);
  std::vector<npt::Triangle> triangles(npt::mannequin().triangles().begin(), npt::mannequin().triangles().end());
  const std::vector<std::uint32_t> heaviest = npt::mannequin().tables().weights.heaviest_columns();
  // The left arm of the fit hangs down beside the thigh; that of the mesh does not.
  std::vector<std::size_t> hand, thigh;
  for (std::size_t v = 0; v < heaviest.size(); ++v)
    if (heaviest[v] == 20 || heaviest[v] == 22)
      hand.push_back(v);
    else if (heaviest[v] == 1)
      thigh.push_back(v);
  double gap = 1;
  Vec3d of_hand, of_thigh;
  for (float turn = 1; gap > 0.035 && turn < 1.8F; turn += 0.02F) {
    gap = 1;
    fit.axis_angles[3 * std::size_t{16} + 2] = -turn;
    const std::vector<Vec3d> fitted = points_of(fit);
    for (const std::size_t h : hand)
      for (const std::size_t t : thigh)
        if (const double d = length(fitted[h] - points[t]); d < gap) gap = d, of_hand = fitted[h], of_thigh = points[t];
  }
  REQUIRE(gap < 0.035);
  const auto badge = static_cast<std::uint32_t>(points.size());
  const Vec3d centre = of_thigh + (of_hand - of_thigh) * 0.7;
  for (const Vec3d corner : {Vec3d{0, 0.004, 0}, Vec3d{0, -0.002, 0.004}, Vec3d{0, -0.002, -0.004}})
    points.push_back(centre + corner);
  triangles.push_back({badge, badge + 1, badge + 2});

  const npt::SparseMatrix weights = npt::body_weights(without_fingers(), fit, points, triangles, {.facing = 0}).weights;
  for (std::uint32_t v = badge; v < badge + 3; ++v) {
    float leg = 0;
    for (std::size_t i = weights.start[v]; i < weights.start[v + 1]; ++i)
      if (weights.column[i] == 1 || weights.column[i] == 0) leg += weights.value[i];
    CHECK(leg > 0.9F);
  }
}

TEST_CASE("a mesh whose triangles turn inwards, seams and unused vertices") {
  const npt::BodyFit fit = random_fit(4);
  std::vector<Vec3d> points = points_of(fit);
  std::vector<npt::Triangle> triangles(npt::mannequin().triangles().begin(), npt::mannequin().triangles().end());
  const npt::SparseMatrix plain = npt::body_weights(without_fingers(), fit, points, triangles).weights;
  for (npt::Triangle& t : triangles) std::swap(t[0], t[1]);
  CHECK(npt::body_weights(without_fingers(), fit, points, triangles, {.facing = -1}).weights == plain);
  for (npt::Triangle& t : triangles) std::swap(t[0], t[1]);
  // Triangle 5 gets corners of its own, in the same places; the last vertex belongs to nothing.
  for (std::uint32_t& corner : triangles[5]) {
    points.push_back(points[corner]);
    corner = static_cast<std::uint32_t>(points.size() - 1);
  }
  points.push_back({1, 2, 3});
  const npt::SparseMatrix cut = npt::body_weights(without_fingers(), fit, points, triangles).weights;
  REQUIRE(cut.rows == points.size());
  for (std::size_t r = 0; r < cut.rows; ++r) CHECK(std::abs(cut.row_sum(r) - 1) < 1e-5);
  const std::size_t v = npt::mannequin().triangles()[5][0], copy = npt::mannequin().vertex_count();
  CHECK(cut.gathered(std::vector<std::uint32_t>{static_cast<std::uint32_t>(v)}) ==
        cut.gathered(std::vector<std::uint32_t>{static_cast<std::uint32_t>(copy)}));
}
