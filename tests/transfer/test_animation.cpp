#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/transfer/animation.hpp>
#include <npt/transfer/body_domain.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace {

npt::Mesh bent(float angle, float shift) {
  std::vector<float> pose(72, 0.0F);
  pose[3 * 16 + 2] = -angle, pose[3 * 4] = angle / 2;
  npt::Mesh mesh = npt::to_mesh(npt::mannequin(), std::vector<float>{0.5F}, pose);
  for (npt::Vec3f& p : mesh.positions) p.z += shift;
  return mesh;
}

}  // namespace

TEST_CASE("an animation is its frames one after another, on a skeleton that gives the same, along the root") {
  const auto transfer = npt::PoseTransfer::open(NPT_SOURCE_DIR "/examples/weights/human.safetensors", {}, 1);
  const npt::Mesh identity = npt::to_mesh(npt::mannequin());
  const npt::Character hero = transfer.character(identity);
  const std::vector<npt::Mesh> meshes{bent(0.2F, 0), bent(0.6F, 0.2F), bent(0.9F, 0.5F)};
  npt::FrameSource source;
  source.count = meshes.size();
  source.frame = [&](std::size_t i) -> const npt::Mesh& { return meshes[i]; };
  const npt::Animation in_place = npt::animate(transfer, hero, source, false);
  const npt::Animation moving = npt::animate(transfer, hero, source);
  REQUIRE(in_place.positions.size() == 3);
  REQUIRE(in_place.skeleton);
  REQUIRE(in_place.motions.size() == 3);
  CHECK(in_place.report.method == npt::Method::body);
  npt::PoseTracker tracker(transfer);
  const auto triangles = npt::triangulate(identity);
  for (std::size_t i = 0; i < 3; ++i) {
    std::vector<float> alone(hero.positions().size());
    transfer.apply(hero, tracker.next({meshes[i].coordinates(), triangles, "frame"}, hero.vertex_count()), alone);
    CHECK(alone == in_place.positions[i]);
  }
  // Blended by all weights, the joints' motions are the positions.
  const npt::SkinnedSkeleton& skeleton = *moving.skeleton;
  double worst = 0;
  for (std::size_t v = 0; v < hero.vertex_count(); ++v) {
    npt::Vec3d sum;
    for (std::size_t k = skeleton.start[v]; k < skeleton.start[v + 1]; ++k)
      sum += moving.motions[2][skeleton.influences[k].joint](identity.positions[v].as<double>()) *
             static_cast<double>(skeleton.influences[k].weight);
    worst = std::max(worst, length(sum - npt::point_at(moving.positions[2], v)));
  }
  CHECK(worst < 1e-5);
  // The poses went half a metre along z, on legs as long.
  const double went = static_cast<double>(moving.positions[2][2] - in_place.positions[2][2]) -
                      static_cast<double>(moving.positions[0][2] - in_place.positions[0][2]);
  CHECK(went == doctest::Approx(0.5).epsilon(0.1));
  const npt::Scene scene = npt::animation_scene(identity, "hero", moving, "walk", std::vector<double>{0, 0.5, 1});
  CHECK(scene.clips.size() == 1);
  CHECK(scene.skins.size() == 1);
}

TEST_CASE("an animation tells how far it is, and stops where it is asked to") {
  const auto transfer = npt::PoseTransfer::open(NPT_SOURCE_DIR "/examples/weights/human.safetensors",
                                                {.method = npt::Method::network}, 1);
  const npt::Mesh identity = npt::to_mesh(npt::mannequin());
  const npt::Character hero = transfer.character(identity);
  const npt::Mesh pose = bent(0.2F, 0);
  npt::FrameSource source;
  source.count = 3;
  source.frame = [&](std::size_t) -> const npt::Mesh& { return pose; };
  int calls = 0;
  const npt::Animation whole =
      npt::animate(transfer, hero, source, true, npt::JointNames::vrm, {.progress = [&](double) { ++calls; }});
  CHECK(calls == 4);
  CHECK_FALSE(whole.skeleton);
  CHECK(npt::animation_scene(identity, "hero", whole, "walk", std::vector<double>{0, 1, 2}).clips.size() == 1);
  try {
    (void)npt::animate(transfer, hero, source, true, npt::JointNames::vrm, {.stop = [&] { return ++calls > 6; }});
    FAIL("not stopped");
  } catch (const npt::Error& error) {
    CHECK(error.code() == npt::ErrorCode::stopped);
  }
}
