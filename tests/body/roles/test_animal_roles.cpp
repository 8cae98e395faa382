/// Roles of a four-legged animal's joints: by names, by shape, in bone maps.
#include <doctest/doctest.h>

#include <npt/base/vec3.hpp>
#include <npt/body/roles/bone_map.hpp>
#include <npt/body/roles/facing.hpp>
#include <npt/body/roles/feet_apart.hpp>
#include <npt/body/roles/joint_chains.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/body/roles/placed_motion.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <body/roles/animal_skeleton.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace {

using npt::JointRole;
using npt::SkeletonKind;

std::string joint_of(const npt::Motion& motion, const npt::JointRoles& roles, JointRole role) {
  return roles.joint(role) == npt::no_item ? "none" : motion.joints[roles.joint(role)].name;
}

/// Roles whose joints differ.
std::string unlike(const npt::JointRoles& a, const npt::JointRoles& b) {
  std::string text;
  for (std::size_t r = 0; r < npt::joint_role_count; ++r)
    if (a.joints[r] != b.joints[r]) text += a.role_name(static_cast<JointRole>(r)) + "; ";
  return text;
}

}  // namespace

TEST_CASE("an animal's joints are known by the names of npt's own, which have all roles") {
  const npt::Motion motion = animal_skeleton::of_names(animal_skeleton::own_names());
  const npt::JointRoles roles = npt::joint_roles(motion);
  CHECK(roles.kind() == SkeletonKind::four_legged);
  CHECK(roles.dialect == "npt, animals");
  CHECK(roles.confidence > 0.95);
  CHECK(joint_of(motion, roles, JointRole::hips) == "pelvis");
  CHECK(joint_of(motion, roles, JointRole::tail_5) == "tail5");
  CHECK(joint_of(motion, roles, JointRole::neck_2) == "neck2");
  CHECK(joint_of(motion, roles, JointRole::left_fore_toes) == "l_forefoot");
  CHECK(joint_of(motion, roles, npt::limb_role(npt::LimbPart::shoulder, 1)) == "r_scapula");
  CHECK(joint_of(motion, roles, npt::limb_role(npt::LimbPart::foot, 0)) == "l_hock");
}

TEST_CASE("and by the shape alone, whichever way it stands and whichever axis is up") {
  npt::Motion motion = animal_skeleton::of_names(animal_skeleton::own_names());
  const npt::JointRoles named = npt::joint_roles(motion);
  for (const npt::Vec3d turn : {npt::Vec3d{}, npt::Vec3d{0, 3, 0}, npt::Vec3d{1.57, 0, 0}, npt::Vec3d{0, 0, 3.14}}) {
    npt::Motion nameless = animal_skeleton::turned(motion, turn);
    for (npt::MotionJoint& joint : nameless.joints) joint.name = "";
    const npt::JointRoles roles = npt::joint_roles(nameless);
    CHECK(roles.kind() == SkeletonKind::four_legged);
    CHECK(roles.confidence > 0.6);
    CHECK(unlike(named, roles) == "jaw; leftEar; rightEar; ");
  }
}

TEST_CASE("left is left where an animal's names exchange the sides") {
  npt::Motion motion = animal_skeleton::of_names(animal_skeleton::own_names());
  const npt::JointRoles named = npt::joint_roles(motion);
  for (npt::MotionJoint& joint : motion.joints)
    if (joint.name[1] == '_') joint.name[0] = joint.name[0] == 'l' ? 'r' : 'l';
  CHECK(unlike(named, npt::joint_roles(motion)) == "");
}

TEST_CASE("an animal that stands on its hind legs alone is none with four") {
  const npt::Motion motion =
      animal_skeleton::turned_behind(animal_skeleton::of_names(animal_skeleton::own_names()), "spine1", {-1.4, 0, 0});
  CHECK(npt::joint_roles(motion, SkeletonKind::four_legged).confidence < 0.3);
}

TEST_CASE("axes of an animal: legs hang down, the forelegs are in front") {
  const npt::Motion motion = animal_skeleton::of_names(animal_skeleton::own_names());
  const npt::BodyAxes axes = npt::body_axes(npt::joint_roles(motion).joints, npt::joint_positions(motion, {}));
  CHECK(axes.up.y > 0.99);
  CHECK(axes.forward.z > 0.99);
  CHECK(axes.left.x > 0.99);
}

TEST_CASE("an animal's chains hold all joints between the first and the last that have a role") {
  const npt::Motion motion = animal_skeleton::of_names(animal_skeleton::own_names());
  const npt::JointRoles roles = npt::joint_roles(motion);
  const npt::JointChains chains = npt::joint_chains(motion, roles);
  CHECK(chains[0].size() == 4);  // of which three have roles
  CHECK(chains[npt::neck_chain].size() == 3);
  CHECK(chains[2].size() == 5);
  const std::vector<std::size_t> same = npt::same_joints(motion, roles, motion, roles);
  for (std::size_t j = 0; j < same.size(); ++j) CHECK((same[j] == j || roles.role_of(j) != JointRole::none));
  CHECK(npt::feet_apart(motion, roles).empty());
}

TEST_CASE("a bone map of an animal has names of its own, and reads back") {
  const npt::Motion motion = animal_skeleton::of_names(animal_skeleton::own_names());
  const npt::JointRoles roles = npt::joint_roles(motion);
  const std::string text = npt::format_bone_map(motion, roles);
  CHECK(text.find("leftForeUpperLeg \"l_shoulder\" 1\n") != std::string::npos);
  CHECK(text.find("rightHindFoot \"r_hock\" 1\n") != std::string::npos);
  CHECK(npt::parse_bone_map(text, motion, roles, "map.txt").joints == roles.joints);
  // Also of a skeleton that was taken for a person's, whose roles then don't count.
  const npt::JointRoles person = npt::joint_roles(motion, SkeletonKind::person);
  const npt::JointRoles read = npt::parse_bone_map(text, motion, person, "map.txt");
  CHECK(read.kind() == SkeletonKind::four_legged);
  CHECK(read.joints == roles.joints);
  CHECK_THROWS_WITH(
      npt::parse_bone_map("leftUpperArm l_elbow\nleftForeUpperLeg l_shoulder\n", motion, roles, "map.txt"),
      doctest::Contains("map.txt: line 2: found 'leftForeUpperLeg', expected roles of people or of animals alone"));
}

TEST_CASE("an animal's size says the unit of a file that says none") {
  npt::Motion motion = animal_skeleton::of_names(animal_skeleton::own_names());
  for (npt::MotionJoint& joint : motion.joints) joint.rest.translation = joint.rest.translation * 100.0;
  CHECK(npt::metres_a_unit(npt::placed_motion(motion)) == doctest::Approx(0.01));
}
