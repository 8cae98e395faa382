#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/people_kind.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/estimate/angle_correction.hpp>
#include <npt/io/safetensors.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using npt::joint_index;
using npt::SmplJoint;

constexpr std::size_t angle_inputs = 69, shape_inputs = 26, columns = angle_inputs + shape_inputs,
                      rows = angle_inputs + 3;

npt::AngleCorrection bias_of(std::vector<float> b) { return {std::move(b), *npt::people_kind()}; }

/// A mesh in which a body lies with these angles, at the distance of another model's.
npt::BodyEstimate reading_of(std::uint64_t seed, double distance = 0.006) {
  npt::Random random(seed);
  npt::BodyEstimate reading;
  reading.fit.relative_distance = distance;
  for (std::size_t i = 0; i < rows; ++i)
    reading.fit.body.axis_angles.push_back(static_cast<float>(0.4 * random.normal()));
  for (std::size_t i = 0; i < shape_inputs; ++i) reading.fit.body.betas.push_back(static_cast<float>(random.normal()));
  return reading;
}

double angle(const npt::BodyEstimate& reading, SmplJoint joint, std::size_t axis) {
  return static_cast<double>(reading.fit.body.axis_angles[3 * joint_index(joint) + axis]);
}

/// [24] in space.
std::array<npt::Matrix3, npt::smpl_joint_count> in_space(const std::vector<float>& angles) {
  npt::BodyEstimate reading;
  reading.fit.body.axis_angles = angles;
  std::array<npt::Matrix3, npt::smpl_joint_count> all;
  for (std::size_t j = 0; j < all.size(); ++j) {
    const int parent = npt::smpl_parents[j];
    all[j] = parent < 0 ? reading.joint_rotation(j) : all[static_cast<std::size_t>(parent)] * reading.joint_rotation(j);
  }
  return all;
}

double difference(const npt::Matrix3& a, const npt::Matrix3& b) { return std::sqrt((a - b).squared_norm()); }

/// The pelvis turns about its own y axis by `factor` times an input.
npt::AngleCorrection pelvis_with(std::size_t input, float factor) {
  std::vector<float> b(rows * (columns + 1));
  b[(3 * joint_index(SmplJoint::pelvis) + 1) * (columns + 1) + input] = factor;
  return bias_of(std::move(b));
}
/// The same with the left hip's angle about x.
npt::AngleCorrection pelvis_with_hip(float factor) {
  return pelvis_with(3 * (joint_index(SmplJoint::left_hip) - 1), factor);
}

npt::FileTensor tensor_of(const std::vector<float>& values, npt::TensorShape shape) {
  return {.name = npt::AngleCorrection::tensor, .shape = std::move(shape), .bytes = std::as_bytes(std::span(values))};
}

/// How people at rest are fitted: the head a little back.
constexpr double back = 0.047;
const npt::AngleCorrection& at_ease() {
  static const npt::AngleCorrection shared = [] {
    std::vector<float> b(rows * (columns + 1));
    b[3 * joint_index(SmplJoint::head) * (columns + 1) + columns] = static_cast<float>(back);
    return bias_of(std::move(b));
  }();
  return shared;
}
double own_rest(const npt::BodyEstimate& estimate) { return at_ease().own_rest(estimate); }
std::vector<float> from_own_rest(const npt::BodyEstimate& identity, const std::vector<float>& angles) {
  return at_ease().from_own_rest(identity, angles);
}

/// A T pose, a joint turned about x beyond people's.
npt::BodyEstimate at_rest(npt::SmplJoint joint, float radians, double distance) {
  npt::BodyEstimate reading;
  reading.fit.body.axis_angles.assign(72, 0.0F);
  reading.fit.body.axis_angles[3 * npt::joint_index(joint)] = radians;
  reading.fit.relative_distance = distance;
  return reading;
}

npt::Matrix3 rotation_of(const std::vector<float>& angles, npt::SmplJoint joint) {
  const std::size_t at = 3 * npt::joint_index(joint);
  return npt::rotation_matrix(npt::Vec3f{angles[at], angles[at + 1], angles[at + 2]}.as<double>());
}

/// Radians about x, of a joint that is turned about it.
double about_x(const std::vector<float>& angles, npt::SmplJoint joint) {
  const npt::Vec3d up = rotation_of(angles, joint) * npt::Vec3d{0, 1, 0};
  return std::atan2(up.z, up.y);
}

}  // namespace

TEST_CASE("a joint turns in its own frame by what both poses' angles say, the others keep theirs in space") {
  const npt::BodyEstimate identity = reading_of(1), pose = reading_of(2);
  const auto before = in_space(pose.fit.body.axis_angles);
  const auto after = in_space(pelvis_with_hip(0.2F).without_bias(identity, pose));
  const double turn = 0.2 * (angle(pose, SmplJoint::left_hip, 0) - angle(identity, SmplJoint::left_hip, 0));
  REQUIRE(std::abs(turn) > 0.01);
  CHECK(difference(after[0], before[0] * npt::rotation_matrix({0, turn, 0})) < 1e-6);
  for (std::size_t j = 1; j < npt::smpl_joint_count; ++j) CHECK(difference(after[j], before[j]) < 1e-6);
}

TEST_CASE("a build's posture is taken out, and stays between meshes of one build") {
  npt::BodyEstimate identity = reading_of(1), pose = reading_of(2);
  constexpr std::size_t shape = 12;
  const npt::AngleCorrection bias = pelvis_with(angle_inputs + shape, 0.05F);
  const double turn =
      0.05 * (static_cast<double>(pose.fit.body.betas[shape]) - static_cast<double>(identity.fit.body.betas[shape]));
  REQUIRE(std::abs(turn) > 0.01);
  const npt::Matrix3 before = pose.joint_rotation(0);
  CHECK(difference(in_space(bias.without_bias(identity, pose))[0], before * npt::rotation_matrix({0, turn, 0})) < 1e-6);
  identity.fit.body.betas = pose.fit.body.betas;
  CHECK(difference(in_space(bias.without_bias(identity, pose))[0], before) < 1e-6);
}

TEST_CASE("between equal poses nothing changes, and no turn is greater than 0.35 of a radian") {
  const npt::BodyEstimate identity = reading_of(1), pose = reading_of(2);
  const npt::AngleCorrection bias = pelvis_with_hip(100);
  CHECK(difference(in_space(bias.without_bias(pose, pose))[0], pose.joint_rotation(0)) < 1e-6);
  const npt::Matrix3 turned = bias.bias(pose)[0];
  CHECK(difference(turned, npt::rotation_matrix({0, std::copysign(0.35, angle(pose, SmplJoint::left_hip, 0)), 0})) <
        1e-9);
}

TEST_CASE("it counts where both keep a distance from the body as people of other models do") {
  const npt::BodyEstimate person = reading_of(1), mannequin = reading_of(2, 0.001), stylised = reading_of(2, 0.011);
  for (const npt::BodyEstimate* other : {&mannequin, &stylised}) {
    CHECK(pelvis_with_hip(1).without_bias(person, *other) == other->fit.body.axis_angles);
    CHECK(pelvis_with_hip(1).without_bias(*other, person) == person.fit.body.axis_angles);
  }
}

TEST_CASE("people at rest are fitted so that bias and constant take them to no turn at all") {
  CHECK(npt::length(pelvis_with_hip(0.2F).rest()[0]) == 0);
  std::vector<float> b(rows * (columns + 1));
  const auto row = [&b](SmplJoint joint, std::size_t axis) {
    return std::span(b).subspan((3 * joint_index(joint) + axis) * (columns + 1), columns + 1);
  };
  row(SmplJoint::left_hip, 0)[columns] = 0.1F;
  row(SmplJoint::left_knee, 0)[columns] = -0.05F;
  row(SmplJoint::left_knee, 0)[3 * (joint_index(SmplJoint::left_hip) - 1)] = 0.5F;
  const auto rest = bias_of(b).rest();
  const double hip = rest[joint_index(SmplJoint::left_hip)].x, knee = rest[joint_index(SmplJoint::left_knee)].x;
  CHECK(hip == doctest::Approx(-0.1));
  CHECK(hip + knee + 0.5 * hip - 0.05 == doctest::Approx(0).epsilon(1e-6));
}

TEST_CASE("a file without the numbers, with others or with broken ones is refused") {
  const auto opened = [](const npt::FileTensor& tensor) {
    const std::filesystem::path path = std::filesystem::temp_directory_path() / "npt_test_angle_correction.safetensors";
    npt::write_safetensors(path, std::vector{tensor});
    const npt::SafetensorsFile file = npt::SafetensorsFile::read(path);
    std::filesystem::remove(path);
    return npt::AngleCorrection(file, *npt::people_kind());
  };
  std::vector<float> values(rows * (columns + 1), 0.01F);
  CHECK_NOTHROW(opened(tensor_of(values, npt::AngleCorrection::shape(*npt::people_kind()))));
  CHECK_THROWS_WITH_AS(opened(tensor_of(values, {24, 3, 6, 16})),
                       doctest::Contains("found [24, 3, 6, 16], expected [24, 3, 96]"), npt::Error);
  npt::FileTensor other = tensor_of(values, npt::AngleCorrection::shape(*npt::people_kind()));
  other.name = "another";
  CHECK_THROWS_WITH_AS(opened(other), doctest::Contains("no tensor 'joints'"), npt::Error);
  values[5] = std::numeric_limits<float>::quiet_NaN();
  CHECK_THROWS_WITH_AS(opened(tensor_of(values, npt::AngleCorrection::shape(*npt::people_kind()))),
                       doctest::Contains("NaN"), npt::Error);
}

TEST_CASE("the shipped reader's file holds it, and it leaves the mannequin alone") {
  const npt::SafetensorsFile shipped =
      npt::SafetensorsFile::read(std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights/human.safetensors");
  const npt::AngleCorrection bias(shipped.part("fit_bias/"), *npt::people_kind());
  const npt::BodyEstimate person = reading_of(3), same = reading_of(4);
  CHECK(bias.without_bias(person, same) != same.fit.body.axis_angles);
  CHECK(bias.without_bias(reading_of(3, 0.001), reading_of(4, 0.001)) == same.fit.body.axis_angles);
}

TEST_CASE("the mannequin, people and stylised characters keep distances of their own from the body") {
  const auto at = [](double distance) { return reading_of(1, distance); };
  CHECK(npt::AngleCorrection::unlike_mannequin(at(0.001)) == 0);
  CHECK(npt::AngleCorrection::unlike_mannequin(at(0.0035)) == doctest::Approx(0.5));
  CHECK(npt::AngleCorrection::unlike_mannequin(at(0.007)) == 1);
  CHECK(npt::AngleCorrection::unlike_people(at(0.007)) == 0);
  CHECK(npt::AngleCorrection::unlike_people(at(0.0095)) == doctest::Approx(0.5));
  CHECK(npt::AngleCorrection::unlike_people(at(0.011)) == 1);
}

TEST_CASE("a character of its own build in a T pose keeps its head where it is; people take the pose's angles") {
  std::vector<float> pose(72, 0.0F);
  pose[3 * joint_index(SmplJoint::head)] = 0.3F;
  const npt::BodyEstimate stylised = at_rest(SmplJoint::head, 0.2F, 0.012),
                          person = at_rest(SmplJoint::head, 0.2F, 0.007);
  CHECK(own_rest(stylised) == 1);
  CHECK(own_rest(person) == 0);
  CHECK(from_own_rest(person, pose) == pose);
  CHECK(about_x(from_own_rest(stylised, pose), SmplJoint::head) == doctest::Approx(0.3 + 0.2 + back).epsilon(1e-3));
  CHECK(own_rest(at_rest(SmplJoint::head, 0.2F, 0.0095)) == doctest::Approx(0.5));
}

TEST_CASE("who moves isn't at rest, wherever it looks") {
  CHECK(own_rest(at_rest(SmplJoint::left_shoulder, 0.8F, 0.012)) == 0);
  CHECK(own_rest(at_rest(SmplJoint::left_hand, 0.8F, 0.012)) == 1);  // fingers
  CHECK(own_rest(npt::BodyEstimate{}) == 0);
  npt::BodyEstimate aside = at_rest(SmplJoint::pelvis, 0, 0.012);
  aside.fit.body.axis_angles[1] = 2;
  CHECK(own_rest(aside) == 1);
  // The result looks where the pose does.
  const std::vector<float> pose(72, 0.0F);
  const npt::Vec3d front = rotation_of(from_own_rest(aside, pose), SmplJoint::pelvis) * npt::Vec3d{0, 0, 1};
  CHECK(front.z > 0.99);
}
