// Skinning knows no kind: a four-legged body without hands is bound and posed as people are.
#include <doctest/doctest.h>

#include <estimate/four_legged.hpp>

#include <npt/body/body_model.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/skin/bound_character.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

TEST_CASE("a four-legged mesh takes another pose of its kind, and has a skeleton with the plan's names") {
  const npt::BodyKind& kind = *four_legged::kind();
  const four_legged::Posed identity = four_legged::draw(1), pose = four_legged::draw(2);
  npt::BodyEstimate estimate, other;
  estimate.fit.body = identity.truth, other.fit.body = pose.truth;
  const npt::Mesh mesh = npt::to_mesh(*kind.body, identity.truth.betas, identity.truth.axis_angles);
  const npt::BoundCharacter character =
      npt::bind_character(kind, {mesh.coordinates(), kind.body->triangles(), "animal"}, estimate);
  CHECK(character.joints.size() == kind.joint_count());
  const std::vector<float> angles = character.angles(kind, pose.truth.axis_angles, other);
  CHECK(angles == pose.truth.axis_angles);
  std::vector<float> result(mesh.coordinates().size());
  character.pose(kind, angles, result);
  const npt::Mesh truth = npt::to_mesh(*kind.body, identity.truth.betas, pose.truth.axis_angles);
  double squares = 0;
  for (std::size_t i = 0; i < result.size(); ++i)
    squares += std::pow(static_cast<double>(result[i] - truth.coordinates()[i]), 2);
  CHECK(std::sqrt(squares / static_cast<double>(truth.vertex_count())) < 0.02);
  const npt::SkinnedSkeleton skeleton = character.skeleton(kind);
  REQUIRE(skeleton.joint_count() == kind.joint_count());
  CHECK(skeleton.names.front() == "pelvis");
}
