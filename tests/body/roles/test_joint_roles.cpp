#include <doctest/doctest.h>

#include <npt/body/roles/dialects.hpp>
#include <npt/body/roles/facing.hpp>
#include <npt/body/roles/joint_name.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/body/roles/limbs.hpp>
#include <npt/body/roles/named_roles.hpp>
#include <npt/body/roles/rest_pose.hpp>
#include <npt/body/roles/root_motion.hpp>
#include <npt/body/roles/shaped_roles.hpp>
#include <npt/body/roles/skeleton_shape.hpp>

#include <body/roles/skeletons.hpp>

#include <cstddef>
#include <string>

namespace {

using npt::JointRole;

/// Roles that aren't as they were made, by name.
std::string wrong_roles(const skeletons::Person& person, const npt::JointRoles& roles) {
  std::string wrong;
  for (std::size_t j = 0; j < person.roles.size(); ++j)
    if (person.roles[j] != JointRole::none && roles.joint(person.roles[j]) != j) {
      const std::size_t other = roles.joint(person.roles[j]);
      wrong += npt::role_name(person.roles[j]) + " = " +
               (other == npt::no_item ? std::string("none") : person.motion.joints[other].name) + "; ";
    }
  return wrong;
}

skeletons::Person nameless(skeletons::Person person) {
  for (npt::MotionJoint& joint : person.motion.joints) joint.name = "";
  return person;
}

}  // namespace

TEST_CASE("names of roles are unlike each other and read back") {
  for (std::size_t r = 0; r < npt::joint_role_count; ++r) {
    const auto role = static_cast<JointRole>(r);
    CHECK(npt::role_named(npt::role_name(role)) == role);
    CHECK(npt::mirrored(npt::mirrored(role)) == role);
  }
  CHECK(npt::role_name(npt::limb_role(npt::LimbPart::upper_arm, 1)) == "rightUpperArm");
  CHECK(npt::role_name(npt::limb_role(npt::digit_part(4, 2), 0)) == "leftLittleDistal");
  CHECK(npt::role_named("Hips") == JointRole::none);
}

TEST_CASE("a joint's name gives its side and its words, however it is spelled") {
  for (const char* name :
       {"mixamorig:LeftUpLeg", "mixamorig1:LeftUpLeg", "LeftUpLeg", "upleg_l", "UpLeg.L", "lUpLeg", "Bip01 L UpLeg",
        "J_Bip_L_UpLeg", "DEF-up_leg.L", "left_up_leg", "UP-LEG-LEFT", "Rig|upleg.l", "leftupleg"}) {
    const npt::JointName parsed = npt::parse_joint_name(name);
    CHECK_MESSAGE(parsed.words.front() == "upleg", name);
    CHECK_MESSAGE(parsed.side == std::size_t{0}, name);
  }
  CHECK(npt::parse_joint_name("RHipJoint").words.front() == "hipjoint");
  CHECK(npt::parse_joint_name("RHipJoint").side == std::size_t{1});
  CHECK(npt::parse_joint_name("spine_01").words == std::vector<std::string>{"spine01", "spine1", "spine"});
  CHECK(!npt::parse_joint_name("Head").side.has_value());
  CHECK(npt::parse_joint_name("Armature").words.front() == "armature");
  CHECK(npt::parse_joint_name("").words.front().empty());
  CHECK(npt::parse_joint_name("右腕").words.front() == "腕");
}

TEST_CASE("each dialect's skeleton is known by its names, in T and A poses, and says the dialect") {
  for (const skeletons::Names& names : skeletons::dialects())
    for (const double below : {0.0, 45.0}) {
      const skeletons::Person person = skeletons::person(names, {.arms_below = below});
      const npt::JointRoles roles = npt::joint_roles(person.motion);
      CHECK_MESSAGE(wrong_roles(person, roles) == "", names.dialect);
      CHECK_MESSAGE(roles.dialect == names.dialect, roles.dialect);
      CHECK_MESSAGE(roles.confidence > 0.95, names.dialect);
      CHECK(roles.confidence_of(npt::limb_role(npt::LimbPart::lower_arm, 1)) == 1);
      CHECK(npt::rest_pose_of(person.motion, roles) == (below == 0 ? npt::RestPose::t : npt::RestPose::a));
    }
}

TEST_CASE("fingers may branch from a joint of the palm behind the wrist") {
  skeletons::Person person = nameless(skeletons::person(skeletons::dialects().front()));
  for (std::size_t side = 0; side < 2; ++side) {
    const std::size_t hand = person.joint(npt::limb_role(npt::LimbPart::hand, side));
    npt::MotionJoint palm;
    palm.parent = hand;
    for (npt::MotionJoint& joint : person.motion.joints) {
      if (joint.parent == npt::no_item || joint.parent < hand) continue;
      if (joint.parent == hand) palm.rest.translation = joint.rest.translation * 0.9;
      if (joint.parent == hand) joint.rest.translation = joint.rest.translation - palm.rest.translation;
      ++joint.parent;
    }
    person.motion.joints.insert(person.motion.joints.begin() + static_cast<std::ptrdiff_t>(hand) + 1, palm);
    person.roles.insert(person.roles.begin() + static_cast<std::ptrdiff_t>(hand) + 1, JointRole::none);
  }
  const npt::JointRoles roles = npt::joint_roles(person.motion);
  for (std::size_t side = 0; side < 2; ++side)
    for (const auto part :
         {npt::LimbPart::shoulder, npt::LimbPart::upper_arm, npt::LimbPart::lower_arm, npt::LimbPart::hand})
      CHECK(roles.joint(part, side) == person.joint(npt::limb_role(part, side)));
}

TEST_CASE("a skeleton without names is known by its shape, whatever the frames of its bones") {
  for (const bool backwards : {false, true})
    for (const double below : {0.0, 50.0}) {
      const skeletons::Person person = nameless(skeletons::person(
          skeletons::dialects().front(), {.arms_below = below, .size = 40, .rolls = true, .backwards = backwards}));
      const npt::JointRoles roles = npt::joint_roles(person.motion);
      CHECK(wrong_roles(person, roles) == "");
      CHECK(roles.dialect.empty());
      CHECK(roles.confidence > 0.5);
      CHECK(roles.confidence <= 0.7);
    }
}

TEST_CASE("what a VRM file says of its joints goes before their names") {
  skeletons::Person person = nameless(skeletons::person(skeletons::dialects().front()));
  for (std::size_t j = 0; j < person.roles.size(); ++j) {
    std::string bone = npt::role_name(person.roles[j]);
    person.motion.joints[j].name = "bone" + std::to_string(j);
    // VRM 0's thumbs
    if (const std::size_t at = bone.find("ThumbProximal"); at != std::string::npos)
      bone.replace(at, 13, "ThumbIntermediate");
    if (const std::size_t at = bone.find("ThumbMetacarpal"); at != std::string::npos)
      bone.replace(at, 15, "ThumbProximal");
    person.motion.joints[j].bone = bone;
  }
  const npt::JointRoles roles = npt::joint_roles(person.motion);
  CHECK(wrong_roles(person, roles) == "");
  CHECK(roles.dialect == "VRM's bones");
  CHECK(roles.confidence > 0.95);
}

TEST_CASE("left and right are the body's own where names exchange them") {
  skeletons::Names names = skeletons::dialects().front();
  std::swap(names.sides[0], names.sides[1]);
  const skeletons::Person person = skeletons::person(names);
  const npt::JointRoles roles = npt::joint_roles(person.motion);
  CHECK(wrong_roles(person, roles) == "");
  CHECK(roles.confidence_of(npt::limb_role(npt::LimbPart::hand, 0)) < 0.8);
}

TEST_CASE("names that don't fit the skeleton give way to its shape") {
  skeletons::Person person = skeletons::person(skeletons::dialects().front());
  const std::size_t arm = person.joint(npt::limb_role(npt::LimbPart::upper_arm, 0));
  const std::size_t knee = person.joint(npt::limb_role(npt::LimbPart::lower_leg, 0));
  std::swap(person.motion.joints[arm].name, person.motion.joints[knee].name);
  CHECK(wrong_roles(person, npt::joint_roles(person.motion)) == "");
}

TEST_CASE("a joint of one name twice is the one that more hangs from") {
  skeletons::Person person = skeletons::person(skeletons::dialects().front());
  person.motion.joints.push_back({.name = "mixamorig:Hips", .parent = 0});
  CHECK(wrong_roles(person, npt::joint_roles(person.motion)) == "");
}

TEST_CASE("what is no body gets no confidence, and nothing breaks") {
  CHECK(npt::joint_roles({}).confidence == 0);
  npt::Motion chain;
  for (std::size_t i = 0; i < 20; ++i) {
    chain.joints.push_back({.name = "Bone", .parent = i == 0 ? npt::no_item : i - 1});
    chain.joints.back().rest.translation = {0, 1, 0};
  }
  CHECK(npt::joint_roles(chain).confidence < 0.2);
  for (npt::MotionJoint& joint : chain.joints) joint.rest.translation = {};
  CHECK(npt::joint_roles(chain).confidence < 0.2);
}

TEST_CASE("arms much longer than legs are wings: what has them is hardly a person, whatever its names") {
  const auto confidence = [](double leg) {
    return npt::joint_roles(skeletons::person(skeletons::dialects().front(), {.leg = leg}).motion).confidence;
  };
  CHECK(confidence(0.5) == doctest::Approx(1));  // arms of 1.3 legs
  CHECK(confidence(0.3) == doctest::Approx(0.44).epsilon(0.1));
  CHECK(confidence(0.2) < 0.3);
}

TEST_CASE("finger names that count a bone in the palm are taken from the next joint on") {
  skeletons::Names names = skeletons::dialects().front();
  skeletons::Person person = skeletons::person(names);
  const std::size_t hand = person.joint(npt::limb_role(npt::LimbPart::hand, 0));
  const std::size_t first = person.joint(npt::limb_role(npt::digit_part(1, 0), 0));
  npt::MotionJoint palm{.name = person.motion.joints[first].name, .parent = hand};
  palm.rest.translation = person.motion.joints[first].rest.translation * 0.25;
  person.motion.joints[first].rest.translation = palm.rest.translation * 3.0;
  for (std::size_t i = 0; i < 3; ++i)
    person.motion.joints[first + i].name = "mixamorig:LeftHandIndex" + std::to_string(i + 2);
  for (std::size_t j = first; j < person.motion.joints.size(); ++j)
    if (person.motion.joints[j].parent != hand && person.motion.joints[j].parent >= first)
      ++person.motion.joints[j].parent;
  person.motion.joints[first].parent = first;
  person.motion.joints.insert(person.motion.joints.begin() + static_cast<std::ptrdiff_t>(first), palm);
  person.roles.insert(person.roles.begin() + static_cast<std::ptrdiff_t>(first), JointRole::none);
  CHECK(wrong_roles(person, npt::joint_roles(person.motion)) == "");
}

TEST_CASE("the clip's way and the joint that carries it are found") {
  skeletons::Person person = skeletons::person(skeletons::dialects().front());
  skeletons::add_clip(person);
  const npt::RootPath root = npt::root_motion_of(person.motion, npt::joint_roles(person.motion));
  CHECK(root.joint == 0);
  CHECK(root.way.z == doctest::Approx(1.6).epsilon(1e-4));
  std::erase_if(person.motion.clip.channels, [](const npt::ClipChannel& c) { return c.width == 3; });
  CHECK(npt::root_motion_of(person.motion, npt::joint_roles(person.motion)).joint == npt::no_item);
}
