#include <doctest/doctest.h>

#include <npt/base/rotation.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/lab/rig/rig_axes.hpp>

#include <numbers>

#include "lab/rig/rigged_figure.hpp"

TEST_CASE("a rig's axes are the scene's, where its nodes don't turn it") {
  const npt::RigAxes axes = npt::rig_axes(npt::make_rig(rigged::figure(), "figure.glb"));
  CHECK(axes.turn == npt::Matrix3::identity());
  CHECK(axes.scale == doctest::Approx(1));
}

TEST_CASE("of the quarter turns the one most like a rotation is taken") {
  const npt::Matrix3 quarter = npt::rotation_matrix(npt::Vec3d{std::numbers::pi / 2, 0, 0});
  const npt::Matrix3 near = npt::rotation_matrix(npt::Vec3d{std::numbers::pi / 2 + 0.3, 0, 0});
  const npt::Matrix3 found = npt::rig::internal::quarter_turn_near(near);
  for (std::size_t i = 0; i < 3; ++i) CHECK(length(found.rows[i] - quarter.rows[i]) < 1e-12);
}
