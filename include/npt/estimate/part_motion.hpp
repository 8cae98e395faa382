/// How the parts of a body moved, in closed form, from points of a mesh and where on the resting body each was read to
/// belong: a start for a fit that no local optimum hides behind, and a residual that tells readings right from wrong.
///   p = size_j R_j q + t_j   for the points p of part j with the places q
/// 1. The trunk's similarity, then each part's along the kinematic tree, weighted by skin weight and certainty of the
///    reading, wild points counted out by iterated weights. A part begins where its parent puts the joint between them;
///    the fewer and the rounder its points, the more of its motion is the parent's.
/// 2. Points of a limb whose mirrored place explains them, and their own does not, are taken for the other side's: first
///    by their distance from the joint that the limb is attached to, which no rotation changes; then by the motion.
/// Shapes    parts, residuals: [J] of a plan's joints; axis angles: [J, 3], relative to the parent
/// Units     metres, or any for the points: `size` is their unit in the body's
/// Threads   a template may be shared by threads
/// Errors    npt::Error for fewer than 20 points, and for values that are not finite
/// Source    rotations: Horn, 1987, Umeyama, 1991 (nearest_rotation.hpp); weights: Geman and McClure, "Statistical
///           methods for tomographic image reconstruction", 1987
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/similarity.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_level.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/solve/nearest_rotation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A point of a mesh's surface, and where on the resting body it was read to belong.
struct PointCorrespondence {
  Vec3d point;           ///< of the mesh
  Vec3d normal;          ///< of the mesh, unit, as its triangles turn; (0, 0, 0): unknown
  Vec3d place;           ///< on the body's mean shape in its rest pose, or near it
  double spread = 0.05;  ///< b of the Laplace distribution of the place's error, in metres
};

/// A point of a body's surface: the sum of the vertices `corners` times `weights`.
struct BodyPoint {
  Triangle corners{};
  std::array<double, 3> weights{};
  Vec3d rest;  ///< where it is on the mean shape in the rest pose
};

NPT_INLINE_CLASS(class, CorrespondenceTemplate);
/// The resting body that places are read on. Level and plan must outlive it.
template <class>
class BasicCorrespondenceTemplate {
 public:
  using Skin = std::vector<double>;  ///< [J]

  /// Requires  a body of the plan's joints
  BasicCorrespondenceTemplate(const BodyModel& model, const BodyLevel& level, const BodyPlan& plan)
      : level_(level),
        plan_(plan),
        limbs_(plan.limb_pairs()),
        tree_(level.rest_points(), level.triangles()),
        joints_(model.joints({})) {
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
  BodyPoint locate(Vec3d place) const {
    const ClosestPoint c = tree_.closest(place);
    return {level_.triangles()[c.triangle], c.weights, c.point};
  }

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
  TriangleTree tree_;
  std::vector<Vec3d> joints_;
  std::vector<Skin> skins_;  ///< by vertex of the level
};

/// Pairs of limbs whose places are mirrored before the motion is found, as bits: candidates beside what was read.
using SwappedLimbs = std::uint64_t;

struct PartMotion {
  std::vector<Similarity> parts;    ///< [J] from the places to the points
  double size = 1;                  ///< of the trunk
  Vec3d translation;                ///< as BodyFit's, for a body of the mean shape
  std::vector<double> axis_angles;  ///< [J, 3] relative to the parent, as BodyFit's
  std::vector<double> residuals;    ///< [J] mean distance of a part's points from where they were read, m
  /// Of all points and joints, in metres of the body, each distance cut off at 0.3 m. Of readings with errors of 5 cm
  /// and a tenth of the places wild: 0.07 to 0.10, and 0.10 to 0.17 where both legs were taken for each other.
  double residual = 0;
  std::vector<BodyPoint> places;  ///< [n] the surface's points that the places were taken for
  std::vector<double> certainty;  ///< [n] weights of the points
};

namespace fit::internal {
NPT_INLINE_CLASS(class, PartMotionSolver);
template <class>
class BasicPartMotionSolver {
 public:
  BasicPartMotionSolver(const CorrespondenceTemplate& rest, std::span<const PointCorrespondence> points,
                        SwappedLimbs swapped)
      : rest_(rest), plan_(rest.plan()), points_(points), limb_of_(plan_.joint_count(), no_limb) {
    for (std::size_t j = 0; j < limb_of_.size(); ++j)
      for (std::size_t l = 0; l < rest.limbs().size(); ++l)
        for (const auto& joints : rest.limbs()[l].joints)
          if (plan_.joints[j].limb == plan_.joints[joints.back()].limb) limb_of_[j] = l;
    if (points.size() < 20)
      throw Error({.file = "reading", .found = std::to_string(points.size()) + " points", .expected = "at least 20"});
    for (const PointCorrespondence& p : points) {
      if (!is_finite(p.point) || !is_finite(p.place) || !(p.spread >= 0))
        throw Error({.file = "reading", .found = "a point or place that is not finite", .expected = "finite numbers"});
      Read& r = reads_.emplace_back();
      r.own = rest.locate(p.place);
      r.skin = rest.skin(r.own);
      r.certainty = 0.05 / std::max(p.spread, 0.01);
      total_ += r.certainty;
      r.limb = limb_of(r.skin);
      if (r.limb != no_limb && (swapped >> r.limb & 1U) != 0) mirror(r);
    }
    unit_ = total_ / 600;
  }

  PartMotion operator()() {
    solve_trunk();
    choose_sides_by_reach();
    solve_parts();
    for (int round = 0; round < 2; ++round) {
      choose_sides_by_residual();
      solve_parts();
    }
    return result();
  }

 private:
  static constexpr std::size_t no_limb = BodyPlan::no_joint;

  struct Read {
    BodyPoint own;
    CorrespondenceTemplate::Skin skin;
    double certainty = 1;
    std::size_t limb = no_limb;  ///< number of the pair
    bool mirrored = false;
  };

  std::size_t limb_of(const CorrespondenceTemplate::Skin& skin) const {
    for (std::size_t l = 0; l < rest_.limbs().size(); ++l) {
      double sum = 0;
      for (std::size_t j = 0; j < skin.size(); ++j)
        if (limb_of_[j] == l) sum += skin[j];
      if (sum > 0.5) return l;
    }
    return no_limb;
  }
  /// Parts that are too small or too round to be asked alone.
  bool is_small(std::size_t j) const {
    using enum JointKind;
    const JointKind kind = plan_.joints[j].kind;
    return kind == girdle || kind == tip || kind == spine || kind == neck || kind == appendage;
  }

  /// The place with x negated, and the joints' weights exchanged.
  void mirror(Read& r) const {
    Vec3d place = r.own.rest;
    place.x = -place.x;
    r.own = rest_.locate(place);
    CorrespondenceTemplate::Skin skin(r.skin.size());
    for (std::size_t j = 0; j < skin.size(); ++j) skin[plan_.joints[j].mirrored] = r.skin[j];
    r.skin = std::move(skin);
    r.mirrored = !r.mirrored;
  }

  static double robust(double squared, double scale) {
    const double share = scale * scale / (scale * scale + squared);
    return share * share;
  }

  /// What a part is held by besides its points.
  struct Hold {
    Similarity from;          ///< the parent's, or the trunk's
    Vec3d joint;              ///< of the rest pose
    double joint_weight = 0;  ///< how firmly the joint stays where `from` puts it
    double stiffness = 0;     ///< how firmly the rotation and the size stay, in weighted square metres
  };

  /// Weighted Procrustes with weights iterated from `scales`, of points by their share_ in the part.
  Similarity solve(const Hold& hold, std::initializer_list<double> scales, bool by_reach) const {
    Similarity part = hold.from;
    const Vec3d joint = hold.from(hold.joint);
    bool first = true;
    for (const double scale : scales) {
      double total = hold.joint_weight;
      Vec3d p_centre = joint * hold.joint_weight, q_centre = hold.joint * hold.joint_weight;
      weights_.assign(reads_.size(), 0.0);
      for (std::size_t i = 0; i < reads_.size(); ++i) {
        double w = share_[i];
        if (w < 0.02) continue;
        const Vec3d p = points_[i].point, q = reads_[i].own.rest;
        w *= reads_[i].certainty;
        if (!first) {
          const Vec3d d = (part(q) - p) / part.scale;
          w *= robust(dot(d, d), scale);
        } else if (by_reach) {
          const double off = length(p - joint) / hold.from.scale - length(q - hold.joint);
          w *= robust(off * off, scale);
        }
        weights_[i] = w;
        total += w;
        p_centre += p * w;
        q_centre += q * w;
      }
      first = false;
      if (!(total > 0)) return part;
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
      if (hold.joint_weight > 0) add(joint, hold.joint, hold.joint_weight);
      for (std::size_t i = 0; i < reads_.size(); ++i)
        if (weights_[i] > 0) add(points_[i].point, reads_[i].own.rest, weights_[i]);
      part.rotation = matrix_of(nearest_rotation(columns));
      const std::array<Vec3d, 3> rotation = part.rotation.columns();
      // The noise is in the places: the regression of places on points has the slope 1 / size.
      double crossed = 0;
      for (std::size_t c = 0; c < 3; ++c) crossed += dot(columns[c], rotation[c]);
      if (crossed > 0) part.scale = std::clamp(p_squares / crossed, 0.6 * hold.from.scale, 1.6 * hold.from.scale);
      part.shift = p_centre - part.rotation * q_centre * part.scale;
    }
    return part;
  }

  void solve_trunk() {
    share_.assign(reads_.size(), 0.0);
    for (std::size_t j = 0; j < plan_.joint_count(); ++j)
      if (plan_.in_trunk(j))
        for (std::size_t i = 0; i < reads_.size(); ++i) share_[i] += reads_[i].skin[j];
    // The overall size as a start, from how far the points are from their mean; a bent body is smaller.
    Vec3d p_mean, q_mean;
    for (std::size_t i = 0; i < reads_.size(); ++i) {
      p_mean += points_[i].point / static_cast<double>(reads_.size());
      q_mean += reads_[i].own.rest / static_cast<double>(reads_.size());
    }
    double p_squares = 0, q_squares = 0;
    for (std::size_t i = 0; i < reads_.size(); ++i) {
      p_squares += dot(points_[i].point - p_mean, points_[i].point - p_mean);
      q_squares += dot(reads_[i].own.rest - q_mean, reads_[i].own.rest - q_mean);
    }
    Hold hold;
    hold.from.scale = q_squares > 0 && p_squares > 0 ? std::sqrt(p_squares / q_squares) : 1;
    hold.from.shift = p_mean - q_mean * hold.from.scale;
    trunk_ = solve(hold, {1.0, 0.3, 0.2, 0.12, 0.1, 0.1}, false);
    parts_.assign(plan_.joint_count(), trunk_);
  }

  void solve_parts() {
    for (std::size_t j = 0; j < parts_.size(); ++j) {
      Hold hold;
      hold.joint = rest_.joints()[j];
      if (j == 0) {
        hold.from = trunk_;
        hold.stiffness = 0.1 * unit_;
      } else {
        hold.from = parts_[parent(j)];
        hold.joint_weight = 8 * unit_;
        hold.stiffness = (is_small(j) ? 0.1 : 0.02) * unit_;
      }
      for (std::size_t i = 0; i < reads_.size(); ++i) share_[i] = reads_[i].skin[j];
      parts_[j] = solve(hold, {0.15, 0.3, 0.15, 0.1, 0.1}, j > 0);
    }
  }

  std::size_t parent(std::size_t j) const { return static_cast<std::size_t>(plan_.joints[j].parent); }

  Vec3d predicted(const Read& r) const {
    return skinned(r.skin, [&](std::size_t j) { return parts_[j](r.own.rest); });
  }

  void choose_sides_by_reach() {
    for (std::size_t i = 0; i < reads_.size(); ++i) {
      Read& r = reads_[i];
      if (r.limb == no_limb) continue;
      const LimbPair& limb = rest_.limbs()[r.limb];
      const std::size_t own = limb.joints[r.own.rest.x > 0 ? 0 : 1][limb.first], other = plan_.joints[own].mirrored;
      const double radius = length(r.own.rest - rest_.joints()[own]) * trunk_.scale;
      const double excess = length(points_[i].point - trunk_(rest_.joints()[own])) - radius;
      const double mirrored = length(points_[i].point - trunk_(rest_.joints()[other])) - radius;
      if (excess > 0.12 * trunk_.scale && mirrored < 0.05 * trunk_.scale) mirror(r);
    }
  }

  void choose_sides_by_residual() {
    for (std::size_t i = 0; i < reads_.size(); ++i) {
      Read& r = reads_[i];
      if (r.limb == no_limb) continue;
      const double own = length(predicted(r) - points_[i].point) / trunk_.scale;
      if (own < 0.12) continue;
      Read other = r;
      mirror(other);
      if (length(predicted(other) - points_[i].point) / trunk_.scale < 0.5 * own) r = other;
    }
  }

  PartMotion result() const {
    PartMotion m;
    m.parts = parts_;
    m.size = trunk_.scale;
    const std::size_t joints = parts_.size();
    m.axis_angles.resize(3 * joints);
    m.residuals.resize(joints);
    for (std::size_t j = 0; j < joints; ++j) {
      Matrix3 relative = parts_[j].rotation;
      if (j > 0) relative = parts_[parent(j)].rotation.transposed() * relative;
      const Vec3d a = axis_angle(relative);
      m.axis_angles[3 * j] = a.x, m.axis_angles[3 * j + 1] = a.y, m.axis_angles[3 * j + 2] = a.z;
    }
    m.translation = parts_[0](rest_.joints()[0]) - rest_.joints()[0];
    std::vector<double> share(joints);
    double all = 0;
    for (std::size_t i = 0; i < reads_.size(); ++i) {
      const Read& r = reads_[i];
      const double off = std::min(length(predicted(r) - points_[i].point) / trunk_.scale, cut_off);
      // A place that had to be mirrored was read wrong.
      all += r.certainty * (r.mirrored ? std::max(off, 0.1) : off);
      for (std::size_t j = 0; j < joints; ++j) {
        m.residuals[j] += r.certainty * r.skin[j] * off;
        share[j] += r.certainty * r.skin[j];
      }
      m.places.push_back(r.own);
      m.certainty.push_back(r.certainty);
    }
    double gaps = 0;
    for (std::size_t j = 0; j < joints; ++j) {
      if (share[j] > 0) m.residuals[j] /= share[j];
      if (j == 0) continue;
      const Vec3d joint = rest_.joints()[j];
      const Vec3d gap = parts_[j](joint) - parts_[parent(j)](joint);
      gaps += std::min(length(gap) / trunk_.scale, cut_off) / static_cast<double>(joints - 1);
    }
    m.residual = all / total_ + 0.5 * gaps;
    return m;
  }

  static constexpr double cut_off = 0.3;

  const CorrespondenceTemplate& rest_;
  const BodyPlan& plan_;
  std::span<const PointCorrespondence> points_;
  std::vector<std::size_t> limb_of_;  ///< [J] number of the pair whose limb a joint belongs to
  std::vector<Read> reads_;
  double total_ = 0, unit_ = 1;
  Similarity trunk_;
  std::vector<Similarity> parts_;
  std::vector<double> share_;  ///< of each point in the part that is solved for
  mutable std::vector<double> weights_;
};

}  // namespace fit::internal

/// The motion of a body's parts from read points.
NPT_INLINE PartMotion part_motion(const CorrespondenceTemplate& rest, std::span<const PointCorrespondence> points,
                                  SwappedLimbs swapped = 0) {
  return fit::internal::PartMotionSolver(rest, points, swapped)();
}

}  // namespace npt::inline NPT_ABI
