#include "rigged_figure.hpp"

#include <doctest/doctest.h>

#include <npt/lab/rig/rig.hpp>
#include <npt/lab/rig/rig_character.hpp>
#include <npt/lab/rig/rig_sampler.hpp>
#include <npt/mesh/points.hpp>
#include <npt/scene/pose.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace {

using enum npt::SmplJoint;

npt::Scene moving_figure() {
  const rigged::Angles kick = rigged::turned(left_hip, -0.8F, 0, 0, rigged::turned(right_elbow, 0, 0.9F, 0));
  const rigged::Angles bow = rigged::turned(spine1, 0.7F, 0, 0);
  return rigged::figure({}, {{{}, kick}, {bow, {}}});
}

std::shared_ptr<const npt::RigCharacter> character(npt::Scene scene = moving_figure()) {
  return std::make_shared<const npt::RigCharacter>(npt::make_rig(std::move(scene), "figure.glb"));
}

std::string message_of_character(npt::Scene scene) {
  try {
    character(std::move(scene));
  } catch (const npt::Error& error) {
    return error.what();
  }
  return "no error";
}

/// The worst difference between a rig's frame and the scene's, but for where it stands.
double worst_difference(const npt::Scene& scene, const npt::RigCharacter& rig, std::size_t clip, std::size_t frame) {
  std::vector<float> own(3 * rig.vertex_count()), scenes(own.size());
  rig.posed({}, rig, rig.clips()[clip][frame], own);
  npt::ScenePoser(scene).positions(&scene.clips[clip], static_cast<double>(frame) / npt::RigCharacter::frame_rate,
                                   scenes);
  double worst = 0;
  for (std::size_t i = 3; i < own.size(); ++i)
    worst = std::max(worst, std::abs(static_cast<double>((own[i] - own[i % 3]) - (scenes[i] - scenes[i % 3]))));
  return worst;
}

}  // namespace

TEST_CASE("a rig's own frames are the scene's, also with a foot that hangs on the root") {
  npt::Scene scene = moving_figure();
  const auto rig = character(scene);
  CHECK(rig->clip_names() == std::vector<std::string>{"clip0", "clip1"});
  CHECK(worst_difference(scene, *rig, 0, 15) < 1e-4);
  CHECK(worst_difference(scene, *rig, 1, 7) < 1e-4);
  // The left foot as inverse kinematics leaves it: a root of its own, with keys for its place and direction.
  const npt::ScenePoser poser(scene);
  const auto foot = static_cast<std::size_t>(
      std::ranges::find(scene.nodes, std::string("Foot.L"), &npt::SceneNode::name) - scene.nodes.begin());
  npt::Scene loose = scene;
  loose.nodes[foot].parent = npt::no_item;
  const npt::Affine stands = poser.pose().worlds[foot];
  loose.nodes[foot].place.translation = stands.shift;
  for (std::size_t c = 0; c < scene.clips.size(); ++c) {
    npt::Clip& clip = loose.clips[c];
    std::erase_if(clip.channels, [foot](const npt::ClipChannel& channel) { return channel.node == foot; });
    npt::ClipChannel shift{foot, npt::ChannelPath::translation, npt::Interpolation::step, 3, {}, {}};
    npt::ClipChannel turn{foot, npt::ChannelPath::rotation, npt::Interpolation::step, 4, {}, {}};
    for (int f = 0; f <= 15; ++f) {
      const double time = f / npt::RigCharacter::frame_rate;
      const npt::Affine now = poser.pose(&scene.clips[c], time).worlds[foot];
      const npt::Quaternion q = npt::quaternion_of(now.linear);
      for (npt::ClipChannel* channel : {&shift, &turn}) channel->times.push_back(static_cast<float>(time) - 0.001F);
      for (const double v : {now.shift.x, now.shift.y, now.shift.z}) shift.values.push_back(static_cast<float>(v));
      for (const double v : {q.x, q.y, q.z, q.w}) turn.values.push_back(static_cast<float>(v));
    }
    clip.channels.push_back(std::move(shift));
    clip.channels.push_back(std::move(turn));
  }
  const auto loose_rig = character(loose);
  CHECK(worst_difference(loose, *loose_rig, 0, 15) < 1e-4);
  // With legs twice as long the foot is still at the shin's end: the surface is as long as its edges say.
  npt::RigProportions tall;
  tall.parts["upperleg"] = tall.parts["lowerleg"] = {2, 1};
  std::vector<float> xyz(3 * loose_rig->vertex_count()), truth(xyz.size());
  loose_rig->posed(tall, *loose_rig, loose_rig->clips()[0][15], xyz);
  rig->posed(tall, *rig, rig->clips()[0][15], truth);
  double worst = 0;
  for (std::size_t i = 0; i < xyz.size(); ++i)
    worst = std::max(worst, std::abs(static_cast<double>(xyz[i] - truth[i])));
  CHECK(worst < 0.02);
}

TEST_CASE("a pose mixed of two has each limb as one of them has it") {
  const auto rig = character();
  // The left leg is raised in the one, the spine bent in the other.
  const npt::RigPose kick = rig->clips()[0].back(), bow = rig->clips()[1].front();
  const auto differs = [&](const npt::RigPose& a, const npt::RigPose& b, const std::string& joint) {
    const std::size_t j = rig->joints().at(joint);
    double sum = 0;
    for (std::size_t r = 0; r < 3; ++r) sum += length(a.rotations[j].rows[r] - b.rotations[j].rows[r]);
    return sum > 1e-9;
  };
  npt::Random random(1);
  bool raised[2] = {}, both = false;
  for (int i = 0; i < 40; ++i) {
    const npt::RigPose pose = rig->mixed(kick, bow, random);
    const bool leg = differs(pose, bow, "UpperLeg.L"), spine = differs(pose, kick, "Torso");
    if (leg) CHECK_FALSE(differs(pose, kick, "UpperLeg.L"));
    if (spine) CHECK_FALSE(differs(pose, bow, "Torso"));
    raised[leg ? 1 : 0] = true;
    both = both || (leg && spine);
  }
  CHECK(raised[0]);
  CHECK(raised[1]);
  CHECK(both);
}

TEST_CASE("samples of rigs depend on seed, step and index only; the truth is the identity in the pose mesh's pose") {
  const auto rig = character();
  const auto mixture = std::make_shared<const npt::RigMixture>(std::vector<npt::WeightedRig>{{rig, 1}, {rig, 2}});
  CHECK(mixture->partners(0).size() == 2);
  const npt::RigSampler sampler(mixture, {.seed = 3, .vertices = 50});
  const npt::Sample s = sampler.draw(1, 2);
  CHECK(npt::identity_of(s).size() == 150);
  CHECK(s.truth == sampler.draw(1, 2).truth);
  CHECK(s.truth != sampler.draw(1, 3).truth);
  CHECK(s.truth != npt::RigSampler(mixture, {.seed = 4, .vertices = 50}).draw(1, 2).truth);
  CHECK(sampler.max_vertices() == 50);
  CHECK(sampler.equal_counts());
  const npt::Sample whole = npt::RigSampler(mixture, {.seed = 3}).draw(0, 0);
  CHECK(whole.vertex_count() == rig->vertex_count());
  CHECK(whole.edges.size() == rig->edges().size());
  // Of one rig, as it came, pose mesh and truth are the same points in another order.
  const npt::EvaluationPair pair = npt::rig_pairs(mixture, 2, 1).pair(1);
  std::vector<float> pose = pair.pose, truth = pair.truth;
  std::ranges::sort(pose), std::ranges::sort(truth);
  CHECK(pose == truth);
}

TEST_CASE("pairs take identity and pose mesh from the rigs that are asked for") {
  const auto rig = character();
  npt::Scene other = moving_figure();
  const auto second = std::make_shared<const npt::RigCharacter>(npt::make_rig(std::move(other), "models/other.glb"));
  const auto mixture = std::make_shared<const npt::RigMixture>(std::vector<npt::WeightedRig>{{rig, 1}, {second, 1}});
  const npt::EvaluationSet set = npt::rig_pairs(mixture, 6, 1, {.identities = {1}, .poses = {0}});
  for (std::size_t i = 0; i < 6; ++i) CHECK(set.pair(i).name.starts_with("other as figure, clip"));
  // Lengths are in the longest side of the character as bound.
  const npt::EvaluationPair pair = set.pair(0);
  CHECK(npt::bounding_box(pair.identity).longest_side() < 1.2);
  CHECK(rig->extent() > 1.5);
}

TEST_CASE("points of a rig's surface lie within its box and have unit normals") {
  const npt::RigMixture mixture({{character(), 1}});
  npt::Random random(3);
  std::vector<npt::Vec3f> points, normals;
  npt::draw_rig_surface(mixture, random, 200, points, normals);
  REQUIRE(points.size() == 200);
  REQUIRE(normals.size() == 200);
  for (std::size_t i = 0; i < 200; ++i) {
    CHECK(length(points[i]) < 3);
    CHECK(length(normals[i]) == doctest::Approx(1).epsilon(1e-4));
  }
}

TEST_CASE("samples are of vertices or of points by area") {
  const auto rig = character();
  const auto mixture = std::make_shared<const npt::RigMixture>(std::vector<npt::WeightedRig>{{rig, 1}});
  const npt::RigSampler sampler(mixture, {.seed = 8, .vertices = 64});
  bool by_area = false, by_vertex = false;
  for (std::uint64_t i = 0; i < 12; ++i) {
    const npt::Sample s = sampler.draw(0, i);
    CHECK(npt::identity_of(s).size() == 192);
    CHECK(s.truth.size() == 192);
    CHECK(s.truth == sampler.draw(0, i).truth);
    const npt::Sample whole = npt::RigSampler(mixture, {.seed = 8}).draw(0, i);
    bool found = false;  // whether the first point is a vertex
    for (std::size_t v = 0; v < npt::identity_of(whole).size(); v += 3)
      found = found || (npt::identity_of(whole)[v] == npt::identity_of(s)[0] &&
                        npt::identity_of(whole)[v + 1] == npt::identity_of(s)[1] &&
                        npt::identity_of(whole)[v + 2] == npt::identity_of(s)[2]);
    (found ? by_vertex : by_area) = true;
  }
  CHECK(by_area);
  CHECK(by_vertex);
}

TEST_CASE("clips are held out by name") {
  const auto rig = character();
  const npt::RigMixture mixture({{rig, 1}}, {"clip1"});
  CHECK(mixture.shown(0) == std::vector<std::size_t>{0});
  CHECK(mixture.held_out(0) == std::vector<std::size_t>{1});
  CHECK_THROWS_WITH_AS(npt::RigMixture({{rig, 1}}, {"clip7"}), "--held-out: found 'clip7', expected a clip of a rig",
                       npt::Error);
  CHECK_THROWS_WITH_AS(npt::RigMixture({{rig, 1}}, {"clip0", "clip1"}),
                       "figure.glb: found no clip that isn't held out, expected at least one", npt::Error);
  CHECK_THROWS_AS(npt::RigMixture({}), npt::Error);
  CHECK_THROWS_AS(npt::RigMixture({{rig, 0}}), npt::Error);
  CHECK_THROWS_AS(npt::RigSampler(std::make_shared<const npt::RigMixture>(std::vector<npt::WeightedRig>{{rig, 1}}),
                                  {.vertices = 100000}),
                  npt::Error);
}

TEST_CASE("rigs that can't be trained on say why") {
  CHECK(message_of_character(rigged::figure()).find("figure.glb: found no clip, expected clips") == 0);
  npt::Scene scene = moving_figure();
  scene.clips[1].channels.clear();
  CHECK(message_of_character(scene) ==
        "figure.glb: clip 'clip1': found no keys, expected a clip that moves the skeleton");
  scene = moving_figure();
  for (npt::SceneNode& node : scene.nodes)
    if (node.name == "Head") node.name = "Neck";
  CHECK(message_of_character(scene).find("joint 'Neck': found two joints of this name") != std::string::npos);
}
