/// What retarget() corrects: feet, arms, hips, twist joints and keys, on walking skeletons of other proportions.
#include <doctest/doctest.h>

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/transfer/motion/foot_contacts.hpp>
#include <npt/transfer/motion/limb_reach.hpp>
#include <npt/transfer/motion/posed_joints.hpp>
#include <npt/transfer/motion/retarget_frames.hpp>
#include <npt/transfer/retarget.hpp>

#include <body/roles/skeletons.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace retarget_corrections {

using npt::JointRole;
using npt::LimbPart;

npt::Motion corrected(const skeletons::Person& source, const skeletons::Person& target,
                      const npt::RetargetOptions& options, const npt::RetargetShapes& shapes = {}) {
  return npt::retarget(source.motion, npt::joint_roles(source.motion), target.motion, npt::joint_roles(target.motion),
                       options, shapes);
}

npt::RetargetOptions only_feet() {
  npt::RetargetOptions options = npt::RetargetOptions::plain();
  options.foot_lock = true;
  return options;
}

/// Adds a channel of 61 frames in two seconds. value: of a time, numbers
template <class Value>
void add_channel(npt::Motion& motion, std::size_t joint, npt::ChannelPath path, const Value& value) {
  npt::ClipChannel channel{joint, path, npt::Interpolation::linear, path == npt::ChannelPath::rotation ? 4U : 3U,
                           {},    {}};
  for (int f = 0; f <= 60; ++f) {
    channel.times.push_back(static_cast<float>(f) / 30);
    for (const double x : value(f / 30.0)) channel.values.push_back(static_cast<float>(x));
  }
  motion.clip.channels.push_back(std::move(channel));
}
void add_turn(npt::Motion& motion, std::size_t joint, auto turn) {
  const npt::Quaternion rest = motion.joints[joint].rest.rotation;
  add_channel(motion, joint, npt::ChannelPath::rotation, [&](double t) {
    const npt::Quaternion q = rest.turned(turn(t));
    return std::array<double, 4>{q.x, q.y, q.z, q.w};
  });
}

/// Feet stand, hips sway and sink: thighs, shins and feet turn so that the feet of this one stay where they are.
skeletons::Person swaying() {
  skeletons::Person person = skeletons::person(skeletons::dialects()[0]);
  person.motion.rate = 30;
  const auto bend = [](double t) { return 0.25 - 0.25 * std::cos(3 * t); };
  const auto sway = [](double t) { return 0.08 * std::sin(3 * t); };
  const double thigh = 0.41, shin = 0.41;
  add_channel(person.motion, 0, npt::ChannelPath::translation, [&](double t) {
    const double drop = (thigh + shin) * (1 - std::cos(bend(t)) * std::cos(sway(t)));
    return std::array<double, 3>{std::sin(sway(t)) * (thigh + shin) * std::cos(bend(t)), 0.95 - drop, 0.0};
  });
  for (std::size_t side = 0; side < 2; ++side) {
    add_turn(person.motion, person.joint(npt::limb_role(LimbPart::upper_leg, side)), [&](double t) {
      return npt::axis_angle(npt::Quaternion{}.turned({-bend(t), 0, 0}).turned({0, 0, -sway(t)}));
    });
    add_turn(person.motion, person.joint(npt::limb_role(LimbPart::lower_leg, side)), [&](double t) {
      return npt::Vec3d{2 * bend(t), 0, 0};
    });
    add_turn(person.motion, person.joint(npt::limb_role(LimbPart::foot, side)), [&](double t) {
      const npt::Quaternion above = npt::Quaternion{}.turned({-bend(t), 0, 0}).turned({0, 0, -sway(t)}) *
                                    npt::Quaternion{}.turned({2 * bend(t), 0, 0});
      return npt::axis_angle(npt::inverse(above));
    });
  }
  return person;
}

/// How far a joint wanders along the ground over the clip.
double wandering(const npt::Motion& motion, std::size_t joint) {
  npt::Vec3d low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  for (int f = 0; f <= 60; ++f) {
    const npt::Vec3d p = npt::joint_positions(motion, f / 30.0)[joint];
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return std::hypot(high.x - low.x, high.z - low.z);
}

}  // namespace retarget_corrections

using namespace retarget_corrections;

TEST_CASE("feet that stand in the source stand on a body of other proportions, at its height") {
  const skeletons::Person source = swaying();
  const std::size_t own = source.joint(npt::limb_role(LimbPart::foot, 0));
  const double theirs = wandering(source.motion, own);
  skeletons::Person target = skeletons::person(skeletons::dialects()[2], {.rolls = true});
  for (npt::MotionJoint& joint : target.motion.joints)  // long shins, short thighs, wide hips
    if (joint.name == "calf_l" || joint.name == "calf_r")
      joint.rest.translation = joint.rest.translation * 0.8;
    else if (joint.name == "thigh_l" || joint.name == "thigh_r")
      joint.rest.translation.x *= 1.5;
  const std::size_t foot = target.joint(npt::limb_role(LimbPart::foot, 0));
  const npt::Motion plain = corrected(source, target, npt::RetargetOptions::plain());
  const npt::Motion held = corrected(source, target, only_feet());
  MESSAGE("source " << theirs << ", plain " << wandering(plain, foot) << ", held " << wandering(held, foot));
  CHECK(wandering(held, foot) < 1.2 * theirs + 0.002);
  CHECK(wandering(held, foot) < wandering(plain, foot));
  const double floor = npt::joint_positions(target.motion, std::nullopt)[foot].y;
  for (int f = 0; f <= 60; ++f) CHECK(npt::joint_positions(held, f / 30.0)[foot].y > floor - 0.01);
}

TEST_CASE("straight legs stay straight, and knees bend forwards") {
  const skeletons::Person source = swaying();
  const skeletons::Person target = skeletons::person(skeletons::dialects()[1], {.size = 0.6, .leg = 0.7});
  const npt::Motion held = corrected(source, target, only_feet());
  const auto straightness = [](const npt::Motion& motion, const skeletons::Person& person, double time) {
    const auto p = npt::joint_positions(motion, time);
    const npt::Vec3d hip = p[person.joint(npt::limb_role(LimbPart::upper_leg, 0))];
    const npt::Vec3d knee = p[person.joint(npt::limb_role(LimbPart::lower_leg, 0))];
    const npt::Vec3d foot = p[person.joint(npt::limb_role(LimbPart::foot, 0))];
    return npt::length(foot - hip) / (npt::length(knee - hip) + npt::length(foot - knee));
  };
  for (int f = 0; f <= 60; ++f)
    CHECK(straightness(held, target, f / 30.0) ==
          doctest::Approx(straightness(source.motion, source, f / 30.0)).epsilon(0.005));
  const auto p = npt::joint_positions(held, 1.0);
  const npt::Vec3d hip = p[target.joint(npt::limb_role(LimbPart::upper_leg, 0))];
  const npt::Vec3d knee = p[target.joint(npt::limb_role(LimbPart::lower_leg, 0))];
  const npt::Vec3d foot = p[target.joint(npt::limb_role(LimbPart::foot, 0))];
  CHECK(knee.z > 0.5 * (hip.z + foot.z));
}

TEST_CASE("a stretched leg comes near its goal without a snap") {
  double last = 0;
  for (int i = 0; i <= 100; ++i) {
    const double wish = 0.9 + 0.002 * i, got = npt::internal::soft_distance(wish, 0.9, 1);
    CHECK(got <= 1);
    CHECK(got >= last);
    CHECK(got - last < (i == 0 ? 1.0 : 0.0021));
    last = got;
  }
  CHECK(npt::internal::soft_distance(0.999, 1, 1) == doctest::Approx(0.999));  // straight before: straight
}

TEST_CASE("a leg that is nearly straight reaches its goal, whichever way it is bent") {
  const skeletons::Person person = skeletons::person(skeletons::dialects()[0]);
  const npt::JointRoles roles = npt::joint_roles(person.motion);
  const npt::internal::LimbJoints limb{roles.joint(LimbPart::upper_leg, 0),
                                       roles.joint(LimbPart::lower_leg, 0),
                                       roles.joint(LimbPart::foot, 0),
                                       {1, 0, 0}};
  for (int i = 0; i < 8; ++i) {
    npt::internal::PosedJoints pose(person.motion, {}, npt::bound_worlds(person.motion));
    pose.set(npt::local_places(person.motion, std::nullopt));
    pose.turn(limb.middle, npt::turn_between(pose.position(limb.last) - pose.position(limb.middle),
                                             pose.position(limb.middle) - pose.position(limb.first)));
    pose.turn(limb.middle, npt::Quaternion{}.turned({0.04 * std::cos(0.7 * i), 0, 0.04 * std::sin(0.7 * i)}));
    const npt::Vec3d goal = pose.position(limb.last) + npt::Vec3d{0, 0.05, 0.02};
    CHECK(npt::internal::reach(pose, limb, goal) < 1e-4);  // after one turn up to 7 mm
    CHECK(npt::length(pose.position(limb.last) - goal) < 1e-4);
  }
}

TEST_CASE("a foot doesn't stand where its leg is drawn out to the ground") {
  const npt::internal::LimbJoints leg{0, 1, 2, {}};
  const auto joints = [](double hip) {
    return std::vector<npt::Affine>{{.shift = {0, hip, 0}}, {.shift = {0, hip - 0.4, 0}}, {.shift = {0, 0.1, 0}}};
  };
  npt::internal::RetargetFrames frames;
  for (int f = 0; f <= 30; ++f) {
    frames.times.push_back(static_cast<float>(f) / 30);
    frames.sources.push_back(joints(f < 20 ? 0.8 : 0.8 + 0.05 * (f - 19)));  // the foot stays on the ground
  }
  const std::vector<npt::internal::Contact> contacts = npt::internal::foot_contacts(frames, 2, 0.8, leg, joints(0.9));
  REQUIRE(contacts.size() == 1);
  CHECK(contacts[0].first == 0);
  CHECK(contacts[0].last == 21);  // where the hip is 0.8 above the foot
  CHECK(npt::internal::foot_contacts(frames, 2, 0.8, {}, joints(0.9))[0].last == 30);
}

TEST_CASE("keys that interpolation brings back are left out, within a tenth of a millimetre") {
  skeletons::Person source = skeletons::person(skeletons::dialects()[0], {.rolls = true});
  skeletons::add_clip(source);
  npt::RetargetOptions all = npt::RetargetOptions::plain(), thin = all;
  thin.key_tolerance = 1e-4;
  const npt::Motion whole = corrected(source, source, all), less = corrected(source, source, thin);
  const auto keys = [](const npt::Motion& motion) {
    std::size_t count = 0;
    for (const npt::ClipChannel& channel : motion.clip.channels) count += channel.times.size();
    return count;
  };
  MESSAGE(keys(whole) << " keys, " << keys(less) << " after thinning");
  CHECK(keys(less) < keys(whole));
  double most = 0;
  for (int f = 0; f <= 60; ++f) {
    const auto a = npt::joint_positions(whole, f / 30.0), b = npt::joint_positions(less, f / 30.0);
    for (std::size_t j = 0; j < a.size(); ++j) most = std::max(most, npt::length(a[j] - b[j]));
  }
  CHECK(most < 1e-4);
  for (const npt::ClipChannel& channel : less.clip.channels)
    for (const float time : channel.times) CHECK(std::abs(time * 30 - std::round(time * 30)) < 1e-4F);
}

TEST_CASE("a motion in place goes nowhere; its way can be the root's") {
  skeletons::Person source = skeletons::person(skeletons::dialects()[0]);
  skeletons::add_clip(source);
  skeletons::Person target = source;
  target.motion.clip = {};
  for (npt::MotionJoint& joint : target.motion.joints)
    joint.parent = joint.parent == npt::no_item ? 0 : joint.parent + 1;
  target.motion.joints.insert(target.motion.joints.begin(), {.name = "Root"});
  target.roles.insert(target.roles.begin(), JointRole::none);
  npt::RetargetOptions options = npt::RetargetOptions::plain();
  options.root_motion = npt::RootMotion::extract;
  const npt::Motion kept = corrected(source, target, npt::RetargetOptions::plain());
  const npt::Motion extracted = corrected(source, target, options);
  options.in_place = true;
  const npt::Motion in_place = corrected(source, target, options);
  CHECK(wandering(kept, 0) == 0);
  CHECK(wandering(extracted, 0) == doctest::Approx(wandering(kept, 1)).epsilon(1e-4));
  CHECK(wandering(in_place, 1) < 1e-5);
  const auto a = npt::joint_positions(kept, 2.0), b = npt::joint_positions(extracted, 2.0);
  for (std::size_t j = 1; j < a.size(); ++j) CHECK(npt::length(a[j] - b[j]) < 1e-5);  // the last frame is exact
}

TEST_CASE("arms are kept out of a trunk that is in their way, and turns are smooth") {
  skeletons::Person source = skeletons::person(skeletons::dialects()[0]);
  source.motion.rate = 30;
  add_turn(source.motion, source.joint(npt::limb_role(LimbPart::upper_arm, 0)), [](double t) {
    return npt::Vec3d{0, 0, -0.75 * (1 - std::cos(3 * t))};
  });  // down to the flank and up again
  const skeletons::Person target = skeletons::person(skeletons::dialects()[0]);
  const npt::JointRoles roles = npt::joint_roles(target.motion);
  npt::RetargetShapes shapes;
  const auto places = npt::joint_positions(target.motion, std::nullopt);
  for (int i = 0; i < 8; ++i) {
    npt::BodyRing ring{roles.joint(JointRole::hips), {0, 0.88 + 0.07 * i, 0}, {}};
    ring.radii.fill(0.35);
    shapes.target.rings.push_back(ring);
  }
  const std::size_t elbow = roles.joint(LimbPart::lower_arm, 0), hand = roles.joint(LimbPart::hand, 0);
  for (const double along : {0.0, 0.5, 1.0})
    shapes.target.arms[0].push_back({elbow, places[elbow] * (1 - along) + places[hand] * along, 0});
  npt::RetargetOptions options = npt::RetargetOptions::plain();
  const npt::Motion plain = corrected(source, target, options, shapes);
  options.clearance = 1;
  const npt::Motion clear = corrected(source, target, options, shapes);
  const auto inside = [&](const npt::Motion& motion) {
    double sum = 0;
    for (int f = 0; f <= 60; ++f) {
      const npt::Vec3d p = npt::joint_positions(motion, f / 30.0)[hand];
      if (p.y > 0.88 && p.y < 1.37) sum += std::max(0.0, 0.35 - std::hypot(p.x, p.z));
    }
    return sum;
  };
  MESSAGE("inside " << inside(plain) << ", cleared " << inside(clear));
  CHECK(inside(plain) > 0.1);
  CHECK(inside(clear) < 0.02 * inside(plain));
  for (int f = 1; f <= 60; ++f) {
    const double step =
        npt::length(npt::joint_positions(clear, f / 30.0)[hand] - npt::joint_positions(clear, (f - 1) / 30.0)[hand]);
    CHECK(step < 0.15);
  }
}

TEST_CASE("a bent arm that is in the trunk lifts its elbow and keeps its hand") {
  skeletons::Person source = skeletons::person(skeletons::dialects()[0]);
  source.motion.rate = 30;
  add_turn(source.motion, source.joint(npt::limb_role(LimbPart::upper_arm, 0)), [](double) {
    return npt::Vec3d{0, 0, -1.4};
  });  // hangs
  add_turn(source.motion, source.joint(npt::limb_role(LimbPart::lower_arm, 0)), [](double) {
    return npt::Vec3d{0, -1.6, 0};
  });  // forwards
  const skeletons::Person target = skeletons::person(skeletons::dialects()[0]);
  const npt::JointRoles roles = npt::joint_roles(target.motion);
  const auto places = npt::joint_positions(target.motion, std::nullopt);
  const std::size_t shoulder = roles.joint(LimbPart::upper_arm, 0), elbow = roles.joint(LimbPart::lower_arm, 0),
                    hand = roles.joint(LimbPart::hand, 0);
  npt::RetargetShapes shapes;
  for (int i = 0; i < 8; ++i) {
    shapes.target.rings.push_back({roles.joint(JointRole::hips), {0, 0.88 + 0.07 * i, 0}, {}});
    shapes.target.rings.back().radii.fill(places[shoulder].x + 0.1);
  }
  for (const double along : {0.5, 1.0})
    shapes.target.arms[0].push_back({shoulder, places[shoulder] * (1 - along) + places[elbow] * along, 0});
  for (const double along : {0.0, 0.5, 1.0})
    shapes.target.arms[0].push_back({elbow, places[elbow] * (1 - along) + places[hand] * along, 0});
  npt::RetargetOptions options = npt::RetargetOptions::plain();
  const auto plain = npt::joint_positions(corrected(source, target, options, shapes), 1.0);
  options.clearance = 1;
  const auto clear = npt::joint_positions(corrected(source, target, options, shapes), 1.0);
  const double elbow_way = npt::length(clear[elbow] - plain[elbow]), hand_way = npt::length(clear[hand] - plain[hand]);
  MESSAGE("elbow " << elbow_way << ", hand " << hand_way);
  CHECK(std::hypot(plain[elbow].x, plain[elbow].z) < places[shoulder].x + 0.08);
  CHECK(std::hypot(clear[elbow].x, clear[elbow].z) > places[shoulder].x + 0.09);
  CHECK(hand_way < 0.5 * elbow_way);
}

TEST_CASE("hands that touch each other touch on a body with broader shoulders") {
  skeletons::Person source = skeletons::person(skeletons::dialects()[0]);
  source.motion.rate = 30;
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}})  // forwards, and together
    add_turn(source.motion, source.joint(npt::limb_role(LimbPart::upper_arm, side)), [side](double) {
      return npt::Vec3d{0, (side == 0 ? -1 : 1) * 1.9, 0};
    });
  skeletons::Person target = skeletons::person(skeletons::dialects()[0]);
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}})
    target.motion.joints[target.joint(npt::limb_role(LimbPart::upper_arm, side))].rest.translation.x *= 1.6;
  const auto apart = [&](const npt::Motion& motion, const skeletons::Person& person) {
    const auto p = npt::joint_positions(motion, 1.0);
    return npt::length(p[person.joint(npt::limb_role(LimbPart::hand, 0))] -
                       p[person.joint(npt::limb_role(LimbPart::hand, 1))]);
  };
  npt::RetargetOptions options = npt::RetargetOptions::plain();
  const double plain = apart(corrected(source, target, options), target);
  options.touch = true;
  const double touching = apart(corrected(source, target, options), target), theirs = apart(source.motion, source);
  MESSAGE("source " << theirs << ", plain " << plain << ", touching " << touching);
  CHECK(std::abs(touching - theirs) < 0.5 * std::abs(plain - theirs));
}

TEST_CASE("a forearm's twist joint takes half of the hand's turn, and skin joints of nobody keep their places") {
  skeletons::Person source = skeletons::person(skeletons::dialects()[2]);
  source.motion.rate = 30;
  const std::size_t hand = source.joint(npt::limb_role(LimbPart::hand, 0)),
                    elbow = source.joint(npt::limb_role(LimbPart::lower_arm, 0));
  add_turn(source.motion, hand, [](double t) { return npt::Vec3d{0.5 * t, 0, 0}; });  // about the arm
  skeletons::Person target = source;
  target.motion.clip = {};
  const std::size_t twist = target.motion.joints.size();
  target.motion.joints.insert(target.motion.joints.begin() + static_cast<std::ptrdiff_t>(elbow) + 1,
                              npt::MotionJoint{.name = "lowerarm_twist_01_l", .parent = elbow});
  target.motion.joints[elbow + 1].rest.translation = target.motion.joints[hand + 1].rest.translation * 0.5;
  for (std::size_t j = 0; j <= twist; ++j)
    if (std::size_t& parent = target.motion.joints[j].parent; parent != npt::no_item && parent > elbow) ++parent;
  target.roles.insert(target.roles.begin() + static_cast<std::ptrdiff_t>(elbow) + 1, JointRole::none);
  npt::RetargetOptions options = npt::RetargetOptions::plain();
  options.twist = true;
  const npt::Motion got = corrected(source, target, options);
  const npt::Vec3d turned = npt::axis_angle(npt::local_places(got, 2.0)[elbow + 1].rotation);
  CHECK(std::abs(turned.x) == doctest::Approx(0.5).epsilon(0.02));
  CHECK(npt::length(turned) == doctest::Approx(0.5).epsilon(0.02));
}
