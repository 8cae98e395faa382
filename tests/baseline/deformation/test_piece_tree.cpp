#include <doctest/doctest.h>

#include <mesh/shapes.hpp>
#include <npt/baseline/deformation/deformation_transfer.hpp>
#include <npt/baseline/deformation/piece_tree.hpp>
#include <npt/baseline/deformation/surface.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using npt::Mesh;
using npt::Vec3d;
using npt::deformation::Hook;

struct Tree {
  npt::deformation::Surface surface;
  npt::deformation::Pieces pieces;
  std::vector<Hook> hooks;

  explicit Tree(const Mesh& mesh, std::vector<std::uint32_t> roots = {0})
      : surface(npt::deformation::surface_of(mesh, "mesh")) {
    pieces = npt::deformation::pieces_of(surface);
    std::vector<char> held(pieces.count);
    for (const std::uint32_t root : roots) held[root] = 1;
    hooks = npt::deformation::PieceTree(surface, pieces.of_point, held).hooks();
  }
  /// The piece that `piece` hangs on.
  std::uint32_t parent(std::uint32_t piece) const {
    const auto hook = std::ranges::find(hooks, piece, &Hook::piece);
    return hook == hooks.end() ? npt::no_index : pieces.of_point[surface.triangles[hook->at.triangle][0]];
  }
};

/// Balls in a row, 0.2, 0.25 and 0.15 apart, of these numbers of rings, so that the order of sizes is not that of
/// places.
Mesh row_of_balls(const std::vector<std::uint32_t>& rings) {
  const float places[] = {0, 2.2F, 4.45F, 6.6F};
  Mesh mesh;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    Mesh ball = shapes::starfish(rings[i], 12);
    for (npt::Vec3f& p : ball.positions) p = npt::normalised(p);
    mesh = shapes::joined(mesh, shapes::moved(ball, {places[i], 0, 0}));
  }
  return mesh;
}

}  // namespace

TEST_CASE("a piece hangs on what is nearest, however small, and parents come first") {
  // From the largest at x = 0: small, smaller, middle. By size they are pieces 0, 2, 3, 1.
  const Tree tree(row_of_balls({12, 8, 6, 10}));
  REQUIRE(tree.pieces.count == 4);
  CHECK(tree.parent(2) == 0);
  CHECK(tree.parent(3) == 2);
  CHECK(tree.parent(1) == 3);
  REQUIRE(tree.hooks.size() == 3);
  std::vector<char> held{1, 0, 0, 0};
  for (const Hook& hook : tree.hooks) {
    CHECK(held[tree.pieces.of_point[tree.surface.triangles[hook.at.triangle][0]]] == 1);
    CHECK(held[hook.piece] == 0);
    held[hook.piece] = 1;
    CHECK(tree.pieces.of_point[hook.point] == hook.piece);
    const auto [a, b, c] = tree.surface.corners(hook.at.triangle);
    CHECK(length(a * hook.at.weights[0] + b * hook.at.weights[1] + c * hook.at.weights[2] - hook.at.point) < 1e-12);
    CHECK(length(tree.surface.points[hook.point] - hook.at.point) < 0.6);  // 0.2 at best
  }
  // Another root: the same joints the other way round.
  const Tree other(row_of_balls({12, 8, 6, 10}), {3});
  CHECK(other.parent(2) == 3);
  CHECK(other.parent(0) == 2);
  CHECK(other.parent(1) == 3);
  // Two roots: each holds its side.
  const Tree both(row_of_balls({12, 8, 6, 10}), {0, 1});
  CHECK(both.hooks.size() == 2);
  CHECK(both.parent(2) == 0);
  CHECK(both.parent(3) == 1);
}

TEST_CASE("leaves hang, and nothing hangs on them") {
  Mesh mesh = row_of_balls({12, 8});
  const auto count = static_cast<std::uint32_t>(mesh.vertex_count());
  mesh.positions.insert(mesh.positions.end(), {{1.1F, 0, 0}, {9, 9, 9}, {1.12F, 0, 0}});
  shapes::add_face(mesh, {count, count, count + 2});  // without an area, between the balls
  const Tree tree(mesh);
  REQUIRE(tree.pieces.count == 4);
  CHECK(tree.parent(1) == 0);
  CHECK(tree.parent(2) <= 1);
  CHECK(tree.parent(3) == 1);  // the vertex far out
  // Only a leaf holds itself: the others have nothing to hang on.
  const Tree nothing(mesh, {2});
  CHECK(nothing.parent(0) == npt::no_index);
}

TEST_CASE("clothes stay on the body that is deformed, all over") {
  const Mesh body = shapes::starfish(40, 60), other = shapes::starfish(40, 60, 0.3);
  Mesh dressed = other, shirt = other;
  const auto normals = npt::vertex_normals(other);
  for (std::size_t v = 0; v < shirt.positions.size(); ++v) shirt.positions[v] += normals[v] * 0.02F;  // outside
  shirt.corners.resize(3 * 2000);
  shirt.face_start.resize(2001);
  dressed = shapes::joined(dressed, shirt);
  // The body's faces move the shirt's, as they would after a registration.
  auto pairs = npt::identical_pairs(body.face_count());
  for (std::uint32_t t = 0; t < 2000; ++t) pairs.push_back({t, static_cast<std::uint32_t>(body.face_count()) + t});
  const std::vector<float> pose = shapes::bent(body, 1.0);
  const auto worst_gap = [&](bool link) {
    npt::DeformationTransferOptions options;
    options.link_pieces = link;
    std::vector<float> result(3 * dressed.vertex_count());
    npt::DeformationTransfer(body, dressed, pairs, options)(pose, result);
    const auto points = shapes::points_of(result);
    double worst = 0;
    for (std::size_t c = 0; c < shirt.corners.size(); ++c) {
      const std::size_t v = shirt.corners[c];
      worst = std::max(worst, std::abs(length(points[v + other.vertex_count()] - points[v]) - 0.02));
    }
    return worst;
  };
  CHECK(worst_gap(true) < 0.01);
  CHECK(worst_gap(true) < 0.7 * worst_gap(false));
}
