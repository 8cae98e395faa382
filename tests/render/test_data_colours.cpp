/// Colours for numbers: order, evenness, and what they are given for.
#include <doctest/doctest.h>

#include <render/data_colours.hpp>
#include <render/shapes.hpp>

#include <npt/base/error.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace {

using render::Colour;

double apart(Colour a, Colour b) { return npt::length(render::to_oklab(a) - render::to_oklab(b)); }

bool shown(Colour c) { return std::min({c.x, c.y, c.z}) >= -1e-4F && std::max({c.x, c.y, c.z}) <= 1.0001F; }

}  // namespace

TEST_CASE("OKLab: white, black, and back") {
  const npt::Vec3d white = render::to_oklab({1, 1, 1});
  CHECK(white.x == doctest::Approx(1).epsilon(1e-4));
  CHECK(std::abs(white.y) < 1e-4);
  CHECK(std::abs(white.z) < 1e-4);
  CHECK(render::to_oklab({0, 0, 0}).x == doctest::Approx(0));
  for (const Colour c : {Colour{0.2F, 0.5F, 0.9F}, {1, 0, 0}, {0, 0, 1}, {0.3F, 0.3F, 0.3F}})
    CHECK(npt::length(render::from_oklab(render::to_oklab(c)) - c) < 1e-4F);
}

TEST_CASE("heat: equal steps look equally far apart, lightness falls all the way, every colour can be shown") {
  constexpr int steps = 100;
  double shortest = 1, longest = 0;
  for (int i = 0; i <= steps; ++i) {
    const Colour here = render::heat_colour(static_cast<float>(i) / steps);
    CHECK(shown(here));
    if (i == 0) continue;
    const Colour before = render::heat_colour(static_cast<float>(i - 1) / steps);
    CHECK(render::to_oklab(here).x < render::to_oklab(before).x);
    shortest = std::min(shortest, apart(here, before));
    longest = std::max(longest, apart(here, before));
  }
  CHECK(longest < 1.4 * shortest);  // shorter around the corners of the path
}

TEST_CASE("beyond its ends the scale keeps their colours; NaN is the darkest") {
  CHECK(render::heat_colour(-3) == render::heat_colour(0));
  CHECK(render::heat_colour(7) == render::heat_colour(1));
  CHECK(render::heat_colour(std::numeric_limits<float>::quiet_NaN()) == render::heat_colour(1));
  const std::vector<double> values{0, 5, 10, 20};
  const std::vector<Colour> colours = render::heat_colours(values, 0, 10);
  CHECK(colours[0] == render::heat_colour(0));
  CHECK(apart(colours[1], render::heat_colour(0.5F)) < 1e-5);
  CHECK(colours[3] == colours[2]);
  CHECK(render::heat_colours(values, 4, 4).size() == 4);
}

TEST_CASE("hues have one lightness, are all different, and can be shown") {
  for (int i = 0; i <= 60; ++i) {
    const Colour here = render::hue_colour(static_cast<float>(i) / 60);
    CHECK(shown(here));
    CHECK(render::to_oklab(here).x == doctest::Approx(0.74).epsilon(1e-3));
    for (int k = 0; k < i; ++k) CHECK(apart(here, render::hue_colour(static_cast<float>(k) / 60)) > 0.008);
  }
}

TEST_CASE("index colours go from the first vertex to the last") {
  const std::vector<Colour> colours = render::index_colours(101);
  REQUIRE(colours.size() == 101);
  CHECK(colours.front() == render::hue_colour(0));
  CHECK(colours.back() == render::hue_colour(1));
  CHECK(apart(colours[50], render::hue_colour(0.5F)) < 1e-6);
  CHECK(render::index_colours(1).size() == 1);
  CHECK(render::index_colours(0).empty());
}

TEST_CASE("normals as colours; no normal is grey") {
  npt::Mesh mesh = shapes::square(1, 0);
  mesh.positions.push_back({5, 5, 5});
  const std::vector<Colour> colours = render::normal_colours(mesh);
  REQUIRE(colours.size() == 5);
  CHECK(npt::length(colours[0] - render::from_srgb(0.5F, 0.5F, 1)) < 1e-5F);
  CHECK(npt::length(colours[4] - render::from_srgb(0.5F, 0.5F, 0.5F)) < 1e-5F);
}

TEST_CASE("distances don't see where a mesh stands, and need one vertex each") {
  const npt::Mesh mesh = shapes::sphere(1, {}, 6);
  npt::Mesh other = mesh;
  for (npt::Vec3f& p : other.positions) p += npt::Vec3f{10, -20, 5};
  other.positions[20].x += 0.25F;
  const std::vector<double> distances = render::centred_distances(mesh.coordinates(), other.coordinates());
  for (std::size_t v = 0; v < distances.size(); ++v)
    CHECK(distances[v] == doctest::Approx(v == 20 ? 0.25 : 0).epsilon(1e-4));
  other.positions.pop_back();
  CHECK_THROWS_AS(render::centred_distances(mesh.coordinates(), other.coordinates()), npt::Error);
}
