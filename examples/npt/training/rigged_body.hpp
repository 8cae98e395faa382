/// A rigged person as a body in SMPL's layout: brought to the mannequin's rest pose and about its size, looking at +z,
/// with SMPL's 24 joints, so that it takes whatever poses bodies take; and where each of its vertices belongs on the
/// resting mannequin (canonical coordinates), for networks that read meshes.
///   RiggedBody knight = rigged_body(make_rig(read_scene("knight.glb"), "knight.glb"), {.longest_edge = 0.04});
/// Joints    by their roles (humanoid_joints.hpp). Weights of other joints go to the nearest of the 24 above them;
///           those of the trunk are shared among hips and spine by height. What a weapon's joint moves goes with
///           the hand
/// Places    each part is stretched onto the mannequin's (canonical_places.hpp)
/// Shapes    canonical: [V, 3], metres, the mannequin's mean shape in its rest pose
/// Numerics  in double, rounded once
/// Errors    npt::Error that names file and joint: joints that are missing or named twice, bones without a length,
///           limbs that no vertex moves with, left and right exchanged
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/roles/joint_name.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/lab/rig/humanoid_joints.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/triangles.hpp>
#include <training/canonical_places.hpp>
#include <training/joint_regression.hpp>
#include <training/rest_surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct RiggedBodyOptions {
  /// Metres; longer edges are halved, so that places can be told for points within large faces. 0: the rig's vertices.
  double longest_edge = 0;
  double frame_rate = 0;  ///< of the poses that are taken from the rig's clips, in a second; 0: none are
};

struct RiggedBody {
  std::shared_ptr<const BodyModel> body;
  std::vector<float> canonical;
  std::vector<std::vector<std::array<float, 3 * smpl_joint_count>>> clips;  ///< axis angles of each clip's frames
};

namespace rig::internal {

class RiggedBodyMaker {
 public:
  RiggedBodyMaker(const Rig& rig, const RiggedBodyOptions& options)
      : rig_(rig), options_(options), found_(humanoid_joints(rig)), model_(measured_mannequin()) {
    positions_.reserve(rig.positions.size());
    triangles_ = rig.triangles;
    own_joints();
    for (std::size_t v = 0; v < rig.positions.size(); ++v) {
      positions_.push_back(rig.positions[v].as<double>());
      JointWeights& row = rest_.weights.emplace_back();
      double props = 0;
      for (std::size_t i = rig.weights.start[v]; i < rig.weights.start[v + 1]; ++i) {
        const double w = static_cast<double>(rig.weights.value[i]);
        row[owner_[rig.weights.column[i]]] += w;
        if (prop_[rig.weights.column[i]]) props += w;
      }
      props_.push_back(props > 0.5 || rig.hangs[v]);
    }
    find_places();
    stand_upright();
    check_bones();
    if (options.longest_edge > 0)
      for (int round = 0; round < 8 && halve_edges(options.longest_edge); ++round) {
      }
    take_rest_pose();
  }

  RiggedBody make() {
    RiggedBody result;
    rest_.measure(triangles_, props_);
    check_limbs();
    result.canonical = CanonicalPlaces(rest_, model_, props_).places();
    BodyTables tables;
    for (const Vec3d p : rest_.points) {
      const Vec3f q = p.as<float>();
      tables.v_template.insert(tables.v_template.end(), {q.x, q.y, q.z});
    }
    tables.triangles = triangles_;
    tables.parents.assign(smpl_parents.begin(), smpl_parents.end());
    tables.joint_names.assign(smpl_joint_names.begin(), smpl_joint_names.end());
    tables.metadata = {{"unit", "metre"}, {"up", "y"}, {"front", "z"}, {"rest_pose", "T"}, {"source", rig_.name}};
    tables.weights.columns = smpl_joint_count;
    for (const JointWeights& row : rest_.weights) {
      for (std::size_t j = 0; j < smpl_joint_count; ++j)
        if (row[j] > 0) tables.weights.append(static_cast<std::uint32_t>(j), static_cast<float>(row[j]));
      tables.weights.end_row();
    }
    tables.J_regressor = regressed_joints(rest_.points, rest_.joints);
    if (options_.frame_rate > 0)
      for (const Clip& clip : rig_.scene.clips) result.clips.push_back(angles_of(clip));
    result.body = std::make_shared<const BodyModel>(std::move(tables), rig_.name);
    return result;
  }

 private:
  using Places = std::array<Vec3d, smpl_joint_count>;
  /// Those whose bones make the arms and legs.
  static constexpr std::array<std::size_t, 8> limb_bones =
      joint_indices(SmplJoint::left_hip, SmplJoint::right_hip, SmplJoint::left_knee, SmplJoint::right_knee,
                    SmplJoint::left_shoulder, SmplJoint::right_shoulder, SmplJoint::left_elbow, SmplJoint::right_elbow);

  static Vec3d& at(Places& places, SmplJoint joint) { return places[joint_index(joint)]; }
  static const Vec3d& at(const Places& places, SmplJoint joint) { return places[joint_index(joint)]; }
  static Vec3d middle_of(const Places& places, SmplJoint a, SmplJoint b) {
    return (at(places, a) + at(places, b)) * 0.5;
  }
  bool has(SmplJoint joint) const { return found_[joint_index(joint)] != no_item; }

  [[noreturn]] void fail(std::size_t joint, std::string found, std::string expected) const {
    std::string place = "joint " + std::string(smpl_joint_names[joint]);
    if (found_[joint] != no_item) place += " ('" + rig_.joint_name(found_[joint]) + "')";
    throw Error({rig_.name, std::move(place), std::move(found), std::move(expected)});
  }

  static bool names_prop(std::string_view name) {
    const std::string base = parse_joint_name(name).words.front();
    for (const std::string_view word : {"weapon", "sword", "gun", "pistol", "rifle", "shield", "prop", "tool"})
      if (base.find(word) != std::string::npos) return true;
    return false;
  }

  /// owner_: which of the 24 each joint of the rig goes with; a trunk's are all the pelvis for now.
  void own_joints() {
    std::vector<int> mapped(rig_.joint_count(), -1);
    for (std::size_t j = 0; j < smpl_joint_count; ++j)
      if (found_[j] != no_item) mapped[found_[j]] = static_cast<int>(j);
    prop_.assign(rig_.joint_count(), false);
    for (std::size_t r = 0; r < rig_.joint_count(); ++r) {
      const std::size_t above = rig_.parents[r];
      std::size_t owner = joint_index(SmplJoint::pelvis);
      if (mapped[r] >= 0)
        owner = static_cast<std::size_t>(mapped[r]);
      else if (above != no_item)
        owner = end_of(owner_[above], mapped[above] >= 0);
      owner_.push_back(owner);
      prop_[r] = names_prop(rig_.joint_name(r)) || (above != no_item && prop_[above]);
    }
  }
  /// What hangs below a forearm without a wrist is its hand, below a shin without an ankle its foot.
  std::size_t end_of(std::size_t owner, bool directly) {
    using enum SmplJoint;
    if (!directly || !is_joint(owner, left_elbow, right_elbow, left_knee, right_knee)) return owner;
    const std::size_t end = bone_end(owner);
    return found_[end] == no_item ? end : owner;
  }

  /// Where the 24 joints are in the bind pose; what the rig lacks at the mannequin's share of the way.
  void find_places() {
    using enum SmplJoint;
    for (std::size_t j = 0; j < smpl_joint_count; ++j)
      if (found_[j] != no_item) bind_[j] = rig_.joint_place(found_[j]);
    for (const std::size_t bend : joint_indices(left_elbow, right_elbow, left_knee, right_knee)) {
      const std::size_t end = bone_end(bend);
      if (found_[end] == no_item) bind_[end] = end_of_limb(bend);
    }
    const Places& m = model_.joints;
    const Vec3d hips = middle_of(bind_, left_hip, right_hip),
                shoulders = middle_of(bind_, left_shoulder, right_shoulder);
    const Vec3d model_hips = middle_of(m, left_hip, right_hip), &model_pelvis = at(m, pelvis),
                &model_neck = at(m, neck);
    if (!has(neck)) at(bind_, neck) = !has(head) ? shoulders : shoulders + (at(bind_, head) - shoulders) * 0.4;
    if (!has(head)) {
      const double share = length(at(m, head) - model_neck) / length(model_neck - model_hips);
      at(bind_, head) = at(bind_, neck) + (at(bind_, neck) - hips) * share;
    }
    const double share = (model_pelvis.y - model_hips.y) / (model_neck.y - model_hips.y);
    at(bind_, pelvis) = hips + (at(bind_, neck) - hips) * share;
    for (const std::size_t j : joint_indices(spine1, spine2, spine3))
      bind_[j] = at(bind_, pelvis) +
                 (at(bind_, neck) - at(bind_, pelvis)) * ((m[j].y - model_pelvis.y) / (model_neck.y - model_pelvis.y));
    for (const std::size_t collar : joint_indices(left_collar, right_collar)) {
      if (found_[collar] != no_item) continue;
      const Vec3d middle = at(bind_, spine3) + (at(bind_, neck) - at(bind_, spine3)) * 0.6;
      const std::size_t shoulder = bone_end(collar);
      bind_[collar] = middle + (bind_[shoulder] - middle) * (m[collar].x / m[shoulder].x);
    }
  }
  /// Where the joints begin that are attached to it; without any the end of what it moves.
  Vec3d end_of_limb(std::size_t joint) const {
    Vec3d sum;
    double count = 0;
    for (std::size_t r = 0; r < rig_.joint_count(); ++r)
      if (rig_.parents[r] == found_[joint] && !prop_[r]) sum += rig_.joint_place(r), ++count;
    if (count > 0) return sum / count;
    const auto above = static_cast<std::size_t>(smpl_parents[joint]);
    const Vec3d along = normalised(bind_[joint] - bind_[above]);
    double farthest = 0;
    for (std::size_t v = 0; v < positions_.size(); ++v)
      if (rest_.weights[v][joint] > 0.5) farthest = std::max(farthest, dot(positions_[v] - bind_[joint], along));
    return bind_[joint] + along * (0.8 * farthest);
  }

  /// Turns the bind pose so that the trunk stands as the mannequin's does.
  void stand_upright() {
    using enum SmplJoint;
    const Matrix3 frame = trunk_frame(bind_);
    if (!(frame.determinant() > 0.5)) fail(joint_index(neck), "no way from the hips to it", "a bind pose with a trunk");
    upright_ = trunk_frame(model_.joints).transposed() * frame;
    centre_ = at(bind_, pelvis);
    const auto turned = [&](Vec3d p) { return upright_ * (p - centre_); };
    for (Vec3d& p : positions_) p = turned(p);
    for (Vec3d& p : bind_) p = turned(p);
    add_toes_and_hands();
    // Feet point forwards, whatever the names say.
    double forwards = 0;
    for (std::size_t v = 0; v < positions_.size(); ++v)
      for (const std::size_t ankle : joint_indices(left_ankle, right_ankle)) {
        const double w = rest_.weights[v][ankle] + rest_.weights[v][bone_end(ankle)];
        forwards += w * (positions_[v].z - bind_[ankle].z);
      }
    if (forwards < 0)
      fail(joint_index(left_ankle), "feet that point backwards, as seen from where left and right are",
           "left joints on the body's own left");
    metres_ = size_of(model_.joints) / size_of(bind_);
    for (Vec3d& p : positions_) p = p * metres_;
    for (Vec3d& p : bind_) p = p * metres_;
  }
  /// Toes without a joint: as far before the ankle as the mannequin's are, in feet as long as they are. Hands likewise,
  /// as the forearm points.
  void add_toes_and_hands() {
    using enum SmplJoint;
    const Places& m = model_.joints;
    double own = 0, mannequins = 0;
    for (const auto& [hip, knee, ankle] :
         {joint_indices(left_hip, left_knee, left_ankle), joint_indices(right_hip, right_knee, right_ankle)}) {
      own += length(bind_[knee] - bind_[hip]) + length(bind_[ankle] - bind_[knee]);
      mannequins += length(m[knee] - m[hip]) + length(m[ankle] - m[knee]);
    }
    for (const auto& [ankle, foot] : {joint_indices(left_ankle, left_foot), joint_indices(right_ankle, right_foot)})
      if (found_[foot] == no_item) bind_[foot] = bind_[ankle] + (m[foot] - m[ankle]) * (own / mannequins);
    for (const auto& [elbow, wrist, hand] :
         {joint_indices(left_elbow, left_wrist, left_hand), joint_indices(right_elbow, right_wrist, right_hand)})
      if (found_[hand] == no_item)
        bind_[hand] =
            bind_[wrist] + normalised(bind_[wrist] - bind_[elbow]) * (length(m[hand] - m[wrist]) * own / mannequins);
  }
  /// Rows: to the left, from the hips to the neck, forwards.
  static Matrix3 trunk_frame(const Places& j) {
    using enum SmplJoint;
    const Vec3d y = normalised(at(j, neck) - middle_of(j, left_hip, right_hip));
    const Vec3d side =
        normalised(at(j, left_hip) - at(j, right_hip)) + normalised(at(j, left_shoulder) - at(j, right_shoulder));
    const Vec3d x = normalised(side - y * dot(side, y));
    return {{{x, y, cross(x, y)}}};
  }
  /// Of a skeleton: legs, trunk and arms.
  static double size_of(const Places& j) {
    using enum SmplJoint;
    double sum = length(at(j, neck) - middle_of(j, left_hip, right_hip)) +
                 0.5 * length(at(j, left_shoulder) - at(j, right_shoulder));
    for (const std::size_t k : limb_bones) sum += 0.5 * length(j[bone_end(k)] - j[k]);
    return sum;
  }

  void check_bones() const {
    using enum SmplJoint;
    for (const std::size_t j : joint_indices(left_hip, right_hip, left_knee, right_knee, neck, left_shoulder,
                                             right_shoulder, left_elbow, right_elbow))
      if (!(length(bind_[bone_end(j)] - bind_[j]) > 1e-3))
        fail(j,
             "a bone of length " + std::to_string(length(bind_[bone_end(j)] - bind_[j])) + " to " +
                 std::string(smpl_joint_names[bone_end(j)]),
             "a length above 0");
  }
  void check_limbs() const {
    constexpr std::size_t head = joint_index(SmplJoint::head), neck = joint_index(SmplJoint::neck);
    for (const std::size_t j : limb_bones)
      if (!(rest_.spread[j].area > 0)) fail(j, "no vertex with a weight of it", "a part of the surface that it moves");
    double skull = rest_.spread[head].area + rest_.spread[neck].area;
    if (!(skull > 0)) fail(head, "no vertex with a weight of it", "a part of the surface that it moves");
  }

  /// Halves every edge that is longer than asked for, once; false where there is none.
  bool halve_edges(double longest) {
    std::vector<Edge> edges;
    for (const auto& [a, b] : edges_of_triangles(as_span(triangles_)))
      if (length(positions_[a] - positions_[b]) > longest) edges.push_back({a, b});
    if (edges.empty()) return false;
    const auto before = static_cast<std::uint32_t>(positions_.size());
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const Edge edge{std::min(a, b), std::max(a, b)};
      const auto at = std::lower_bound(edges.begin(), edges.end(), edge);
      return at != edges.end() && *at == edge ? before + static_cast<std::uint32_t>(at - edges.begin()) : no_index;
    };
    for (const auto& [a, b] : edges) {
      positions_.push_back((positions_[a] + positions_[b]) * 0.5);
      JointWeights row;
      for (std::size_t j = 0; j < smpl_joint_count; ++j) row[j] = (rest_.weights[a][j] + rest_.weights[b][j]) * 0.5;
      rest_.weights.push_back(row);
      props_.push_back(props_[a] && props_[b]);
    }
    std::vector<Triangle> smaller;
    for (Triangle t : triangles_) {
      std::array<std::uint32_t, 3> m{middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])};
      const auto halved = std::ranges::count_if(m, [](std::uint32_t v) { return v != no_index; });
      // One edge: the first. Two: all but the last.
      while ((halved == 1 && m[0] == no_index) || (halved == 2 && m[2] != no_index))
        std::rotate(t.begin(), t.begin() + 1, t.end()), std::rotate(m.begin(), m.begin() + 1, m.end());
      if (halved == 0) smaller.push_back(t);
      if (halved == 1) smaller.insert(smaller.end(), {{t[0], m[0], t[2]}, {m[0], t[1], t[2]}});
      if (halved == 2) smaller.insert(smaller.end(), {{m[0], t[1], m[1]}, {t[0], m[0], m[1]}, {t[0], m[1], t[2]}});
      if (halved == 3)
        smaller.insert(smaller.end(), {{t[0], m[0], m[2]}, {m[0], t[1], m[1]}, {m[2], m[1], t[2]}, {m[0], m[1], m[2]}});
    }
    triangles_ = std::move(smaller);
    return true;
  }

  /// Limbs point where the mannequin's do; trunk, head and feet stay as they are.
  void take_rest_pose() {
    std::array<Matrix3, smpl_joint_count> turns;
    for (std::size_t j = 0; j < smpl_joint_count; ++j) {
      const Matrix3 above = j == 0 ? Matrix3::identity() : turns[static_cast<std::size_t>(smpl_parents[j])];
      turns[j] = above;
      rest_.joints[j] = j == 0 ? bind_[0]
                               : rest_.joints[static_cast<std::size_t>(smpl_parents[j])] +
                                     above * (bind_[j] - bind_[static_cast<std::size_t>(smpl_parents[j])]);
      if (is_trunk(j) || is_joint(j, SmplJoint::neck, SmplJoint::head) || is_foot(j)) {
        turns[j] = Matrix3::identity();
      } else if (bone_end(j) != j) {
        const Vec3d own = above * (bind_[bone_end(j)] - bind_[j]);
        const Vec3d goal = model_.joints[bone_end(j)] - model_.joints[j];
        if (is_collar(j)) continue;
        if (length(own) > 0) turns[j] = shortest_turn(normalised(own), normalised(goal)) * above;
      }
    }
    turns_ = turns;
    // A wrist's and a hand's bones as long as they were.
    rest_.points.resize(positions_.size());
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      rest_.points[v] = skinned(rest_.weights[v],
                                [&](std::size_t j) { return rest_.joints[j] + turns[j] * (positions_[v] - bind_[j]); });
      share_trunk(rest_.weights[v], rest_.points[v].y);
    }
  }
  /// Which joint of the rig turns each of the 24; no_item: none, it goes with the one before it.
  HumanoidJoints turning_joints() const {
    using enum SmplJoint;
    HumanoidJoints turning = found_;
    std::size_t& root = turning[joint_index(pelvis)];
    if (const std::size_t above = rig_.parents[found_[joint_index(left_hip)]]; above != no_item)
      root = above;  // what the legs are attached to
    // Of the chain down from the neck the joint that stands nearest below each of the spine's.
    std::size_t from = rig_.parents[found_[joint_index(has(neck) ? neck : head)]];
    std::vector<std::size_t> chain;
    for (; from != no_item && from != root && owner_[from] == joint_index(pelvis); from = rig_.parents[from])
      chain.push_back(from);
    for (const std::size_t j : joint_indices(spine1, spine2, spine3)) {
      turning[j] = no_item;
      double least = 0.06;
      for (const std::size_t r : chain) {
        const double height = (upright_ * (rig_.joint_place(r) - centre_)).y * metres_ - bind_[j].y;
        if (height < least && (turning[j] == no_item || joint_height(r) > joint_height(turning[j]))) turning[j] = r;
      }
    }
    return turning;
  }
  double joint_height(std::size_t r) const { return (upright_ * (rig_.joint_place(r) - centre_)).y; }

  std::vector<std::array<float, 3 * smpl_joint_count>> angles_of(const Clip& clip) const {
    const HumanoidJoints turning = turning_joints();
    std::vector<std::array<float, 3 * smpl_joint_count>> frames;
    for (const double time : frame_times(clip, options_.frame_rate)) {
      const std::vector<Affine> motions = rig_.motions(&clip, time);
      std::array<Matrix3, smpl_joint_count> whole;
      auto& frame = frames.emplace_back();
      for (std::size_t j = 0; j < smpl_joint_count; ++j) {
        const Matrix3 above = j == 0 ? Matrix3::identity() : whole[static_cast<std::size_t>(smpl_parents[j])];
        whole[j] = turning[j] == no_item ? above
                                         : matrix_of(quaternion_of(orthonormal(motions[turning[j]].linear) *
                                                                   upright_.transposed() * turns_[j].transposed()));
        const Vec3d angle = axis_angle(quaternion_of(above.transposed() * whole[j]));
        frame[3 * j] = static_cast<float>(angle.x), frame[3 * j + 1] = static_cast<float>(angle.y);
        frame[3 * j + 2] = static_cast<float>(angle.z);
      }
    }
    return frames;
  }

  /// Hips and spine share the trunk's weight by height, each strongest half way to the next.
  void share_trunk(JointWeights& row, double y) const {
    using enum SmplJoint;
    static constexpr std::array chain = joint_indices(pelvis, spine1, spine2, spine3, neck);
    double trunk = 0;
    for (std::size_t i = 0; i < 4; ++i) trunk += std::exchange(row[chain[i]], 0.0);
    if (!(trunk > 0)) return;
    const auto centre = [&](std::size_t i) { return (rest_.joints[chain[i]].y + rest_.joints[chain[i + 1]].y) / 2; };
    std::size_t i = 0;
    while (i < 3 && y > centre(i + 1)) ++i;
    if (i == 3 || y <= centre(0)) {
      row[chain[i]] += trunk;
      return;
    }
    const double t = (y - centre(i)) / (centre(i + 1) - centre(i));
    row[chain[i]] += trunk * (1 - t), row[chain[i + 1]] += trunk * t;
  }

  const Rig& rig_;
  RiggedBodyOptions options_;
  HumanoidJoints found_;
  RestSurface model_, rest_;  ///< the mannequin; the rig in its rest pose
  std::vector<std::size_t> owner_;
  std::vector<bool> prop_, props_;  ///< joints of the rig; vertices
  std::vector<Vec3d> positions_;    ///< in the bind pose, upright
  std::vector<Triangle> triangles_;
  Places bind_{};
  std::array<Matrix3, smpl_joint_count> turns_;
  Matrix3 upright_ = Matrix3::identity();
  Vec3d centre_;       ///< of the hips, in the bind pose
  double metres_ = 1;  ///< in a unit of the bind pose
};

}  // namespace rig::internal

inline RiggedBody rigged_body(const Rig& rig, const RiggedBodyOptions& options = {}) {
  return rig::internal::RiggedBodyMaker(rig, options).make();
}

}  // namespace npt::inline NPT_ABI
