#include "rigged_figure.hpp"

#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/lab/rig/humanoid_joints.hpp>
#include <npt/lab/rig/rig.hpp>

#include <cstddef>
#include <string>
#include <utility>

using enum npt::SmplJoint;

TEST_CASE("joints of a person are known by names, and by the skeleton's shape where names say nothing") {
  npt::Rig rig = npt::make_rig(rigged::figure(), "figure.glb");
  for (const bool named : {true, false}) {
    const npt::HumanoidJoints found = npt::humanoid_joints(rig);
    for (std::size_t j = 0; j < npt::smpl_joint_count; ++j) {
      CAPTURE(named);
      CAPTURE(npt::smpl_joint_names[j]);
      const bool open = npt::is_joint(j, spine1, spine2, spine3);
      const bool fingers = npt::is_joint(j, left_hand, right_hand);  // by shape a hand may end at its wrist
      if (named || !fingers) CHECK((open ? found[j] == npt::no_item : fingers || found[j] == j));
    }
    for (std::size_t j = 0; j < rig.joint_count(); ++j) rig.scene.nodes[rig.joints[j]].name = std::to_string(j);
  }
}

TEST_CASE("a skeleton that is no person's says so") {
  npt::Scene scene = rigged::figure();
  for (npt::SceneNode& node : scene.nodes) node.name = "bone";
  npt::Rig rig = npt::make_rig(std::move(scene), "chain.glb");
  // One chain without limbs.
  for (std::size_t j = 1; j < rig.joint_count(); ++j) rig.scene.nodes[rig.joints[j]].parent = rig.joints[j - 1];
  CHECK_THROWS_WITH_AS(npt::humanoid_joints(rig),
                       "chain.glb: found 24 joints that are a person's with a confidence of 0 %, expected a person's "
                       "joints, with 69 %: npt info --bones lists what is found",
                       npt::Error);
}
