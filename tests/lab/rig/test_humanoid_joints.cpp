#include "rigged_figure.hpp"

#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/lab/rig/humanoid_joints.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/from_mesh.hpp>
#include <npt/scene/scene.hpp>
#include <npt/scene/skinned_skeleton.hpp>

#include <body/roles/animal_skeleton.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
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

TEST_CASE("a four-legged animal's skeleton says so") {
  npt::SkinnedSkeleton skeleton;
  skeleton.start = {0};
  npt::Mesh mesh;
  mesh.face_start = {0};
  for (const animal_skeleton::Joint& joint : animal_skeleton::own_names()) {
    const auto parent = std::find(skeleton.names.begin(), skeleton.names.end(), joint.parent);
    skeleton.parents.push_back(
        parent == skeleton.names.end() ? npt::no_item : static_cast<std::size_t>(parent - skeleton.names.begin()));
    skeleton.names.push_back(joint.name);
    skeleton.joints.push_back(joint.place);
    for (const npt::Vec3d& by : {npt::Vec3d{}, npt::Vec3d{0.02, 0, 0}, npt::Vec3d{0, 0.02, 0}}) {
      mesh.corners.push_back(static_cast<std::uint32_t>(mesh.vertex_count()));
      mesh.positions.push_back((joint.place + by).as<float>());
      skeleton.influences.push_back({static_cast<std::uint16_t>(skeleton.joints.size() - 1), 1});
      skeleton.start.push_back(skeleton.influences.size());
    }
    mesh.face_start.push_back(mesh.corners.size());
  }
  npt::MeshScene made = npt::scene_from(mesh, "animal");
  npt::add_skeleton(made, skeleton);
  CHECK_THROWS_WITH_AS(npt::humanoid_joints(npt::make_rig(std::move(made.scene), "animal.glb")),
                       "animal.glb: found 35 joints that are a four-legged animal's, expected a person's joints: npt "
                       "info --bones lists what is found",
                       npt::Error);
}
