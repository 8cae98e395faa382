/// A rigged four-legged animal as a body with a plan's joints: looking to +z, standing on legs that point as the
/// template's do, about its size, so that it takes whatever poses such bodies take; and where each of its vertices
/// belongs on the resting template (canonical coordinates), for networks that read meshes.
///   const BodyModel quadruped = load_body("quadruped.safetensors");
///   PlannedBody horse = rigged_quadruped(make_rig(read_scene("horse.glb"), "horse.glb"), quadruped, plan);
/// Joints    by their part and place (quadruped_joints.hpp). Of a leg each joint goes to the one of the plan at about
///           its height that bends its way; what a leg lacks lies as on the template, between those it has. Neck and
///           tail of another number of joints than the plan's are divided by length, the trunk by the joints along it
///           A template whose forelegs end above the floor is of animals that walk on two legs: theirs may end anywhere
/// Weights   of other joints (horns, mane, saddle) go to the nearest of the plan's above them
/// Shapes    canonical: [V, 3]; clips: [J, 3] a frame, the root looking to +z where the scene's animal does so at rest
/// Errors    npt::Error that names file and joint: rigs without four legs or a head, bones without a length, legs that
///           no vertex moves with, plans without four legs, a neck or a tail
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/lab/rig/rig_axes.hpp>
#include <npt/scene/scene.hpp>
#include <training/body_from_rig.hpp>
#include <training/chain_shares.hpp>
#include <training/leg_matching.hpp>
#include <training/quadruped_joints.hpp>
#include <training/rest_surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace rig::internal {

/// The joints of a four-legged plan by what they are.
struct QuadrupedChains {
  std::array<std::vector<std::size_t>, 4> legs;  ///< as QuadrupedJoints::legs, from shoulder and hip on
  std::array<std::size_t, 4> girdles{};          ///< of the forelegs, then the root twice
  std::vector<std::size_t> neck, tail;
  std::size_t head = BodyPlan::no_joint, jaw = BodyPlan::no_joint;
  std::array<std::size_t, 2> ears{BodyPlan::no_joint, BodyPlan::no_joint};
};

inline QuadrupedChains quadruped_chains(const PlanParts& parts) {
  const BodyPlan& plan = parts.plan();
  QuadrupedChains c;
  for (std::size_t j = 0; j < plan.joint_count(); ++j) {
    const std::size_t above = j == 0 ? 0 : parts.parent(j), side = plan.side(j) > 0 ? 0 : 1;
    const JointKind kind = parts.kind(j);
    if (kind == JointKind::neck) c.neck.push_back(j);
    if (kind == JointKind::head) c.head = j;
    if (kind == JointKind::appendage && plan.side(j) == 0) c.jaw = j;
    if (kind == JointKind::appendage && plan.side(j) != 0) c.ears[side] = j;
    const bool begins = kind == JointKind::bone && (parts.is_trunk(above) || parts.is_girdle(above));
    if (!begins) continue;
    const std::size_t leg = (parts.is_girdle(above) ? 0U : 2U) + side;
    std::vector<std::size_t>& chain = plan.side(j) == 0 ? c.tail : c.legs[leg];
    if (plan.side(j) != 0) c.girdles[leg] = above;
    for (std::size_t k = j;; k = parts.toward(k)) {
      chain.push_back(k);
      if (parts.toward(k) == k) break;
    }
  }
  for (const auto& leg : c.legs)
    if (leg.size() < 3 || c.neck.empty() || c.tail.empty() || c.head == BodyPlan::no_joint)
      throw Error({.file = "plan " + plan.name,
                   .found = "no four legs of three joints with girdles before, or no neck, head or tail",
                   .expected = "a four-legged animal's plan"});
  return c;
}

class RiggedQuadrupedMaker : private BodyFromRig {
 public:
  RiggedQuadrupedMaker(const Rig& rig, const BodyModel& model, const BodyPlan& plan, const RiggedBodyOptions& options)
      : BodyFromRig(rig, options, model, plan),
        chains_(quadruped_chains(parts_)),
        forelegs_stand_(template_stands_on_forelegs()),
        joints_(quadruped_joints(rig, forelegs_stand_)) {
    upright_ = joints_.turn;
    facing_ = joints_.facing;
    faces_aside_ = true;
    for (Vec3d& p : positions_) p = upright_ * p;
    for (std::size_t r = 0; r < rig.joint_count(); ++r) places_.push_back(upright_ * rig.joint_place(r));
    floor_ = std::ranges::min(positions_, {}, [](Vec3d p) { return p.y; }).y;
    for (std::size_t leg = 0; leg < 4; ++leg) low_[leg] = lowest_of(leg), model_low_[leg] = model_lowest_of(leg);
    match_joints();
    own_joints();
    sum_weights(owner_, std::vector<bool>(rig.joint_count(), false));
    find_legs();
    find_trunk();
    find_neck_and_head();
    find_tail();
    bring_to_size();
    std::vector<std::size_t> bones;
    for (const auto& leg : chains_.legs) bones.insert(bones.end(), leg.begin(), leg.end() - 1);
    check_bones(bones);
    if (forelegs_stand_) check_forelegs();
    divide_weights();
    halve_long_edges();
    take_rest_pose();
    stand_on_floor();
    find_turning_joints();
  }

  PlannedBody make() {
    measure();
    give_what_it_lacks();
    measure();
    std::vector<std::vector<std::size_t>> needed{{chains_.head}};
    for (const auto& leg : chains_.legs) needed.push_back(leg);
    check_surfaces(needed);
    PlannedBody result = make_body({{"unit", "metre"}, {"up", "y"}, {"front", "z"}, {"rest_pose", "standing"}});
    result.metres = metres_ / rig_axes(rig_).scale;
    return result;
  }

 private:
  using Joints = std::vector<std::size_t>;

  /// found_: which joint of the rig each of the plan's is.
  void match_joints() {
    for (std::size_t leg = 0; leg < 4; ++leg) {
      const Joints& plan = chains_.legs[leg];
      std::vector<Vec3d> models;
      for (const std::size_t j : plan) models.push_back(model_.joints[j]);
      const auto match = [&](std::size_t first) {
        std::vector<Vec3d> places;
        for (std::size_t i = first; i < joints_.legs[leg].size(); ++i) places.push_back(places_[joints_.legs[leg][i]]);
        // A leg whose last joint is the shank's ends on the floor.
        const bool has_foot = places.back().y - low_[leg] < 0.3 * (places.front().y - low_[leg]);
        return LegMatch(places, has_foot ? places.back() : foot_of(leg), low_[leg], models, model_low_[leg]);
      };
      std::size_t& girdle = joints_.girdles[leg];
      LegMatch best = match(girdle);
      // One joint more than the leg has is a shoulder blade, if the others are in better places then.
      if (joints_.legs[leg].size() - girdle > plan.size())
        if (LegMatch other = match(girdle + 1); other.cost() + 0.1 < best.cost()) best = std::move(other), ++girdle;
      const std::vector<std::size_t>& matched = best.matched();
      const Joints own(joints_.legs[leg].begin() + static_cast<std::ptrdiff_t>(girdle), joints_.legs[leg].end());
      for (std::size_t i = 0; i < plan.size(); ++i)
        if (matched[i] != no_item) found_[plan[i]] = own[matched[i]];
      if (leg < 2 && joints_.girdles[leg] > 0)
        found_[chains_.girdles[leg]] = joints_.legs[leg][joints_.girdles[leg] - 1];
    }
    found_[chains_.head] = joints_.head;
    if (chains_.jaw != BodyPlan::no_joint) found_[chains_.jaw] = joints_.jaw;
    for (std::size_t side = 0; side < 2; ++side)
      if (chains_.ears[side] != BodyPlan::no_joint && !joints_.ears[side].empty())
        found_[chains_.ears[side]] = joints_.ears[side].front();
    if (joints_.neck.size() == chains_.neck.size())
      for (std::size_t i = 0; i < joints_.neck.size(); ++i) found_[chains_.neck[i]] = joints_.neck[i];
    if (joints_.tail.size() == chains_.tail.size())
      for (std::size_t i = 0; i < joints_.tail.size(); ++i) found_[chains_.tail[i]] = joints_.tail[i];
  }

  /// owner_: which of the plan's joints each of the rig's goes with; of the trunk all with the root for now, of a neck
  /// or a tail that is to be divided all with its first.
  void own_joints() {
    owner_.assign(rig_.joint_count(), no_item);
    for (const std::size_t r : joints_.neck) owner_[r] = chains_.neck.front();
    for (const std::size_t r : joints_.tail) owner_[r] = chains_.tail.front();
    for (const std::size_t r : joints_.skull) owner_[r] = chains_.head;
    for (std::size_t leg = 0; leg < 4; ++leg)
      for (std::size_t i = 0; i < joints_.girdles[leg]; ++i) owner_[joints_.legs[leg][i]] = chains_.girdles[leg];
    for (std::size_t j = 0; j < found_.size(); ++j)
      if (found_[j] != no_item) owner_[found_[j]] = j;
    for (const Joints& leg : joints_.legs)
      for (std::size_t i = 1; i < leg.size(); ++i)
        if (owner_[leg[i]] == no_item) owner_[leg[i]] = owner_[leg[i - 1]];
    for (std::size_t r = 0; r < owner_.size(); ++r)
      if (owner_[r] == no_item) owner_[r] = rig_.parents[r] == no_item ? 0 : owner_[rig_.parents[r]];
  }

  Vec3d middle(std::size_t a, std::size_t b) const { return (bind_[a] + bind_[b]) * 0.5; }
  Vec3d model_middle(std::size_t a, std::size_t b) const { return (model_.joints[a] + model_.joints[b]) * 0.5; }
  Vec3d hips() const { return middle(chains_.legs[2][0], chains_.legs[3][0]); }
  Vec3d model_hips() const { return model_middle(chains_.legs[2][0], chains_.legs[3][0]); }

  /// What a leg lacks lies where it does on the template between the joints before and after it, turned and grown as
  /// the way between these is: so that both bones turn alike into the rest pose.
  void find_legs() {
    for (std::size_t l = 0; l < 4; ++l) {
      const Joints& leg = chains_.legs[l];
      for (const std::size_t j : leg)
        if (found_[j] != no_item) bind_[j] = places_[found_[j]];
      if (found_[leg.back()] == no_item) bind_[leg.back()] = end_of(l);
      std::size_t before = 0;
      for (std::size_t i = 1; i < leg.size(); ++i) {
        if (found_[leg[i]] == no_item && i + 1 < leg.size()) continue;
        for (std::size_t k = before + 1; k < i; ++k)
          bind_[leg[k]] = between(leg[before], leg[i], model_.joints[leg[k]]);
        before = i;
      }
    }
  }
  Vec3d between(std::size_t a, std::size_t b, Vec3d model) const {
    const Vec3d way = bind_[b] - bind_[a], goal = model_.joints[b] - model_.joints[a];
    return bind_[a] +
           shortest_turn(normalised(goal), normalised(way)) * (model - model_.joints[a]) * (length(way) / length(goal));
  }
  /// Whether its forelegs reach its floor, to a seventh of its height.
  bool template_stands_on_forelegs() const {
    const double high = std::ranges::max(model_.points, {}, [](Vec3d p) { return p.y; }).y, low = lowest(model_);
    return model_lowest_of_joint(chains_.legs[0].back()) - low < 0.15 * (high - low);
  }
  double model_lowest_of_joint(std::size_t j) const {
    double low = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < model_.points.size(); ++v)
      if (model_.weights[v][j] > 0.5) low = std::min(low, model_.points[v].y);
    return low;
  }
  bool is_arm(std::size_t leg) const { return leg < 2 && !forelegs_stand_; }
  double model_lowest_of(std::size_t leg) const {
    return is_arm(leg) ? model_lowest_of_joint(chains_.legs[leg].back()) : lowest(model_);
  }
  /// The floor where a leg stands, else the lowest point of an arm.
  double lowest_of(std::size_t leg) const {
    if (!is_arm(leg)) return floor_;
    double low = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < positions_.size(); ++v)
      if (moves_with(leg, v)) low = std::min(low, positions_[v].y);
    return low;
  }
  bool moves_with(std::size_t leg, std::size_t v) const {
    const Joints& own = joints_.legs[leg];
    const auto values = rig_.weights.values_of(v);
    const auto most = static_cast<std::size_t>(std::ranges::max_element(values) - values.begin());
    return std::ranges::find(own, rig_.weights.columns_of(v)[most]) != own.end();
  }
  /// Where a leg stands, or an arm ends: the middle of the lowest of what it moves.
  Vec3d foot_of(std::size_t leg) const {
    const double high = low_[leg] + 0.1 * (places_[joints_.legs[leg][joints_.girdles[leg]]].y - low_[leg]);
    Vec3d sum;
    double count = 0;
    for (std::size_t v = 0; v < rig_.positions.size(); ++v)
      if (positions_[v].y <= high && moves_with(leg, v)) sum += positions_[v], ++count;
    if (!(count > 0))
      fail(chains_.legs[leg].back(), "no vertex of the leg near the ground", "legs that stand in the bind pose");
    return sum / count;
  }
  /// A foot without a joint: above that, as high as the template's.
  Vec3d end_of(std::size_t leg) const {
    const Joints& own = chains_.legs[leg];
    const double top = bind_[own.front()].y - low_[leg], low = model_low_[leg];
    Vec3d p = foot_of(leg);
    p.y = low_[leg] + top * (model_.joints[own.back()].y - low) / (model_.joints[own.front()].y - low);
    return p;
  }

  /// The trunk's joints by their share of the way from the hips to the neck, at the height of the rig's own line.
  void find_trunk() {
    const std::span<const std::size_t> trunk = parts_.trunk();
    const std::size_t neck = trunk.back();
    const Vec3d back = hips();
    const Vec3d front = middle(chains_.legs[0][0], chains_.legs[1][0]);
    const Vec3d model_front = model_middle(chains_.legs[0][0], chains_.legs[1][0]);
    const double share = (front.z - back.z) / (model_front.z - model_hips().z);
    if (!joints_.neck.empty()) {
      bind_[neck] = places_[joints_.neck.front()];
    } else {
      bind_[neck] = front + (model_.joints[neck] - model_front) * share;
    }
    // No nearer to the hips than the shoulders are.
    bind_[neck].z = std::max(bind_[neck].z, front.z - 0.1 * (front.z - back.z));
    std::vector<Vec3d> line;
    for (const std::size_t r : joints_.back) line.push_back(places_[r]);
    const double far = bind_[neck].z - back.z, model_far = model_.joints[neck].z - model_hips().z;
    for (std::size_t i = 0; i + 1 < trunk.size(); ++i) {
      Vec3d& p = bind_[trunk[i]];
      p = {back.x, 0, back.z + far * (model_.joints[trunk[i]].z - model_hips().z) / model_far};
      p.y = line.empty() ? back.y + (model_.joints[trunk[i]].y - model_hips().y) * share : height_at(line, p.z);
    }
    for (std::size_t leg = 0; leg < 2; ++leg) {
      const std::size_t girdle = chains_.girdles[leg], shoulder = chains_.legs[leg][0];
      bind_[girdle] = found_[girdle] != no_item
                          ? places_[found_[girdle]]
                          : bind_[shoulder] + (model_.joints[girdle] - model_.joints[shoulder]) * share;
    }
  }
  static double height_at(const std::vector<Vec3d>& line, double z) {
    if (z <= line.front().z) return line.front().y;
    for (std::size_t i = 1; i < line.size(); ++i)
      if (z <= line[i].z) {
        const double gap = line[i].z - line[i - 1].z;
        return gap > 0 ? line[i - 1].y + (line[i].y - line[i - 1].y) * (z - line[i - 1].z) / gap : line[i].y;
      }
    return line.back().y;
  }

  void find_neck_and_head() {
    bind_[chains_.head] = places_[joints_.head];
    const double size = rough_size() / rough_model_size();
    std::vector<Vec3d> own;
    for (const std::size_t r : joints_.neck) own.push_back(places_[r]);
    if (own.empty()) own.push_back(bind_[parts_.trunk().back()]);
    own.front() = bind_[parts_.trunk().back()];
    own.push_back(bind_[chains_.head]);
    std::vector<Vec3d> models;
    for (const std::size_t j : chains_.neck) models.push_back(model_.joints[j]);
    models.push_back(model_.joints[chains_.head]);
    const std::vector<double> shares = shares_along(models);
    for (std::size_t i = 1; i < chains_.neck.size(); ++i)
      bind_[chains_.neck[i]] =
          found_[chains_.neck[i]] != no_item ? places_[found_[chains_.neck[i]]] : point_along(own, shares[i]);
    for (const std::size_t j : {chains_.jaw, chains_.ears[0], chains_.ears[1]})
      if (j != BodyPlan::no_joint)
        bind_[j] = found_[j] != no_item ? places_[found_[j]]
                                        : bind_[chains_.head] + (model_.joints[j] - model_.joints[chains_.head]) * size;
  }

  void find_tail() {
    const Joints& tail = chains_.tail;
    std::vector<Vec3d> models;
    for (const std::size_t j : tail) models.push_back(model_.joints[j]);
    const double size = rough_size() / rough_model_size();
    if (joints_.tail.empty()) {
      for (const std::size_t j : tail) bind_[j] = bind_[0] + (model_.joints[j] - model_.joints[0]) * size;
      tail_end_ = bind_[tail.back()] * 2 - bind_[tail[tail.size() - 2]];
      return;
    }
    const auto end_beyond = [](const std::vector<Vec3d>& points, const auto& weight, Vec3d last, Vec3d before) {
      Vec3d end = last * 2 - before;
      double farthest = 0;
      for (std::size_t v = 0; v < points.size(); ++v)
        if (const double far = length(points[v] - last); weight(v) > 0.5 && far > farthest)
          farthest = far, end = points[v];
      return end;
    };
    std::vector<Vec3d> own;
    for (const std::size_t r : joints_.tail) own.push_back(places_[r]);
    const std::size_t last = joints_.tail.back();
    const Vec3d before = own.size() > 1 ? own[own.size() - 2] : bind_[0];
    tail_end_ = end_beyond(
        positions_,
        [&](std::size_t v) {
          double sum = 0;
          for (std::size_t i = rig_.weights.start[v]; i < rig_.weights.start[v + 1]; ++i)
            if (rig_.weights.column[i] == last) sum += static_cast<double>(rig_.weights.value[i]);
          return sum;
        },
        own.back(), before);
    const Vec3d model_end = end_beyond(
        model_.points, [&](std::size_t v) { return model_.weights[v][tail.back()]; }, models.back(),
        models[models.size() - 2]);
    own.push_back(tail_end_);
    models.push_back(model_end);
    const std::vector<double> shares = shares_along(models);
    for (std::size_t i = 0; i < tail.size(); ++i)
      bind_[tail[i]] = found_[tail[i]] != no_item ? places_[found_[tail[i]]] : point_along(own, shares[i]);
  }

  /// Trunk and legs, which tell an animal's size better than neck and tail.
  double size_of(const std::vector<Vec3d>& joints) const {
    const Vec3d back = (joints[chains_.legs[2][0]] + joints[chains_.legs[3][0]]) * 0.5;
    double sum = length(joints[parts_.trunk().back()] - back);
    for (const Joints& leg : chains_.legs)
      for (std::size_t i = 1; i < leg.size(); ++i) sum += 0.25 * length(joints[leg[i]] - joints[leg[i - 1]]);
    return sum;
  }
  double rough_size() const { return size_of(bind_); }
  double rough_model_size() const { return size_of(model_.joints); }

  /// On the template's floor, its root above the template's.
  void bring_to_size() {
    metres_ = rough_model_size() / rough_size();
    const Vec3d from{bind_[0].x, floor_, bind_[0].z}, to{0, lowest(model_), model_.joints[0].z};
    const auto moved = [&](Vec3d p) { return to + (p - from) * metres_; };
    for (Vec3d& p : positions_) p = moved(p);
    for (Vec3d& p : bind_) p = moved(p);
    tail_end_ = moved(tail_end_);
    for (double& low : low_) low = moved({0, low, 0}).y;
  }
  /// Legs that were turned may be off the floor.
  void stand_on_floor() {
    const double up = lowest(model_) - std::ranges::min(rest_.points, {}, [](Vec3d p) { return p.y; }).y;
    for (Vec3d& p : rest_.points) p.y += up;
    for (Vec3d& p : rest_.joints) p.y += up;
  }

  /// Those who walk on two legs may reach the ground with their hands, too: a raptor's arms have 56 % of
  /// its legs' length, a stegosaur's forelegs 60 %.
  void check_forelegs() const {
    const auto reach = [&](std::size_t leg) {
      return length(bind_[chains_.legs[leg].back()] - bind_[chains_.legs[leg][0]]);
    };
    const double share = (reach(0) + reach(1)) / (reach(2) + reach(3));
    if (share < 0.58)
      fail(chains_.legs[0][0],
           "forelegs of " + std::to_string(std::lround(100 * share)) + " % of the hind legs' length",
           "a four-legged animal");
  }

  /// What one joint of the rig moves and several of the plan do: by the place along these.
  void divide_weights() {
    std::vector<ChainShares> chains;
    for (std::size_t l = 0; l < 4; ++l) {
      const Joints& leg = chains_.legs[l];
      for (std::size_t i = 0; i < leg.size(); ++i) {
        std::size_t next = i + 1;
        while (next < leg.size() && found_[leg[next]] == no_item) ++next;
        if (next == i + 1) continue;
        Joints own(leg.begin() + static_cast<std::ptrdiff_t>(i), leg.begin() + static_cast<std::ptrdiff_t>(next));
        std::vector<Vec3d> points;
        for (const std::size_t j : own) points.push_back(bind_[j]);
        points.push_back(next < leg.size() ? bind_[leg[next]]
                                           : Vec3d{bind_[own.back()].x, low_[l], bind_[own.back()].z});
        chains.emplace_back(std::move(own), std::move(points));
      }
    }
    if (joints_.neck.size() != chains_.neck.size() && !joints_.neck.empty())
      add_chain(chains, chains_.neck, bind_[chains_.head]);
    if (joints_.tail.size() != chains_.tail.size() && !joints_.tail.empty()) add_chain(chains, chains_.tail, tail_end_);
    for (std::size_t v = 0; v < positions_.size(); ++v)
      for (const ChainShares& chain : chains) chain.divide(rest_.weights[v], positions_[v]);
  }
  void add_chain(std::vector<ChainShares>& chains, const Joints& joints, Vec3d end) const {
    std::vector<Vec3d> points;
    for (const std::size_t j : joints) points.push_back(bind_[j]);
    points.push_back(end);
    chains.emplace_back(joints, std::move(points));
  }

  /// A joint of the plan is turned by the rig's joint that it is; one that a leg lacks by that of the bone it lies in;
  /// those of trunk, neck, tail and ears by the rig's joints that move the same vertices, in proportion.
  void find_turning_joints() {
    std::vector<bool> shared(parts_.count(), false);
    for (std::size_t j = 0; j < parts_.count(); ++j) shared[j] = parts_.is_trunk(j);
    for (const Joints* chain : {&chains_.neck, &chains_.tail})
      for (const std::size_t j : *chain) shared[j] = found_[j] == no_item;
    for (const std::size_t j : chains_.ears)
      if (j != BodyPlan::no_joint) shared[j] = true;
    // Of one group: the trunk's are all the root's, a neck's or a tail's its first joint's.
    const auto group = [&](std::size_t j) {
      if (parts_.is_trunk(j)) return std::size_t{0};
      if (parts_.kind(j) == JointKind::neck) return chains_.neck.front();
      if (std::ranges::find(chains_.tail, j) != chains_.tail.end()) return chains_.tail.front();
      return j;
    };
    std::vector<std::map<std::size_t, double>> masses(parts_.count());
    for (std::size_t v = 0; v < rig_.positions.size(); ++v)
      for (std::size_t i = rig_.weights.start[v]; i < rig_.weights.start[v + 1]; ++i) {
        const std::size_t r = rig_.weights.column[i];
        for (std::size_t j = 0; j < parts_.count(); ++j)
          if (shared[j] && rest_.weights[v][j] > 0 && group(j) == group(owner_[r]))
            masses[j][r] += rest_.weights[v][j] * static_cast<double>(rig_.weights.value[i]);
      }
    for (std::size_t j = 0; j < parts_.count(); ++j) {
      if (!shared[j]) {
        if (found_[j] != no_item) turning_[j] = {{found_[j], 1.0}};
        continue;
      }
      double sum = 0;
      for (const auto& [r, mass] : masses[j]) sum += mass;
      for (const auto& [r, mass] : masses[j])
        if (mass > 0.02 * sum) turning_[j].emplace_back(r, mass / sum);
    }
    for (const Joints& leg : chains_.legs)
      for (std::size_t i = 1; i < leg.size(); ++i)
        if (turning_[leg[i]].empty()) turning_[leg[i]] = turning_[leg[i - 1]];
  }

  /// Where a rig has no joint for ears and jaw, their surface is the head's: so is the template's. The same where the
  /// joint moves little: a fox's ears that move with the head, all but their tips.
  void give_what_it_lacks() {
    const auto share = [&](const RestSurface& s, std::size_t j) {
      return s.spread[j].area / s.spread[chains_.head].area;
    };
    for (const std::size_t j : {chains_.jaw, chains_.ears[0], chains_.ears[1]})
      if (j != BodyPlan::no_joint && !(share(rest_, j) > 0.4 * share(model_, j)))
        for (JointWeights& row : model_.weights) row[chains_.head] += std::exchange(row[j], 0.0);
  }

  QuadrupedChains chains_;
  bool forelegs_stand_;
  QuadrupedJoints joints_;
  std::vector<Vec3d> places_;  ///< of the rig's joints in the bind pose, upright
  std::vector<std::size_t> owner_;
  Vec3d tail_end_;
  std::array<double, 4> low_{}, model_low_{};  ///< lowest_of each leg, and of the template's
  double floor_ = 0, metres_ = 1;
};

}  // namespace rig::internal

/// model: the template, with the plan's joints.
inline PlannedBody rigged_quadruped(const Rig& rig, const BodyModel& model, const BodyPlan& plan,
                                    const RiggedBodyOptions& options = {}) {
  return rig::internal::RiggedQuadrupedMaker(rig, model, plan, options).make();
}

}  // namespace npt::inline NPT_ABI
