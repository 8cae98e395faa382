#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/skeleton.hpp>
#include <training/plan_parts.hpp>
#include <training/rest_surface.hpp>

#include <cstddef>
#include <vector>

#include "training/quadruped_figure.hpp"

TEST_CASE("people stand upright on feet that stay; hands count with wrists") {
  using enum npt::SmplJoint;
  const npt::rig::internal::RestSurface rest = npt::rig::internal::rest_surface(npt::mannequin());
  const npt::rig::internal::PlanParts parts(npt::people_plan(), rest.joints, npt::rig::internal::lowest(rest));
  CHECK(parts.axis() == 1);
  CHECK(parts.across() == 2);
  REQUIRE(parts.trunk().size() == 5);
  CHECK(parts.trunk().back() == npt::joint_index(neck));
  for (const npt::SmplJoint joint : {pelvis, spine2, neck, head, left_ankle, right_foot})
    CHECK(parts.stays(npt::joint_index(joint)));
  for (const npt::SmplJoint joint : {left_hip, right_collar, left_wrist, right_hand})
    CHECK_FALSE(parts.stays(npt::joint_index(joint)));
  CHECK(parts.other(npt::joint_index(left_wrist)) == npt::joint_index(left_hand));
  CHECK(parts.other(npt::joint_index(right_foot)) == npt::joint_index(right_ankle));
  CHECK(parts.other(npt::joint_index(left_elbow)) == npt::joint_index(left_elbow));
  std::vector<double> row(npt::smpl_joint_count);
  row[npt::joint_index(left_wrist)] = 0.25, row[npt::joint_index(left_hand)] = 0.5;
  CHECK(parts.weight(row, npt::joint_index(left_hand)) == 0.75);
}

TEST_CASE("animals stand along z on feet that stay, below bones that are turned; a tail's tip is no hand") {
  const npt::BodyPlan& plan = quadruped::plan();
  const npt::rig::internal::PlanParts parts(plan, quadruped::joints(), 0);
  CHECK(parts.axis() == 2);
  CHECK(parts.across() == 1);
  CHECK(parts.trunk().back() == plan.joint("neck1"));
  for (const char* name : {"chest", "neck2", "head", "l_forefoot", "r_hindfoot"}) CHECK(parts.stays(plan.joint(name)));
  for (const char* name : {"l_wrist", "r_hock", "tail5", "l_elbow", "l_ear"})
    CHECK_FALSE(parts.stays(plan.joint(name)));
  CHECK(parts.is_round(plan.joint("l_forefoot")));
  CHECK_FALSE(parts.is_round(plan.joint("l_wrist")));
  CHECK_FALSE(parts.is_round(plan.joint("tail5")));
  CHECK(parts.other(plan.joint("l_forefoot")) == plan.joint("l_forefoot"));
}
