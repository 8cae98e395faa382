// Vertices at one point made one.
#include <doctest/doctest.h>
#include <npt/mesh/weld.hpp>

#include <cstdint>
#include <vector>

using Numbers = std::vector<std::uint32_t>;

TEST_CASE("vertices at one point become one, numbered as their first vertices stand") {
  const npt::Welding welding = npt::weld(std::vector<float>{5, 0, 0, 1, 2, 3, 5, -0.0F, 0, 0, 0, 0, 1, 2, 3, 5, 0, 0});
  CHECK(welding.point_of == Numbers{0, 1, 0, 2, 1, 0});
  CHECK(welding.vertex_of == Numbers{0, 1, 3});
  CHECK(welding.point_count() == 3);
}

TEST_CASE("triangles follow their corners; one between vertices of a seam collapses") {
  const npt::Welding welding = npt::weld(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0});
  CHECK(welding.welded(std::vector<npt::Triangle>{{3, 1, 2}, {0, 3, 1}}) ==
        std::vector<npt::Triangle>{{0, 1, 2}, {0, 0, 1}});
}

TEST_CASE("nothing is welded that is not equal, and nothing at all on request") {
  CHECK(npt::weld(std::vector<float>{1, 1, 1, 1, 1, 1.0000001F}).point_count() == 2);
  CHECK(npt::weld({}).point_count() == 0);
  const npt::Welding open = npt::unwelded(3);
  CHECK(open.point_of == Numbers{0, 1, 2});
  CHECK(open.vertex_of == Numbers{0, 1, 2});
}
