#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/body/mannequin/finger_joints.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/body/proportions.hpp>
#include <npt/mesh/mesh.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace {

const npt::BodyModel& fingered_mannequin() {
  static const npt::BodyModel body = npt::with_finger_joints(npt::mannequin());
  return body;
}

constexpr npt::HandBend a_fist{.knuckles = 0.9, .middle = {1.5, 1.5, 1.5, 1.5}};
const std::vector<float> straight(3 * npt::smpl_joint_count, 0.0F);

}  // namespace

TEST_CASE("finger joints hang on the hands, two on each finger, between knuckles and tips") {
  const npt::BodyModel& body = fingered_mannequin();
  REQUIRE(body.joint_count() == npt::fingered_joint_count);
  const std::vector<npt::Vec3d> joints = body.joints({});
  for (std::size_t side = 0; side < 2; ++side) {
    const double sign = side == 0 ? 1 : -1;
    const std::size_t hand = joint_index(npt::SmplJoint::left_hand) + side;
    for (std::size_t f = 0; f < npt::finger_count; ++f) {
      const std::size_t middle = npt::middle_finger_joint(side, f);
      CHECK(body.tables().parents[middle] == static_cast<int>(hand));
      CHECK(body.tables().parents[middle + 1] == static_cast<int>(middle));
      CHECK(sign * joints[middle].x > sign * joints[hand].x);
      CHECK(sign * joints[middle + 1].x > sign * joints[middle].x + 0.015);
      if (f > 0) CHECK(joints[middle].z < joints[middle - 2].z - 0.01);  // the index finger is in front
    }
  }
}

TEST_CASE("with straight fingers the body is as without their joints, in any shape and pose") {
  const npt::BodyModel characters = npt::with_proportions(npt::mannequin());
  const npt::BodyModel body = npt::with_finger_joints(characters);
  npt::Random random(3);
  for (int i = 0; i < 3; ++i) {
    const std::vector<float> betas = npt::sample_character(random, npt::mannequin().shape_count());
    const auto pose = npt::sample_pose(random);
    const npt::Mesh without = npt::to_mesh(characters, betas, pose);
    const npt::Mesh with = npt::to_mesh(body, betas, npt::with_fingers(pose, {}));
    float worst = 0;
    for (std::size_t v = 0; v < with.vertex_count(); ++v)
      worst = std::max(worst, length(with.positions[v] - without.positions[v]));
    CHECK(worst < 1e-5F);
  }
}

TEST_CASE("a fist brings the fingertips to the palm and leaves thumb, wrist and the other hand") {
  const npt::BodyModel& body = fingered_mannequin();
  const npt::Mesh open = npt::to_mesh(body, {}, npt::with_fingers(straight, {}));
  for (std::size_t side = 0; side < 2; ++side) {
    std::array<npt::HandBend, 2> hands;
    hands[side] = a_fist;
    const npt::Mesh closed = npt::to_mesh(body, {}, npt::with_fingers(straight, hands));
    const float sign = side == 0 ? 1 : -1;
    float reach_open = 0, reach_closed = 0;
    for (std::size_t v = 0; v < open.vertex_count(); ++v) {
      const npt::Vec3f from = open.positions[v], to = closed.positions[v];
      reach_open = std::max(reach_open, sign * from.x), reach_closed = std::max(reach_closed, sign * to.x);
      if (sign * from.x > 0.88F) {
        CHECK(sign * to.x < 0.84F);
        CHECK(to.y < from.y - 0.01F);  // palms look down
      }
      if (sign * from.x < 0.765F || from.z > 0.07F) CHECK(length(to - from) < 1e-6F);
    }
    CHECK(reach_open - reach_closed > 0.04F);
  }
}

TEST_CASE("a finger bends by itself, its end joint by two thirds of the middle one's angle") {
  std::array<npt::HandBend, 2> hands;
  hands[1].middle[2] = 0.9;
  const std::vector<float> angles = npt::with_fingers(straight, hands);
  for (std::size_t j = npt::smpl_joint_count; j < npt::fingered_joint_count; ++j) {
    const double angle = length(npt::Vec3f{angles[3 * j], angles[3 * j + 1], angles[3 * j + 2]}.as<double>());
    const std::size_t middle = npt::middle_finger_joint(1, 2);
    CHECK(angle == doctest::Approx(j == middle ? 0.9 : j == middle + 1 ? 0.6 : 0));
  }
}
