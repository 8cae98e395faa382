#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/estimate/body_estimator.hpp>
#include <npt/lab/body_pairs.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimate/people.hpp"
#include "support/bumpy_sphere.hpp"

using people::Person;

namespace {

const npt::BodyEstimator& shipped_estimator() {
  static const npt::BodyEstimator reader(people::shipped_correspondences(), npt::people_kind());
  return reader;
}

/// A table: a body can be flattened to lie in it.
npt::BodyEstimate read_table() {
  std::vector<float> xyz;
  std::vector<npt::Triangle> faces;
  const auto add_box = [&](npt::Vec3f centre, npt::Vec3f half) {
    const auto first = static_cast<std::uint32_t>(xyz.size() / 3);
    for (int k = 0; k < 8; ++k)
      xyz.insert(xyz.end(), {centre.x + ((k & 4) != 0 ? half.x : -half.x), centre.y + ((k & 2) != 0 ? half.y : -half.y),
                             centre.z + ((k & 1) != 0 ? half.z : -half.z)});
    for (const auto& [a, b, c, d] :
         {std::array{0U, 1U, 3U, 2U}, std::array{4U, 6U, 7U, 5U}, std::array{0U, 4U, 5U, 1U},
          std::array{2U, 3U, 7U, 6U}, std::array{0U, 2U, 6U, 4U}, std::array{1U, 5U, 7U, 3U}}) {
      faces.push_back({first + a, first + b, first + c});
      faces.push_back({first + a, first + c, first + d});
    }
  };
  add_box({0, 0.72F, 0}, {0.6F, 0.03F, 0.4F});
  for (const float x : {-0.5F, 0.5F})
    for (const float z : {-0.3F, 0.3F}) add_box({x, 0.35F, z}, {0.04F, 0.35F, 0.04F});
  return shipped_estimator().read({xyz, faces, "table"});
}

/// Within so many metres of a mannequin's.
void expect_joints(const npt::BodyEstimate& reading, std::span<const float> betas, std::span<const float> pose,
                   double off) {
  npt::BodyFit truth;
  truth.betas.assign(betas.begin(), betas.end());
  truth.axis_angles.assign(pose.begin(), pose.end());
  const std::vector<npt::Vec3d> joints = npt::fitted_joints(shipped_estimator().body(), reading.fit.body),
                                expected = npt::fitted_joints(npt::mannequin(), truth);
  REQUIRE(joints.size() == expected.size());
  for (std::size_t j = 0; j < joints.size(); ++j)
    CHECK(length(joints[j] / reading.metres + reading.centre - expected[j]) < off);
}

}  // namespace

TEST_CASE("an upside-down person is read, and said to be") {
  Person a(3);
  a.pose = {};
  npt::Mesh mesh = npt::to_mesh(npt::mannequin(), a.betas, a.pose);
  for (npt::Vec3f& p : mesh.positions) p = {p.x, -p.y, -p.z};
  const npt::BodyEstimate reading =
      shipped_estimator().read({mesh.coordinates(), npt::mannequin().triangles(), "handstand"});
  CHECK(reading.confidence > 0.85);
  CHECK(reading.warnings(npt::people_plan()) == std::vector{npt::WarningCode::upside_down});
}

// As another unit or another program brings. Where rounding moved a few of the samples, one
// of three such results lay 3 to 6 mm elsewhere.
TEST_CASE("rounding of a mesh moves its estimate by no more than 0.1 mm") {
  for (const std::uint64_t seed : {3U, 5U, 9U, 22U, 42U}) {
    const Person person(seed);
    npt::Random random(seed, 1);
    npt::Mesh rounded = person.mesh;
    for (npt::Vec3f& p : rounded.positions)
      for (float* const x : {&p.x, &p.y, &p.z}) *x += static_cast<float>(1e-7 * random.normal());
    const auto& faces = npt::mannequin().triangles();
    const auto joints = [&](const npt::Mesh& mesh) {
      return npt::fitted_joints(shipped_estimator().body(),
                                shipped_estimator().read({mesh.coordinates(), faces, ""}).fit.body);
    };
    const std::vector<npt::Vec3d> one = joints(person.mesh), other = joints(rounded);
    REQUIRE(one.size() == other.size());
    double off = 0;
    for (std::size_t j = 0; j < one.size(); ++j) off = std::max(off, length(one[j] - other[j]));
    CAPTURE(seed);
    CHECK(off < 1e-4);  // 0.047 mm at most, in the median 0.0001
  }
}

TEST_CASE("arms that a fit leaves elsewhere are found by the search of limbs") {
  // With 8 starts an arm of each ended 0.25 m and more away, with a confidence of 1.
  for (const std::uint64_t number : {77U, 108U}) {
    npt::Random random(3, number);
    const std::vector<float> betas = npt::sample_shape(random, npt::mannequin().shape_count());
    const auto pose = npt::sample_pose(random, npt::PoseDistribution::wide);
    const npt::Mesh mesh = npt::to_mesh(npt::mannequin(), betas, pose);
    expect_joints(shipped_estimator().read({mesh.coordinates(), npt::mannequin().triangles(), "wide"}), betas, pose,
                  0.03);
  }
}

TEST_CASE("an arm in doubt is looked at from the front, though the whole is sure") {
  // Else the arms of this one end in each other's place: 0.2 m for the whole mesh in the mean.
  constexpr std::size_t number = 183;
  const std::vector<npt::BodyPair> pairs = npt::fresh_pairs(
      number + 1, 0, npt::mannequin().shape_count(), npt::ShapeDistribution::normal, npt::PoseDistribution::natural);
  const npt::EvaluationPair pair = npt::body_pairs(npt::borrowed(npt::mannequin()), pairs, "natural").pair(number);
  const npt::BodyEstimate reading = shipped_estimator().read({pair.pose, pair.pose_triangles, "natural"});
  CHECK(reading.confidence > 0.85);
  CHECK(reading.warnings(npt::people_plan()).empty());
  expect_joints(reading, pairs[number].pose_shape, pairs[number].pose, 0.05);
}

TEST_CASE("an arm whose pose no natural one is near reaches for what the body leaves uncovered") {
  // Else it ends elsewhere: 0.32 m for the whole mesh in the mean.
  constexpr std::size_t number = 152;
  const std::vector<npt::BodyPair> pairs = npt::fresh_pairs(
      number + 1, 2, npt::mannequin().shape_count(), npt::ShapeDistribution::normal, npt::PoseDistribution::natural);
  const npt::EvaluationPair pair = npt::body_pairs(npt::borrowed(npt::mannequin()), pairs, "natural", 2).pair(number);
  const npt::BodyEstimate reading = shipped_estimator().read({pair.identity, pair.identity_triangles, "natural"});
  CHECK(reading.warnings(npt::people_plan()).empty());
  expect_joints(reading, pairs[number].identity_shape, pairs[number].identity_pose, 0.05);
}

TEST_CASE("what is no person has low confidence") {
  const npt::Mesh ball = support::bumpy_sphere(20, 30, 0.2, true);
  const auto triangles = npt::triangulate(ball);
  CHECK(shipped_estimator().read({ball.coordinates(), triangles, "ball"}).confidence < 0.6);
  // It reads like a person, with too few vertices to be one.
  const std::vector<float> pyramid{0, 0, 0, 1, 0, 0, 0, 1.5F, 0, 0, 0, 1};
  const std::vector<npt::Triangle> sides{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  const npt::BodyEstimate few = shipped_estimator().read({pyramid, sides, "pyramid"});
  CHECK(few.confidence == 0);
  CHECK_THROWS_WITH_AS(npt::expect_body(few, "pyramid"), doctest::Contains("no body can lie"), npt::Error);
}

TEST_CASE("a table has low confidence") { CHECK(read_table().confidence < 0.1); }

TEST_CASE("the next frame goes on from the last one, and a jump is read anew") {
  const npt::BodyEstimator& reader = shipped_estimator();
  const Person a(1), b(4);
  const npt::BodyEstimate first = reader.read(a.view());
  Person next = a;
  for (std::size_t i = 3; i < 72; ++i) next.pose[i] += 0.02F;
  next.mesh = npt::to_mesh(npt::mannequin(), next.betas, next.pose);
  const npt::BodyEstimate second = reader.follow(next.view(), first);
  CHECK(second.confidence > 0.85);
  CHECK(second.fit.body.betas == first.fit.body.betas);
  CHECK(second.metres == first.metres);
  const npt::BodyEstimate jump = reader.follow(b.view(), first);
  CHECK(jump.confidence > 0.8);
}

TEST_CASE("a sequence that hardly reads goes on from the next frame that surely does, looked for less and less often") {
  const npt::BodyEstimator& reader = shipped_estimator();
  const Person person(3);
  npt::BodyEstimate misread = reader.read(person.view());
  REQUIRE(misread.confidence >= npt::high_confidence);
  misread.confidence = 0.7;
  const npt::BodyEstimate anew = reader.follow(person.view(), misread);
  CHECK(anew.confidence >= npt::high_confidence);
  CHECK(anew.followed == 0);
  misread.followed = 2;
  const npt::BodyEstimate third = reader.follow(person.view(), misread);
  CHECK(third.confidence < npt::high_confidence);
  CHECK(third.followed == 3);
  CHECK(reader.follow(person.view(), third).confidence >= npt::high_confidence);
}

TEST_CASE("several threads read what one does, bit for bit, where limbs are searched, too") {
  const npt::BodyEstimator two(people::shipped_correspondences(2), npt::people_kind());
  const Person doubtful(26);
  const npt::BodyEstimate one = shipped_estimator().read(doubtful.view());
  CHECK(two.read(doubtful.view()).fit.body.axis_angles == one.fit.body.axis_angles);
}

TEST_CASE("a mesh without an area is an error") {
  const std::vector<float> points{0, 0, 0, 1, 0, 0, 0, 1, 0};
  CHECK_THROWS_AS(shipped_estimator().read({points, {}, "points"}), npt::Error);
}
