#include <doctest/doctest.h>

#include <npt/mesh/piece_links.hpp>

#include <vector>

namespace {

using npt::Edge;
using npt::Triangle;
using npt::Vec3d;

/// Two triangles over each other, `gap` apart; the upper faces up or down.
struct Pair {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;

  explicit Pair(double gap, bool same_way = true)
      : points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.01, 0, gap}, {1, 0.01, gap}, {0, 1, gap}},
        triangles{{0, 1, 2}, same_way ? Triangle{3, 4, 5} : Triangle{3, 5, 4}} {}
  std::vector<Edge> links(double reach) const { return npt::piece_links(points, triangles, reach); }
};

}  // namespace

TEST_CASE("pieces that lie on each other are linked at their nearest points, each link once") {
  CHECK(Pair(0.1).links(0.2) == std::vector<Edge>{{0, 3}, {1, 4}, {2, 5}});
  CHECK(Pair(0.3).links(0.2).empty());
}

TEST_CASE("what faces each other isn't linked, nor what hangs together") {
  CHECK(Pair(0.1, false).links(0.2).empty());
  Pair joined(0.1);
  joined.triangles.push_back({2, 5, 1});
  CHECK(joined.links(0.2).empty());
}

TEST_CASE("points of no triangle, no triangles at all, and no reach give no links") {
  Pair pair(0.1);
  pair.points.push_back({0, 0, 0.05});
  CHECK(pair.links(0.2) == std::vector<Edge>{{0, 3}, {1, 4}, {2, 5}});
  CHECK(pair.links(0).empty());
  pair.triangles.clear();
  CHECK(pair.links(0.2).empty());
}

TEST_CASE("far from the origin and far apart, cells are found as well") {
  Pair pair(0.1);
  for (Vec3d& p : pair.points) p += Vec3d{-1e6, 3e5, 7e5};
  CHECK(pair.links(0.2).size() == 3);
  pair.points[0] = {1e300, 0, 0};
  (void)pair.links(0.2);
}
