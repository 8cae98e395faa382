#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/proportions.hpp>
#include <npt/lab/clothes.hpp>
#include <npt/mesh/topology.hpp>

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "body/small_body.hpp"

TEST_CASE("a dressed body is the body, with pieces around it that move along") {
  const npt::BodyModel& body = npt::mannequin();
  const npt::BodyModel dressed = npt::with_clothes(body);
  const std::size_t own = body.vertex_count();
  REQUIRE(dressed.vertex_count() > own + 500);
  // The shirt, the shorts, two shoes and the hair.
  const std::vector<std::uint32_t> piece = npt::connected_components(dressed.triangles(), dressed.vertex_count());
  const std::set<std::uint32_t> before(piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(own)),
      clothes(piece.begin() + static_cast<std::ptrdiff_t>(own), piece.end());
  CHECK(clothes.size() == 5);
  for (const std::uint32_t p : clothes) CHECK_FALSE(before.contains(p));

  npt::Random random(3);
  const auto shape = npt::sample_shape(random, body.shape_count());
  const auto pose = npt::sample_pose(random);
  const npt::Mesh bare = npt::to_mesh(body, shape, {pose.begin(), pose.end()});
  const npt::Mesh worn = npt::to_mesh(dressed, shape, {pose.begin(), pose.end()});
  for (std::size_t v = 0; v < own; v += 31) CHECK(worn.positions[v] == bare.positions[v]);
  CHECK(dressed.joints(shape) == body.joints(shape));
  // Each of its points lies 1 to 2 cm from the point that it covers, and so not much farther from the nearest one.
  for (std::size_t v = own; v < worn.positions.size(); v += 17) {
    float least = 1;
    for (const npt::Vec3f p : bare.positions) least = std::min(least, length(p - worn.positions[v]));
    CHECK(least < 0.03F);
    CHECK(least > 0.002F);
  }
}

TEST_CASE("bodies with proportions are dressed, too") {
  const npt::BodyModel dressed = npt::with_clothes(npt::with_proportions(npt::mannequin()));
  CHECK(dressed.shape_count() == npt::mannequin().shape_count() + npt::body_proportion_count);
}

TEST_CASE("a body of other joints can't be dressed") {
  CHECK_THROWS_WITH_AS(npt::with_clothes(npt::BodyModel(small_body(), "small")),
                       "body: found 3 joints, expected SMPL's 24, for clothes", npt::Error);
}
