/// Joints that a reader split are one node again, in all of a scene.
#include <doctest/doctest.h>

#include <npt/base/rotation.hpp>
#include <npt/scene/joined_nodes.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/scene.hpp>

#include <cmath>
#include <string>
#include <vector>

namespace joined_test {

/// A root, a hip in three parts of which the second turns, and a leg below it.
npt::Scene split_scene() {
  npt::Scene scene;
  const auto add = [&](const std::string& name, npt::Vec3d at, npt::Vec3d turn = {}) {
    npt::SceneNode node{.name = name, .parent = scene.nodes.empty() ? npt::no_item : scene.nodes.size() - 1};
    node.matrix = npt::Affine{npt::rotation_matrix(turn), at};
    scene.nodes.push_back(std::move(node));
  };
  add("root", {0, 1, 0});
  add("hip_$AssimpFbx$_Translation", {1, 0, 0});
  add("hip_$AssimpFbx$_PreRotation", {}, {0, 0, 1});
  add("hip_$AssimpFbx$_Rotation", {});
  add("hip", {});
  add("leg", {0, -1, 0});
  npt::SceneNode& turning = scene.nodes[3];
  turning.matrix.reset();
  const auto c = static_cast<float>(std::cos(0.3)), s = static_cast<float>(std::sin(0.3));
  scene.clips.push_back({"turn",
                         {{.node = 3,
                           .path = npt::ChannelPath::rotation,
                           .width = 4,
                           .times = {0, 1},
                           .values = {0, 0, 0, 1, s, 0, 0, c}},
                          {.node = 0, .path = npt::ChannelPath::weights, .width = 1, .times = {0}, .values = {1}}}});
  scene.skins.push_back({"skin", {4, 5}, std::vector<npt::Affine>(2)});
  scene.shown = {5};
  return scene;
}

}  // namespace joined_test

TEST_CASE("split joints are joined, and move as before") {
  using namespace joined_test;
  const npt::Scene split = split_scene(), joined = npt::with_joined_nodes(split);
  REQUIRE(joined.nodes.size() == 3);
  CHECK(joined.nodes[1].name == "hip");
  CHECK(joined.nodes[1].parent == 0);
  CHECK(joined.nodes[2].parent == 1);
  CHECK(!joined.nodes[1].matrix);
  CHECK(joined.nodes[2].matrix == split.nodes[5].matrix);
  CHECK(joined.skins[0].joints == std::vector<std::size_t>{1, 2});
  CHECK(joined.shown == std::vector<std::size_t>{2});
  REQUIRE(joined.clips[0].channels.size() == 4);
  CHECK(joined.clips[0].channels[0].path == npt::ChannelPath::weights);
  const npt::Motion a = npt::motion_of(split, &split.clips[0], "a"), b = npt::motion_of(joined, &joined.clips[0], "b");
  REQUIRE(a.joints.size() == b.joints.size());
  for (const double time : {0.0, 0.4, 1.0}) {
    const std::vector<npt::Vec3d> p = npt::joint_positions(a, time), q = npt::joint_positions(b, time);
    for (std::size_t j = 0; j < p.size(); ++j) CHECK(length(p[j] - q[j]) < 1e-7);
  }
}

TEST_CASE("parts that hold something else stay") {
  using namespace joined_test;
  npt::Scene scene = split_scene();
  scene.nodes.push_back({.name = "other", .parent = 2});  // a second node below a part
  CHECK(npt::with_joined_nodes(scene).nodes.size() == 5);
  scene = split_scene();
  scene.skins[0].joints[0] = 3;
  CHECK(npt::with_joined_nodes(scene).nodes.size() == 4);
  scene = split_scene();
  scene.nodes[1].mesh = 0;
  const npt::Scene joined = npt::with_joined_nodes(scene);
  REQUIRE(joined.nodes.size() == 4);
  CHECK(joined.nodes[1].mesh == 0);
  CHECK(joined.nodes[2].parent == 1);
}
