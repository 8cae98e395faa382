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

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace {

using npt::Vec3d;

const npt::BodyPlan& plan() { return four_legged::kind()->plan; }

npt::Posture posture_of(const std::vector<float>& values, npt::TensorShape shape) {
  const scratch::Folder folder;
  const std::vector<npt::FileTensor> tensors{{.name = "joints",
                                              .dtype = npt::Dtype::f32,
                                              .shape = std::move(shape),
                                              .bytes = std::as_bytes(std::span(values))}};
  npt::write_safetensors(folder / "posture.safetensors", tensors, {});
  return {npt::SafetensorsFile::read(folder / "posture.safetensors"), *four_legged::kind()};
}

/// Random angles by the one shape, and constants; the same on both sides.
npt::Posture even_posture() {
  const std::size_t joints = plan().joint_count();
  npt::Random random(3);
  std::vector<float> values(6 * joints);
  for (float& value : values) value = static_cast<float>(0.2 * random.normal());
  for (std::size_t j = 0; j < joints; ++j)
    for (std::size_t i = 0; i < 6; ++i) {
      if (plan().side(j) < 0) values[6 * j + i] = (i < 2 ? 1.0F : -1.0F) * values[6 * plan().joints[j].mirrored + i];
      if (plan().side(j) == 0 && i >= 2) values[6 * j + i] = 0;  // no turn to a side
    }
  return posture_of(values, {3 * joints, 2});
}

npt::BodyEstimate estimate_of(float beta, const std::vector<Vec3d>& angles) {
  npt::BodyEstimate estimate;
  estimate.fit.body.betas = {beta};
  for (const Vec3d a : angles)
    for (const double x : {a.x, a.y, a.z}) estimate.fit.body.axis_angles.push_back(static_cast<float>(x));
  return estimate;
}
npt::BodyEstimate at_rest(const npt::Posture& posture, float beta) {
  return estimate_of(beta, posture.rest(std::vector{beta}));
}
/// Each pair's left limb bends about x by one angle, its right by another.
npt::BodyEstimate bent(const npt::Posture& posture, float beta, double left, double right) {
  std::vector<Vec3d> angles = posture.rest(std::vector{beta});
  for (const npt::LimbPair& pair : plan().limb_pairs())
    for (std::size_t k = 0; k < pair.joints[0].size(); ++k)
      angles[pair.joints[0][k]].x += left, angles[pair.joints[1][k]].x += right;
  return estimate_of(beta, angles);
}

double difference(const npt::Matrix3& a, const npt::Matrix3& b) { return std::sqrt((a - b).squared_norm()); }

}  // namespace

TEST_CASE("the posture at rest is linear in the shape, up to three deviations") {
  const npt::Posture posture = even_posture();
  const auto rest = [&posture](float beta) { return posture.rest(std::vector{beta}); };
  const std::vector<Vec3d> none = posture.rest({}), zero = rest(0), one = rest(1), two = rest(2), less = rest(-1);
  REQUIRE(zero.size() == plan().joint_count());
  double moved = 0;
  for (std::size_t j = 0; j < zero.size(); ++j) {
    CHECK(none[j] == zero[j]);
    CHECK(length(two[j] - zero[j] - (one[j] - zero[j]) * 2) < 1e-9);
    CHECK(length(less[j] + one[j] - zero[j] * 2) < 1e-9);
    moved += length(one[j] - zero[j]);
  }
  CHECK(moved > 1);
  CHECK(rest(9) == rest(3));
  CHECK(rest(-9) == rest(-3));
}

TEST_CASE("a body stands in the rest of its shape, wherever it looks, and doesn't in a walk or crouching") {
  const npt::Posture posture = even_posture();
  npt::BodyEstimate standing = at_rest(posture, 1);
  CHECK(posture.standing(standing) == 1);
  npt::set_joint_rotation(standing.fit.body.axis_angles, 0,
                          npt::rotation_matrix({0, 2, 0}) * standing.joint_rotation(0));
  CHECK(posture.standing(standing) == 1);
  CHECK(posture.standing(bent(posture, 1, 0.5, -0.5)) == 0);  // a walk
  CHECK(posture.standing(bent(posture, 1, 0.8, 0.8)) == 0);   // crouching
  CHECK(posture.standing(bent(posture, 1, 0.05, -0.05)) == doctest::Approx(1));
}

TEST_CASE("a pose goes from one shape's rest to another's") {
  const npt::Posture posture = even_posture();
  const npt::BodyEstimate identity = at_rest(posture, 1), rest = at_rest(posture, -1);
  npt::BodyEstimate result = identity;
  result.fit.body.axis_angles = posture.angles(identity, rest);
  for (std::size_t j = 0; j < plan().joint_count(); ++j)
    CHECK(difference(result.joint_rotation(j), identity.joint_rotation(j)) < 1e-5);

  // What a joint does far beyond its rest is what the identity's does beyond its own.
  npt::BodyEstimate pose = rest;
  const npt::Matrix3 bend = npt::rotation_matrix({0.6, 0.1, -0.2}), turn = npt::rotation_matrix({0, 1, 0});
  const std::size_t knee = plan().joint("l_knee");
  npt::set_joint_rotation(pose.fit.body.axis_angles, knee, rest.joint_rotation(knee) * bend);
  npt::set_joint_rotation(pose.fit.body.axis_angles, 0, turn * rest.joint_rotation(0));
  result.fit.body.axis_angles = posture.angles(identity, pose);
  CHECK(difference(result.joint_rotation(knee), identity.joint_rotation(knee) * bend) < 1e-5);
  CHECK(difference(result.joint_rotation(0), turn * identity.joint_rotation(0)) < 1e-5);
}

TEST_CASE("an identity that stands at rest keeps its own angles, one that walks takes its shape's") {
  const npt::Posture posture = even_posture();
  const npt::BodyEstimate rest = at_rest(posture, -1), own = bent(posture, 1, 0.1, 0.1),
                          walking = bent(posture, 1, 0.5, -0.5), shape = at_rest(posture, 1);
  const std::size_t knee = plan().joint("r_knee");
  npt::BodyEstimate result = rest;
  result.fit.body.axis_angles = posture.angles(own, rest);
  CHECK(difference(result.joint_rotation(knee), own.joint_rotation(knee)) < 1e-5);
  result.fit.body.axis_angles = posture.angles(walking, rest);
  CHECK(difference(result.joint_rotation(knee), shape.joint_rotation(knee)) < 1e-5);
}

TEST_CASE("a tensor of another shape is refused, with the file's name and the expected shape") {
  const std::string expected = "expected [" + std::to_string(3 * plan().joint_count()) + ", 2]";
  CHECK_THROWS_WITH_AS(posture_of(std::vector<float>(12, 0.0F), {6, 2}), doctest::Contains(expected.c_str()),
                       npt::Error);
  CHECK_THROWS_WITH_AS(posture_of(std::vector<float>(12, 0.0F), {6, 2}), doctest::Contains("posture.safetensors"),
                       npt::Error);
}
