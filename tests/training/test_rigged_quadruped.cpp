#include <doctest/doctest.h>

#include <npt/base/rotation.hpp>
#include <npt/io/gltf.hpp>
#include <npt/lab/rig/rig.hpp>
#include <training/body_from_rig.hpp>
#include <training/quadruped_joints.hpp>
#include <training/quadruped_names.hpp>
#include <training/rig_agreement.hpp>
#include <training/rigged_quadruped.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "support/needs.hpp"
#include "training/quadruped_figure.hpp"

namespace {

npt::Rig rig_of(const quadruped::SceneOptions& options = {}) {
  return npt::make_rig(quadruped::scene(options), "animal.glb");
}

npt::PlannedBody made_of(const npt::Rig& rig, double frame_rate = 0) {
  return npt::rigged_quadruped(rig, quadruped::body(), quadruped::plan(), {.frame_rate = frame_rate});
}

std::string message_of(npt::Scene scene) {
  try {
    made_of(npt::make_rig(std::move(scene), "animal.glb"));
  } catch (const npt::Error& error) {
    return error.what();
  }
  return "no error";
}

npt::Vec3d place(const std::vector<float>& xyz, std::size_t v) {
  return npt::Vec3f{xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]}.as<double>();
}

/// The median and the share within 8 cm of the distances between places and where the template's vertices are, in
/// order.
std::pair<double, double> distances(const npt::PlannedBody& made) {
  const npt::BodyModel model = quadruped::body();
  std::vector<double> far;
  double near = 0;
  for (std::size_t v = 0; v < model.vertex_count(); ++v) {
    far.push_back(length(place(made.canonical, v) - place(model.tables().v_template, v)));
    if (far.back() < 0.08) ++near;
  }
  std::ranges::sort(far);
  return {far[far.size() / 2], near / static_cast<double>(far.size())};
}

std::size_t joint(const char* name) { return quadruped::plan().joint(name); }

void check_is_template(const npt::PlannedBody& made, double tolerance) {
  const std::vector<npt::Vec3d> own = made.body->joints({}), model = quadruped::body().joints({});
  for (std::size_t j = 0; j < own.size(); ++j) {
    INFO(quadruped::plan().joints[j].name);
    CHECK(length(own[j] - model[j]) < tolerance);
  }
  const auto [median, near] = distances(made);
  CHECK(median < 0.01);
  CHECK(near > 0.97);
}

std::vector<float> stretched_out() {
  std::vector<float> pose(3 * quadruped::plan().joint_count());
  pose[3 * joint("l_shoulder")] = -0.7F, pose[3 * joint("l_wrist")] = 0.5F, pose[3 * joint("r_hip")] = 0.6F;
  pose[3 * joint("neck1")] = 0.4F, pose[3 * joint("head") + 1] = 0.3F, pose[3 * joint("tail1") + 1] = 0.5F;
  return pose;
}

}  // namespace

TEST_CASE("the template with a rig is the template again, whichever way the rig lies and whatever its size") {
  check_is_template(made_of(rig_of()), 0.01);
  check_is_template(made_of(rig_of({.turn = npt::rotation_matrix(npt::Vec3d{0, std::numbers::pi / 2, 0}), .scale = 7})),
                    0.01);
  check_is_template(made_of(rig_of({.loose_feet = true})), 0.01);
}

TEST_CASE("joints without names are found by shape") {
  const npt::Rig rig = rig_of({.names = false});
  const npt::QuadrupedJoints found = npt::quadruped_joints(rig);
  CHECK(rig.joint_name(found.tail.back()) == "Bone." + std::to_string(joint("tail5")));
  CHECK(rig.joint_name(found.legs[0].back()) == "Bone." + std::to_string(joint("l_forefoot")));
  CHECK(rig.joint_name(found.legs[3].back()) == "Bone." + std::to_string(joint("r_hindfoot")));
  CHECK(std::ranges::count_if(found.neck, [&](std::size_t r) {
          return rig.joint_name(r) == "Bone." + std::to_string(joint("neck1"));
        }) == 1);
}

TEST_CASE("clips become angles of the plan's joints, seen from where the animal looks") {
  const std::vector<float> rest(3 * quadruped::plan().joint_count()), pose = stretched_out();
  const npt::Rig rig =
      rig_of({.turn = npt::rotation_matrix(npt::Vec3d{0, -std::numbers::pi / 2, 0}), .clip = {rest, pose}});
  const npt::PlannedBody made = made_of(rig, 1);
  REQUIRE(made.clips.size() == 1);
  REQUIRE(made.clips[0].size() == 2);
  for (std::size_t j = 0; j < quadruped::plan().joint_count(); ++j) {
    INFO(quadruped::plan().joints[j].name);
    if (quadruped::plan().joints[j].kind == npt::JointKind::spine) continue;  // neighbours share the trunk's vertices
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(std::abs(made.clips[0][0][3 * j + k]) < 0.02F);
      CHECK(std::abs(made.clips[0][1][3 * j + k] - pose[3 * j + k]) < 0.06F);
    }
  }
  const npt::RigAgreement agreement = npt::rig_agreement(rig, made, 1);
  CHECK(agreement.frames == 2);
  CHECK(agreement.worst < 0.01);
}

TEST_CASE("what a rig lacks lies where the template has it, and its neighbours move with the rig") {
  const std::vector<float> rest(3 * quadruped::plan().joint_count());
  const npt::Rig rig = rig_of({.without = {"neck2", "neck3", "jaw", "l_ear", "r_ear", "l_elbow", "r_elbow", "tail2",
                                           "tail4", "l_scapula", "r_scapula", "spine2"},
                               .clip = {rest, stretched_out()}});
  const npt::PlannedBody made = made_of(rig, 1);
  const std::vector<npt::Vec3d> own = made.body->joints({}), model = quadruped::body().joints({});
  for (const char* name : {"l_elbow", "r_elbow", "neck2", "neck3", "tail2", "l_scapula", "l_ear", "spine2"}) {
    INFO(name);
    CHECK(length(own[joint(name)] - model[joint(name)]) < 0.05);
  }
  CHECK(distances(made).second > 0.9);
  CHECK(npt::rig_agreement(rig, made, 1).worst < 0.02);
  CHECK_FALSE(made.turned[joint("jaw")]);
  CHECK(made.turned[joint("l_elbow")]);
}

TEST_CASE("a rig that is no four-legged animal's says why") {
  npt::Scene good = quadruped::scene();
  CHECK(message_of(good) == "no error");
  npt::Scene scene = good;
  for (npt::SceneNode& n : scene.nodes)
    if (n.name == "head") n.name = "Wheel";
  // Names that tell no head: by shape, it still has one.
  CHECK(message_of(scene) == "no error");
  CHECK(message_of(quadruped::scene({.names = false, .without = {"l_hindfoot", "l_hock", "l_knee", "l_hip"}}))
            .find("animal.glb: found 3 branches of joints that reach the ground") == 0);
  CHECK(message_of(quadruped::scene({.without = {"l_hindfoot", "l_hock", "l_knee"}}))
            .find("animal.glb: found 1 joints of the left hind leg") == 0);
  scene = good;
  scene.nodes[scene.shown[0]].skin = npt::no_item;
  CHECK(message_of(scene).find("animal.glb: found no mesh with a skin") == 0);
  CHECK_THROWS_WITH_AS(
      npt::rigged_quadruped(rig_of(), quadruped::body(), npt::read_body_plan("joint a - a x root a 1 1", "p")),
      "plan: found 1 joints, expected 35, as the body has", npt::Error);
}

TEST_CASE("a template whose forelegs end above the floor is of animals that walk on two legs") {
  const npt::BodyModel two_legged = quadruped::body(0.4);
  const auto made_from = [&](double forelegs, const npt::BodyModel& model) {
    return npt::rigged_quadruped(rig_of({.forelegs = forelegs}), model, quadruped::plan());
  };
  const std::vector<npt::Vec3d> own = made_from(0.4, two_legged).body->joints({}), model = two_legged.joints({});
  for (std::size_t j = 0; j < own.size(); ++j) {
    INFO(quadruped::plan().joints[j].name);
    CHECK(length(own[j] - model[j]) < 0.01);
  }
  CHECK_THROWS_WITH_AS(made_from(1, two_legged),
                       "animal.glb: found a left foreleg that ends 0 % of the height above the ground, expected arms "
                       "that end above it, of an animal that walks on two legs",
                       npt::Error);
  CHECK_THROWS_AS(made_from(0.4, quadruped::body()), npt::Error);
}

TEST_CASE("the rigged animals at hand follow their own clips" * support::needs_shared("data/glb")) {
  for (const char* name : {"Horse.glb", "Fox.glb", "Cow.glb"}) {
    INFO(name);
    const std::filesystem::path path = std::filesystem::path(NPT_SHARED) / "data/glb" / name;
    const npt::Rig rig = npt::make_rig(npt::read_scene(path), name);
    const npt::PlannedBody made = made_of(rig, 3);
    CHECK(npt::rig_agreement(rig, made, 3).mean < 0.03);
    // Sides are the template's.
    double same = 0, count = 0;
    for (std::size_t v = 0; v < made.body->vertex_count(); ++v) {
      const double x = static_cast<double>(made.body->tables().v_template[3 * v]);
      if (std::abs(x) > 0.03) ++count, same += x * static_cast<double>(made.canonical[3 * v]) > 0 ? 1 : 0;
    }
    CHECK(same > 0.95 * count);
  }
}
