#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/base/rotation.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_of_scene.hpp>

#include <cmath>
#include <string>
#include <vector>

namespace {

using npt::no_item;

std::size_t add_node(npt::Scene& scene, const std::string& name, std::size_t parent, npt::Vec3d at = {0, 1, 0}) {
  npt::SceneNode node{.name = name, .parent = parent};
  node.place.translation = at;
  scene.nodes.push_back(std::move(node));
  return scene.nodes.size() - 1;
}

/// A chain of joints below a node, and the last of them.
std::size_t add_chain(npt::Scene& scene, const std::string& name, std::size_t parent, int count) {
  for (int i = 0; i < count; ++i) parent = add_node(scene, name + std::to_string(i), parent);
  return parent;
}

npt::ClipChannel turning(std::size_t node, std::vector<float> times = {0, 0.5F, 1}) {
  npt::ClipChannel channel{node, npt::ChannelPath::rotation, npt::Interpolation::linear, 4, std::move(times), {}};
  for (std::size_t k = 0; k < channel.times.size(); ++k) {
    const double half = 0.2 * static_cast<double>(k);
    for (const double v : {std::sin(half), 0.0, 0.0, std::cos(half)}) channel.values.push_back(static_cast<float>(v));
  }
  return channel;
}

}  // namespace

TEST_CASE("a skeleton without a mesh is a motion, its standing armature is its base") {
  npt::Scene scene;
  const std::size_t root = add_node(scene, "RootNode", no_item, {}), armature = add_node(scene, "Armature", root, {});
  scene.nodes[armature].place.scale = {0.01, 0.01, 0.01};
  scene.nodes[armature].place.rotation = npt::quaternion_of(npt::rotation_matrix({-1.5707963267948966, 0, 0}));
  const std::size_t hips = add_node(scene, "Hips", armature, {0, 0, 100});
  add_node(scene, "Leg.L_end", add_node(scene, "Leg.L", hips, {10, 0, -50}));
  const std::size_t arm = add_chain(scene, "Spine", hips, 3);
  scene.clips.push_back({"wave", {turning(arm)}});
  CHECK(npt::has_skeleton(scene));
  const npt::Motion motion = npt::motion_of(scene, &scene.clips[0], "a.glb");
  REQUIRE(motion.joints.size() == 6);
  CHECK(motion.joints[0].name == "Hips");
  CHECK(motion.joints[0].node == hips);
  CHECK(npt::metres_a_unit(motion) == doctest::Approx(0.01));
  CHECK(npt::up_axis(motion) == "z");
  CHECK(motion.rate == 2);
  CHECK(npt::length(npt::joint_positions(motion, std::nullopt)[0] - npt::Vec3d{0, 1, 0}) < 1e-12);
  CHECK(npt::length(npt::joint_positions(motion, std::nullopt)[1] - npt::Vec3d{0.1, 0.5, 0}) < 1e-12);
  CHECK(motion.clip.channels[0].node == 5);
  CHECK(motion.joints[2].end);
  CHECK(!motion.joints[5].end);
}

TEST_CASE("what hangs below a mesh that nothing moves is no joint") {
  npt::Scene scene;
  const std::size_t hips = add_node(scene, "Hips", no_item), hand = add_chain(scene, "Arm", hips, 3);
  const std::size_t sword = add_node(scene, "Sword", hand);
  scene.nodes[sword].mesh = 0;
  add_node(scene, "Tip", add_node(scene, "Blade", sword));
  scene.clips.push_back({"wave", {turning(hand), turning(hips)}});
  const npt::Motion motion = npt::motion_of(scene, &scene.clips[0], "a.glb");
  REQUIRE(motion.joints.size() == 4);
  for (std::size_t j = 1; j < motion.joints.size(); ++j) CHECK(motion.joints[j].parent == j - 1);
}

TEST_CASE("a curve of one value is constant, whatever stands between its keys") {
  npt::ClipChannel curve{.times = {0, 1}, .values = {1, 2, 3, 1, 2, 3}};
  CHECK(curve.is_constant());
  curve.values[4] = 5;
  CHECK(!curve.is_constant());
  curve.interpolation = npt::Interpolation::cubic;
  curve.values = {0, 0, 0, 1, 2, 3, 0, 0, 0, 0, 0, 0, 1, 2, 3, 0, 0, 0};
  CHECK(curve.is_constant());
  curve.values[6] = 1;  // a tangent
  CHECK(!curve.is_constant());
}

TEST_CASE("of two skeletons the one that the clip moves is taken") {
  npt::Scene scene;
  const std::size_t root = add_node(scene, "RootNode", no_item, {});
  const std::size_t a = add_chain(scene, "a", root, 12), b = add_chain(scene, "b", root, 12);
  for (const std::size_t top : {a - 11, b - 11}) add_chain(scene, "leg", top, 2);
  scene.nodes[add_node(scene, "mesh", root)].mesh = 0;
  scene.clips = {{"first", {turning(a)}}, {"second", {turning(b)}}};
  CHECK(npt::motion_of(scene, &scene.clips[0], "").joints[11].name == "a11");
  CHECK(npt::motion_of(scene, &scene.clips[1], "").joints[11].name == "b11");
  CHECK(npt::motion_of(scene, &scene.clips[1], "").joints.size() == 14);
}

TEST_CASE("the nodes that assimp makes of one joint are one joint again, its curves joined") {
  npt::Scene scene;
  const std::size_t top = add_node(scene, "Hips", no_item, {});
  const std::size_t shift = add_node(scene, "Arm_$AssimpFbx$_Translation", top, {0, 2, 0});
  const std::size_t before = add_node(scene, "Arm_$AssimpFbx$_PreRotation", shift, {});
  scene.nodes[before].matrix = npt::Affine{npt::rotation_matrix({0, 0, 1.2}), {}};
  const std::size_t turn = add_node(scene, "Arm_$AssimpFbx$_Rotation", before, {});
  const std::size_t arm = add_node(scene, "Arm", turn, {0, 0, 0});
  add_node(scene, "Hand", arm, {0, 3, 0});
  add_node(scene, "Tail", top, {0, 0, -1});
  scene.clips = {{"wave", {turning(turn), turning(top)}}};
  const npt::Motion motion = npt::motion_of(scene, &scene.clips[0], "");
  REQUIRE(motion.joints.size() == 4);
  CHECK(motion.joints[1].name == "Arm");
  CHECK(motion.joints[2].parent == 1);
  for (const double time : {0.0, 0.3, 1.0}) {
    npt::NodePlace place;
    npt::set_from(scene.clips[0].channels[0], time, place);
    npt::NodePlace first;
    npt::set_from(scene.clips[0].channels[1], time, first);
    const npt::Affine expected = first.affine() * npt::Affine{npt::Matrix3::identity(), {0, 2, 0}} *
                                 *scene.nodes[before].matrix * place.affine() *
                                 npt::Affine{npt::Matrix3::identity(), {0, 3, 0}};
    CHECK(npt::length(npt::joint_positions(motion, time)[2] - expected.shift) < 1e-6);
  }
}

TEST_CASE("a scene without joints is no motion") {
  npt::Scene scene;
  scene.nodes.push_back({.name = "cube"});
  CHECK(!npt::has_skeleton(scene));
  CHECK_THROWS_WITH_AS(npt::motion_of(scene, nullptr, "cube.glb"),
                       "cube.glb: found no skeleton, expected joints that a skin or a clip moves", npt::Error);
}

TEST_CASE("a bone keeps its length below a scale that differs along axes") {
  npt::Scene scene;
  const std::size_t hip = add_node(scene, "Hip", no_item), knee = add_node(scene, "Knee", hip);
  add_node(scene, "Foot", knee, {0.3, 1, 0});
  scene.nodes[hip].place.scale = {1, 1.00005, 1};
  scene.clips.push_back({"bend", {turning(knee), turning(hip)}});
  npt::Motion motion = npt::motion_of(scene, &scene.clips[0], "a.glb");
  const auto before = npt::joint_worlds(motion, 0.0), after = npt::joint_worlds(motion, 1.0);
  const double length = npt::bone_length(motion, before, 2);
  CHECK(length == doctest::Approx(std::hypot(0.3, 1)).epsilon(1e-4));
  CHECK(std::abs(npt::length(after[2].shift - after[1].shift) - npt::length(before[2].shift - before[1].shift)) > 1e-6);
  CHECK(std::abs(npt::bone_length(motion, after, 2) - length) < 1e-12);
  // What a motion moves or scales is seen.
  motion.joints[2].rest.translation.x += 0.1;
  CHECK(std::abs(npt::bone_length(motion, npt::joint_worlds(motion, 1.0), 2) - length) > 0.01);
  motion.joints[2].rest.translation.x -= 0.1;
  motion.joints[1].rest.scale = {1.1, 1.1, 1.1};
  CHECK(npt::bone_length(motion, npt::joint_worlds(motion, 1.0), 2) == doctest::Approx(1.1 * length).epsilon(1e-6));
}

TEST_CASE("the rate of keys is found also where frames were left out, and is none for other keys") {
  CHECK(npt::key_rate({"", {turning(0, {0, 1 / 30.0F, 2 / 30.0F, 5 / 30.0F})}}) == 30);
  CHECK(npt::key_rate({"", {turning(0, {0, 0.0083333F, 0.0166667F})}}) == doctest::Approx(120));
  CHECK(npt::key_rate({"", {turning(0, {0, 0.1F, 0.25F, 0.31F})}}) == 0);
  CHECK(npt::key_rate({"", {turning(0, {0})}}) == 0);
  CHECK(npt::key_rate({}) == 0);
}

TEST_CASE("frames at the sampling rate end at the last key, also where the rate was rounded") {
  npt::Motion motion;
  motion.clip.channels = {turning(0, {0, 0.0333F, 0.0666F, 0.0999F})};
  motion.rate = 30;
  CHECK(npt::frame_times(motion.clip, motion.rate).size() == 3);
  CHECK(npt::frame_times(motion.clip, npt::sampling_rate(motion)).size() == 4);
  motion.clip.channels = {turning(0, {0, 0.115F})};  // behind the last frame
  CHECK(npt::sampling_rate(motion) == 30);
  motion.rate = 0;
  CHECK(npt::sampling_rate(motion, 24) == 24);
}

TEST_CASE("a map gives the place that makes it, also where it mirrors") {
  npt::NodePlace place{{1, 2, 3}, npt::normalised(npt::Quaternion{0.1, -0.2, 0.3, 0.8}), {-2, 3, 0.5}};
  CHECK((npt::place_of(place.affine()).affine().linear - place.affine().linear).squared_norm() < 1e-20);
  place.scale = {1, 0, 1};
  CHECK(npt::place_of(place.affine()).scale.y == 0);
}

TEST_CASE("a rig alone, without skin and clip, is a skeleton") {
  npt::Scene scene;
  for (std::size_t n = 0; n < 12; ++n) scene.nodes.push_back({.name = "j", .parent = n == 0 ? npt::no_item : n - 1});
  CHECK(npt::motion_of(scene, nullptr, "rig.glb").joints.size() == 12);
  scene.nodes.resize(3);
  CHECK_THROWS_AS(npt::motion_of(scene, nullptr, "rig.glb"), npt::Error);
}
