// The steps that make a sample from meshes: options, placement, noise, normalisation, vertex order.
#include <doctest/doctest.h>
#include <npt/lab/assembly.hpp>
#include <npt/lab/augmentation.hpp>
#include <npt/lab/transfer_sample.hpp>

#include <cmath>
#include <vector>

using namespace npt::data;

TEST_CASE("options that no sample can be made with are refused by name") {
  const auto message = [](const npt::SampleOptions& options) {
    try {
      check_options(options);
    } catch (const npt::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(message({}).empty());
  npt::SampleOptions options;
  options.yaw = 181;
  CHECK(message(options).find("yaw") != std::string::npos);
  options = {};
  options.scale_low = 0;
  CHECK(message(options).find("least scale") != std::string::npos);
  options = {};
  options.scale_low = 2;
  CHECK(message(options).find("largest scale") != std::string::npos);
  options = {};
  options.noise = -1;
  CHECK(message(options).find("noise") != std::string::npos);
}

TEST_CASE("a placement turns about y, then scales; the identity changes no bit") {
  std::vector<float> xyz{1, 2, 0, 0, 0, 3};
  const npt::Matrix3 quarter{{{{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}}}};
  place({quarter, 2, {}}, xyz);
  CHECK(xyz == std::vector<float>{0, 4, -2, 6, 0, 0});
  const std::vector<float> before{0.1F, -0.0F, 3e-39F};
  std::vector<float> after = before;
  place({}, after);
  CHECK(after == before);
}

TEST_CASE("the truth turns as the pose mesh does and grows as the identity does") {
  npt::SampleOptions options;
  options.yaw = 90, options.scale_low = 0.5, options.scale_high = 2;
  npt::Random random(3);
  const Placements placements = draw_placements(options, random);
  CHECK(placements.truth.rotation == placements.pose.rotation);
  CHECK(placements.truth.scale == placements.identity.scale);
  CHECK(placements.pose.scale != placements.identity.scale);
}

TEST_CASE("noise has the standard deviation that is asked for") {
  std::vector<float> xyz(30001, 0.0F);  // an odd number: numbers are drawn in pairs
  npt::Random random(5);
  add_noise(xyz, 0.25, random);
  double sum = 0, squares = 0;
  for (const float x : xyz) sum += double{x}, squares += double{x} * double{x};
  const auto n = static_cast<double>(xyz.size());
  CHECK(std::abs(sum / n) < 0.01);
  CHECK(std::abs(std::sqrt(squares / n) - 0.25) < 0.005);
}

TEST_CASE("edges and triangles follow vertices to their new places") {
  std::vector<std::uint32_t> places;
  places_of(std::vector<std::uint32_t>{2, 0, 1}, places);
  CHECK(places == std::vector<std::uint32_t>{1, 2, 0});
  std::vector<npt::Edge> edges;
  renumber_edges(places, std::vector<npt::Edge>{{0, 1}, {1, 2}}, edges);
  CHECK(edges == std::vector<npt::Edge>{{1, 2}, {0, 2}});
  std::vector<npt::Triangle> triangles;
  renumber_triangles(places, std::vector<npt::Triangle>{{0, 1, 2}}, triangles);
  CHECK(triangles == std::vector<npt::Triangle>{{1, 2, 0}});
}

TEST_CASE("a sample is normalised by its whole meshes, the truth scaled as the identity is") {
  Scratch scratch;
  scratch.identity = {0, 0, 0, 2, 0, 0, 1, 0, 0};
  scratch.truth = {5, 0, 0, 9, 0, 0, 7, 0, 0};
  scratch.pose = {0, 0, 0, 0, 8, 0};
  scratch.identity_rows = {1, 2};
  scratch.pose_rows = {1};
  npt::Sample sample;
  normalise_into(scratch, npt::Normalisation::sphere, sample);
  const auto r = static_cast<float>(npt::sphere_radius);
  CHECK(sample.scale == npt::sphere_radius);
  CHECK(npt::identity_of(sample) == std::vector<float>{r, 0, 0, 0, 0, 0});
  CHECK(sample.truth == std::vector<float>{2 * r, 0, 0, 0, 0, 0});
  CHECK(npt::pose_of(sample) == std::vector<float>{0, r, 0});
}
