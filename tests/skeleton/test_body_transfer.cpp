#include <doctest/doctest.h>

#include <npt/body/natural_poses.hpp>
#include <npt/mannequin/finger_joints.hpp>
#include <npt/mannequin/mannequin.hpp>
#include <npt/mesh/metrics.hpp>
#include <npt/skeleton/body_transfer.hpp>
#include <npt/skeleton/joint_names.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <vector>

#include "support/bumpy_sphere.hpp"

namespace {

const npt::BodyTransfer& shipped_body_transfer() {
  static const npt::BodyTransfer transfer(
      npt::Reader::open(std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights/readers/human.safetensors", 1));
  return transfer;
}

struct Person {
  std::vector<float> betas;
  std::array<float, 72> pose{};
  npt::Mesh mesh;

  explicit Person(std::uint64_t seed) {
    npt::Random random(811, seed);
    pose = npt::natural_poses().sample(random);
    betas = npt::sample_shape(random, npt::mannequin().shape_count());
    mesh = npt::to_mesh(npt::mannequin(), betas, pose);
  }
  npt::MeshView view() const { return {mesh.coordinates(), npt::mannequin().triangles(), "person"}; }
};

/// Mean squared distance, both centred by their means.
double error_of(std::span<const float> a, std::span<const float> b) {
  npt::Vec3d shift;
  const std::size_t n = a.size() / 3;
  const auto at = [](std::span<const float> x, std::size_t v) {
    return npt::Vec3f{x[3 * v], x[3 * v + 1], x[3 * v + 2]}.as<double>();
  };
  for (std::size_t v = 0; v < n; ++v) shift += (at(a, v) - at(b, v)) / static_cast<double>(n);
  double sum = 0;
  for (std::size_t v = 0; v < n; ++v) {
    const npt::Vec3d d = at(a, v) - at(b, v) - shift;
    sum += dot(d, d) / static_cast<double>(n);
  }
  return sum;
}

/// A table as it is read: a body can be flattened to lie in it.
npt::BodyReading read_new_table() {
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
  return shipped_body_transfer().read({xyz, faces, "table"});
}

const npt::BodyReading& read_table() {
  static const npt::BodyReading reading = read_new_table();
  return reading;
}

}  // namespace

TEST_CASE("a person takes another's natural pose to 3 cm, whatever direction both look in") {
  const npt::BodyTransfer& transfer = shipped_body_transfer();
  const Person a(1), b(2);
  const npt::BoundCharacter character = transfer.bind(a.view());
  const npt::BodyReading reading = transfer.read(b.view());
  CHECK(character.reading.trust() > 0.85);
  CHECK(reading.trust() > 0.85);
  std::vector<float> result(a.mesh.coordinates().size());
  transfer.pose(character, reading, result);
  const npt::Mesh truth = npt::to_mesh(npt::mannequin(), a.betas, b.pose);
  CHECK(error_of(result, truth.coordinates()) < 9e-4);

  // In another unit and place.
  npt::Mesh far = b.mesh;
  for (npt::Vec3f& p : far.positions) p = p * 100.0F + npt::Vec3f{512, 0, -256};
  const npt::BodyReading other = transfer.read({far.coordinates(), npt::mannequin().triangles(), "far"});
  CHECK(other.metres == doctest::Approx(reading.metres / 100).epsilon(1e-4));
  CHECK(other.trust() == doctest::Approx(reading.trust()).epsilon(0.05));
}

TEST_CASE("a skeleton's motions, blended by all weights, are the pose; its joints lie in the mesh and have names") {
  const npt::BodyTransfer& transfer = shipped_body_transfer();
  Person a(4), b(5);
  for (npt::Vec3f& p : a.mesh.positions) p = p * 100.0F + npt::Vec3f{7, -30, 2};
  const npt::BoundCharacter character = transfer.bind(a.view());
  const npt::BodyReading reading = transfer.read(b.view());
  std::vector<float> result(a.mesh.coordinates().size());
  transfer.pose(character, reading, result);
  const npt::SkinnedSkeleton skeleton = transfer.skeleton(character, npt::JointNames::mixamo);
  const std::vector<npt::Affine> motions = transfer.motions(character, reading);
  REQUIRE(skeleton.joint_count() == npt::fingered_joint_count);
  CHECK(skeleton.names[0] == "mixamorig:Hips");
  CHECK(transfer.skeleton(character).names[15] == npt::joint_name(15, npt::JointNames::vrm));
  CHECK(npt::joint_name(20, npt::JointNames::smpl) == "l_wrist");
  CHECK(npt::joint_name(npt::middle_finger_joint(0, 0), npt::JointNames::vrm) == "leftIndexIntermediate");
  CHECK(npt::joint_name(npt::middle_finger_joint(1, 3) + 1, npt::JointNames::mixamo) == "mixamorig:RightHandPinky3");
  CHECK(npt::joint_name(npt::middle_finger_joint(1, 0), npt::JointNames::smpl) == "r_index_middle");
  double worst = 0;
  for (std::size_t v = 0; v < a.mesh.vertex_count(); ++v) {
    npt::Vec3d sum;
    for (std::size_t i = skeleton.start[v]; i < skeleton.start[v + 1]; ++i)
      sum += motions[skeleton.influences[i].joint](a.mesh.positions[v].as<double>()) *
             static_cast<double>(skeleton.influences[i].weight);
    worst = std::max(worst, length(sum - npt::Vec3f{result[3 * v], result[3 * v + 1], result[3 * v + 2]}.as<double>()));
  }
  CHECK(worst < 1e-3);  // of 170
  // A child's joint moves the same with its parent, so that a rotation says all of a joint.
  for (std::size_t j = 1; j < skeleton.joint_count(); ++j)
    CHECK(length(motions[j](skeleton.joints[j]) - motions[skeleton.parents[j]](skeleton.joints[j])) < 1e-6);
}

TEST_CASE("an open hand closes to the pose's fist, and a fist opens") {
  const npt::BodyTransfer& transfer = shipped_body_transfer();
  const npt::BodyModel body = npt::with_finger_joints(npt::mannequin());
  constexpr npt::HandBend fist{.knuckles = 0.7, .middle = {1.4, 1.4, 1.4, 1.4}};
  const Person a(4), b(5);
  const auto mesh_of = [&](const Person& p, const std::array<float, 72>& pose, const npt::HandBend& right) {
    return npt::to_mesh(body, p.betas, npt::with_fingers(pose, {npt::HandBend{}, right}));
  };
  // The right fingers' ends, beyond the wrist.
  const auto fingertip_error = [&](std::span<const float> result, const npt::Mesh& truth) {
    npt::Vec3d shift;
    double sum = 0, count = 0;
    const auto of = [&](std::size_t joint, const auto& use) {
      for (std::size_t v = 0; v < body.vertex_count(); ++v)
        for (std::size_t i = body.tables().weights.start[v]; i < body.tables().weights.start[v + 1]; ++i)
          if (body.tables().weights.column[i] == joint && body.tables().weights.value[i] > 0.99F)
            use(npt::Vec3f{result[3 * v], result[3 * v + 1], result[3 * v + 2]}.as<double>() -
                truth.positions[v].as<double>());
    };
    of(joint_index(npt::SmplJoint::right_wrist), [&](npt::Vec3d d) { shift += d, ++count; });
    shift = shift / count;
    count = 0;
    for (std::size_t f = 0; f < npt::finger_count; ++f)
      of(npt::middle_finger_joint(1, f) + 1, [&](npt::Vec3d d) { sum += length(d - shift), ++count; });
    return sum / count;
  };
  for (const bool closes : {true, false}) {
    const npt::Mesh identity = mesh_of(a, a.pose, closes ? npt::HandBend{} : fist);
    const npt::Mesh pose = mesh_of(b, b.pose, closes ? fist : npt::HandBend{});
    const npt::Mesh truth = mesh_of(a, b.pose, closes ? fist : npt::HandBend{});
    const npt::Mesh rigid = mesh_of(a, b.pose, closes ? npt::HandBend{} : fist);
    const auto view = [](const npt::Mesh& m) {
      return npt::MeshView{m.coordinates(), npt::mannequin().triangles(), "person"};
    };
    std::vector<float> result(identity.coordinates().size());
    transfer.pose(transfer.bind(view(identity)), transfer.read(view(pose)), result);
    CHECK(fingertip_error(result, truth) < 0.55 * fingertip_error(rigid.coordinates(), truth));  // 39, 47 of 91 mm
  }
}

TEST_CASE("an upside-down person is read, and said to be") {
  Person a(3);
  a.pose = {};
  npt::Mesh mesh = npt::to_mesh(npt::mannequin(), a.betas, a.pose);
  for (npt::Vec3f& p : mesh.positions) p = {p.x, -p.y, -p.z};
  const npt::BodyReading reading =
      shipped_body_transfer().read({mesh.coordinates(), npt::mannequin().triangles(), "handstand"});
  CHECK(reading.trust() > 0.85);
  CHECK(reading.notes().find("upside down") != std::string::npos);
}

TEST_CASE("what is no person isn't trusted") {
  const npt::Mesh ball = support::bumpy_sphere(20, 30, 0.2, true);
  const auto triangles = npt::triangulate(ball);
  CHECK(shipped_body_transfer().read({ball.coordinates(), triangles, "ball"}).trust() < 0.6);
  // It reads like a person, with too few vertices to be one.
  const std::vector<float> pyramid{0, 0, 0, 1, 0, 0, 0, 1.5F, 0, 0, 0, 1};
  const std::vector<npt::Triangle> sides{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  const npt::BodyReading few = shipped_body_transfer().read({pyramid, sides, "pyramid"});
  CHECK(few.trust() == 0);
  CHECK_THROWS_WITH_AS(shipped_body_transfer().joints(few), doctest::Contains("no body can lie"), npt::Error);
}

TEST_CASE("a table that is taken for a person is said to have no person's proportions") {
  CHECK(read_table().notes().find("proportions") != std::string::npos);
}

TEST_CASE("a table isn't trusted") { CHECK(read_table().trust() < 0.6); }

TEST_CASE("trust: distance counts less where the reader tells people, shapes that nobody has count against") {
  npt::BodyReading reading;
  CHECK(reading.trust() == 0);
  reading.fit.body.axis_angles.assign(72, 0.0F);
  reading.fit.body.betas.assign(26, 1.0F);
  reading.fit.mesh_explained = reading.fit.body_explained = 0.9;
  reading.fit.reading_residual = 0.08;
  reading.fit.relative_distance = 0.005;
  CHECK(reading.trust() == doctest::Approx(0.9));
  reading.fit.relative_distance = 0.0165;  // a robot
  CHECK(reading.trust() == doctest::Approx(0.9 * 0.35));
  reading.told = true;
  CHECK(reading.trust() > 0.6);
  CHECK(reading.trust() < 0.85);
  reading.fit.reading_residual = 0.18;  // and its parts don't agree
  CHECK(reading.trust() < 0.6);
  reading.fit.reading_residual = 0.08;
  reading.disagreement = 0.06;  // nor what is read from several sides
  CHECK(reading.trust() < 0.6);
  reading.fit.mesh_explained = reading.fit.body_explained = 0.98;  // but the body lies in it
  CHECK(reading.trust() > 0.6);
  reading.fit.mesh_explained = reading.fit.body_explained = 0.9;
  reading.disagreement = 0;
  reading.fit.relative_distance = 0.005;
  CHECK(reading.notes().empty());
  reading.fit.body.betas.assign(26, 4.5F);
  CHECK(reading.trust() > 0.85);
  CHECK(reading.notes() == "its proportions are no person's");
  reading.fit.body.betas.assign(26, 8.0F);
  CHECK(reading.trust() == 0);
}

TEST_CASE("the next frame goes on from the last one, and a jump is read anew") {
  const npt::BodyTransfer& transfer = shipped_body_transfer();
  const Person a(1), b(4);
  const npt::BodyReading first = transfer.read(a.view());
  Person next = a;
  for (std::size_t i = 3; i < 72; ++i) next.pose[i] += 0.02F;
  next.mesh = npt::to_mesh(npt::mannequin(), next.betas, next.pose);
  const npt::BodyReading second = transfer.follow(next.view(), first);
  CHECK(second.trust() > 0.85);
  CHECK(second.fit.body.betas == first.fit.body.betas);
  CHECK(second.metres == first.metres);
  const npt::BodyReading jump = transfer.follow(b.view(), first);
  CHECK(jump.trust() > 0.8);
}

TEST_CASE("a mesh without an area, and results of another size, are errors") {
  const npt::BodyTransfer& transfer = shipped_body_transfer();
  const std::vector<float> points{0, 0, 0, 1, 0, 0, 0, 1, 0};
  CHECK_THROWS_AS(transfer.read({points, {}, "points"}), npt::Error);
  const Person a(1);
  const npt::BoundCharacter character = transfer.bind(a.view());
  std::vector<float> small(9);
  CHECK_THROWS_AS(transfer.pose(character, character.reading, small), npt::Error);
}
