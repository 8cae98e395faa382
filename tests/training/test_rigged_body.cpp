#include <doctest/doctest.h>

#include <npt/lab/rig/rig.hpp>
#include <training/canonical_places.hpp>
#include <training/clip_poses.hpp>
#include <training/joint_regression.hpp>
#include <training/rest_surface.hpp>
#include <training/rigged_body.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "lab/rig/rigged_figure.hpp"

namespace {

using enum npt::SmplJoint;

std::string message_of_body(npt::Scene scene) {
  try {
    npt::rigged_body(npt::make_rig(std::move(scene), "figure.glb"));
  } catch (const npt::Error& error) {
    return error.what();
  }
  return "no error";
}

npt::SceneNode& node(npt::Scene& scene, const std::string& name) {
  return *std::ranges::find(scene.nodes, name, &npt::SceneNode::name);
}

/// The median distance in metres between places and where the mannequin's vertices are, in order.
double median_distance(const npt::RiggedBody& body, const std::vector<std::uint32_t>& vertex_of) {
  std::vector<double> distances;
  const std::vector<float>& rest = npt::mannequin().tables().v_template;
  for (std::size_t i = 0; i < vertex_of.size(); ++i) {
    double square = 0;
    for (std::size_t k = 0; k < 3; ++k)
      square += std::pow(static_cast<double>(body.canonical[3 * i + k] - rest[3 * std::size_t{vertex_of[i]} + k]), 2);
    distances.push_back(std::sqrt(square));
  }
  std::ranges::nth_element(distances, distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2));
  return distances[distances.size() / 2];
}

}  // namespace

TEST_CASE("the mannequin with a rig is a body again: its joints, its places, its clips' angles") {
  const rigged::Angles kick = rigged::turned(left_hip, -0.8F, 0, 0, rigged::turned(right_elbow, 0, 0.9F, 0));
  npt::Scene scene = rigged::figure({}, {{{}, kick, kick}});
  const npt::Rig rig = npt::make_rig(scene, "figure.glb");
  const npt::RiggedBody body = npt::rigged_body(rig, {.frame_rate = 1});
  REQUIRE(body.body->vertex_count() == npt::mannequin().vertex_count());
  std::vector<std::uint32_t> vertex_of(body.body->vertex_count());
  for (std::uint32_t v = 0; v < vertex_of.size(); ++v) vertex_of[v] = v;
  CHECK(median_distance(body, vertex_of) < 0.01);
  const std::vector<npt::Vec3d> joints = body.body->joints({}), own = npt::mannequin().joints({});
  for (const npt::SmplJoint joint : {left_knee, right_ankle, left_elbow, right_wrist, head})
    CHECK(npt::length((joints[npt::joint_index(joint)] - joints[0]) - (own[npt::joint_index(joint)] - own[0])) < 0.03);
  REQUIRE(body.clips.size() == 1);
  REQUIRE(body.clips[0].size() == 3);
  for (const npt::SmplJoint joint : {left_hip, right_elbow, left_knee, right_shoulder, pelvis})
    for (std::size_t k = 0; k < 3; ++k)
      CHECK(body.clips[0][2][3 * npt::joint_index(joint) + k] ==
            doctest::Approx(kick[3 * npt::joint_index(joint) + k]).epsilon(0.02));
  npt::ClipPoses<std::array<float, 3 * npt::smpl_joint_count>> clips;
  CHECK(clips.empty());
  clips.add(body.clips);
  npt::Random a(5), b(5);
  CHECK(clips.sample(a) == clips.sample(b));
}

TEST_CASE("arms that hang in the bind pose come up, large faces are halved") {
  const rigged::Angles hanging = rigged::turned(left_shoulder, 0, 0, -0.9F, rigged::turned(right_shoulder, 0, 0, 0.9F));
  const npt::Rig rig = npt::make_rig(rigged::figure(hanging), "figure.glb");
  const npt::RiggedBody body = npt::rigged_body(rig, {.longest_edge = 0.03});
  CHECK(body.clips.empty());
  CHECK(body.body->vertex_count() > rig.positions.size());
  std::vector<std::uint32_t> vertex_of(rig.positions.size());
  for (std::uint32_t v = 0; v < vertex_of.size(); ++v) vertex_of[v] = v;
  CHECK(median_distance(body, vertex_of) < 0.015);
  const std::vector<npt::Vec3d> joints = body.body->joints({});
  CHECK(std::abs(joints[npt::joint_index(left_wrist)].y - joints[npt::joint_index(left_shoulder)].y) < 0.05);
  for (const npt::Triangle& t : body.body->triangles())
    for (std::size_t k = 0; k < 3; ++k)
      REQUIRE(npt::length(npt::Vec3f{body.canonical[3 * std::size_t{t[k]}], body.canonical[3 * std::size_t{t[k]} + 1],
                                     body.canonical[3 * std::size_t{t[k]} + 2]}) < 1.5F);
}

TEST_CASE("a rig that is no person's says which joint is at fault") {
  const npt::Scene good = rigged::figure();
  CHECK(message_of_body(good) == "no error");
  npt::Scene scene = good;
  scene.nodes[scene.shown[0]].skin = npt::no_item;
  CHECK(message_of_body(scene).find("figure.glb: found no mesh with a skin, expected a rigged character") == 0);
  scene = good;
  node(scene, "LowerLeg.R").name = "Wheel";
  CHECK(message_of_body(scene) == "no error");
  // A knee where the hip is.
  scene = good;
  npt::Skin& skin = scene.skins[0];
  skin.inverse_binds[npt::joint_index(left_knee)] = skin.inverse_binds[npt::joint_index(left_hip)];
  CHECK(message_of_body(scene).find("figure.glb: joint l_hip ('UpperLeg.L'): found a bone of length 0") == 0);
  // A forearm that moves nothing.
  scene = good;
  for (std::uint16_t& joint : scene.meshes[scene.nodes[scene.shown[0]].mesh].blocks[0].joints)
    if (joint == npt::joint_index(left_elbow)) joint = static_cast<std::uint16_t>(npt::joint_index(left_shoulder));
  CHECK(message_of_body(scene).find("figure.glb: joint l_elbow ('LowerArm.L'): found no vertex with a weight of it") ==
        0);
  // Left and right exchanged: sides are the body's own, whatever names say.
  scene = good;
  for (npt::SceneNode& n : scene.nodes)
    if (n.name.ends_with(".L"))
      n.name.back() = 'R';
    else if (n.name.ends_with(".R"))
      n.name.back() = 'L';
  CHECK(message_of_body(scene) == "no error");
  // A weight that is missing.
  scene = good;
  npt::VertexBlock& block = scene.meshes[scene.nodes[scene.shown[0]].mesh].blocks[0];
  for (std::size_t i = 0; i < block.influences; ++i) block.weights[i] = 0;
  CHECK(message_of_body(scene).find("vertex 0: found no weight above 0") != std::string::npos);
  scene = good;
  scene.skins[0].inverse_binds[3].linear = {};
  CHECK(message_of_body(scene).find("joint 'Abdomen': found an inverse bind matrix without an inverse") !=
        std::string::npos);
}
