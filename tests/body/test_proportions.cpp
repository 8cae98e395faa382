#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/proportions.hpp>

#include <cmath>
#include <vector>

#include "small_body.hpp"

namespace {

/// The mannequin's joints with one proportion changed.
std::vector<npt::Vec3d> joints_with(npt::BodyProportion proportion, float by) {
  const npt::BodyModel body = npt::with_proportions(npt::mannequin());
  std::vector<float> betas(body.shape_count(), 0.0F);
  betas[npt::mannequin().shape_count() + static_cast<std::size_t>(proportion)] = by;
  return body.joints(betas);
}

double bone(const std::vector<npt::Vec3d>& joints, npt::SmplJoint a, npt::SmplJoint b) {
  return length(joints[joint_index(a)] - joints[joint_index(b)]);
}

}  // namespace

TEST_CASE("without a change the body is what it was, and so is each of its own shapes") {
  const npt::BodyModel body = npt::with_proportions(npt::mannequin());
  CHECK(body.shape_count() == npt::mannequin().shape_count() + npt::body_proportion_count);
  std::vector<float> betas(body.shape_count(), 0.0F);
  betas[1] = 1.5F;
  const npt::Mesh a = npt::to_mesh(body, betas);
  const npt::Mesh b = npt::to_mesh(npt::mannequin(), std::vector<float>{0, 1.5F});
  for (std::size_t v = 0; v < a.positions.size(); v += 37) CHECK(length(a.positions[v] - b.positions[v]) < 1e-6F);
}

TEST_CASE("proportions make bones longer as they say, and leave others alone") {
  using enum npt::SmplJoint;
  using P = npt::BodyProportion;
  const auto rest = npt::mannequin().joints({});
  const auto thigh = joints_with(P::thigh_length, 0.5F);
  CHECK(bone(thigh, left_hip, left_knee) / bone(rest, left_hip, left_knee) == doctest::Approx(1.5).epsilon(0.08));
  CHECK(bone(thigh, left_knee, left_ankle) == doctest::Approx(bone(rest, left_knee, left_ankle)).epsilon(0.08));
  CHECK(bone(thigh, left_shoulder, left_elbow) == doctest::Approx(bone(rest, left_shoulder, left_elbow)).epsilon(1e-3));
  const auto all = joints_with(P::size, 0.25F);
  CHECK(bone(all, left_hip, left_ankle) == doctest::Approx(1.25 * bone(rest, left_hip, left_ankle)).epsilon(1e-4));
}

TEST_CASE("units scale directions, so that all shape parameters may be standard deviations") {
  const npt::BodyModel plain = npt::with_proportions(npt::mannequin());
  const npt::BodyModel scaled = npt::with_proportions(npt::mannequin(), npt::human_proportion_deviations);
  std::vector<float> a(plain.shape_count(), 0.0F), b = a;
  const std::size_t head = npt::mannequin().shape_count() + static_cast<std::size_t>(npt::BodyProportion::head_size);
  a[head] = 0.16F, b[head] = 2;  // of 0.08 each
  const npt::Mesh p = npt::to_mesh(plain, a), q = npt::to_mesh(scaled, b);
  for (std::size_t v = 0; v < p.positions.size(); v += 41) CHECK(length(p.positions[v] - q.positions[v]) < 1e-5F);
}

TEST_CASE("drawn proportions stay in their ranges, and many bodies are nearly people's") {
  int plain = 0;
  for (std::uint64_t i = 0; i < 200; ++i) {
    npt::Random random(5, i);
    const npt::Proportions p = npt::sample_proportions(random);
    double largest = 0;
    for (const double x : p) {
      CHECK(x >= -0.5 - 1e-9);
      CHECK(x <= 1.3 + 1e-9);
      largest = std::max(largest, std::abs(x));
    }
    plain += largest < 0.2 ? 1 : 0;
  }
  CHECK(plain >= 30);
  CHECK(plain <= 100);
}

TEST_CASE("a body without SMPL's joints has no proportions: an error") {
  CHECK_THROWS_AS(npt::with_proportions(npt::BodyModel(small_body(), "small")), npt::Error);
}
