// SMPL's skeleton: a tree whose joints have left and right twins.
#include <doctest/doctest.h>
#include <npt/body/skeleton.hpp>

#include <string>

TEST_CASE("parents stand before their children, and joint 0 is the only root") {
  CHECK(npt::smpl_parents[0] == -1);
  for (std::size_t j = 1; j < npt::smpl_joint_count; ++j) {
    CHECK(npt::smpl_parents[j] >= 0);
    CHECK(npt::smpl_parents[j] < static_cast<int>(j));
  }
}

TEST_CASE("joint_index is the place of a joint's name") {
  CHECK(npt::smpl_joint_names[npt::joint_index(npt::SmplJoint::pelvis)] == "pelvis");
  CHECK(npt::smpl_joint_names[npt::joint_index(npt::SmplJoint::left_elbow)] == "l_elbow");
  CHECK(npt::smpl_joint_names[npt::joint_index(npt::SmplJoint::right_hand)] == "r_hand");
}

TEST_CASE("a right joint follows its left twin, and their parents are twins or one joint") {
  const auto& names = npt::smpl_joint_names;
  for (std::size_t j = 0; j < npt::smpl_joint_count; ++j) {
    if (!names[j].starts_with("l_")) continue;
    REQUIRE(names[j + 1] == "r_" + std::string(names[j].substr(2)));
    const auto left = static_cast<std::size_t>(npt::smpl_parents[j]);
    const auto right = static_cast<std::size_t>(npt::smpl_parents[j + 1]);
    CHECK(right == (names[left].starts_with("l_") ? left + 1 : left));
  }
}
