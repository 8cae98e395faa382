#include <doctest/doctest.h>

#include <npt/lab/rig/humanoid_joints.hpp>

TEST_CASE("joints of a person are known by the names that tools give them") {
  using npt::rig::internal::JointName;
  const auto is = [](const char* name, const char* base, JointName::Side side) {
    const JointName parsed = npt::rig::internal::parse_joint_name(name);
    CAPTURE(name);
    CHECK(parsed.base == base);
    CHECK(parsed.side == side);
  };
  using enum JointName::Side;
  is("mixamorig:LeftUpLeg", "upleg", left);
  is("mixamorigLeftForeArm", "forearm", left);
  is("rightUpperLeg", "upperleg", right);
  is("DEF-upper_arm.L.001", "upperarm1", left);
  is("Bip01 R Thigh", "thigh", right);
  is("J_Bip_C_UpperChest", "upperchest", middle);
  is("calf_l", "calf", left);
  is("l_hip", "hip", left);
  is("Armature|Hips", "hips", middle);
  is("LeftHandMiddle1", "handmiddle1", left);
}
