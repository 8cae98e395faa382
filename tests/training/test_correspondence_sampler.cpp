#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <training/correspondence_sampler.hpp>
#include <training/dress.hpp>
#include <training/surface_cloud.hpp>

#include <cmath>
#include <memory>
#include <set>
#include <vector>

namespace {

std::shared_ptr<const npt::SurfaceCloud> reading_cloud() {
  static const auto cloud =
      std::make_shared<const npt::SurfaceCloud>(npt::borrowed(npt::mannequin()), npt::mannequin().tables().v_template);
  return cloud;
}

npt::CorrespondenceSampler reading_sampler(const npt::CorrespondenceSampleOptions& options) {
  return {{reading_cloud()}, [](npt::Random& r) { return npt::natural_poses().sample(r); }, options};
}

float norm(const std::vector<float>& xyz, std::size_t i) {
  return std::sqrt(xyz[3 * i] * xyz[3 * i] + xyz[3 * i + 1] * xyz[3 * i + 1] + xyz[3 * i + 2] * xyz[3 * i + 2]);
}

}  // namespace

TEST_CASE("a reading's points are centred and of one size, normals are unit, places lie on the mannequin") {
  const npt::CorrespondenceSampler sampler = reading_sampler({.seed = 3, .points = 300});
  for (std::uint64_t index = 0; index < 20; ++index) {
    const npt::Sample s = sampler.draw(1, index);
    REQUIRE(s.inputs[0].size() == 900);
    double square = 0, mean = 0;
    for (std::size_t i = 0; i < 300; ++i) {
      square += static_cast<double>(norm(s.inputs[0], i) * norm(s.inputs[0], i)) / 300;
      mean += static_cast<double>(s.inputs[0][3 * i + 1]) / 300;
      const float n = norm(s.inputs[1], i);
      CHECK((n == 0 || std::abs(n - 1) < 1e-4F));
      CHECK(norm(s.truth, i) < 0.75F);  // half the mannequin's reach
    }
    CHECK(std::sqrt(square) == doctest::Approx(npt::reading_radius).epsilon(1e-4));
    CHECK(std::abs(mean) < 1e-5);
  }
}

TEST_CASE("a plain body in no pose is the mannequin itself, turned") {
  // Distances between points are those between their places, but for shape.
  const npt::CorrespondenceSampler sampler(
      {reading_cloud()}, [](npt::Random&) { return std::array<float, 72>{}; },
      {.seed = 1, .points = 200, .natural = 1, .fallen = 0, .dressed = 0, .plain = 1});
  const npt::Sample s = sampler.draw(0, 0);
  double ratio_sum = 0, ratio_squares = 0;
  int count = 0;
  for (std::size_t i = 0; i < 199; ++i) {
    double d = 0, t = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      d += std::pow(static_cast<double>(s.inputs[0][3 * i + k] - s.inputs[0][3 * i + 3 + k]), 2);
      t += std::pow(static_cast<double>(s.truth[3 * i + k] - s.truth[3 * i + 3 + k]), 2);
    }
    if (t < 0.02) continue;
    const double ratio = std::sqrt(d / t);
    ratio_sum += ratio, ratio_squares += ratio * ratio, ++count;
  }
  const double mean = ratio_sum / count;
  CHECK(std::sqrt(ratio_squares / count - mean * mean) < 0.15 * mean);
}

TEST_CASE("samples depend on seed, step and index only, and differ in each of them") {
  const npt::CorrespondenceSampler sampler = reading_sampler({.seed = 3, .points = 64});
  CHECK(sampler.draw(1, 2).inputs[0] == sampler.draw(1, 2).inputs[0]);
  CHECK(sampler.draw(1, 2).inputs[0] != sampler.draw(1, 3).inputs[0]);
  CHECK(sampler.draw(1, 2).inputs[0] != sampler.draw(2, 2).inputs[0]);
  CHECK(sampler.draw(1, 2).inputs[0] != reading_sampler({.seed = 4, .points = 64}).draw(1, 2).inputs[0]);
  CHECK(sampler.equal_counts());
  CHECK(sampler.max_vertices() == 64);
}

TEST_CASE("limbs of several bodies on one trunk, mirrored, are a reading like any other") {
  const std::vector<npt::WeightedCloud> bodies{{reading_cloud(), 1}, {reading_cloud(), 3}};
  const auto pose = [](npt::Random& r) { return npt::natural_poses().sample(r); };
  const npt::CorrespondenceSampler sampler(bodies, pose, {.seed = 5, .points = 200, .patched = 1, .mirror = true});
  const npt::Sample s = sampler.draw(0, 1);
  REQUIRE(s.truth.size() == 600);
  CHECK(s.truth == sampler.draw(0, 1).truth);
  for (std::size_t i = 0; i < 200; ++i) CHECK(norm(s.truth, i) < 0.75F);
  // Weights and patches that change nothing leave the samples as they were.
  const npt::CorrespondenceSampler equal(std::vector<npt::WeightedCloud>{{reading_cloud(), 2}}, pose,
                                         {.seed = 5, .points = 200});
  CHECK(equal.draw(0, 1).truth == reading_sampler({.seed = 5, .points = 200}).draw(0, 1).truth);
}

TEST_CASE("a part of the samples is of strangers, all of whose points belong to one place that no body has") {
  const auto pole = [](npt::Random& random, std::size_t n, std::vector<npt::Vec3f>& points,
                       std::vector<npt::Vec3f>& normals) {
    points.clear(), normals.clear();
    for (std::size_t i = 0; i < n; ++i) {
      points.push_back({0, static_cast<float>(7 * random.uniform()), 0});
      normals.push_back({1, 0, 0});
    }
  };
  const npt::CorrespondenceSampler sampler(
      {{reading_cloud(), 1}}, [](npt::Random& r) { return npt::natural_poses().sample(r); },
      {.seed = 5, .points = 64, .strangers = 0.5}, npt::data::Purpose::training, pole);
  int strange = 0;
  for (std::uint64_t index = 0; index < 40; ++index) {
    const npt::Sample s = sampler.draw(0, index);
    const npt::Vec3f first{s.truth[0], s.truth[1], s.truth[2]};
    const bool stranger = first == npt::stranger_place * 0.5F;
    strange += stranger ? 1 : 0;
    double square = 0;
    for (std::size_t i = 0; i < 64; ++i) {
      if (stranger)
        CHECK(npt::Vec3f{s.truth[3 * i], s.truth[3 * i + 1], s.truth[3 * i + 2]} == first);
      else
        CHECK(s.truth[3 * i + 2] < 0.25F);  // half a metre in front of the resting body at most
      square += static_cast<double>(norm(s.inputs[0], i) * norm(s.inputs[0], i)) / 64;
    }
    CHECK(std::sqrt(square) == doctest::Approx(npt::reading_radius).epsilon(1e-4));
    CHECK(s.inputs[0] == sampler.draw(0, index).inputs[0]);
  }
  CHECK(strange > 10);
  CHECK(strange < 30);
}

namespace {

/// A point of the front that moves with one joint, and whether a dress leaves it there; `at` moves along.
bool clothed(npt::SmplJoint joint, const npt::data::Dress& dress, npt::Vec3f& at) {
  npt::SurfaceCloud::Point p;
  p.along = {1, 0, 0}, p.across = {0, 1, 0};
  const auto weight_of = [joint](auto... joints) { return ((joint == joints) || ...) ? 1.0F : 0.0F; };
  float swollen = 1;
  return npt::data::clothe(p, weight_of, dress, at, swollen);
}

}  // namespace

TEST_CASE("clothes lie before the skin that they cover, and missing hands are not there") {
  using enum npt::SmplJoint;
  npt::data::Dress dress;
  dress.trunk = 0.05F, dress.no_hands = true;
  npt::Vec3f chest, shin, hand;
  CHECK(clothed(spine2, dress, chest));
  CHECK(chest.z == doctest::Approx(0.05));
  CHECK(clothed(left_knee, dress, shin));
  CHECK(shin == npt::Vec3f{});
  CHECK_FALSE(clothed(left_hand, dress, hand));
  dress.hole_radius = 0.1F;
  CHECK_FALSE(clothed(spine2, dress, chest));
}
