/// A four-legged body made of tubes along its bones, by the plan of quadrupeds, and rigged scenes of it: what the tests
/// of animals' rigs are about.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/io/file.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/from_mesh.hpp>
#include <training/joint_regression.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace quadruped {

inline const npt::BodyPlan& plan() {
  static const npt::BodyPlan read =
      npt::read_body_plan(npt::read_file(NPT_SOURCE_DIR "/examples/sculpt/quadruped.plan"), "quadruped.plan");
  return read;
}

/// Where the plan's joints are, in metres, and how thick the bone is; those of the left side, whose mirror images
/// follow.
struct Place {
  const char* joint;
  npt::Vec3d at;
  double radius;
};
inline constexpr std::array<Place, 25> places{{{"pelvis", {0, 0.65, -0.4}, 0.12},
                                               {"spine1", {0, 0.66, -0.27}, 0.12},
                                               {"spine2", {0, 0.66, -0.14}, 0.12},
                                               {"spine3", {0, 0.655, -0.015}, 0.12},
                                               {"chest", {0, 0.645, 0.1}, 0.12},
                                               {"neck1", {0, 0.68, 0.26}, 0.08},
                                               {"neck2", {0, 0.75, 0.35}, 0.07},
                                               {"neck3", {0, 0.83, 0.44}, 0.06},
                                               {"head", {0, 0.9, 0.53}, 0.07},
                                               {"jaw", {0, 0.84, 0.56}, 0.03},
                                               {"l_ear", {0.05, 0.96, 0.5}, 0.02},
                                               {"tail1", {0, 0.68, -0.54}, 0.03},
                                               {"tail2", {0, 0.63, -0.61}, 0.03},
                                               {"tail3", {0, 0.57, -0.67}, 0.03},
                                               {"tail4", {0, 0.49, -0.72}, 0.03},
                                               {"tail5", {0, 0.41, -0.76}, 0.03},
                                               {"l_scapula", {0.07, 0.665, 0.11}, 0.06},
                                               {"l_shoulder", {0.11, 0.5, 0.205}, 0.05},
                                               {"l_elbow", {0.11, 0.425, 0.095}, 0.045},
                                               {"l_wrist", {0.1, 0.205, 0.11}, 0.03},
                                               {"l_forefoot", {0.1, 0.045, 0.115}, 0.04},
                                               {"l_hip", {0.085, 0.605, -0.415}, 0.07},
                                               {"l_knee", {0.106, 0.41, -0.315}, 0.05},
                                               {"l_hock", {0.1, 0.22, -0.5}, 0.03},
                                               {"l_hindfoot", {0.1, 0.047, -0.48}, 0.04}}};

namespace internal {

inline npt::Vec3d end_of(const std::vector<npt::Vec3d>& joints, std::size_t j) {
  const npt::JointPlan& joint = plan().joints[j];
  if (joint.toward != j) return joints[joint.toward];
  if (joint.kind == npt::JointKind::head) return joints[j] + npt::Vec3d{0, -0.06, 0.2};
  if (joint.name.ends_with("foot")) return joints[j] + npt::Vec3d{0, -0.02, 0.06};
  if (joint.name == "jaw") return joints[j] + npt::Vec3d{0, -0.05, 0.12};
  if (joint.name.ends_with("ear")) return joints[j] + npt::Vec3d{joints[j].x * 0.3, 0.08, 0};
  return joints[j] * 2 - joints[static_cast<std::size_t>(joint.parent)];
}

/// A tube of nine rings of ten; the first ring is half the parent's.
inline void add_tube(npt::BodyTables& t, std::size_t j, npt::Vec3d from, npt::Vec3d to, double radius) {
  constexpr std::uint32_t around = 10, rings = 9;
  const npt::Vec3d along = normalised(to - from);
  const npt::Vec3d side = normalised(cross(along, std::abs(along.x) < 0.9 ? npt::Vec3d{1, 0, 0} : npt::Vec3d{0, 1, 0}));
  const npt::Vec3d other = cross(along, side);
  const auto first = static_cast<std::uint32_t>(t.v_template.size() / 3);
  for (std::uint32_t r = 0; r < rings; ++r)
    for (std::uint32_t a = 0; a < around; ++a) {
      const double angle = 2 * std::numbers::pi * a / around, share = static_cast<double>(r) / (rings - 1);
      const double girth = r == 0 || r + 1 == rings ? 0.4 * radius : radius;
      const npt::Vec3f p =
          (from + (to - from) * share + (side * std::cos(angle) + other * std::sin(angle)) * girth).as<float>();
      t.v_template.insert(t.v_template.end(), {p.x, p.y, p.z});
      const int parent = plan().joints[j].parent;
      if (r == 0 && parent >= 0) t.weights.append(static_cast<std::uint32_t>(parent), 0.5F);
      t.weights.append(static_cast<std::uint32_t>(j), r == 0 && parent >= 0 ? 0.5F : 1.0F);
      t.weights.end_row();
      if (r == 0) continue;
      const std::uint32_t next = (a + 1) % around, low = first + (r - 1) * around, high = low + around;
      t.triangles.push_back({low + a, low + next, high + next});
      t.triangles.push_back({low + a, high + next, high + a});
    }
}

}  // namespace internal

/// forelegs: how long they are; from 0.5 downwards they are the arms of an animal that walks on two legs
inline std::vector<npt::Vec3d> joints(double forelegs = 1) {
  std::vector<npt::Vec3d> result(plan().joint_count());
  const npt::Vec3d shoulder = std::ranges::find(places, std::string_view("l_shoulder"), &Place::joint)->at;
  for (const Place& place : places) {
    const std::size_t j = plan().joint(place.joint);
    npt::Vec3d p = place.at;
    if (plan().limbs[plan().joints[j].limb] == "left_foreleg") p = shoulder + (p - shoulder) * forelegs;
    result[plan().joints[j].mirrored] = {-p.x, p.y, p.z};
    result[j] = p;
  }
  return result;
}

inline npt::BodyModel body(double forelegs = 1) {
  npt::BodyTables t;
  const std::vector<npt::Vec3d> at = joints(forelegs);
  t.weights.columns = at.size();
  for (std::size_t j = 0; j < at.size(); ++j) {
    const npt::JointPlan& joint = plan().joints[j];
    t.parents.push_back(joint.parent), t.joint_names.push_back(joint.name);
    double radius = 0;
    for (const Place& place : places)
      if (joint.name == place.joint || plan().joints[joint.mirrored].name == place.joint) radius = place.radius;
    internal::add_tube(t, j, at[j], internal::end_of(at, j), radius);
  }
  std::vector<npt::Vec3d> points;
  for (std::size_t v = 0; v < t.vertex_count(); ++v)
    points.push_back(npt::Vec3f{t.v_template[3 * v], t.v_template[3 * v + 1], t.v_template[3 * v + 2]}.as<double>());
  t.J_regressor = npt::rig::internal::regressed_joints(points, at);
  return npt::BodyModel(std::move(t), "figure");
}

/// A game pack's names.
inline std::string pack_name(const std::string& joint) {
  static constexpr std::array<std::pair<const char*, const char*>, 14> words{{{"pelvis", "Back"},
                                                                              {"spine", "Torso"},
                                                                              {"chest", "Torso4"},
                                                                              {"neck", "Neck"},
                                                                              {"scapula", "Scapula"},
                                                                              {"shoulder", "FrontUpperLeg"},
                                                                              {"elbow", "FrontLowerLeg"},
                                                                              {"wrist", "FrontFoot"},
                                                                              {"forefoot", "FF"},
                                                                              {"hip", "BackLeg"},
                                                                              {"knee", "BackUpperLeg"},
                                                                              {"hock", "BackLowerLeg"},
                                                                              {"hindfoot", "BackFoot"},
                                                                              {"tail", "Tail"}}};
  std::string bare = joint, side;
  if (joint[1] == '_') side = joint[0] == 'l' ? ".L" : ".R", bare = joint.substr(2);
  for (const auto& [from, to] : words)
    if (bare.starts_with(from)) return to + bare.substr(std::string(from).size()) + side;
  return bare + side;
}

struct SceneOptions {
  bool names = true;
  double forelegs = 1;                 ///< as joints()
  bool loose_feet = false;             ///< forefeet are roots, as inverse kinematics has them
  std::vector<std::string> without{};  ///< joints whose weights their parents have
  npt::Matrix3 turn = npt::Matrix3::identity();
  double scale = 1;
  std::vector<std::vector<float>> clip{};  ///< the poses that it goes through, a second each
};

inline npt::Scene scene(const SceneOptions& options = {}) {
  const npt::BodyModel model = body(options.forelegs);
  const auto turned = [&](npt::Vec3d p) { return options.turn * p * options.scale; };
  npt::Mesh mesh = npt::to_mesh(model);
  for (npt::Vec3f& p : mesh.positions) p = turned(p.as<double>()).as<float>();
  const std::vector<npt::Vec3d> at = model.joints({});
  npt::SkinnedSkeleton skeleton;
  std::vector<std::size_t> number(at.size());
  std::vector<std::size_t> kept;
  for (std::size_t j = 0; j < at.size(); ++j) {
    const npt::JointPlan& joint = plan().joints[j];
    const std::size_t parent = j == 0 ? npt::no_item : number[static_cast<std::size_t>(joint.parent)];
    if (std::ranges::find(options.without, joint.name) != options.without.end()) {
      number[j] = parent;
      continue;
    }
    number[j] = kept.size(), kept.push_back(j);
    skeleton.names.push_back(options.names ? pack_name(joint.name) : "Bone." + std::to_string(j));
    skeleton.parents.push_back(options.loose_feet && joint.name.ends_with("forefoot") ? npt::no_item : parent);
    skeleton.joints.push_back(turned(at[j]));
  }
  const npt::SparseMatrix& weights = model.tables().weights;
  skeleton.start.assign(weights.start.begin(), weights.start.end());
  for (std::size_t i = 0; i < weights.value.size(); ++i)
    skeleton.influences.push_back({static_cast<std::uint16_t>(number[weights.column[i]]), weights.value[i]});
  npt::MeshScene made = npt::scene_from(mesh, "animal");
  const std::size_t first = npt::add_skeleton(made, skeleton);
  if (options.clip.empty()) return made.scene;
  std::vector<double> times;
  std::vector<std::vector<npt::Affine>> frames;
  for (const std::vector<float>& pose : options.clip) {
    times.push_back(static_cast<double>(times.size()));
    std::vector<npt::Affine>& frame = frames.emplace_back();
    const std::vector<npt::Rigid> moved = model.bone_motions({}, pose);
    for (const std::size_t j : kept)
      frame.push_back({options.turn * moved[j].rotation * options.turn.transposed(),
                       options.turn * moved[j].shift * options.scale});
  }
  npt::add_skeleton_clip(made, skeleton, first, "clip", times, frames);
  return made.scene;
}

}  // namespace quadruped
