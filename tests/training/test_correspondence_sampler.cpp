#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/proportions.hpp>
#include <npt/body/skeleton.hpp>
#include <training/blocks.hpp>
#include <training/correspondence_sampler.hpp>
#include <training/dress.hpp>
#include <training/people_variation.hpp>
#include <training/surface_cloud.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <vector>

namespace {

std::shared_ptr<const npt::SurfaceCloud> reading_cloud() {
  static const auto cloud =
      std::make_shared<const npt::SurfaceCloud>(npt::borrowed(npt::mannequin()), npt::mannequin().tables().v_template);
  return cloud;
}

std::shared_ptr<const npt::PeopleVariation> people(const npt::PeopleVariationOptions& options = {}) {
  return std::make_shared<const npt::PeopleVariation>([](npt::Random& r) { return npt::natural_poses().sample(r); },
                                                      options);
}

npt::CorrespondenceSampler reading_sampler(const npt::CorrespondenceSampleOptions& options) {
  return {{{reading_cloud(), 1}}, people(), options};
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
      {{reading_cloud(), 1}},
      std::make_shared<const npt::PeopleVariation>([](npt::Random&) { return npt::PeopleVariation::Angles{}; },
                                                   npt::PeopleVariationOptions{.natural = 1, .dressed = 0}),
      {.seed = 1, .points = 200, .fallen = 0, .plain = 1});
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
  const npt::CorrespondenceSampler sampler(bodies, people(), {.seed = 5, .points = 200, .patched = 1, .mirror = true});
  const npt::Sample s = sampler.draw(0, 1);
  REQUIRE(s.truth.size() == 600);
  CHECK(s.truth == sampler.draw(0, 1).truth);
  for (std::size_t i = 0; i < 200; ++i) CHECK(norm(s.truth, i) < 0.75F);
  // Weights and patches that change nothing leave the samples as they were.
  const npt::CorrespondenceSampler equal(std::vector<npt::WeightedCloud>{{reading_cloud(), 2}}, people(),
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
  const npt::CorrespondenceSampler sampler({{reading_cloud(), 1}}, people(),
                                           {.seed = 5, .points = 64, .strangers = 0.5}, npt::data::Purpose::training,
                                           pole);
  int strange = 0;
  for (std::uint64_t index = 0; index < 40; ++index) {
    const npt::Sample s = sampler.draw(0, index);
    const npt::Vec3f first{s.truth[0], s.truth[1], s.truth[2]};
    const bool stranger = first == people()->elsewhere() * 0.5F;
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

TEST_CASE("a piece of a patched body lies on limbs that the body has, so that it is never empty") {
  std::vector<float> narrow = npt::mannequin().tables().v_template;  // arms near no place where the other body's are
  for (std::size_t i = 0; i < narrow.size(); i += 3) narrow[i] *= 0.2F;
  const auto other = std::make_shared<const npt::SurfaceCloud>(npt::borrowed(npt::mannequin()), narrow);
  const npt::CorrespondenceSampler sampler(
      {{reading_cloud(), 1}, {other, 1}}, people(),
      {.seed = 5, .points = 32, .plain = 0, .patched = 1, .strangers = 1, .pieces = 1});
  for (std::uint64_t index = 0; index < 60; ++index) {
    const npt::Sample s = sampler.draw(0, index);
    double square = 0;
    for (std::size_t i = 0; i < 32; ++i)
      square += static_cast<double>(norm(s.inputs[0], i) * norm(s.inputs[0], i)) / 32;
    CHECK(std::sqrt(square) == doctest::Approx(npt::reading_radius).epsilon(1e-4));
  }
}

namespace {

/// A point of the front that moves with one joint, and whether a dress leaves it there; `at` moves along.
bool clothed(npt::SmplJoint joint, const npt::data::Dress& dress, npt::Vec3f& at) {
  npt::SurfaceCloud::Point p;
  p.along = {1, 0, 0}, p.across = {0, 1, 0};
  p.joint[0] = static_cast<std::uint8_t>(npt::joint_index(joint)), p.weight[0] = 1;
  float swollen = 1;
  return npt::data::clothe(*reading_cloud(), p, dress, at, swollen);
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

TEST_CASE("ears are drawn out of the skull, and closed skirts have no inside") {
  using enum npt::SmplJoint;
  npt::data::Dress dress;
  dress.horns[0] = {.length = 0.3F, .narrow = 0.8F, .towards = {0, 1, 0}};
  npt::SurfaceCloud::Point top;
  top.along = {0, 0, 1}, top.across = {1, 0, 0};
  top.canonical = reading_cloud()->head() + npt::Vec3f{0, 0.1F, 0};
  top.joint[0] = static_cast<std::uint8_t>(npt::joint_index(head)), top.weight[0] = 1;
  npt::Vec3f at;
  float swollen = 1;
  REQUIRE(npt::data::clothe(*reading_cloud(), top, dress, at, swollen));
  CHECK(at.y == doctest::Approx(0.3));
  CHECK(swollen > 1);

  dress.skirt = 0.5F, dress.closed = true;
  npt::SurfaceCloud::Point inside;  // of the left leg, towards the right one
  inside.along = {0, 1, 0}, inside.across = {0, 0, -1};
  inside.canonical = {0.05F, -0.4F, 0};
  inside.joint[0] = static_cast<std::uint8_t>(npt::joint_index(left_hip)), inside.weight[0] = 1;
  const npt::Vec3f normal = cross(inside.along, inside.across);
  REQUIRE(normal.x < 0);
  CHECK_FALSE(npt::data::clothe(*reading_cloud(), inside, dress, at, swollen));
}

TEST_CASE("parts that are boxes lie on them, whose faces have normals along the axes") {
  const npt::CorrespondenceSampler sampler(
      {{reading_cloud(), 1}},
      std::make_shared<const npt::PeopleVariation>([](npt::Random&) { return npt::PeopleVariation::Angles{}; },
                                                   npt::PeopleVariationOptions{.natural = 1, .dressed = 0}),
      {.seed = 1, .points = 300, .blocks = 1, .fallen = 0, .plain = 0});
  const npt::SurfaceCloud& cloud = *reading_cloud();
  for (std::size_t k = 0; k < cloud.points().size(); k += 97) {
    const npt::SurfaceCloud::Point& p = cloud.points()[k];
    const npt::SurfaceCloud::Block& block = cloud.blocks()[p.joint[0]];
    npt::Vec3f at = p.rest, normal;
    npt::data::put_on_block(block, at, normal);
    if (normal == npt::Vec3f{}) continue;
    CHECK(length(normal) == doctest::Approx(1));
    const npt::Vec3f face = normal.x + normal.y + normal.z > 0 ? block.high : block.low;
    CHECK(dot(at - face, normal) == doctest::Approx(0).epsilon(1e-4));
  }
  CHECK(sampler.draw(0, 0).truth != reading_sampler({.seed = 1, .points = 300}).draw(0, 0).truth);
}

TEST_CASE("bodies stand as characters are made, or with a big head, where that is asked for") {
  npt::Random random(4);
  const auto standing = people({.standing = 1});
  for (int i = 0; i < 20; ++i) {
    const std::vector<float> pose = standing->draw_pose(random).angles;
    for (const std::size_t knee : npt::joint_indices(npt::SmplJoint::left_knee, npt::SmplJoint::right_knee))
      CHECK(std::abs(pose[3 * knee]) < 0.5F);
  }
  const auto stylised = people({.stylised = 1});
  for (int i = 0; i < 20; ++i)
    CHECK(stylised->draw_proportions(random)[static_cast<std::size_t>(npt::BodyProportion::head_size)] >= 0.29);
}

TEST_CASE("what people carry belongs to where they hold it") {
  const auto sampler_of = [](bool props) {
    return npt::CorrespondenceSampler({{reading_cloud(), 1}}, people({.props = props}),
                                      {.seed = 4, .points = 400, .plain = 0});
  };
  const npt::CorrespondenceSampler with = sampler_of(true), without = sampler_of(false);
  int changed = 0;
  for (std::uint64_t index = 0; index < 40; ++index) {
    const npt::Sample s = with.draw(1, index), bare = without.draw(1, index);
    std::size_t alike = 0;  // places that another point has, too
    std::set<std::array<float, 3>> places;
    for (std::size_t i = 0; i < 400; ++i)
      alike += places.insert({s.truth[3 * i], s.truth[3 * i + 1], s.truth[3 * i + 2]}).second ? 0U : 1U;
    for (std::size_t i = 0; i < 400; ++i) CHECK(norm(s.truth, i) < 0.75F);
    changed += s.truth != bare.truth && alike > 4 ? 1 : 0;
  }
  CHECK(changed > 8);
  CHECK(changed < 32);
}

TEST_CASE("warped bodies are readings like any other, of other shapes") {
  const npt::CorrespondenceSampler plain = reading_sampler({.seed = 3, .points = 400, .plain = 0}),
                                   warped = reading_sampler({.seed = 3, .points = 400, .plain = 0, .warped = 1});
  std::size_t other = 0;
  for (std::uint64_t index = 0; index < 20; ++index) {
    const npt::Sample s = warped.draw(1, index);
    for (std::size_t i = 0; i < 400; ++i) {
      const float n = norm(s.inputs[1], i);
      CHECK((n == 0 || std::abs(n - 1) < 1e-4F));
      CHECK(norm(s.truth, i) < 0.75F);
    }
    other += s.inputs[0] != plain.draw(1, index).inputs[0];
  }
  CHECK(other == 20);
}
