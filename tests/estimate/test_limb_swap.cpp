#include <doctest/doctest.h>

#include <estimate/nearest_fit.hpp>
#include <estimate/people.hpp>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/limb_swap.hpp>

#include <cstddef>
#include <optional>
#include <vector>

namespace {

using npt::SmplJoint;

/// Knees that touch, and shins that go apart from there (side 1) or cross (side -1).
npt::BodyFit legs(float side) {
  npt::BodyFit fit;
  fit.axis_angles.assign(3 * npt::smpl_joint_count, 0.0F);
  const auto turn = [&](SmplJoint joint, std::size_t axis, float by) {
    fit.axis_angles[3 * joint_index(joint) + axis] = by;
  };
  turn(SmplJoint::left_hip, 2, -0.12F), turn(SmplJoint::right_hip, 2, 0.12F);
  turn(SmplJoint::left_knee, 2, 0.35F * side), turn(SmplJoint::right_knee, 2, -0.35F * side);
  // One shin before the other, the same one in both: where they cross they don't pass through each other.
  turn(SmplJoint::left_knee, 0, 0.12F), turn(SmplJoint::right_knee, 0, 0.32F);
  return fit;
}

npt::LimbSwap tangle(const npt::BodyFit& fit, const std::vector<npt::Vec3d>& mesh) {
  return {npt::people_plan(), npt::BodyLookUp(npt::mannequin(), fit, 1, npt::smpl_joint_count), mesh,
          npt::mannequin().triangles()};
}

}  // namespace

TEST_CASE("limbs touch where they come near without being grown together") {
  CHECK(npt::limbs_touch(npt::mannequin(), legs(-1)));
  npt::BodyFit rest;
  rest.axis_angles.assign(3 * npt::smpl_joint_count, 0.0F);
  CHECK_FALSE(npt::limbs_touch(npt::mannequin(), rest));
}

TEST_CASE("a body that lies right isn't torn") {
  const npt::BodyFit right = legs(-1);
  CHECK(tangle(right, npt::fitted_points(npt::mannequin(), right)).torn() < 0.01);
}

TEST_CASE("crossed shins that were fitted as if they went apart are told, and fitted right from mended places") {
  const npt::BodyFit right = legs(-1), wrong = legs(1);
  const std::vector<npt::Vec3d> points = npt::fitted_points(npt::mannequin(), right);
  const npt::LimbSwap now = tangle(wrong, points);
  CHECK(now.torn() > 0.03);
  const std::optional<npt::Correspondences> mended = now.mended();
  REQUIRE(mended);
  CHECK(mended->size() > 1000);

  const npt::CorrespondenceFitter fitter(people::mannequins());
  const npt::CorrespondenceFit fit =
      nearest_fit(fitter, npt::SampledSurface(points, npt::mannequin().triangles()), *mended);
  const std::vector<npt::Vec3d> joints = npt::fitted_joints(npt::mannequin(), fit.body),
                                truth = npt::fitted_joints(npt::mannequin(), right);
  for (const SmplJoint j : {SmplJoint::left_knee, SmplJoint::right_knee, SmplJoint::left_ankle, SmplJoint::right_ankle})
    CHECK(length(joints[joint_index(j)] - truth[joint_index(j)]) < 0.03);
  CHECK(tangle(fit.body, points).torn() < 0.01);
}

TEST_CASE("small pieces say nothing of legs, and a mesh of nothing else can't be mended") {
  const std::vector<npt::Vec3d> points = npt::fitted_points(npt::mannequin(), legs(-1));
  std::vector<npt::Vec3d> corners;
  std::vector<npt::Triangle> apart;
  for (const npt::Triangle& t : npt::mannequin().triangles()) {
    const auto first = static_cast<std::uint32_t>(corners.size());
    for (const std::uint32_t v : t) corners.push_back(points[v]);
    apart.push_back({first, first + 1, first + 2});
  }
  const npt::LimbSwap pieces(npt::people_plan(), npt::BodyLookUp(npt::mannequin(), legs(1), 1, npt::smpl_joint_count),
                             corners, apart);
  CHECK_FALSE(pieces.mended());
}
