#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/transfer/pose_points.hpp>

#include <algorithm>
#include <vector>

#include "support/bumpy_sphere.hpp"

namespace {

npt::PosePoints choose(const npt::Mesh& mesh, std::size_t count, const npt::TransferOptions& options,
                       std::uint64_t pairing = 0) {
  npt::ChoiceScratch scratch;
  npt::PosePoints chosen;
  const auto triangles = npt::triangulate(mesh);
  npt::choose_points({mesh.coordinates(), triangles, "pose"}, count, options, pairing, scratch, chosen);
  return chosen;
}

}  // namespace

TEST_CASE("a pairing of equal counts takes each vertex once, in an order of its own") {
  const npt::Mesh mesh = support::bumpy_sphere(9, 14, 0.4);
  for (const bool invariant : {false, true}) {
    const npt::TransferOptions options{.network = {.invariant = invariant}, .seed = 3};
    const npt::PosePoints first = choose(mesh, 140, options), second = choose(mesh, 140, options, 1);
    CHECK(first.order != second.order);
    for (std::vector<std::uint32_t> order : {first.order, second.order}) {
      REQUIRE(order.size() == 140);
      std::ranges::sort(order);
      for (std::uint32_t v = 0; v < 140; ++v) CHECK(order[v] == v);
    }
  }
  CHECK(choose(mesh, 140, {.network = {.pairing = npt::Pairing::as_given}}).order.empty());
  CHECK(choose(mesh, 0, {}).order.empty());
}

TEST_CASE("chosen points follow their mesh and are refused by another") {
  const npt::Mesh mesh = support::bumpy_sphere(6, 11, 0.4);
  const npt::PosePoints chosen = choose(mesh, 200, {.seed = 4});
  CHECK(chosen.count() == 200);
  npt::Mesh moved = mesh;
  for (npt::Vec3f& p : moved.positions) p = p * 2.0F + npt::Vec3f{1, 2, 3};
  std::vector<float> a, b;
  npt::place_points({mesh.coordinates()}, chosen, a);
  npt::place_points({moved.coordinates()}, chosen, b);
  REQUIRE(a.size() == 600);
  for (std::size_t i = 0; i < a.size(); ++i)
    REQUIRE(b[i] == doctest::Approx(2 * a[i] + static_cast<float>(i % 3 + 1)).epsilon(1e-5));
  const npt::Mesh other = support::bumpy_sphere(5, 8, 0.4);
  CHECK_THROWS_WITH_AS(npt::place_points({other.coordinates(), {}, "pose"}, chosen, a),
                       "pose: found 48 vertices, expected 77, as the mesh that the points were chosen on", npt::Error);
}
