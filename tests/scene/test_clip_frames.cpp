#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/scene/clip_frames.hpp>

#include <vector>

namespace {

/// A triangle whose node moves along x, one unit a second for two seconds.
npt::Scene moving_triangle() {
  npt::Scene scene;
  npt::SceneMesh mesh;
  npt::VertexBlock block;
  block.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.blocks.push_back(block);
  mesh.primitives.push_back({.block = 0, .triangles = {{0, 1, 2}}});
  scene.meshes.push_back(mesh);
  scene.nodes.push_back({.name = "triangle", .mesh = 0});
  scene.shown.push_back(0);
  npt::ClipChannel channel{0, npt::ChannelPath::translation, npt::Interpolation::linear, 3, {0, 2}, {0, 0, 0, 2, 0, 0}};
  scene.clips.push_back({"walk", {channel}});
  return scene;
}

}  // namespace

TEST_CASE("a clip's frames at a rate are its meshes; the scene at rest is another") {
  npt::ClipFrames frames(moving_triangle(), "a.glb", {.rate = 2});
  CHECK(frames.clip_name() == "walk");
  REQUIRE(frames.size() == 5);
  CHECK(frames.times()[3] == doctest::Approx(1.5));
  CHECK(frames.frame(3).positions[0].x == doctest::Approx(1.5));
  CHECK(frames.at_rest().positions[0].x == 0);
  CHECK(npt::ClipFrames(moving_triangle(), "a.glb", {.time = 0.5}).frame(0).positions[1].x == doctest::Approx(1.5));
}

TEST_CASE("clips that aren't there, times beyond the end and clips of a year are errors") {
  CHECK_THROWS_AS(npt::ClipFrames(moving_triangle(), "a.glb", {.clip = "run"}), npt::Error);
  CHECK_THROWS_AS(npt::ClipFrames(moving_triangle(), "a.glb", {.time = 3.0}), npt::Error);
  CHECK_THROWS_AS(npt::ClipFrames(moving_triangle(), "a.glb", {.rate = 1e6}), npt::Error);
  npt::Scene none = moving_triangle();
  none.clips.clear();
  CHECK_THROWS_WITH_AS(npt::ClipFrames(none, "a.glb", {}), doctest::Contains("0 clips"), npt::Error);
}
