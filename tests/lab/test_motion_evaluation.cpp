#include <doctest/doctest.h>

#include <npt/base/affine.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/held_props.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/body/roles/nearest_roles.hpp>
#include <npt/lab/limb_penetration.hpp>
#include <npt/lab/motion_evaluation.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_mesh.hpp>

#include <body/roles/skeletons.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

/// Adds a box around a place, moved by a joint, as a node of its own.
void add_box(npt::MotionMesh& mesh, std::size_t joint, npt::Vec3d centre, npt::Vec3d half) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (int i = 0; i < 8; ++i) {
    const auto sign = [i](int bit) { return (i >> bit & 1) != 0 ? 1.0 : -1.0; };
    mesh.positions.push_back(centre + npt::Vec3d{half.x * sign(0), half.y * sign(1), half.z * sign(2)});
    mesh.influences.push_back({joint, 1});
    mesh.start.push_back(mesh.influences.size());
  }
  constexpr std::array<std::array<std::uint32_t, 3>, 12> faces{{{0, 2, 1},
                                                                {1, 2, 3},
                                                                {4, 5, 6},
                                                                {5, 7, 6},
                                                                {0, 1, 4},
                                                                {1, 5, 4},
                                                                {2, 6, 3},
                                                                {3, 6, 7},
                                                                {0, 4, 2},
                                                                {2, 4, 6},
                                                                {1, 3, 5},
                                                                {3, 7, 5}}};
  for (const auto& f : faces) mesh.triangles.push_back({f[0] + first, f[1] + first, f[2] + first});
  mesh.node.resize(mesh.positions.size(), mesh.node.empty() ? 0 : mesh.node.back() + 1);
  mesh.skinned[joint] = true;
}

}  // namespace

TEST_CASE("a motion against itself has no errors, and one that is moved has its own") {
  skeletons::Person person = skeletons::person(skeletons::dialects()[0]);
  skeletons::add_clip(person);
  const npt::JointRoles roles = npt::joint_roles(person.motion);
  const npt::MotionErrors same =
      npt::evaluate_motion({person.motion, roles}, {person.motion, roles}, &person.motion, nullptr);
  CHECK(same.joint_p95 < 1e-9);
  CHECK(same.truth_drawn_p95 < 1e-9);
  CHECK(same.slide == doctest::Approx(same.source_slide));
  CHECK(same.stretch < 1e-6);
  npt::Motion moved = person.motion;
  moved.base.shift = {0, 0, 0.1};
  const npt::MotionErrors off = npt::evaluate_motion({person.motion, roles}, {moved, roles}, &person.motion, nullptr);
  CHECK(off.joint_median == doctest::Approx(off.joint_p95));
  CHECK(off.joint_median > 0.05);
}

TEST_CASE("errors of several motions are those of all their joints, and slides count by the time of contact") {
  npt::MotionErrors a, b;
  a.joint_errors = {0.1, 0.2, 0.3}, a.slide = 1, a.contact_seconds = 3, a.sink = 2, a.penetration = 1;
  b.joint_errors = {0.4, 0.5}, b.slide = 5, b.contact_seconds = 1, b.sink = 1, b.penetration = 3;
  const std::array<npt::MotionErrors, 2> both{a, b};
  const npt::MotionErrors all = npt::pooled_errors(both);
  CHECK(all.joint_median == 0.3);
  CHECK(all.joint_errors.size() == 5);
  CHECK(all.slide == 2);
  CHECK(all.sink == 2);
  CHECK(all.penetration == 2);
  CHECK(npt::pooled_errors({}).slide == 0);
}

TEST_CASE("a ground truth that draws a shin out of its knee counts with the shin in its place") {
  skeletons::Person person = skeletons::person(skeletons::dialects()[0]);
  skeletons::add_clip(person);
  const npt::JointRoles roles = npt::joint_roles(person.motion);
  npt::Motion drawn = person.motion;
  const std::size_t shin = roles.joint(npt::LimbPart::lower_leg, 0);
  const npt::Vec3d away = drawn.joints[shin].rest.translation * 1.5;
  drawn.clip.channels.push_back({shin,
                                 npt::ChannelPath::translation,
                                 npt::Interpolation::linear,
                                 3,
                                 {0},
                                 {static_cast<float>(away.x), static_cast<float>(away.y), static_cast<float>(away.z)}});
  const npt::MotionErrors errors =
      npt::evaluate_motion({person.motion, roles}, {person.motion, roles}, &drawn, nullptr);
  CHECK(errors.joint_p95 < 1e-6);
  CHECK(errors.truth_drawn_p95 > 0.05);
}

TEST_CASE("a foot that slides while the source's stands, and one that sinks, are found") {
  skeletons::Person still = skeletons::person(skeletons::dialects()[0]);
  npt::ClipChannel shift{0,      npt::ChannelPath::translation, npt::Interpolation::linear, 3,
                         {0, 1}, {0, 0.95F, 0, 0, 0.95F, 0}};
  still.motion.clip.channels = {shift};
  npt::Motion slides = still.motion;
  slides.clip.channels[0].values[3] = 0.1F;   // 10 cm in a second
  slides.clip.channels[0].values[4] = 0.93F;  // and 2 cm down
  const npt::JointRoles roles = npt::joint_roles(still.motion);
  const npt::MotionErrors errors = npt::evaluate_motion({still.motion, roles}, {slides, roles}, nullptr, nullptr);
  CHECK(errors.source_slide == 0);
  CHECK(errors.slide == doctest::Approx(10).epsilon(0.03));
  CHECK(errors.sink == doctest::Approx(2).epsilon(0.05));
}

TEST_CASE("an arm inside the trunk is found, and its depth") {
  const skeletons::Person person = skeletons::person(skeletons::dialects()[0]);
  const npt::JointRoles roles = npt::joint_roles(person.motion);
  npt::MotionMesh mesh;
  mesh.skinned.resize(person.motion.joints.size());
  const std::size_t hips = roles.joint(npt::JointRole::hips), elbow = roles.joint(npt::LimbPart::lower_arm, 0);
  add_box(mesh, hips, {0, 1.2, 0}, {0.2, 0.3, 0.2});
  add_box(mesh, elbow, npt::bound_worlds(person.motion)[elbow].shift + npt::Vec3d{0.1, 0, 0}, {0.05, 0.02, 0.02});
  CHECK(npt::nearest_roles(person.motion, roles)[elbow] == npt::limb_role(npt::LimbPart::lower_arm, 0));
  npt::LimbPenetration depths(mesh, person.motion, roles);
  REQUIRE(depths.has_mesh());
  std::vector<npt::Affine> worlds = npt::bound_worlds(person.motion);
  depths.add(worlds);
  CHECK(depths.worst() == 0);
  worlds[elbow].shift = {-0.1, 1.2, 0};  // into the middle of the trunk
  depths.add(worlds);
  CHECK(depths.worst() == doctest::Approx(0.15).epsilon(0.01));
  CHECK(depths.mean() > 0.05);
}

TEST_CASE("what a hand holds is no part of the arm, but the stiff hand of a figure of stiff parts is") {
  const skeletons::Person person = skeletons::person(skeletons::dialects()[0]);
  const npt::JointRoles roles = npt::joint_roles(person.motion);
  const std::vector<npt::Affine> bound = npt::bound_worlds(person.motion);
  const std::size_t hips = roles.joint(npt::JointRole::hips), hand = roles.joint(npt::LimbPart::hand, 0),
                    elbow = roles.joint(npt::LimbPart::lower_arm, 0);
  npt::MotionMesh mesh;
  mesh.skinned.resize(person.motion.joints.size());
  add_box(mesh, hips, {0, 1.2, 0}, {0.2, 0.3, 0.2});
  add_box(mesh, elbow, bound[elbow].shift, {0.05, 0.02, 0.02});
  add_box(mesh, hand, bound[hand].shift, {0.02, 0.3, 0.02});
  const std::vector<npt::JointRole> nearest = npt::nearest_roles(person.motion, roles);
  CHECK(npt::held_props(mesh, nearest) == std::vector<bool>(24, false));
  std::fill(mesh.node.begin() + 8, mesh.node.begin() + 16, 7);
  mesh.influences[8].joint = hand;  // now the forearm's mesh bends
  std::vector<bool> sword(24, false);
  std::fill(sword.begin() + 16, sword.end(), true);
  CHECK(npt::held_props(mesh, nearest) == sword);
  std::vector<npt::Affine> worlds = bound;
  worlds[hand].shift = {0, 1.2, 0};
  npt::LimbPenetration depths(mesh, person.motion, roles);
  depths.add(worlds);
  CHECK(depths.worst() < 0.2);  // the one corner of the forearm
  CHECK(depths.mean() == doctest::Approx(depths.worst() / 8));
}
