#include <doctest/doctest.h>

#include <mesh/zoo.hpp>
#include <npt/base/random.hpp>
#include <npt/mesh/permute.hpp>
#include <npt/mesh/vertex_order.hpp>

#include <cmath>
#include <cstring>
#include <limits>

namespace {

std::vector<npt::Vec3f> in_order(const std::vector<npt::Vec3f>& points, const std::vector<std::uint32_t>& order) {
  std::vector<npt::Vec3f> result;
  result.reserve(order.size());
  for (const std::uint32_t v : order) result.push_back(points[v]);
  return result;
}

bool same_bits(const std::vector<npt::Vec3f>& a, const std::vector<npt::Vec3f>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(npt::Vec3f)) == 0;
}

npt::Mesh points(std::vector<npt::Vec3f> positions) { return zoo::mesh(std::move(positions), {}); }

/// Random points on a coarse grid, so that many coincide, with zeros of both signs.
npt::Mesh crowd(std::uint32_t count) {
  npt::Random random(3);
  npt::Mesh mesh;
  const auto coordinate = [&] {
    const int k = static_cast<int>(random.below(4)) - 1;
    return k == 0 && random.below(2) == 0 ? -0.0F : static_cast<float>(k) * 0.5F;
  };
  for (std::uint32_t i = 0; i < count; ++i) mesh.positions.push_back({coordinate(), coordinate(), coordinate()});
  return mesh;
}

}  // namespace

TEST_CASE("inverse_order undoes an order and refuses what is none") {
  npt::Random random(1);
  const std::vector<std::uint32_t> order = npt::random_permutation(100, random);
  const std::vector<std::uint32_t> inverse = npt::inverse_order(order);
  for (std::uint32_t i = 0; i < 100; ++i) CHECK(inverse[order[i]] == i);
  CHECK_THROWS_WITH(npt::inverse_order(std::vector<std::uint32_t>{0, 0}),
                    "vertex order: entry 1: found 0 for the second time, expected each number below 2 once");
  CHECK_THROWS_AS(npt::inverse_order(std::vector<std::uint32_t>{0, 2}), npt::Error);
}

TEST_CASE("the canonical order is lexicographic by value") {
  const npt::Mesh mesh = points({{1, 0, 0}, {-1, 5, 5}, {0, 2, 0}, {-0.0F, 1, 9}, {1e-45F, 0, 0}, {-3e38F, 0, 0}});
  CHECK(npt::canonical_order(mesh.coordinates()) == std::vector<std::uint32_t>{5, 1, 3, 2, 4, 0});
  CHECK(npt::canonical_order({}).empty());
}

TEST_CASE("permuting the vertices leaves the canonical sequences of coordinates the same, bit for bit") {
  const npt::Mesh mesh = crowd(500);
  const std::vector<npt::Vec3f> canonical = in_order(mesh.positions, npt::canonical_order(mesh.coordinates()));
  npt::Random random(4);
  for (int trial = 0; trial < 5; ++trial) {
    const npt::Mesh other = npt::permute_vertices(mesh, npt::random_permutation(500, random));
    CHECK(same_bits(in_order(other.positions, npt::canonical_order(other.coordinates())), canonical));
  }
}

TEST_CASE("a NaN has its place in the order too") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const npt::Mesh mesh = points({{nan, 0, 0}, {1, 0, 0}, {std::numeric_limits<float>::infinity(), 0, 0}});
  CHECK(npt::canonical_order(mesh.coordinates()) == std::vector<std::uint32_t>{1, 2, 0});
}

TEST_CASE("coincident vertices share one representative, the same point in every vertex order") {
  const npt::Mesh mesh = crowd(300);
  const std::vector<std::uint32_t> order = npt::canonical_order(mesh.coordinates());
  const std::vector<std::uint32_t> representative = npt::coincident_representatives(mesh.coordinates(), order);
  CHECK(representative == npt::coincident_representatives(mesh.coordinates()));
  const std::vector<std::uint32_t> rank = npt::inverse_order(order);
  std::size_t groups = 0;
  for (std::uint32_t v = 0; v < 300; ++v) {
    CHECK(mesh.positions[representative[v]] == mesh.positions[v]);  // == takes -0 for 0
    CHECK(rank[representative[v]] <= rank[v]);
    CHECK(representative[representative[v]] == representative[v]);
    groups += representative[v] == v ? 1U : 0U;
    for (std::uint32_t u = 0; u < v; ++u)
      CHECK((mesh.positions[u] == mesh.positions[v]) == (representative[u] == representative[v]));
  }
  CHECK(groups == 64);
  npt::Random random(6);
  const std::vector<std::uint32_t> permutation = npt::random_permutation(300, random);
  const npt::Mesh other = npt::permute_vertices(mesh, permutation);
  const std::vector<std::uint32_t> moved = npt::coincident_representatives(other.coordinates());
  const std::vector<std::uint32_t> other_rank = npt::inverse_order(npt::canonical_order(other.coordinates()));
  for (std::uint32_t i = 0; i < 300; ++i) CHECK(other_rank[moved[i]] == rank[representative[permutation[i]]]);
}
