#include <doctest/doctest.h>

#include <mesh/shapes.hpp>
#include <npt/baseline/deformation/registration.hpp>
#include <npt/baseline/deformation/registration_system.hpp>
#include <npt/baseline/deformation/registration_target.hpp>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

using npt::Matrix3;
using npt::Vec3d;
using npt::deformation::RegistrationSystem;
using npt::deformation::RegistrationTarget;

TEST_CASE("the closest point faces the same way, and none is found across an open border") {
  // Two parallel squares, the upper one facing up and the lower one down.
  const npt::Mesh mesh =
      shapes::mesh_of({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
                      {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}});
  const RegistrationTarget target(npt::deformation::surface_of(mesh, "squares"));
  const auto up = target.closest({0.3, 0.2, 0.4}, {0, 0, 1}), down = target.closest({0.3, 0.2, 0.4}, {0, 0, -1});
  REQUIRE((up && down));
  CHECK(length(*up - Vec3d{0.3, 0.2, 1}) < 1e-15);
  CHECK(length(*down - Vec3d{0.3, 0.2, 0}) < 1e-15);
  CHECK(target.closest({0.3, 0.3, 0.9}, {0, 0, 1}));  // on the diagonal, an inner edge
  CHECK(!target.closest({-0.1, 0.5, 1}, {0, 0, 1}));
  CHECK(!target.closest({2, 2, 1}, {0, 0, 1}));
  CHECK(!target.closest({0.3, 0.2, 1}, {1, 0, 0}));
}

TEST_CASE("a system's solution is the least squares one, with fixed variables and goals of one time") {
  RegistrationSystem system(4);
  system.use(0);
  system.use(1);
  system.fix(2, {3, 0, 6});
  system.number_unknowns();  // variable 3 isn't used
  // x1 - x0 = (1, 0, 0) and x2 - x1 = (1, 0, 0), of equal weight; with x2 fixed both can be.
  const Matrix3 step = npt::outer({1, 0, 0}, {1, 0, 0});
  for (std::uint32_t v = 0; v < 2; ++v)
    system.add(std::array<RegistrationSystem::Term, 2>{{{v + 1, {1, 0, 0}}, {v, {-1, 0, 0}}}}, 2, step);
  const std::vector<Vec3d> free = system.solve({}, 1);
  CHECK(length(free[0] - Vec3d{1, 0, 6}) < 1e-14);
  CHECK(length(free[1] - Vec3d{2, 0, 6}) < 1e-14);
  CHECK(free[2] == Vec3d{3, 0, 6});
  // 2 (x1 - x0 - 1)^2 + 2 (2 - x1)^2 + (x0 - 5)^2 along x
  const std::vector<std::pair<std::uint32_t, Vec3d>> goals{{0, {5, 0, 6}}, {2, {9, 9, 9}}};
  const std::vector<Vec3d> pulled = system.solve(goals, 1);
  CHECK(length(pulled[0] - Vec3d{3, 0, 6}) < 1e-14);
  CHECK(length(pulled[1] - Vec3d{3, 0, 6}) < 1e-14);
  CHECK(length(system.solve({}, 1)[0] - Vec3d{1, 0, 6}) < 1e-14);
}
