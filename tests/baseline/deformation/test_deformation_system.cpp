#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <mesh/shapes.hpp>
#include <npt/baseline/deformation/deformation_system.hpp>
#include <npt/baseline/deformation/triangle_sources.hpp>

#include <cstdint>
#include <vector>

using npt::Vec3d;
namespace deformation = npt::deformation;

namespace {

/// A square of two triangles, a second one above it, and a flat triangle.
deformation::Surface squares() {
  return deformation::surface_of(
      shapes::mesh_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
                      {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}, {0, 0, 1}}),
      "squares");
}

std::vector<std::uint32_t> list(const deformation::TriangleSources& sources, std::size_t t) {
  return {sources.of(t).begin(), sources.of(t).end()};
}

}  // namespace

TEST_CASE("each triangle has its sources once, ascending; one without takes the nearest triangle's") {
  const deformation::Surface s = squares();
  const deformation::TriangleSources sources(s, s,
                                             std::vector<npt::TrianglePair>{{3, 2}, {1, 2}, {3, 2}, {4, 1}, {0, 0}});
  CHECK(list(sources, 0) == std::vector<std::uint32_t>{0});
  CHECK(list(sources, 1) == std::vector<std::uint32_t>{0});  // source 4 is flat
  CHECK(list(sources, 2) == std::vector<std::uint32_t>{1, 3});
  CHECK(list(sources, 3) == std::vector<std::uint32_t>{1, 3});
  CHECK(sources.size() == 7);
  const auto error = [&](std::uint32_t source, std::uint32_t target) {
    return scratch::error_of([&] {
      deformation::TriangleSources(s, s, std::vector<npt::TrianglePair>{{source, target}});
    });
  };
  CHECK(error(5, 0) == "triangle pairs: found source triangle 5, expected a number below 5");
  CHECK(error(0, 7) == "triangle pairs: found target triangle 7, expected a number below 5");
  CHECK(error(4, 0) == "triangle pairs: found none, expected a pair whose source triangle has an area");
}

TEST_CASE("gradients that agree are followed exactly, pieces from their first points on; a link holds two of them") {
  const deformation::Surface s = squares();
  const deformation::TriangleSources sources(s, s, npt::identical_pairs(4));
  const npt::Matrix3 map{{{{1.2, 0.3, 0.5}, {0, 0.8, 0}, {-0.4, 0, 1}}}};
  std::vector<npt::Matrix3> gradients(5);
  for (std::size_t t = 0; t < 5; ++t) gradients[t] = map * static_cast<double>(sources.of(t).size());

  deformation::Pieces pieces = deformation::pieces_of(s);
  REQUIRE(pieces.count == 2);
  const std::vector<Vec3d> apart =
      deformation::DeformationSystem(s, sources, pieces, {}).solve(gradients, npt::SerialExecutor());
  for (std::size_t p = 0; p < 8; ++p) CHECK(length(apart[p] - map * (s.points[p] - s.points[p < 4 ? 0 : 4])) < 1e-12);

  pieces.of_point.assign(8, 0);
  const std::vector<npt::Edge> links{{2, 6}};
  const std::vector<Vec3d> linked =
      deformation::DeformationSystem(s, sources, pieces, links).solve(gradients, npt::SerialExecutor());
  for (std::size_t p = 0; p < 8; ++p) CHECK(length(linked[p] - map * s.points[p]) < 1e-12);
}
