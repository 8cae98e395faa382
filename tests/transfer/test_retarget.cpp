#include <doctest/doctest.h>

#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/scene/motion.hpp>
#include <npt/transfer/retarget.hpp>

#include <body/roles/skeletons.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

namespace {

using npt::JointRole;
using npt::LimbPart;
using skeletons::person;

npt::Motion on(const skeletons::Person& source, const skeletons::Person& target) {
  return npt::retarget(source.motion, npt::joint_roles(source.motion), target.motion, npt::joint_roles(target.motion),
                       npt::RetargetOptions::plain());
}

/// The largest distance between joints of the same roles, over the clip.
double largest_error(const npt::Motion& got, const skeletons::Person& target, const npt::Motion& expected,
                     const skeletons::Person& source, double scale = 1) {
  double most = 0;
  for (int f = 0; f <= 60; ++f) {
    const auto a = npt::joint_positions(got, f / 30.0), b = npt::joint_positions(expected, f / 30.0);
    for (std::size_t j = 0; j < target.roles.size(); ++j)
      if (const std::size_t other = source.joint(target.roles[j]); other < b.size())
        most = std::max(most, npt::length(a[j] - b[other] * scale));
  }
  return most;
}

double largest_stretch(const npt::Motion& motion) {
  const auto rest = npt::joint_positions(motion, std::nullopt);
  double most = 0;
  for (int f = 0; f <= 60; ++f) {
    const auto now = npt::joint_positions(motion, f / 30.0);
    for (std::size_t j = 1; j < now.size(); ++j) {
      const std::size_t parent = motion.joints[j].parent;
      most = std::max(most, std::abs(npt::length(now[j] - now[parent]) - npt::length(rest[j] - rest[parent])));
    }
  }
  return most;
}

npt::Vec3d bone(const npt::Motion& motion, const skeletons::Person& person, LimbPart from, LimbPart to, double time) {
  const auto places = npt::joint_positions(motion, time);
  return npt::normalised(places[person.joint(npt::limb_role(to, 0))] - places[person.joint(npt::limb_role(from, 0))]);
}

}  // namespace

TEST_CASE("a motion on its own skeleton is the same motion") {
  skeletons::Person source = person(skeletons::dialects()[0], {.rolls = true});
  skeletons::add_clip(source);
  const npt::Motion got = on(source, source);
  CHECK(largest_error(got, source, source.motion, source) < 2e-6);
  CHECK(got.clip.name == "dance");
  CHECK(got.rate == 30);
  CHECK(got.clip.length() == source.motion.clip.length());
}

TEST_CASE("a motion goes to another dialect, other bone frames, another size and the other direction") {
  skeletons::Person source = person(skeletons::dialects()[0]);
  skeletons::add_clip(source);
  for (const skeletons::Names& names : skeletons::dialects()) {
    if (names.middle[3].empty()) continue;  // fewer joints of the spine: not the same places
    const skeletons::Person target = person(names, {.rolls = true});
    const npt::Motion got = on(source, target);
    CHECK_MESSAGE(largest_error(got, target, source.motion, source) < 5e-6, names.dialect);
  }
  const skeletons::Person large = person(skeletons::dialects()[2], {.size = 3, .rolls = true});
  CHECK(largest_error(on(source, large), large, source.motion, source, 3) < 2e-5);
  const skeletons::Person backwards = person(skeletons::dialects()[2], {.rolls = true, .backwards = true});
  const npt::Motion turned = on(source, backwards);
  const auto a = npt::joint_positions(turned, 1.0), b = npt::joint_positions(source.motion, 1.0);
  for (std::size_t j = 0; j < backwards.roles.size(); ++j) {
    const npt::Vec3d expected = b[source.joint(backwards.roles[j])];
    CHECK(npt::length(a[j] - npt::Vec3d{-expected.x, expected.y, -expected.z}) < 1e-5);
  }
}

TEST_CASE("arms point where the source's point, from a T pose to an A pose and back") {
  for (const double below : {0.0, 50.0}) {
    skeletons::Person source = person(skeletons::dialects()[0], {.arms_below = below});
    skeletons::add_clip(source);
    const skeletons::Person target = person(skeletons::dialects()[1], {.arms_below = 50 - below, .rolls = true});
    const npt::Motion got = on(source, target);
    for (const double time : {0.0, 0.7, 2.0})
      for (const auto& [from, to] :
           {std::pair(LimbPart::upper_arm, LimbPart::lower_arm), std::pair(LimbPart::lower_arm, LimbPart::hand),
            std::pair(LimbPart::upper_leg, LimbPart::lower_leg),
            std::pair(npt::digit_part(2, 0), npt::digit_part(2, 1))})
        CHECK(npt::length(bone(got, target, from, to, time) - bone(source.motion, source, from, to, time)) < 1e-5);
    CHECK(largest_stretch(got) < 1e-6);
  }
}

TEST_CASE("on a rig of the same names that was bound nearly alike, joints turn in their parents as the source's") {
  skeletons::Person source = person(skeletons::dialects()[0]);
  skeletons::add_clip(source);
  const auto most_turn = [&](double below) {  // between both, of joints in their parents
    const skeletons::Person target = person(skeletons::dialects()[0], {.arms_below = below});
    const auto own = npt::local_places(on(source, target), 0.7), other = npt::local_places(source.motion, 0.7);
    double least = 1;
    for (std::size_t j = 0; j < own.size(); ++j)
      least = std::min(least, std::abs(npt::dot(own[j].rotation, other[j].rotation)));
    return 2 * std::acos(std::min(least, 1.0));
  };
  CHECK(most_turn(8) < 1e-3);
  CHECK(most_turn(30) == doctest::Approx(0.5236).epsilon(0.01));  // else arms point where the source's point
}

TEST_CASE("hips go as far as legs are long, and bones keep their lengths") {
  skeletons::Person source = person(skeletons::dialects()[0]);
  skeletons::add_clip(source);
  const skeletons::Person target = person(skeletons::dialects()[4], {.leg = 0.5, .rolls = true});
  const npt::Motion got = on(source, target);
  const auto a = npt::joint_positions(got, 0.0), b = npt::joint_positions(got, 2.0);
  CHECK((b[0] - a[0]).z == doctest::Approx(0.8).epsilon(0.02));  // 1.6 m at the source
  CHECK(largest_stretch(got) < 1e-6);
}

TEST_CASE("a spine of one joint turns as three do, and joints of no role keep their places") {
  skeletons::Person source = person(skeletons::dialects()[0]);
  skeletons::add_clip(source);
  skeletons::Person target = person(skeletons::dialects()[0], {.spine = 1});
  target.motion.joints.push_back({.name = "Ponytail", .parent = target.joint(JointRole::head)});
  target.motion.joints.back().rest.translation = {0, 0.1, -0.1};
  target.roles.push_back(JointRole::none);
  const npt::Motion got = on(source, target);
  const auto own = npt::joint_worlds(got, 1.3), other = npt::joint_worlds(source.motion, 1.3);
  const auto turn = [&](const std::vector<npt::Affine>& worlds, std::size_t joint) { return worlds[joint].linear; };
  CHECK((turn(own, target.joint(JointRole::spine)) - turn(other, source.joint(JointRole::upper_chest))).squared_norm() <
        1e-10);
  CHECK((turn(own, target.joint(JointRole::head)) - turn(other, source.joint(JointRole::head))).squared_norm() < 1e-10);
  CHECK(npt::local_places(got, 1.3).back().translation == npt::Vec3d{0, 0.1, -0.1});
}

TEST_CASE("a foot that a rig moves apart from its leg follows the leg") {
  skeletons::Person source = person(skeletons::dialects()[0]);
  skeletons::add_clip(source);
  skeletons::Person target = source;
  target.motion.clip = {};
  const auto rest = npt::joint_positions(target.motion, std::nullopt);
  npt::MotionJoint root{.name = "Root"};
  for (npt::MotionJoint& joint : target.motion.joints)
    joint.parent = joint.parent == npt::no_item ? 0 : joint.parent + 1;
  target.motion.joints.insert(target.motion.joints.begin(), root);
  target.roles.insert(target.roles.begin(), JointRole::none);
  for (std::size_t side = 0; side < 2; ++side) {
    const std::size_t foot = target.joint(npt::limb_role(LimbPart::foot, side));
    target.motion.joints[foot].parent = 0;
    target.motion.joints[foot].rest.translation = rest[foot - 1];
  }
  const npt::Motion got = on(source, target);
  CHECK(largest_error(got, target, source.motion, source) < 5e-6);
}

TEST_CASE("a rest that hangs around the origin stands on the clip's ground") {
  skeletons::Person source = person(skeletons::dialects()[0]);
  source.motion.joints[0].rest.translation = {};
  skeletons::add_clip(source);
  for (npt::ClipChannel& channel : source.motion.clip.channels)
    if (channel.width == 3)
      for (std::size_t k = 0; k < channel.times.size(); ++k)
        // For a quarter of the time it climbs out of the ground.
        channel.values[3 * k] = 0, channel.values[3 * k + 1] = 4 * k < channel.times.size() ? 0.2F : 0.95F;
  for (npt::ClipChannel& channel : source.motion.clip.channels)
    if (channel.width == 4)
      for (std::size_t i = 0; i < channel.values.size(); ++i) channel.values[i] = i % 4 == 3 ? 1.0F : 0.0F;
  const skeletons::Person target = person(skeletons::dialects()[2]);
  const npt::Motion made = on(source, target);
  CHECK(npt::joint_positions(made, 1.0)[0].y == doctest::Approx(0.95).epsilon(1e-4));
  CHECK(npt::joint_positions(made, 0.0)[0].y == doctest::Approx(0.2).epsilon(1e-4));
}
