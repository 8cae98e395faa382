/// The numbers of a page: what is written comes back, as page.js decodes it.
#include <doctest/doctest.h>

#include <view/encoding.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "view/decoding.hpp"

namespace {

std::vector<std::vector<npt::Vec3f>> walk(std::size_t vertices, std::size_t frames) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-1, 1);
  std::vector<npt::Vec3f> points(vertices);
  for (npt::Vec3f& p : points) p = {place(random), 2 + place(random), 100 * place(random)};
  std::vector<std::vector<npt::Vec3f>> result;
  for (std::size_t f = 0; f < frames; ++f) {
    for (npt::Vec3f& p : points) p.x += 0.01F * place(random);
    result.push_back(points);
  }
  return result;
}

double error(npt::Vec3f a, npt::Vec3f b, const view::Box& box) {
  const npt::Vec3f size = box.high - box.low, d = a - b;
  return std::max({std::abs(static_cast<double>(d.x / size.x)), std::abs(static_cast<double>(d.y / size.y)),
                   std::abs(static_cast<double>(d.z / size.z))});
}

}  // namespace

TEST_CASE("positions come back within half a step of their box, in every frame") {
  for (const std::size_t frames : {1U, 5U}) {
    const auto before = walk(300, frames);
    const view::Box box = view::box_of(before);
    const std::string bytes = view::encode_positions(before, box);
    CHECK(bytes.size() == frames * 300 * 6);
    const auto after = decoding::positions(bytes, 300, frames, box);
    REQUIRE(after.size() == frames);
    double worst = 0;
    for (std::size_t f = 0; f < frames; ++f)
      for (std::size_t v = 0; v < 300; ++v) worst = std::max(worst, error(before[f][v], after[f][v], box));
    CHECK(worst <= 0.51 / 65535);
  }
}

TEST_CASE("a flat mesh, a single point and coordinates that are not finite are encoded all the same") {
  const std::vector<std::vector<npt::Vec3f>> flat{{{0, 1, 3}, {1, 1, 3}, {2, 1, 3}}};
  const view::Box box = view::box_of(flat);
  const auto after = decoding::positions(view::encode_positions(flat, box), 3, 1, box);
  for (std::size_t v = 0; v < 3; ++v) {
    CHECK(std::abs(after[0][v].x - flat[0][v].x) < 1e-4F);
    CHECK(after[0][v].y == 1);
    CHECK(after[0][v].z == 3);
  }
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::vector<npt::Vec3f>> odd{{{nan, 0, 0}, {1, 2, 3}, {3, 4, 5}}};
  const view::Box of_finite = view::box_of(odd);
  CHECK(of_finite.low.x == 1);
  CHECK(of_finite.high.z == 5);
  CHECK(view::encode_positions(odd, of_finite).size() == 18);
}

TEST_CASE("indices come back, in as many bytes as their differences need") {
  const auto round_trip = [](const std::vector<std::uint32_t>& indices) {
    const view::EncodedIndices encoded = view::encode_indices(indices);
    CHECK(encoded.bytes.size() == indices.size() * static_cast<std::size_t>(encoded.planes));
    CHECK(decoding::indices(encoded.bytes, indices.size(), encoded.planes) == indices);
    return encoded.planes;
  };
  CHECK(round_trip({}) == 1);
  CHECK(round_trip({0, 1, 2, 2, 1, 0}) == 1);
  CHECK(round_trip({0, 127, 0}) == 1);
  CHECK(round_trip({0, 128, 0}) == 2);
  CHECK(round_trip({0, 6889, 3}) == 2);
  CHECK(round_trip({0, 70000, 3}) == 3);
  CHECK(round_trip({0xFFFFFFFFU, 0, 0xFFFFFFFEU}) == 5);
}

TEST_CASE("values come back within half a step; what is not finite is the largest") {
  const std::vector<std::vector<double>> before{{0, 1.5, 40}, {3, std::numeric_limits<double>::infinity(), 2}};
  const std::string bytes = view::encode_values(before, 40);
  const auto after = decoding::values(bytes, 3, 2, 40);
  for (std::size_t f = 0; f < 2; ++f)
    for (std::size_t i = 0; i < 3; ++i)
      CHECK(std::abs(after[f][i] - std::min(before[f][i], 40.0)) <= 0.501 * 40 / 65535);
}

TEST_CASE("base64 is that of RFC 4648") {
  CHECK(view::base64("") == "");
  CHECK(view::base64("f") == "Zg==");
  CHECK(view::base64("fo") == "Zm8=");
  CHECK(view::base64("foo") == "Zm9v");
  CHECK(view::base64("foobar") == "Zm9vYmFy");
  std::string all;
  for (int i = 0; i < 256; ++i) all += static_cast<char>(static_cast<unsigned char>(i));
  CHECK(decoding::from_base64(view::base64(all)) == all);
}
