#include <doctest/doctest.h>

#include <npt/body/kinematics.hpp>

#include <array>
#include <cmath>
#include <vector>

using npt::Matrix3;
using npt::Rigid;
using npt::Vec3d;

TEST_CASE("a joint's rotation is put among axis angles and read again") {
  std::array<float, 6> angles{};
  const Matrix3 r = npt::rotation_matrix({0.3, -1.1, 0.7});
  npt::set_joint_rotation(angles, 1, r);
  CHECK(npt::joint_rotation(angles, 0) == Matrix3::identity());
  CHECK((npt::joint_rotation(angles, 1) - r).squared_norm() < 1e-12);
}

TEST_CASE("a joint turns what hangs on it and stays where its parent puts it") {
  const std::array<int, 3> parents{-1, 0, 1};
  const std::array<Vec3d, 3> joints{Vec3d{0, 1, 0}, Vec3d{1, 1, 0}, Vec3d{2, 1, 0}};
  std::array<Matrix3, 3> rotations{Matrix3::identity(), Matrix3::identity(), Matrix3::identity()};
  std::vector<Rigid> motions;
  npt::forward_kinematics(parents, joints, rotations, motions);
  for (const Rigid& m : motions) CHECK((m.rotation == Matrix3::identity() && m.shift == Vec3d{}));

  const double quarter = std::acos(0.0);
  rotations[1] = rotations[2] = npt::rotation_matrix({0, 0, quarter});
  npt::forward_kinematics(parents, joints, rotations, motions);
  CHECK(length(motions[0](joints[1]) - joints[1]) < 1e-14);
  CHECK(length(motions[1](joints[1]) - joints[1]) < 1e-14);
  CHECK(length(motions[1](joints[2]) - Vec3d{1, 2, 0}) < 1e-14);
  CHECK(length(motions[2](joints[2]) - Vec3d{1, 2, 0}) < 1e-14);
  CHECK(length(motions[2](Vec3d{3, 1, 0}) - Vec3d{0, 2, 0}) < 1e-14);

  std::array<double, 18> feature{};
  npt::pose_feature(rotations, feature);
  const std::array<double, 9> expected{-1, -1, 0, 1, -1, 0, 0, 0, 0};
  for (std::size_t k = 0; k < 18; ++k) CHECK(std::abs(feature[k] - expected[k % 9]) < 1e-14);
}
