/// Fingers by the shape of hands alone: as many as a rig has, with as many joints, in any pose.
#include <doctest/doctest.h>

#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/scene/motion.hpp>

#include <body/roles/skeletons.hpp>

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace {

using npt::JointRole;

struct Hands {
  std::vector<std::size_t> digits;  ///< their numbers, the thumb's is 0
  std::size_t joints = 3;           ///< of a finger; the thumb has one less than four
  bool palm = false;                ///< a finger's first joint lies in the palm
  bool from_wrist = false;          ///< all chains begin at the wrist
  double bend = 0;                  ///< of each finger's joint towards the palm, in degrees
};

/// A person in T pose without names whose hands are as wanted; thumbs stand off by 50 degrees. [joints] roles
class HandMaker {
 public:
  explicit HandMaker(const Hands& hands) : hands_(hands) {}

  skeletons::Person make() {
    skeletons::Names names = skeletons::dialects().front();
    names.digits = {};
    person_ = skeletons::person(names, {.size = 1.3});
    for (npt::MotionJoint& joint : person_.motion.joints) joint.name.clear();
    for (std::size_t side = 0; side < 2; ++side)
      for (const std::size_t digit : hands_.digits) add(side, digit);
    return std::move(person_);
  }

 private:
  std::size_t add(std::size_t parent, npt::Vec3d from_parent, JointRole role) {
    npt::MotionJoint joint{.name = "", .parent = parent};
    joint.rest.translation = from_parent * 1.3;
    person_.motion.joints.push_back(joint);
    person_.roles.push_back(role);
    return person_.roles.size() - 1;
  }

  /// Joints of no bend; the hand's fingers point along the arm, palms down.
  void add(std::size_t side, std::size_t digit) {
    const double x = side == 0 ? 1 : -1;
    std::size_t at = person_.joint(npt::limb_role(npt::LimbPart::hand, side));
    const double row = digit == 0 ? 0.03 : 0.03 - 0.02 * static_cast<double>(digit - 1);
    npt::Vec3d way = digit == 0 ? npt::Vec3d{0.025 * x, -0.01, row} : npt::Vec3d{0.09 * x, 0, row};
    const npt::Vec3d palm{0.02 * x, 0, 0.2 * row};
    const auto role = [&](std::size_t i) {
      return i < 3 ? npt::limb_role(npt::digit_part(digit, i), side) : JointRole::none;
    };
    if (hands_.from_wrist) at = add(at, {0.01 * x, 0, 0}, role(0)), way.x -= 0.01 * x;
    if (hands_.palm && digit > 0) at = add(at, palm, JointRole::none), way = way - palm;
    const std::size_t first = hands_.from_wrist ? 1 : 0, count = digit == 0 ? hands_.joints - 1 : hands_.joints;
    for (std::size_t i = first; i < count; ++i) {
      at = add(at, way, role(i));
      const double angle = digit == 0 ? 0 : hands_.bend * static_cast<double>(i - first + 1) * 0.017453292519943295;
      way = digit == 0
                ? npt::Vec3d{0.022 * x, 0, 0.026}
                : npt::Vec3d{std::cos(angle) * x, -std::sin(angle), 0} * (0.035 - 0.005 * static_cast<double>(i));
    }
  }

  const Hands& hands_;
  skeletons::Person person_;
};

std::string wrong_digits(const Hands& hands) {
  const skeletons::Person person = HandMaker(hands).make();
  const npt::JointRoles roles = npt::joint_roles(person.motion);
  std::string wrong;
  for (std::size_t r = npt::middle_role_count; r < npt::joint_role_count; ++r) {
    const auto role = static_cast<JointRole>(r);
    const std::size_t made = person.joint(role);
    const std::size_t expected = made == person.roles.size() ? npt::no_item : made;
    if (npt::is_of_digit(role) && roles.joint(role) != expected) wrong += npt::role_name(role) + "; ";
  }
  return wrong;
}

}  // namespace

TEST_CASE("fingers without names are found from the thumb on, however many, long and bent") {
  for (const auto& digits : {std::vector<std::size_t>{0, 1, 2, 3, 4}, {0, 1, 2, 4}, {0, 1, 2}, {0, 1}})
    for (const std::size_t joints : {2U, 3U, 4U})
      for (const double bend : {0.0, 45.0, 80.0}) {
        CAPTURE(digits.size());
        CAPTURE(joints);
        CAPTURE(bend);
        CHECK(wrong_digits({.digits = digits, .joints = joints, .bend = bend}) == "");
        CHECK(wrong_digits({.digits = {digits.rbegin(), digits.rend()}, .joints = joints, .bend = bend}) == "");
      }
}

TEST_CASE("fingers whose chains begin at the wrist or in the palm are found as well") {
  for (const auto& digits : {std::vector<std::size_t>{4, 3, 2, 1, 0}, {4, 2, 1, 0}, {0, 2, 1}})
    for (const double bend : {0.0, 60.0}) {
      CAPTURE(digits.size());
      CAPTURE(bend);
      CHECK(wrong_digits({.digits = digits, .from_wrist = true, .bend = bend}) == "");
      CHECK(wrong_digits({.digits = digits, .palm = true, .bend = bend}) == "");
    }
}
