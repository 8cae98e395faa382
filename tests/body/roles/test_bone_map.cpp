#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/body/roles/bone_map.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/body/roles/placed_motion.hpp>

#include <body/roles/skeletons.hpp>
#include <io/scratch.hpp>

#include <string>

namespace {

struct Fixture {
  skeletons::Person person = skeletons::person(skeletons::dialects().front());
  npt::JointRoles roles = npt::joint_roles(person.motion);

  npt::JointRoles read(const std::string& text) const {
    return npt::parse_bone_map(text, person.motion, roles, "map.txt");
  }
  std::string error_in(const std::string& text) const {
    return scratch::error_of([&] { read(text); });
  }
};

}  // namespace

TEST_CASE_FIXTURE(Fixture, "a bone map reads back as it was written, also where joints share a name") {
  const std::string text = npt::format_bone_map(person.motion, roles);
  CHECK(text.starts_with("# role joint confidence\nhips \"mixamorig:Hips\" 1\nspine \"mixamorig:Spine\" 0.95\n"));
  npt::JointRoles none;
  none.joints.fill(npt::no_item);
  CHECK(npt::parse_bone_map(text, person.motion, none, "map.txt").joints == roles.joints);
  person.motion.joints[2].name = person.motion.joints[1].name;
  person.motion.joints[3].name = "odd \" name";
  const std::string again = npt::format_bone_map(person.motion, roles);
  CHECK(again.find("spine @1 ") != std::string::npos);
  CHECK(again.find("upperChest @3 ") != std::string::npos);
  CHECK(npt::parse_bone_map(again, person.motion, none, "map.txt").joints == roles.joints);
}

TEST_CASE_FIXTURE(Fixture, "lines of a bone map go before what was found") {
  const npt::JointRoles changed = read("neck -\nhead mixamorig:Neck # no neck\n\nleftHand @0 0.25\n");
  CHECK(changed.joint(npt::JointRole::neck) == npt::no_item);
  CHECK(changed.joint(npt::JointRole::head) == roles.joint(npt::JointRole::neck));
  CHECK(changed.confidence_of(npt::JointRole::head) == 1);
  CHECK(changed.joint(npt::limb_role(npt::LimbPart::hand, 0)) == 0);
  CHECK(changed.confidence_of(npt::limb_role(npt::LimbPart::hand, 0)) == 0.25);
  CHECK(changed.joint(npt::JointRole::hips) == npt::no_item);
  CHECK(changed.joint(npt::JointRole::spine) == roles.joint(npt::JointRole::spine));
}

TEST_CASE_FIXTURE(Fixture, "what is wrong in a bone map is an error that names the line") {
  CHECK(error_in("\npelvis a") ==
        "map.txt: line 2: found 'pelvis', expected a role: hips, spine, head, leftUpperArm, ...");
  CHECK(error_in("hips Tail") == "map.txt: line 1: found no joint 'Tail', expected one of the skeleton's joints");
  CHECK(error_in("hips @999") == "map.txt: line 1: found no joint '@999', expected one of the skeleton's joints");
  CHECK(error_in("hips") == "map.txt: line 1: found 1 word, expected ROLE JOINT [CONFIDENCE]");
  CHECK(error_in("hips 'a") ==
        "map.txt: line 1: found a quotation mark that is not closed, expected ROLE JOINT [CONFIDENCE]");
  CHECK(error_in("hips @0\nhips @1") == "map.txt: line 2: found 'hips' twice, expected each role once");
  CHECK(error_in("hips @0\nhead @0") ==
        "map.txt: line 2: found joint 'mixamorig:Hips' twice, expected one role a joint");
  CHECK(error_in("hips @0 2") == "map.txt: line 1: found '2', expected a confidence from 0 to 1");
  person.motion.joints[4].name = person.motion.joints[5].name;
  CHECK(error_in("head mixamorig:Head") ==
        "map.txt: line 1: found 2 joints 'mixamorig:Head', expected @NUMBER for one of them");
}

TEST_CASE("a motion without unit and up axis gets both from its body") {
  for (const double size : {1.0, 100.0, 1000.0, 1 / 0.0254, 1 / 0.05644}) {
    skeletons::Person person = skeletons::person(skeletons::dialects().front(), {.size = size});
    for (npt::MotionJoint& joint : person.motion.joints)  // z up
      joint.rest.translation = {joint.rest.translation.x, -joint.rest.translation.z, joint.rest.translation.y};
    const npt::Motion placed = npt::placed_motion(person.motion);
    CHECK(npt::metres_a_unit(placed) == doctest::Approx(1 / size));
    CHECK(npt::up_axis(placed) == "z");
    CHECK(npt::joint_positions(placed, std::nullopt)[0].y == doctest::Approx(0.95));
  }
  skeletons::Person doll = skeletons::person(skeletons::dialects().front(), {.size = 4});
  CHECK(npt::metres_a_unit(npt::placed_motion(doll.motion)) == doctest::Approx(1.7 / (4 * 1.6)).epsilon(0.01));
}
