#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_plan.hpp>
#include <training/animal_variation.hpp>
#include <training/body_variation.hpp>
#include <training/dress.hpp>
#include <training/surface_cloud.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "training/quadruped_figure.hpp"

namespace {

const npt::SurfaceCloud& cloud() {
  static const auto body = std::make_shared<const npt::BodyModel>(quadruped::body());
  static const npt::SurfaceCloud made(body, body->tables().v_template, quadruped::plan());
  return made;
}

constexpr npt::TemplateReach reach{{-0.2F, 0, -0.8F}, {0.2F, 1, 0.8F}};

const npt::BodyVariation& animals() {
  static const npt::AnimalVariation made(quadruped::plan(), reach, [](npt::Random& random) {
    std::vector<float> pose(3 * quadruped::plan().joint_count());
    for (float& angle : pose) angle = static_cast<float>(0.1 * random.normal());
    return pose;
  });
  return made;
}

/// The weight of the joints of one kind.
float weight_of(const npt::SurfaceCloud::Point& p, npt::JointKind kind) {
  float sum = 0;
  for (std::size_t i = 0; i < npt::SurfaceCloud::most_joints; ++i)
    if (quadruped::plan().joints[p.joint[i]].kind == kind) sum += p.weight[i];
  return sum;
}

npt::Vec3f normal_of(const npt::SurfaceCloud::Point& p) { return normalised(cross(p.along, p.across)); }

struct Clothed {
  bool there = false;
  float out = 0;  ///< along the normal
  float swollen = 1;
};
Clothed clothed(const npt::SurfaceCloud::Point& p, const npt::data::Dress& dress) {
  Clothed result;
  npt::Vec3f at = p.rest;
  result.there = animals().clothe(cloud(), p, dress, at, result.swollen);
  result.out = dot(at - p.rest, normal_of(p));
  return result;
}

}  // namespace

TEST_CASE("drawn proportions lie in the plan's ranges, relative to the size, and reach far into them") {
  const std::vector<npt::ProportionPlan>& plans = quadruped::plan().proportions;
  REQUIRE(plans.front().name == "size");
  npt::Random random(1);
  std::vector<double> least(plans.size(), 9), most(plans.size(), -9);
  for (int i = 0; i < 2000; ++i) {
    const std::vector<double> changes = animals().draw_proportions(random);
    REQUIRE(changes.size() == plans.size());
    for (std::size_t k = 0; k < changes.size(); ++k) {
      const double factor = 1 + (k == 0 ? changes[0] : changes[k] / (1 + changes[0]));
      REQUIRE(factor > plans[k].low - 1e-9);
      REQUIRE(factor < plans[k].high + 1e-9);
      least[k] = std::min(least[k], factor), most[k] = std::max(most[k], factor);
    }
  }
  for (std::size_t k = 0; k < plans.size(); ++k) {
    CHECK(least[k] < plans[k].low + 0.1 * (1 - plans[k].low));
    CHECK(most[k] > plans[k].high - 0.1 * (plans[k].high - 1));
  }
}

TEST_CASE("poses are those that are given, and what is no animal belongs below the feet") {
  npt::Random a(4), b(4);
  const npt::BodyVariation::Pose pose = animals().draw_pose(a);
  CHECK(pose.angles.size() == 3 * quadruped::plan().joint_count());
  CHECK(pose.angles == animals().draw_pose(b).angles);
  CHECK_FALSE(pose.anywhere);
  CHECK(&animals().plan() == &quadruped::plan());
  CHECK(animals().elsewhere().x == 0);
  CHECK(animals().elsewhere().y < reach.low.y - 0.5F);
}

TEST_CASE("few animals lack feet or a head, some have wool, holes lie in the template's box") {
  npt::Random random(2);
  int without_feet = 0, without_head = 0, wool = 0, holes = 0;
  for (int i = 0; i < 2000; ++i) {
    const npt::data::Dress d = animals().draw_dress(random);
    REQUIRE(d.any);
    REQUIRE(d.trunk >= 0);
    without_feet += d.no_feet, without_head += d.no_head, wool += d.trunk > 0;
    if (!(d.hole_radius > 0)) continue;
    ++holes;
    for (const npt::Vec3f h : d.hole) {
      REQUIRE(h.y >= reach.low.y);
      REQUIRE(h.y <= reach.high.y);
      REQUIRE(std::abs(h.z) <= reach.high.z);
    }
  }
  CHECK(without_feet > 20);
  CHECK(without_feet < 120);
  CHECK(without_head > 10);
  CHECK(without_head < 100);
  CHECK(wool > 300);
  CHECK(wool < 500);
  CHECK(holes > 150);
}

TEST_CASE("wool lies outside the trunk, a mane on the neck's upper side, and neither on the feet") {
  npt::data::Dress coat, wool, mane;
  coat.puff = 0.03F;
  wool.trunk = 0.1F;
  mane.hair = 0.1F;
  std::size_t trunk = 0, feet = 0, crest = 0;
  for (const npt::SurfaceCloud::Point& p : cloud().points()) {
    const Clothed all = clothed(p, coat), woolly = clothed(p, wool), maned = clothed(p, mane);
    REQUIRE(all.there);
    REQUIRE(all.out == doctest::Approx(0.03).epsilon(1e-3));
    if (weight_of(p, npt::JointKind::spine) > 0.99F) {
      ++trunk;
      REQUIRE(woolly.out == doctest::Approx(0.1).epsilon(0.02));
      REQUIRE(maned.out < 0.01F);
    }
    if (weight_of(p, npt::JointKind::tip) > 0.99F) {
      ++feet;
      REQUIRE(std::abs(woolly.out) < 0.002F);
    }
    if (weight_of(p, npt::JointKind::neck) > 0.99F && normal_of(p).y > 0.3F) {
      ++crest;
      REQUIRE(maned.out == doctest::Approx(0.1).epsilon(0.02));
      REQUIRE(maned.swollen > 1.5F);
    }
    if (normal_of(p).y < 0) REQUIRE(maned.out == 0);
  }
  CHECK(trunk > 100);
  CHECK(feet > 100);
  CHECK(crest > 100);
}

TEST_CASE("missing feet, heads and what lies in a hole are missing, and the rest stays") {
  npt::data::Dress no_feet, no_head, hole;
  no_feet.no_feet = true;
  no_head.no_head = true;
  hole.hole = {npt::Vec3f{0, 0.6F, 0}, npt::Vec3f{0, 0.6F, 0}};
  hole.hole_radius = 0.2F;
  std::size_t feet = 0, heads = 0, inside = 0;
  for (const npt::SurfaceCloud::Point& p : cloud().points()) {
    const bool foot = weight_of(p, npt::JointKind::tip) > 0.5F, head = weight_of(p, npt::JointKind::head) > 0.5F;
    const bool near = length(p.canonical - hole.hole[0]) < hole.hole_radius;
    REQUIRE(clothed(p, no_feet).there == !foot);
    REQUIRE(clothed(p, no_head).there == !head);
    REQUIRE(clothed(p, hole).there == !near);
    feet += foot, heads += head, inside += near;
  }
  CHECK(feet > 100);
  CHECK(heads > 100);
  CHECK(inside > 100);
}
