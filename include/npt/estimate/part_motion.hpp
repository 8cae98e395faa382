/// How the parts of a body moved, in closed form, from points of a mesh and where on the resting body each was seen to
/// belong: a start for a fit, and a residual that tells right correspondences from wrong ones.
///   p = size_j R_j q + t_j   for the points p of part j with the places q
/// The trunk's similarity, then each part's along the kinematic tree, weighted by skin weight and certainty, wild
/// points counted out by iterated weights. A part begins where its parent puts the joint between them; the fewer and
/// the rounder its points, the more of its motion is the parent's. Points of a limb whose distance from the joint that
/// it is attached to, which no rotation changes, is wrong, and right from the other side's, are taken for that side's.
/// Shapes    parts: [J] of a plan's joints; axis angles: [J, 3], relative to the parent
/// Units     metres, or any for the points: `size` is their unit in the body's
/// Threads   a template may be shared by threads
/// Errors    npt::Error for fewer than 20 points, and for values that are not finite
/// Source    rotations: Horn, 1987, Umeyama, 1991 (nearest_rotation.hpp)
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/similarity.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_level.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/solve/nearest_rotation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// A point of a mesh's surface, and where on the resting body it was seen to belong.
struct PointCorrespondence {
  Vec3d point;                  ///< of the mesh
  Vec3d normal;                 ///< of the mesh, unit, as its triangles turn; (0, 0, 0): unknown
  Vec3d place;                  ///< on the body's mean shape in its rest pose, or near it
  double spread = usual_error;  ///< b of the Laplace distribution of the place's error, in metres
};

NPT_INLINE_CLASS(class, CorrespondenceTemplate);
/// The resting body that places are seen on. Level and plan must outlive it.
template <class>
class BasicCorrespondenceTemplate {
 public:
  using Skin = std::vector<double>;  ///< [J]

  /// Requires  a body of the plan's joints
  BasicCorrespondenceTemplate(const BodyModel& model, const BodyLevel& level, const BodyPlan& plan)
      : level_(level), plan_(plan), limbs_(plan.limb_pairs()), joints_(model.joints({})) {
    const SparseMatrix& weights = model.tables().weights;
    for (const std::uint32_t v : level.body().vertices()) {
      Skin& skin = skins_.emplace_back(plan.joint_count());
      for (std::size_t i = weights.start[v]; i < weights.start[v + 1]; ++i)
        skin[weights.column[i]] = static_cast<double>(weights.value[i]);
    }
  }

  const BodyPlan& plan() const noexcept { return plan_; }
  const std::vector<LimbPair>& limbs() const noexcept { return limbs_; }
  /// [J] of the mean shape.
  std::span<const Vec3d> joints() const noexcept { return as_span(joints_); }

  /// The surface's point that is closest to a place.
  BodyPoint locate(Vec3d place) const { return level_.locate(place); }

  /// The point's weights, which sum to 1.
  Skin skin(const BodyPoint& at) const {
    Skin sum(plan_.joint_count());
    for (std::size_t c = 0; c < 3; ++c)
      if (at.weights[c] > 0)
        for (std::size_t j = 0; j < sum.size(); ++j) sum[j] += at.weights[c] * skins_[at.corners[c]][j];
    return sum;
  }

 private:
  const BodyLevel& level_;
  const BodyPlan& plan_;
  std::vector<LimbPair> limbs_;
  std::vector<Vec3d> joints_;
  std::vector<Skin> skins_;  ///< by vertex of the level
};

/// Pairs of limbs whose places are mirrored before the motion is found, as bits: candidates beside what was seen.
/// Without them, or without sides that are chosen by distance, 2 of 120 people end with limbs exchanged (44 mm and more
/// instead of 6); medians stay.
using SwappedLimbs = std::uint64_t;

struct PartMotion {
  std::vector<Similarity> parts;    ///< [J] from the places to the points
  double size = 1;                  ///< of the trunk
  Vec3d translation;                ///< as BodyFit's, for a body of the mean shape
  std::vector<double> axis_angles;  ///< [J, 3] relative to the parent, as BodyFit's
  /// Of all points and joints, in metres of the body, each distance cut off at 0.3 m. Of places with errors of 5 cm, a
  /// tenth of them wild: 0.07 to 0.10, and 0.10 to 0.17 where both legs were taken for each other.
  double residual = 0;
  std::vector<Vec3d> places;      ///< [n] the resting surface's points that the places were taken for
  std::vector<double> certainty;  ///< [n] weights of the points
};

namespace fit::internal {
NPT_INLINE_CLASS(class, PartMotionSolver);
template <class>
class BasicPartMotionSolver {
 public:
  BasicPartMotionSolver(const CorrespondenceTemplate& rest, std::span<const PointCorrespondence> points,
                        SwappedLimbs swapped)
      : rest_(rest), plan_(rest.plan()) {
    if (points.size() < 20)
      throw Error({.file = "view", .found = std::to_string(points.size()) + " points", .expected = "at least 20"});
    for (const PointCorrespondence& p : points) {
      if (!is_finite(p.point) || !is_finite(p.place) || !(p.spread >= 0))
        throw Error({.file = "view", .found = "a point or place that is not finite", .expected = "finite numbers"});
      Seen& s = seen_.emplace_back();
      s.point = p.point;
      place(s, p.place);
      s.limb = limb_of(s);
      if (s.limb < rest.limbs().size() && (swapped >> s.limb & 1U) != 0) mirror(s);
      s.certainty = usual_error / std::max(p.spread, usual_error / 5);
      total_ += s.certainty;
    }
    unit_ = total_ / 600;
  }

  PartMotion operator()() {
    solve_trunk();
    choose_sides();
    for (std::size_t j = 0; j < parts_.size(); ++j) {
      Hold hold{.from = j == 0 ? trunk_ : parts_[parent(j)], .joint = rest_.joints()[j]};
      if (j > 0) hold.joint_weight = 8 * unit_;
      hold.stiffness = (j == 0 || is_small(j) ? 0.1 : 0.02) * unit_;
      for (std::size_t i = 0; i < seen_.size(); ++i) share_[i] = seen_[i].skin[j];
      parts_[j] = solve(hold);
    }
    return result();
  }

 private:
  struct Seen {
    Vec3d point, rest;  ///< of the mesh, and on the resting body
    CorrespondenceTemplate::Skin skin{};
    double certainty = 1;
    std::size_t limb = 0;  ///< number of the pair; their count: none
  };

  void place(Seen& s, Vec3d at) const {
    const BodyPoint on = rest_.locate(at);
    s.rest = on.rest;
    s.skin = rest_.skin(on);
  }
  void mirror(Seen& s) const {
    s.rest = rest_.locate({-s.rest.x, s.rest.y, s.rest.z}).rest;
    const CorrespondenceTemplate::Skin skin = s.skin;
    for (std::size_t j = 0; j < skin.size(); ++j) s.skin[plan_.joints[j].mirrored] = skin[j];
  }
  std::size_t limb_of(const Seen& s) const {
    for (std::size_t l = 0; l < rest_.limbs().size(); ++l) {
      const auto& [left, right] = rest_.limbs()[l].joints;
      double share = 0;
      for (std::size_t j = 0; j < s.skin.size(); ++j)
        if (const std::size_t own = plan_.joints[j].limb;
            own == plan_.joints[left.back()].limb || own == plan_.joints[right.back()].limb)
          share += s.skin[j];
      if (share > 0.5) return l;
    }
    return rest_.limbs().size();
  }
  void choose_sides() {
    for (Seen& s : seen_) {
      if (s.limb == rest_.limbs().size()) continue;
      const LimbPair& limb = rest_.limbs()[s.limb];
      const std::size_t own = limb.joints[s.rest.x > 0 ? 0 : 1][limb.first];
      const double radius = length(s.rest - rest_.joints()[own]);
      const auto beyond = [&](std::size_t joint) {
        return length(s.point - trunk_(rest_.joints()[joint])) / trunk_.scale - radius;
      };
      if (beyond(own) > 2 * usual_error && beyond(plan_.joints[own].mirrored) < usual_error) mirror(s);
    }
  }
  /// Parts that are too small or too round to be asked alone.
  bool is_small(std::size_t j) const {
    using enum JointKind;
    const JointKind kind = plan_.joints[j].kind;
    return kind == girdle || kind == tip || kind == spine || kind == neck || kind == appendage;
  }

  /// What a part is held by besides its points.
  struct Hold {
    Similarity from{};        ///< the parent's, or the trunk's
    Vec3d joint{};            ///< of the rest pose
    double joint_weight = 0;  ///< how firmly the joint stays where `from` puts it
    double stiffness = 0;     ///< how firmly the rotation and the size stay, in weighted square metres
  };

  /// A point with its weight in the part that is solved for.
  struct Weighted {
    const Seen* seen;
    double weight, robust = 0;  ///< robust: less where it lies off
  };

  /// Weighted Procrustes: of all points by their share_ in the part, and first by their distance from the part's joint,
  /// which no rotation changes; then with iterated weights, far at first.
  Similarity solve(const Hold& hold) const {
    std::vector<Weighted> points;
    for (std::size_t i = 0; i < seen_.size(); ++i)
      if (share_[i] > 0) points.push_back({&seen_[i], share_[i] * seen_[i].certainty});
    for (Weighted& p : points) {
      p.robust = p.weight;
      if (!(hold.joint_weight > 0)) continue;
      const double reach = length(p.seen->point - hold.from(hold.joint)) / hold.from.scale;
      const double off = reach - length(p.seen->rest - hold.joint);
      p.robust *= robust_weight(off * off, 2 * usual_error);
    }
    Similarity part = procrustes(hold, hold.from, points);
    for (const int times : {4, 2, 1, 1, 1}) {
      for (Weighted& p : points) {
        const Vec3d d = (part(p.seen->rest) - p.seen->point) / part.scale;
        p.robust = p.weight * robust_weight(dot(d, d), 2 * times * usual_error);
      }
      part = procrustes(hold, part, points);
    }
    return part;
  }

  /// The similarity that brings places to their points; `before` where nothing says what it is.
  Similarity procrustes(const Hold& hold, const Similarity& before, const std::vector<Weighted>& points) const {
    const Vec3d joint = hold.from(hold.joint);
    double total = hold.joint_weight;
    Vec3d p_centre = joint * hold.joint_weight, q_centre = hold.joint * hold.joint_weight;
    for (const Weighted& p : points) {
      total += p.robust;
      p_centre += p.seen->point * p.robust;
      q_centre += p.seen->rest * p.robust;
    }
    if (!(total > 0)) return before;
    p_centre = p_centre / total;
    q_centre = q_centre / total;
    const Matrix3 hold_columns = hold.from.rotation.transposed() * (hold.stiffness * hold.from.scale);
    std::array<Vec3d, 3> columns = hold_columns.rows;
    double p_squares = 3 * hold.stiffness * hold.from.scale * hold.from.scale;
    const auto add = [&](Vec3d p, Vec3d q, double w) {
      const Vec3d a = (q - q_centre) * w, b = p - p_centre;
      columns[0] += b * a.x, columns[1] += b * a.y, columns[2] += b * a.z;
      p_squares += w * dot(b, b);
    };
    add(joint, hold.joint, hold.joint_weight);
    for (const Weighted& p : points) add(p.seen->point, p.seen->rest, p.robust);
    Similarity part = before;
    part.rotation = matrix_of(nearest_rotation(columns));
    const std::array<Vec3d, 3> rotation = part.rotation.columns();
    // The noise is in the places: the regression of places on points has the slope 1 / size.
    double crossed = 0;
    for (std::size_t c = 0; c < 3; ++c) crossed += dot(columns[c], rotation[c]);
    if (crossed > 0) part.scale = std::clamp(p_squares / crossed, 0.5 * hold.from.scale, 2 * hold.from.scale);
    part.shift = p_centre - part.rotation * q_centre * part.scale;
    return part;
  }

  void solve_trunk() {
    share_.assign(seen_.size(), 0.0);
    for (std::size_t j = 0; j < plan_.joint_count(); ++j)
      if (plan_.in_trunk(j))
        for (std::size_t i = 0; i < seen_.size(); ++i) share_[i] += seen_[i].skin[j];
    // The overall size as a start, from how far the points are from their mean; a bent body is smaller.
    Vec3d p_mean, q_mean;
    for (const Seen& s : seen_) {
      p_mean += s.point / static_cast<double>(seen_.size());
      q_mean += s.rest / static_cast<double>(seen_.size());
    }
    double p_squares = 0, q_squares = 0;
    for (const Seen& s : seen_) {
      p_squares += dot(s.point - p_mean, s.point - p_mean);
      q_squares += dot(s.rest - q_mean, s.rest - q_mean);
    }
    Hold hold;
    hold.from.scale = q_squares > 0 && p_squares > 0 ? std::sqrt(p_squares / q_squares) : 1;
    hold.from.shift = p_mean - q_mean * hold.from.scale;
    trunk_ = solve(hold);
    parts_.assign(plan_.joint_count(), trunk_);
  }

  std::size_t parent(std::size_t j) const { return static_cast<std::size_t>(plan_.joints[j].parent); }

  PartMotion result() const {
    PartMotion m;
    m.parts = parts_;
    m.size = trunk_.scale;
    m.translation = parts_[0](rest_.joints()[0]) - rest_.joints()[0];
    double gaps = 0;
    for (std::size_t j = 0; j < parts_.size(); ++j) {
      Matrix3 relative = parts_[j].rotation;
      if (j > 0) {
        const Similarity& above = parts_[parent(j)];
        relative = above.rotation.transposed() * relative;
        const Vec3d joint = rest_.joints()[j];
        gaps += cut_off(parts_[j](joint) - above(joint)) / static_cast<double>(parts_.size() - 1);
      }
      const Vec3d a = axis_angle(relative);
      m.axis_angles.insert(m.axis_angles.end(), {a.x, a.y, a.z});
    }
    double all = 0;
    for (const Seen& s : seen_) {
      const double off = cut_off(skinned(s.skin, [&](std::size_t j) { return parts_[j](s.rest); }) - s.point);
      all += s.certainty * off;
      m.places.push_back(s.rest);
      m.certainty.push_back(s.certainty);
    }
    m.residual = all / total_ + 0.5 * gaps;
    return m;
  }

  /// A distance in metres of the body, at most 0.3.
  double cut_off(Vec3d offset) const { return std::min(length(offset) / trunk_.scale, 6 * usual_error); }

  const CorrespondenceTemplate& rest_;
  const BodyPlan& plan_;
  std::vector<Seen> seen_;
  double total_ = 0, unit_ = 1;
  Similarity trunk_;
  std::vector<Similarity> parts_;
  std::vector<double> share_;  ///< of each point in the part that is solved for
};

}  // namespace fit::internal

/// The motion of a body's parts from correspondences.
NPT_INLINE PartMotion part_motion(const CorrespondenceTemplate& rest, std::span<const PointCorrespondence> points,
                                  SwappedLimbs swapped = 0) {
  return fit::internal::PartMotionSolver(rest, points, swapped)();
}

}  // namespace npt::inline NPT_ABI
