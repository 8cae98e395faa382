/// Scenes: what moves, a scene as a mesh, a mesh as a scene, rigs.
#include <doctest/doctest.h>

#include <mesh/zoo.hpp>
#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/mesh/appearance.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/from_mesh.hpp>
#include <npt/scene/pose.hpp>
#include <npt/scene/scene.hpp>
#include <npt/scene/skinned_skeleton.hpp>

#include <cmath>
#include <numbers>

namespace {

npt::Quaternion about_z(double angle) { return {0, 0, std::sin(angle / 2), std::cos(angle / 2)}; }

double distance(npt::Vec3d a, npt::Vec3d b) { return length(a - b); }

std::vector<double> sampled(const npt::ClipChannel& channel, double time) {
  std::vector<double> value(channel.width);
  channel.sample(time, value);
  return value;
}

}  // namespace

TEST_CASE("channels: step, linear and cubic between keys, constant outside of them") {
  npt::ClipChannel c{0, npt::ChannelPath::translation, npt::Interpolation::linear, 3, {1, 2}, {0, 0, 0, 2, 4, 6}};
  CHECK(sampled(c, 0) == std::vector<double>{0, 0, 0});
  CHECK(sampled(c, 1.5) == std::vector<double>{1, 2, 3});
  CHECK(sampled(c, 9) == std::vector<double>{2, 4, 6});
  c.interpolation = npt::Interpolation::step;
  CHECK(sampled(c, 1.999) == std::vector<double>{0, 0, 0});
  CHECK(sampled(c, 2) == std::vector<double>{2, 4, 6});
  // With tangents of a straight line a cubic is that line.
  c = {0, npt::ChannelPath::weights, npt::Interpolation::cubic, 1, {0, 2}, {3, 1, 3, 3, 7, 3}};
  CHECK(sampled(c, 0.5)[0] == doctest::Approx(2.5));
  CHECK(sampled(c, 2)[0] == 7);
}

TEST_CASE("a clip's frames: from 0 to its end, as many as its rate says") {
  npt::Clip clip{"c", {{0, npt::ChannelPath::scale, npt::Interpolation::step, 3, {0, 0.9999999F}, {1, 1, 1, 1, 1, 1}}}};
  CHECK(npt::frame_times(clip, 30).size() == 31);
  CHECK(npt::frame_times(clip, 1.5).size() == 2);
  CHECK(npt::frame_times({"still", {}}, 30) == std::vector<double>{0});
}

TEST_CASE("a mesh becomes a scene and comes back as it was") {
  for (const npt::Mesh& mesh : {zoo::cube(), zoo::hard_cube(), zoo::mixed()}) {
    const npt::MeshScene made = npt::scene_from(mesh);
    const npt::Mesh back = npt::ScenePoser(made.scene).mesh();
    CHECK(npt::triangulate(back).size() == npt::triangulate(mesh).size());
    const auto before = npt::triangulate(mesh), after = npt::triangulate(back);
    for (std::size_t t = 0; t < before.size(); ++t)
      for (std::size_t c = 0; c < 3; ++c) CHECK(back.positions[after[t][c]] == mesh.positions[before[t][c]]);
    for (const npt::Vec3f n : back.normals) CHECK(length(n) == doctest::Approx(1));
  }
  npt::Mesh parts = zoo::cube();
  parts.tags = {{0, "o", "left"}, {0, "usemtl", "skin"}, {2, "usemtl", "cloth"}, {3, "o", "right"}};
  const npt::MeshScene made = npt::scene_from(parts);
  REQUIRE(made.scene.nodes.size() == 2);
  CHECK(made.scene.nodes[1].name == "right");
  CHECK(made.scene.meshes[0].primitives.size() == 2);
  CHECK(made.scene.meshes[1].primitives.size() == 1);
  CHECK(made.scene.appearance->materials.size() == 2);
}

TEST_CASE("texture coordinates count from the top in a scene") {
  const npt::Mesh mesh = zoo::hard_cube();
  const npt::MeshScene made = npt::scene_from(mesh);
  const npt::Mesh back = npt::ScenePoser(made.scene).mesh();
  CHECK(back.texcoords_from_top);
  const std::uint32_t corner = made.corner_of[0][0];
  CHECK(made.scene.meshes[0].blocks[0].texcoords[0][0][1] == 1 - mesh.texcoords[mesh.corner_texcoord[corner]].y);
}

TEST_CASE("a skeleton's clip moves a mesh as the blended motions do") {
  const npt::Mesh mesh = zoo::cube();
  npt::SkinnedSkeleton skeleton{.names = {"a", "b"},
                                .parents = {npt::SkinnedSkeleton::no_parent, 0},
                                .joints = {{0.5, 0, 0.5}, {0.5, 1, 0.5}},
                                .start = {0},
                                .influences = {}};
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    skeleton.influences.push_back({0, 0.25F});
    skeleton.influences.push_back({1, 0.75F});
    skeleton.start.push_back(skeleton.influences.size());
  }
  const auto motion_about = [](npt::Vec3d place, double angle) {
    const npt::Matrix3 turn = npt::matrix_of(about_z(angle));
    return npt::Affine{turn, place - turn * place};
  };
  const std::vector<double> times{0, 0.5};
  std::vector<std::vector<npt::Affine>> motions(2);
  for (std::size_t t = 0; t < 2; ++t) {
    const npt::Affine root = motion_about(skeleton.joints[0], 0.4 * static_cast<double>(t));
    motions[t] = {root, root * motion_about(skeleton.joints[1], 1.2 * static_cast<double>(t) - 0.3)};
  }
  npt::MeshScene made = npt::scene_from(mesh);
  const std::size_t first = npt::add_skeleton(made, skeleton);
  npt::add_skeleton_clip(made, skeleton, first, "bend", times, motions);
  const npt::ScenePoser poser(made.scene);
  CHECK(poser.mesh().positions == mesh.positions);
  npt::Mesh moved = poser.mesh();
  for (std::size_t t = 0; t < 2; ++t) {
    poser.positions(&made.scene.clips[0], times[t], moved.coordinates());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      const npt::Vec3d p = mesh.positions[v].as<double>();
      CHECK(distance(moved.positions[v].as<double>(), motions[t][0](p) * 0.25 + motions[t][1](p) * 0.75) < 1e-6);
    }
  }
}

TEST_CASE("a morph clip goes through its frames") {
  const npt::Mesh mesh = zoo::hard_cube();
  const std::vector<double> times{0, 1, 2};
  std::vector<std::vector<float>> frames;
  for (int t = 0; t < 3; ++t) {
    const auto xyz = mesh.coordinates();
    frames.emplace_back(xyz.begin(), xyz.end());
    for (std::size_t i = 0; i < frames.back().size(); i += 3) frames.back()[i] += static_cast<float>(t);
  }
  npt::MeshScene made = npt::scene_from(mesh);
  npt::add_morph_clip(made, mesh, "go", times, frames);
  const npt::ScenePoser poser(made.scene);
  npt::Mesh moved = poser.mesh();
  for (const double time : {0.0, 0.5, 2.0}) {
    poser.positions(&made.scene.clips[0], time, moved.coordinates());
    for (std::size_t v = 0; v < moved.vertex_count(); ++v)
      CHECK(moved.positions[v].x ==
            doctest::Approx(mesh.positions[made.vertex_of[0][v]].x + static_cast<float>(time)).epsilon(1e-5));
  }
  for (const npt::MorphTarget& target : made.scene.meshes[0].blocks[0].targets)
    for (const npt::Vec3f n : target.normals) CHECK(length(n) < 1e-5F);  // shifting turns nothing
}

TEST_CASE("a scene that shows nothing has no mesh") {
  CHECK_THROWS_AS(npt::ScenePoser(npt::Scene{}).mesh(), npt::Error);
  CHECK(npt::clip_names(npt::Scene{}) == "none");
}
