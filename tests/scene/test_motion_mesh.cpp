#include <doctest/doctest.h>

#include <npt/base/vec3.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_mesh.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/pose.hpp>
#include <npt/scene/scene.hpp>

#include <cstddef>
#include <vector>

namespace {

/// Twelve joints in a chain, of which the first two move a triangle's corners by halves, and a rigid triangle on the
/// third.
npt::Scene chain_with_skin() {
  npt::Scene scene;
  npt::Skin skin;
  for (std::size_t j = 0; j < 12; ++j) {
    scene.nodes.push_back({.name = "joint", .parent = j == 0 ? npt::no_item : j - 1});
    scene.nodes.back().place.translation = {0, 1, 0};
    skin.joints.push_back(j);
    skin.inverse_binds.push_back({npt::Matrix3::identity(), {0, -static_cast<double>(j + 1), 0}});
  }
  scene.skins.push_back(skin);
  npt::SceneMesh skinned, rigid;
  skinned.blocks.push_back({.positions = {{0, 1, 0}, {1, 2, 0}, {0, 2, 1}}});
  skinned.blocks[0].influences = 4;
  skinned.blocks[0].joints = {0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0};
  skinned.blocks[0].weights = {1, 0, 0, 0, 0.5F, 0.5F, 0, 0, 1, 0, 0, 0};
  skinned.primitives.push_back({.block = 0, .triangles = {{0, 1, 2}}});
  rigid.blocks.push_back({.positions = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}});
  rigid.primitives = skinned.primitives;
  scene.meshes = {skinned, rigid};
  scene.nodes.push_back({.name = "body", .mesh = 0, .skin = 0});
  scene.nodes.push_back({.name = "hat", .parent = 2, .mesh = 1});
  scene.nodes.back().place.translation = {0, 0, 3};
  scene.shown = {12, 13};
  npt::ClipChannel turn{1,      npt::ChannelPath::rotation,    npt::Interpolation::linear, 4,
                        {0, 1}, {0, 0, 0, 1, 0.6F, 0, 0, 0.8F}};
  scene.clips.push_back({"turn", {turn}});
  return scene;
}

}  // namespace

TEST_CASE("a motion's mesh is where the scene's is at the same time") {
  const npt::Scene scene = chain_with_skin();
  const npt::Motion motion = npt::motion_of(scene, &scene.clips[0], "scene");
  const npt::MotionMesh mesh = npt::motion_mesh(scene, motion);
  REQUIRE(mesh.vertex_count() == 6);
  CHECK(mesh.triangles.size() == 2);
  CHECK(mesh.main_joint(2) == 1);
  CHECK(mesh.node == std::vector<std::size_t>{12, 12, 12, 13, 13, 13});
  const npt::ScenePoser poser(scene);
  for (const double time : {0.0, 0.4, 1.0}) {
    std::vector<float> expected(18);
    poser.positions(&scene.clips[0], time, expected);
    const std::vector<npt::Vec3d> got = mesh.moved(motion, npt::joint_worlds(motion, time));
    for (std::size_t v = 0; v < 6; ++v)
      CHECK(npt::length(got[v] - npt::Vec3d{expected[3 * v], expected[3 * v + 1], expected[3 * v + 2]}) < 1e-6);
  }
}
