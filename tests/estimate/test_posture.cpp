#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/posture.hpp>
#include <npt/io/safetensors.hpp>

#include <estimate/four_legged.hpp>
#include <io/scratch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using npt::Vec3d;

const npt::BodyPlan& plan() { return four_legged::kind()->plan; }

std::size_t count() { return 3 * plan().joint_count(); }

/// Random angles, the same on both sides.
std::vector<double> even_angles(std::uint64_t seed) {
  npt::Random random(seed);
  std::vector<double> values(count());
  for (double& value : values) value = 0.2 * random.normal();
  for (std::size_t j = 0; j < plan().joint_count(); ++j)
    for (std::size_t i = 0; i < 3; ++i) {
      if (plan().side(j) < 0) values[3 * j + i] = (i < 1 ? 1 : -1) * values[3 * plan().joints[j].mirrored + i];
      if (plan().side(j) == 0 && i >= 1) values[3 * j + i] = 0;  // no turn to a side
    }
  return values;
}

std::vector<double> diagonal(double value) {
  std::vector<double> matrix(count() * count());
  for (std::size_t i = 0; i < count(); ++i) matrix[i * count() + i] = value;
  return matrix;
}

constexpr double rest_variance = 0.04, motion_variance = 0.09;

/// Two rigs, of shapes 2 and -2.
const npt::PostureModel& model() {
  static const npt::PostureModel all = [] {
    npt::PostureModel model{.shapes = {2, -2}, .shape_variances = {1e-12}, .angles = even_angles(1)};
    const std::vector<double> second = even_angles(2);
    model.angles.insert(model.angles.end(), second.begin(), second.end());
    model.rest_covariance = diagonal(rest_variance), model.motion_covariance = diagonal(motion_variance);
    return model;
  }();
  return all;
}
const npt::Posture& posture() {
  static const npt::Posture all(model(), *four_legged::kind());
  return all;
}

/// [J] Of a rig at rest, or of the mean of both.
std::vector<Vec3d> rest_of_rig(std::size_t rig) {
  const double* a = &model().angles[rig * count()];
  std::vector<Vec3d> angles;
  for (std::size_t i = 0; i < count(); i += 3) angles.push_back({a[i], a[i + 1], a[i + 2]});
  return angles;
}
std::vector<Vec3d> mean_rest() {
  std::vector<Vec3d> angles = rest_of_rig(0), other = rest_of_rig(1);
  for (std::size_t j = 0; j < angles.size(); ++j) angles[j] = (angles[j] + other[j]) / 2;
  return angles;
}

npt::BodyEstimate estimate_of(float beta, const std::vector<Vec3d>& angles) {
  npt::BodyEstimate estimate;
  estimate.fit.body.betas = {beta};
  for (const Vec3d a : angles)
    for (const double x : {a.x, a.y, a.z}) estimate.fit.body.axis_angles.push_back(static_cast<float>(x));
  return estimate;
}
/// Each pair's left limb turns on about x by one angle, its right by another.
npt::BodyEstimate bent(npt::BodyEstimate estimate, double left, double right) {
  for (const npt::LimbPair& pair : plan().limb_pairs())
    for (std::size_t k = 0; k < pair.joints[0].size(); ++k)
      for (std::size_t side = 0; side < 2; ++side)
        npt::set_joint_rotation(
            estimate.fit.body.axis_angles, pair.joints[side][k],
            estimate.joint_rotation(pair.joints[side][k]) * npt::rotation_matrix({side == 0 ? left : right, 0, 0}));
  return estimate;
}

double difference(const npt::Matrix3& a, const npt::Matrix3& b) { return std::sqrt((a - b).squared_norm()); }
double largest(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
  double most = 0;
  for (std::size_t j = 0; j < a.size(); ++j)
    most = std::max(most, difference(npt::rotation_matrix(a[j]), npt::rotation_matrix(b[j])));
  return most;
}

}  // namespace

TEST_CASE("an animal that was learned from has its rig's rest in whatever pose") {
  for (const std::size_t rig : {0U, 1U}) {
    const npt::BodyEstimate standing = estimate_of(rig == 0 ? 2.0F : -2.0F, rest_of_rig(rig));
    CHECK(largest(posture().rest(standing, false), rest_of_rig(rig)) < 1e-5);
    CHECK(largest(posture().rest(bent(standing, 0.5, -0.4), false), rest_of_rig(rig)) < 0.03);
    CHECK(largest(posture().rest(bent(standing, 0.8, 0.8), false), rest_of_rig(rig)) < 0.03);
  }
}

TEST_CASE("another animal's rest is the mean of the posterior, as plain sums give it") {
  const npt::BodyEstimate mesh = bent(estimate_of(0.5F, mean_rest()), 0.3, 0.3);
  const std::vector<Vec3d> mean = mean_rest(), rest = posture().rest(mesh, false);
  const std::size_t knee = plan().joint("l_knee");
  double square = 0;
  for (std::size_t j = 1; j < mean.size(); ++j) {
    const Vec3d off = npt::axis_angle(npt::rotation_matrix(mean[j]).transposed() * mesh.joint_rotation(j));
    square += dot(off, off);
  }
  double share = 0, sum = 0;
  for (const double scale : {0.1, 0.3, 1.0, 3.0}) {
    const double variance = rest_variance + scale * scale * motion_variance + 0.03 * 0.03,
                 n = static_cast<double>(count() - 3);
    const double odds = std::exp(-0.5 * (square / variance + n * std::log(variance / rest_variance)));
    share += odds * rest_variance / variance, sum += odds;
  }
  share /= sum;
  CHECK(share > 0.1);
  const Vec3d moved = npt::axis_angle(npt::rotation_matrix(mean[knee]).transposed() * npt::rotation_matrix(rest[knee]));
  CHECK(moved.x == doctest::Approx(0.3 * share).epsilon(1e-4));
  CHECK(std::abs(moved.y) + std::abs(moved.z) < 1e-6);
}

TEST_CASE("less of what a mesh shows is rest where it is expected to move") {
  const npt::BodyEstimate standing = bent(estimate_of(0.5F, mean_rest()), 0.05, 0.05);
  const double rest = largest(posture().rest(standing, false), mean_rest()),
               moves = largest(posture().rest(standing, true), mean_rest());
  CHECK(moves > 0);
  CHECK(moves < 0.5 * rest);
}

TEST_CASE("what left and right differ by is no rest") {
  const npt::BodyEstimate walking = bent(estimate_of(0.5F, mean_rest()), 0.4, -0.4);
  CHECK(largest(posture().rest(walking, false), mean_rest()) < 1e-4);
}

TEST_CASE("a rest doesn't depend on where an animal looks or lies") {
  const npt::BodyEstimate mesh = bent(estimate_of(0.5F, mean_rest()), 0.3, 0.1);
  const std::vector<Vec3d> rest = posture().rest(mesh, false);
  for (const Vec3d turn : {Vec3d{0, 2, 0}, Vec3d{1.5, 0, 0}, Vec3d{0.3, -1, 2}}) {
    npt::BodyEstimate turned = mesh;
    npt::set_joint_rotation(turned.fit.body.axis_angles, 0, npt::rotation_matrix(turn) * mesh.joint_rotation(0));
    CHECK(posture().rest(turned, false) == rest);
  }
}

TEST_CASE("a pose goes from one animal's rest to another's") {
  const npt::BodyEstimate identity = estimate_of(2, rest_of_rig(0)), rest = estimate_of(-2, rest_of_rig(1));
  npt::BodyEstimate result = identity;
  result.fit.body.axis_angles = posture().angles(identity, rest);
  for (std::size_t j = 0; j < plan().joint_count(); ++j)
    CHECK(difference(result.joint_rotation(j), identity.joint_rotation(j)) < 1e-5);

  // What a joint does beyond its rest is what the identity's does beyond its own.
  const npt::BodyEstimate walking = bent(rest, 0.4, -0.4);
  const npt::Matrix3 turn = npt::rotation_matrix({0, 1, 0});
  npt::BodyEstimate pose = walking;
  npt::set_joint_rotation(pose.fit.body.axis_angles, 0, turn * rest.joint_rotation(0));
  result.fit.body.axis_angles = posture().angles(identity, pose);
  const std::size_t knee = plan().joint("l_knee");
  CHECK(difference(result.joint_rotation(knee), bent(identity, 0.4, -0.4).joint_rotation(knee)) < 1e-3);
  CHECK(difference(result.joint_rotation(0), turn * identity.joint_rotation(0)) < 1e-3);
}

TEST_CASE("tensors of other shapes are refused, with the file's name and the expected shape") {
  const std::size_t n = count();
  const std::vector<float> values(n * n, 0.0F);
  const auto read = [&](npt::TensorShape angles, npt::TensorShape covariance) {
    const scratch::Folder folder;
    std::vector<npt::FileTensor> tensors;
    const auto add = [&](const char* name, npt::TensorShape shape) {
      std::uint64_t size = 1;
      for (const std::uint64_t extent : shape) size *= extent;
      tensors.push_back({.name = name,
                         .dtype = npt::Dtype::f32,
                         .shape = std::move(shape),
                         .bytes = std::as_bytes(std::span(values).first(size))});
    };
    add("shapes", {2, 1}), add("shape_variances", {1}), add("angles", std::move(angles));
    add("rest_covariance", std::move(covariance)), add("motion_covariance", {n, n}), add("other_odds", {1});
    npt::write_safetensors(folder / "posture.safetensors", tensors, {});
    return npt::read_posture_model(npt::SafetensorsFile::read(folder / "posture.safetensors"), *four_legged::kind());
  };
  CHECK(read({2, n}, {n, n}).rig_count() == 2);
  const std::string expected = "expected [2, " + std::to_string(n) + "]";
  CHECK_THROWS_WITH_AS(read({n, 2}, {n, n}), doctest::Contains(expected.c_str()), npt::Error);
  CHECK_THROWS_WITH_AS(read({2, n}, {n}), doctest::Contains("posture.safetensors"), npt::Error);
}
