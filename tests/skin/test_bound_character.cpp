#include <doctest/doctest.h>

#include <npt/body/joint_names.hpp>
#include <npt/body/mannequin/finger_joints.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/skin/bound_character.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "estimate/people.hpp"

using people::Person;

namespace {

const people::Bodies& bodies() {
  static const people::Bodies shipped;
  return shipped;
}

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

}  // namespace

TEST_CASE("a person takes another's natural pose to 3 cm, whatever direction both look in") {
  const people::Bodies& transfer = bodies();
  const Person a(1), b(2);  // 21, 19 of 88 mm remain; of the slower 4 and 5, 39, 47 of 91
  const npt::BoundCharacter character = transfer.bind(a.view());
  const npt::BodyEstimate reading = transfer.read(b.view());
  CHECK(character.estimate.confidence > 0.85);
  CHECK(reading.confidence > 0.85);
  std::vector<float> result(a.mesh.coordinates().size());
  transfer.pose(character, reading, result);
  const npt::Mesh truth = npt::to_mesh(npt::mannequin(), a.betas, b.pose);
  CHECK(error_of(result, truth.coordinates()) < 9e-4);

  // In another unit and place.
  npt::Mesh far = b.mesh;
  for (npt::Vec3f& p : far.positions) p = p * 100.0F + npt::Vec3f{512, 0, -256};
  const npt::BodyEstimate other = transfer.read({far.coordinates(), npt::mannequin().triangles(), "far"});
  CHECK(other.metres == doctest::Approx(reading.metres / 100).epsilon(1e-4));
  CHECK(other.confidence == doctest::Approx(reading.confidence).epsilon(0.05));
}

TEST_CASE("a skeleton's motions, blended by all weights, are the pose; its joints lie in the mesh and have names") {
  const people::Bodies& transfer = bodies();
  Person a(4), b(5);
  for (npt::Vec3f& p : a.mesh.positions) p = p * 100.0F + npt::Vec3f{7, -30, 2};
  const npt::BoundCharacter character = transfer.bind(a.view());
  const npt::BodyEstimate reading = transfer.read(b.view());
  std::vector<float> result(a.mesh.coordinates().size());
  transfer.pose(character, reading, result);
  const npt::SkinnedSkeleton skeleton = character.skeleton(transfer.kind());
  const std::vector<npt::Affine> motions = character.motions_in_place(
      transfer.kind(), character.angles(transfer.kind(), reading.fit.body.axis_angles, reading));
  REQUIRE(skeleton.joint_count() == npt::fingered_joint_count);
  CHECK(skeleton.names[15] == npt::joint_name(15, npt::JointNames::vrm));
  CHECK(npt::joint_name(0, npt::JointNames::mixamo) == "mixamorig:Hips");
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
  const people::Bodies& transfer = bodies();
  const npt::BodyModel body = npt::with_finger_joints(npt::mannequin());
  constexpr npt::HandBend fist{.knuckles = 0.7, .middle = {1.4, 1.4, 1.4, 1.4}};
  const Person a(1), b(2);  // at most 33 of 88 mm remain; of the slower 4 and 5, 39, 47 of 91
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
    CHECK(fingertip_error(result, truth) < 0.4 * fingertip_error(rigid.coordinates(), truth));
  }
}

TEST_CASE("results of another size, and meshes in which no body lies, are errors") {
  const people::Bodies& transfer = bodies();
  const Person a(1);
  const npt::BoundCharacter character = transfer.bind(a.view());
  std::vector<float> small(9), result(a.mesh.coordinates().size());
  CHECK_THROWS_AS(transfer.pose(character, character.estimate, small), npt::Error);
  CHECK_THROWS_WITH_AS(transfer.pose(character, npt::BodyEstimate{}, result), doctest::Contains("no body can lie"),
                       npt::Error);
}
