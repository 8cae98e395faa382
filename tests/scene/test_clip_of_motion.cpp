/// A motion as a scene's clip, and a pose as its rest.
#include <doctest/doctest.h>

#include <npt/scene/clip_of_motion.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/scene.hpp>

#include <optional>
#include <string>
#include <vector>

namespace clip_of_motion_test {

/// Two joints, the first with a matrix; a clip moves the second.
npt::Scene two_joints() {
  npt::Scene scene;
  scene.nodes = {{.name = "a"}, {.name = "b", .parent = 0}};
  scene.nodes[0].matrix = npt::Affine{npt::Matrix3::identity() * 2.0, {0, 1, 0}};
  scene.nodes[1].place.translation = {0, 1, 0};
  scene.skins.push_back({"skin", {0, 1}, std::vector<npt::Affine>(2)});
  scene.clips.push_back({"go", {{.node = 1, .times = {0, 1}, .values = {0, 1, 0, 3, 1, 0}}}});
  return scene;
}

npt::Motion pose_of(const npt::Scene& scene) {
  npt::Motion motion = npt::motion_of(scene, nullptr, "x");
  motion.clip = {"pose",
                 {{.node = 0, .times = {0}, .values = {5, 1, 0}},
                  {.node = 1, .path = npt::ChannelPath::rotation, .width = 4, .times = {0}, .values = {0, 0, 1, 0}}}};
  return motion;
}

}  // namespace clip_of_motion_test

TEST_CASE("a motion becomes a clip with a name of its own") {
  using namespace clip_of_motion_test;
  npt::Scene scene = two_joints();
  const npt::Motion motion = pose_of(scene);
  CHECK(npt::add_clip(scene, motion, "go") == "go_2");
  CHECK(npt::add_clip(scene, motion, "go") == "go_3");
  CHECK(npt::add_clip(scene, motion, "") == "pose");
  REQUIRE(scene.clips.size() == 4);
  CHECK(scene.clips[1].channels.size() == 3);  // with the rest of what "go" moves
  CHECK(!scene.nodes[0].matrix);               // what moves has a place
  CHECK(scene.nodes[0].place.translation == npt::Vec3d{0, 1, 0});
  CHECK(scene.nodes[0].place.scale == npt::Vec3d{2, 2, 2});
}

TEST_CASE("what other clips move and a new one doesn't gets its rest") {
  using namespace clip_of_motion_test;
  npt::Scene scene = two_joints();
  scene.nodes[1].place.translation = {0, 7, 0};
  npt::Motion motion = pose_of(scene);
  npt::add_clip(scene, motion, "whole");
  motion.clip.channels = {{.node = 1, .times = {0, 1}, .values = {1, 0, 0, 2, 0, 0}}};
  npt::add_clip(scene, motion, "part");
  const npt::Clip& whole = scene.clips[1];
  const npt::Clip& part = scene.clips[2];
  for (const npt::ClipChannel& c : whole.channels) CHECK(npt::internal::moves_part(part, c));
  CHECK(part.channels[0].values == std::vector<float>{1, 0, 0, 2, 0, 0});
  CHECK(part.channels.size() > 1);
  for (std::size_t i = 1; i < part.channels.size(); ++i) CHECK(part.channels[i].times == std::vector<float>{0});
}

TEST_CASE("a pose becomes the rest, and clips play as before") {
  using namespace clip_of_motion_test;
  const npt::Scene before = two_joints();
  npt::Scene after = before;
  npt::set_rest(after, pose_of(before), 0);
  CHECK(after.nodes[0].place.translation == npt::Vec3d{5, 1, 0});
  CHECK(after.nodes[1].place.rotation == npt::Quaternion{0, 0, 1, 0});
  CHECK(after.clips[0].channels.size() == 3);
  for (const double time : {0.0, 0.5, 1.0}) {
    const std::vector<npt::Affine> p = npt::joint_worlds(npt::motion_of(before, &before.clips[0], "x"), time);
    const std::vector<npt::Affine> q = npt::joint_worlds(npt::motion_of(after, &after.clips[0], "x"), time);
    for (std::size_t j = 0; j < p.size(); ++j) CHECK(p[j] == q[j]);
  }
  npt::Scene same = before;
  npt::set_rest(same, npt::motion_of(before, nullptr, "x"), 0);
  CHECK(same.nodes[0].matrix == before.nodes[0].matrix);
  CHECK(same.clips[0].channels.size() == 1);
}
