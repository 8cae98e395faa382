#include <doctest/doctest.h>
#include <npt/transfer/root_trajectory.hpp>

#include <array>
#include <vector>

TEST_CASE("a character goes as far as its legs are longer, and its lowest point comes to the ground") {
  const std::array<npt::JointPose, 3> poses{npt::JointPose{{}, {1, 5, 2}, 0.8}, npt::JointPose{{}, {1, 5.5, 4}, 1.0},
                                            npt::JointPose{{}, {2, 5, 6}, 1.2}};
  const std::array<double, 3> lowest{-1, -1.25, -1};
  const std::vector<npt::Vec3d> trajectory = npt::root_trajectory(2, poses, lowest, 0.5);
  REQUIRE(trajectory.size() == 3);
  // Twice the pose's trajectory; the deepest of -1, -1.25 + 1 and -1 is -1.
  CHECK(trajectory[0] == npt::Vec3d{0, 1.5, 0});
  CHECK(trajectory[1] == npt::Vec3d{0, 2.5, 4});
  CHECK(trajectory[2] == npt::Vec3d{2, 1.5, 8});
}

TEST_CASE("without legs there is no trajectory") {
  const std::array<npt::JointPose, 1> poses{npt::JointPose{{}, {1, 5, 2}, 0}};
  CHECK(npt::root_trajectory(2, poses, std::array{0.0}, 0).empty());
  CHECK(npt::root_trajectory(0, std::array{npt::JointPose{{}, {}, 1}}, std::array{0.0}, 0).empty());
  CHECK(npt::root_trajectory(1, {}, {}, 0).empty());
}
