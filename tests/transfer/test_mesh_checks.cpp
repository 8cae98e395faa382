#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/transfer/mesh_checks.hpp>

#include <limits>
#include <vector>

namespace {

using Triangles = std::vector<npt::Triangle>;
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

}  // namespace

TEST_CASE("meshes that can't be transferred are named") {
  const std::vector<float> corner{0, 0, 0, 1, 0, 0, 0, 1, 0}, point{1, 2, 3, 1, 2, 3},
      unknown{not_a_number, 0, 0, not_a_number, 0, 0};
  const Triangles beyond{{0, 1, 3}};
  CHECK_NOTHROW(npt::internal::expect_transferable({corner, {}, "m"}));
  CHECK_NOTHROW(npt::internal::expect_transferable({unknown, {}, "m"}));  // NaN counts as different
  CHECK_THROWS_WITH_AS(npt::internal::expect_transferable({{}, {}, "m"}),
                       "m: found no vertices, expected at least one vertex", npt::Error);
  CHECK_THROWS_WITH_AS(npt::internal::expect_transferable({point, {}, "m"}),
                       "m: found all vertices in one point, expected a mesh with an extent", npt::Error);
  CHECK_THROWS_WITH_AS(npt::internal::expect_transferable({corner, beyond, "m"}),
                       "m: triangle 0: found vertex 3, expected a number below 3", npt::Error);
}

TEST_CASE("a surface has an area, and all of its coordinates are finite") {
  const Triangles one{{0, 1, 2}};
  const std::vector<float> corner{0, 0, 0, 1, 0, 0, 0, 1, 0}, line{0, 0, 0, 1, 0, 0, 2, 0, 0};
  std::vector<float> broken = corner;
  broken.insert(broken.end(), {not_a_number, 0, 0});
  CHECK(npt::internal::has_surface({corner, one, "m"}));
  CHECK_FALSE(npt::internal::has_surface({corner, {}, "m"}));
  CHECK_FALSE(npt::internal::has_surface({line, one, "m"}));
  CHECK_FALSE(npt::internal::has_surface({broken, one, "m"}));
}

TEST_CASE("names, memory and results") {
  const std::vector<float> a{0, 0, 0, 1, 0, 0}, b = a;
  CHECK(npt::internal::named({a, {}, ""}, "pose").name == "pose");
  CHECK(npt::internal::named({a, {}, "x.obj"}, "pose").name == "x.obj");
  CHECK(npt::internal::same_memory({a, {}, "a"}, {a, {}, "b"}));
  CHECK_FALSE(npt::internal::same_memory({a, {}, "a"}, {b, {}, "a"}));
  CHECK_NOTHROW(npt::internal::expect_result(6, 6));
  CHECK_THROWS_WITH_AS(npt::internal::expect_result(5, 6),
                       "result: found 5 numbers, expected 6, three for each of the identity's vertices", npt::Error);
}
