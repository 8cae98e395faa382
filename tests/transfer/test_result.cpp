#include <doctest/doctest.h>

#include <npt/mesh/normals.hpp>
#include <npt/transfer/result.hpp>

#include <algorithm>
#include <vector>

#include "transfer/shipped.hpp"

TEST_CASE("a result says how it was made, and has all that the identity's mesh has") {
  npt::Mesh identity = shipped::person(0.1F);
  identity.tags.push_back({.face = 3, .keyword = "usemtl", .value = "skin"});
  npt::recompute_normals(identity);
  identity.normals.assign(identity.vertex_count(), {0, 0, 1});
  const npt::Character hero = shipped::human().character(identity);
  const npt::Result result = shipped::human().apply(hero, shipped::pose());
  CHECK(result.method == npt::Method::body);
  CHECK(result.confidence == std::min(hero.confidence(), shipped::pose().confidence()));
  CHECK(result.warnings.empty());
  CHECK(result.mesh.corners == identity.corners);
  CHECK(result.mesh.tags.size() == 1);
  CHECK(result.mesh.normals == npt::vertex_normals(result.mesh));
  std::vector<float> positions(identity.coordinates().size());
  const npt::TransferReport report = shipped::human().apply(hero, shipped::pose(), positions);
  CHECK(positions == shipped::numbers(result.mesh.coordinates()));
  CHECK(report.method == result.method);
  CHECK(report.confidence == result.confidence);
}

TEST_CASE("a character from a view gives a mesh of its triangles; no body, no confidence") {
  const shipped::Viewed identity(shipped::person(0.1F));
  const auto transfer = npt::PoseTransfer::open(shipped::weights(), {.method = npt::Method::network}, 1);
  const npt::Character hero = transfer.character(identity.view());
  const npt::Result result = transfer.apply(hero, transfer.pose(shipped::person(1.0F), hero.vertex_count()));
  CHECK(npt::triangulate(result.mesh) == npt::triangulate(identity.mesh()));
  CHECK(result.method == npt::Method::network);
  CHECK_FALSE(result.confidence);
  CHECK(result.warnings.empty());
}
