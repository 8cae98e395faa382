/// A clip of a dialect, made with the rest frames of its rigs, turns a character with the dialect's joints as its own:
/// local rotations are taken over by name, without a retargeting.
#include <doctest/doctest.h>

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/joint_names.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/from_mesh.hpp>
#include <npt/scene/pose.hpp>
#include <npt/transfer/named_skeleton.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "shipped.hpp"

namespace {

constexpr double degree = std::numbers::pi / 180;

double degrees_between(npt::Vec3d a, npt::Vec3d b) {
  return std::acos(std::clamp(npt::dot(npt::normalised(a), npt::normalised(b)), -1.0, 1.0)) / degree;
}
double degrees_of(npt::Quaternion q) { return npt::length(npt::axis_angle(npt::normalised(q))) / degree; }

/// A joint of a dialect's own rig in T pose: its rotation in its parent, and where its bone points in its own axes.
struct RigJoint {
  std::string name{}, parent{};
  npt::Quaternion rest{};
  npt::Vec3d bone{};
};

npt::Quaternion euler(double x, double y, double z) {  // FBX's order: x first
  return npt::Quaternion{}.turned({0, 0, z * degree}) * npt::Quaternion{}.turned({0, y * degree, 0}) *
         npt::Quaternion{}.turned({x * degree, 0, 0});
}

/// The pre-rotations of a rig as Mixamo's FBX files have them; bones point along y.
std::vector<RigJoint> mixamo_rig() {
  std::vector<RigJoint> rig{
      {"Hips", "", {}, {}},         {"Spine", "Hips", euler(-10.54, 0, 0), {}}, {"Spine1", "Spine", {}, {}},
      {"Spine2", "Spine1", {}, {}}, {"Neck", "Spine2", euler(10.54, 0, 0), {}}, {"Head", "Neck", {}, {}}};
  for (const double side : {1.0, -1.0}) {
    const std::string s = side > 0 ? "Left" : "Right";
    const npt::Vec3d y{0, 1, 0};
    rig.push_back({s + "UpLeg", "Hips", euler(1.02, -0.02 * side, -178.69 * side), y});
    rig.push_back({s + "Leg", s + "UpLeg", euler(-7.68, 0, -0.9 * side), y});
    rig.push_back({s + "Foot", s + "Leg", euler(54.84, 9.08 * side, 0), {}});
    rig.push_back({s + "ToeBase", s + "Foot", euler(42.03, 1.26 * side, 0), {}});
    rig.push_back({s + "Shoulder", "Spine2", euler(-74.5, 87.11 * side, -179.04 * side), {}});
    rig.push_back({s + "Arm", s + "Shoulder", euler(-7.97, 0, 2.38 * side), y});
    rig.push_back({s + "ForeArm", s + "Arm", euler(-8.57, 0, 3.82 * side), y});
    rig.push_back({s + "Hand", s + "ForeArm", euler(8.9, 5.37 * side, -5.2 * side), y});
  }
  for (RigJoint& joint : rig)
    for (std::string* name : {&joint.name, &joint.parent})
      if (!name->empty()) name->insert(0, "mixamorig:");
  return rig;
}

/// Axes as the body's in T pose, as SMPL's joints and VRM 0's have them.
std::vector<RigJoint> plain_rig(npt::JointNames names) {
  std::vector<RigJoint> rig;
  for (std::size_t j = 0; j < npt::smpl_joint_count; ++j) {
    const int parent = npt::smpl_parents[j];
    using enum npt::SmplJoint;
    npt::Vec3d bone{};
    if (npt::is_joint(j, left_hip, right_hip, left_knee, right_knee)) bone = {0, -1, 0};
    if (npt::is_joint(j, left_shoulder, left_elbow)) bone = {1, 0, 0};
    if (npt::is_joint(j, right_shoulder, right_elbow)) bone = {-1, 0, 0};
    rig.push_back({std::string(npt::joint_name(j, names)),
                   parent < 0 ? "" : std::string(npt::joint_name(static_cast<std::size_t>(parent), names)),
                   {},
                   bone});
  }
  return rig;
}

/// The largest angles between a rig's bones and the character's, and between how both turn the flesh from T pose on.
struct Differences {
  double bone = 0, turn = 0;
};

Differences played(const npt::Character& character, npt::JointNames names, const std::vector<RigJoint>& rig,
                   double swing) {
  const npt::SkinnedSkeleton skeleton = *npt::named_skeleton(character, names);
  npt::MeshScene made = npt::scene_from(shipped::person(0.1F), "hero");
  const std::size_t first = npt::add_skeleton(made, skeleton);
  npt::Clip clip{"clip", {}};
  std::map<std::string, npt::Quaternion> now, rest;  // in the world
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const auto phase = static_cast<double>(i);
    const npt::Quaternion own =
        rig[i].rest.turned(npt::Vec3d{std::sin(phase), std::cos(2 * phase), std::sin(3 * phase)} * swing);
    now[rig[i].name] = now[rig[i].parent] * own, rest[rig[i].name] = rest[rig[i].parent] * rig[i].rest;
    const auto named = std::ranges::find(skeleton.names, rig[i].name);
    REQUIRE(named != skeleton.names.end());
    npt::ClipChannel channel{first + static_cast<std::size_t>(named - skeleton.names.begin()),
                             npt::ChannelPath::rotation,
                             npt::Interpolation::linear,
                             4,
                             {0},
                             {}};
    for (const double c : {own.x, own.y, own.z, own.w}) channel.values.push_back(static_cast<float>(c));
    clip.channels.push_back(std::move(channel));
  }
  made.scene.clips.push_back(std::move(clip));
  const npt::ScenePose pose = npt::ScenePoser(made.scene).pose(&made.scene.clips[0], 0);
  const std::vector<npt::Affine> to_rest = character.rest_motions();
  Differences most;
  for (const RigJoint& joint : rig) {
    const auto j = static_cast<std::size_t>(std::ranges::find(skeleton.names, joint.name) - skeleton.names.begin());
    const auto child = static_cast<std::size_t>(std::ranges::find(skeleton.parents, j) - skeleton.parents.begin());
    if (joint.bone != npt::Vec3d{}) {
      const npt::Vec3d own = pose.worlds[first + child].shift - pose.worlds[first + j].shift;
      most.bone = std::max(most.bone, degrees_between(own, now[joint.name](joint.bone)));
    }
    const npt::Quaternion flesh = npt::quaternion_of(pose.worlds[first + j].linear) * npt::inverse(skeleton.frame(j));
    const npt::Quaternion from_t = flesh * npt::inverse(npt::quaternion_of(to_rest[j].linear));
    const npt::Quaternion expected = now[joint.name] * npt::inverse(rest[joint.name]);
    most.turn = std::max(most.turn, degrees_of(npt::inverse(expected) * from_t));
  }
  return most;
}

}  // namespace

TEST_CASE("a Mixamo clip turns a character with Mixamo's joints as its own rig") {
  for (const double swing : {0.0, 0.3, 0.8}) {
    const Differences most = played(shipped::character(), npt::JointNames::mixamo, mixamo_rig(), swing);
    MESSAGE("bones " << most.bone << " degrees apart, flesh " << most.turn);
    CHECK(most.bone < 0.01);
    CHECK(most.turn < 20);  // 14: the rests differ, its spine leans by 10 degrees, its knees bend by 8
  }
}

TEST_CASE("rotations of SMPL's joints turn a character with these joints as SMPL") {
  for (const double swing : {0.0, 0.8}) {
    const Differences most =
        played(shipped::character(), npt::JointNames::smpl, plain_rig(npt::JointNames::smpl), swing);
    MESSAGE("bones " << most.bone << " degrees apart, flesh " << most.turn);
    CHECK(most.bone < 10);  // the estimated body's arms and legs aren't quite level and upright in T pose
    CHECK(most.turn < 0.01);
  }
}

TEST_CASE("a clip for VRM's axes turns a character that stands in T pose as its own rig") {
  const npt::Character straight = shipped::human().character(shipped::person(0.0F), "straight");
  for (const double swing : {0.0, 0.8}) {
    const Differences most = played(straight, npt::JointNames::vrm, plain_rig(npt::JointNames::vrm), swing);
    MESSAGE("bones " << most.bone << " degrees apart, flesh " << most.turn);
    CHECK(most.bone < 10);
    CHECK(most.turn < 15);  // 12: of a hand, which is fitted bent by 11
  }
}
