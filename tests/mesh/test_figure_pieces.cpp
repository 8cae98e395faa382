#include <doctest/doctest.h>

#include <npt/mesh/figure_pieces.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace {

/// Pieces of a mesh, one behind the other.
struct Pieces {
  std::vector<float> xyz;
  std::vector<npt::Triangle> triangles;
  std::vector<std::size_t> ends;  ///< of each piece, in triangles

  /// A strip of `count` + 2 points that goes up and down between two heights.
  void add_strip(float x, float low, float high, std::uint32_t count) {
    const auto first = static_cast<std::uint32_t>(xyz.size() / 3);
    for (std::uint32_t i = 0; i < count + 2; ++i)
      xyz.insert(xyz.end(), {x + 0.01F * static_cast<float>(i), i % 2 == 0 ? low : high, 0});
    for (std::uint32_t i = 0; i < count; ++i) triangles.push_back({first + i, first + i + 1, first + i + 2});
    ends.push_back(triangles.size());
  }
  void add_floor(float y, float size) {
    const auto first = static_cast<std::uint32_t>(xyz.size() / 3);
    for (const auto& [x, z] : {std::pair{-size, -size}, {size, -size}, {size, size}, {-size, size}})
      xyz.insert(xyz.end(), {x, y, z});
    triangles.push_back({first, first + 1, first + 2});
    triangles.push_back({first, first + 2, first + 3});
    ends.push_back(triangles.size());
  }
  npt::MeshView view() const { return {xyz, triangles, "mesh"}; }
  /// Which pieces a guess holds, each wholly or not at all.
  std::vector<bool> held(const std::vector<bool>& guess) const {
    std::vector<bool> result;
    std::size_t begin = 0;
    for (const std::size_t end : ends) {
      const auto from = guess.begin() + static_cast<std::ptrdiff_t>(begin);
      result.push_back(*from);
      CHECK(std::count(from, guess.begin() + static_cast<std::ptrdiff_t>(end), *from) ==
            static_cast<std::ptrdiff_t>(end - begin));
      begin = end;
    }
    return result;
  }
};

using Held = std::vector<bool>;

}  // namespace

TEST_CASE("a figure is guessed without its floor, strays and a smaller figure beside it") {
  Pieces pieces;
  pieces.add_strip(0, 0, 1.8F, 60);        // a figure
  pieces.add_strip(0.1F, 1.6F, 1.9F, 10);  // its hair
  pieces.add_floor(0, 2);
  pieces.add_strip(5, 0, 1.7F, 50);  // another one
  pieces.add_strip(60, 0, 0.1F, 1);  // a stray triangle
  const std::vector<std::vector<bool>> guesses = npt::figure_pieces(pieces.view());
  REQUIRE(guesses.size() == 1);  // the piece with the most points and its group are the same
  CHECK(pieces.held(guesses[0]) == Held{true, true, false, false, false});
}

TEST_CASE("of a figure in parts the group is one guess, its largest part with what lies within another") {
  Pieces pieces;
  pieces.add_strip(0, 0.8F, 1.8F, 60);
  pieces.add_strip(0.1F, 0, 0.8F, 40);
  pieces.add_floor(0, 2);
  const std::vector<std::vector<bool>> guesses = npt::figure_pieces(pieces.view());
  REQUIRE(guesses.size() == 2);
  CHECK(pieces.held(guesses[0]) == Held{true, true, false});
  CHECK(pieces.held(guesses[1]) == Held{true, false, false});
}

TEST_CASE("a mesh of one piece, and pieces that are all one figure, are no guess") {
  Pieces pieces;
  pieces.add_strip(0, 0, 1.8F, 60);
  CHECK(npt::figure_pieces(pieces.view()).empty());
  pieces.add_strip(0.1F, 1.6F, 1.8F, 10);
  CHECK(npt::figure_pieces(pieces.view()).empty());
  CHECK(npt::figure_pieces({}).empty());
}

TEST_CASE("figures are numbered by their points; floors, strays and what a figure wears are none") {
  Pieces pieces;
  pieces.add_strip(5, 0, 1.7F, 50);
  pieces.add_floor(0, 20);
  pieces.add_strip(0, 0, 1.8F, 60);
  pieces.add_strip(0.1F, 1.6F, 1.9F, 10);
  pieces.add_strip(60, 0, 0.1F, 1);
  const std::vector<std::vector<bool>> figures = npt::figures(pieces.view());
  REQUIRE(figures.size() == 2);
  CHECK(pieces.held(figures[0]) == Held{false, false, true, true, false});
  CHECK(pieces.held(figures[1]) == Held{true, false, false, false, false});
  Pieces one;
  one.add_strip(0, 0, 1.8F, 60);
  REQUIRE(npt::figures(one.view()).size() == 1);
  CHECK(npt::figures(one.view())[0] == std::vector<bool>(60, true));
}
