/// Other poses of a fitted body's pairs of limbs that a surface allows: where limbs cross, lie close or were seen
/// wrong, a fit ends in the wrong valley, and no small step leads out of it.
/// 1. poses of each limb alone: the fit's, those that views show, the kind's natural ones, and those that reach for
///    what the rest of the body leaves alone; each judged by how far its points are from the surface
/// 2. the best ones of the left limb with the best ones of the right, judged also by how much of the surface that the
///    rest of the body leaves alone lies near one of the two
/// Shapes    fits: as BodyFit, with other axis angles of the limbs
/// Units     metres
/// Numerics  double; the same answer for the same input. Less than 100 ms for a pair of limbs on one core of a Xeon
/// Threads   a search may be used by several threads at a time; it runs both limbs of a pair side by side
/// Source    the idea of hypotheses that are tested: Fischler and Bolles, "Random sample consensus", 1981
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/random.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/farthest_points.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/sampled_surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, LimbSearch);
template <class>
class BasicLimbSearch {
 public:
  explicit BasicLimbSearch(std::shared_ptr<const BodyKind> kind)
      : kind_(checked_kind(std::move(kind))), pairs_(kind_->plan.limb_pairs()) {
    for (const LimbPair& pair : pairs_)
      for (const std::vector<std::size_t>& joints : pair.joints) limbs_.push_back({joints, pair.middle(), {}});
    const BodyTables& tables = kind_->body->tables();
    const std::vector<std::uint32_t> part = tables.weights.heaviest_columns();
    const std::vector<Vec3d> points = points_of(as_span(tables.v_template));
    const std::vector<Vec3d> normals = area_vectors(as_span(points), kind_->body->triangles());
    Random random(20260620);
    for (const std::uint32_t v : random_permutation(static_cast<std::uint32_t>(part.size()), random)) {
      const Vec3d normal = normalised(normals[v]);
      for (Limb& l : limbs_)
        if (l.has(part[v]) && l.points.size() < of_limb) l.points.push_back({v, part[v], normal});
      if (others_.size() < of_whole) others_.push_back({v, part[v], normal});
    }
  }

  /// The plan's.
  std::span<const LimbPair> pairs() const noexcept { return as_span(pairs_); }

  /// At most `count` fits with other poses of a pair of limbs, the best first; may hold the pose that the fit has.
  /// pair: its number; facing: as CorrespondenceFit's; seen: other angles of the whole body, as the motions of views.
  template <class Exec = SerialExecutor>
  std::vector<BodyFit> operator()(const SampledSurface& surface, const BodyFit& fit, std::size_t pair, double facing,
                                  std::span<const std::vector<float>> seen, std::size_t count,
                                  const Exec& executor = Exec()) const {
    const std::array<std::size_t, 2> sides{2 * pair, 2 * pair + 1};
    std::vector<Rigid> motions = kind_->body->bone_motions(as_span(fit.betas), as_span(fit.axis_angles));
    for (Rigid& m : motions) m.shift += fit.translation;
    const std::vector<Vec3d> left_alone = uncovered(surface, fit, motions, sides);
    std::vector<Vec3d> goals;
    if (!left_alone.empty())
      for (const std::uint32_t p : farthest_points(as_span(left_alone), std::min(count, left_alone.size())))
        goals.push_back(left_alone[p]);
    std::array<std::vector<Hypothesis>, 2> best;
    executor.for_each(2, [&](int i, int) {
      const auto s = static_cast<std::size_t>(i);
      const Judge judge(*kind_, surface, limbs_[sides[s]], fit, motions, facing);
      best[s] = hypotheses(judge, fit, seen, goals);
      for (Hypothesis& h : best[s]) h.cover(left_alone);
    });
    return combined(fit, sides, best, left_alone.size(), count);
  }

 private:
  /// Points of a limb, and poses of it that are combined with the other's; points of the body, and of the mesh.
  static constexpr std::size_t of_limb = 40, of_whole = 900;

  struct Point {
    std::uint32_t vertex = 0;
    std::uint32_t part = 0;
    Vec3d normal;  ///< of the resting body
  };
  /// Left and right limb of the first pair, then of the next; the joint that a limb is attached to is fixed.
  struct Limb {
    std::vector<std::size_t> joints;
    std::size_t middle;  ///< as LimbPair's
    std::vector<Point> points;

    std::size_t step_of(std::size_t part) const {
      return static_cast<std::size_t>(std::find(joints.begin(), joints.end(), part) - joints.begin());
    }
    bool has(std::size_t part) const { return step_of(part) < joints.size(); }
  };
  struct Hypothesis {
    std::vector<float> angles;  ///< of the limb's joints
    Vec3d middle, end;          ///< where elbow and wrist, or knee and ankle, are
    std::vector<Vec3d> points;  ///< of the limb
    double distance = 0;
    std::vector<float> reach;  ///< squared distance of each point that the rest leaves alone

    bool near(const Hypothesis& other) const {
      return length(middle - other.middle) < usual_error && length(end - other.end) < usual_error;
    }
    void cover(std::span<const Vec3d> left_alone) {
      reach.assign(left_alone.size(), std::numeric_limits<float>::infinity());
      for (const Vec3d p : points)
        for (std::size_t u = 0; u < reach.size(); ++u) {
          const Vec3d d = left_alone[u] - p;
          reach[u] = std::min(reach[u], static_cast<float>(dot(d, d)));
        }
    }
  };

  /// [n] Where points of the shaped body are at rest.
  static std::vector<Vec3d> at_rest(const BodyModel& model, const BodyFit& fit, std::span<const Point> points) {
    std::vector<std::uint32_t> vertices;
    for (const Point& p : points) vertices.push_back(p.vertex);
    std::vector<float> xyz(3 * vertices.size());
    model.posed(as_span(fit.betas), as_span(std::vector<float>(fit.axis_angles.size())), as_span(vertices),
                as_span(xyz));
    return points_of(as_span(xyz));
  }

  /// Points of the surface that nothing but the two limbs can be near.
  std::vector<Vec3d> uncovered(const SampledSurface& surface, const BodyFit& fit, std::span<const Rigid> motions,
                               const std::array<std::size_t, 2>& sides) const {
    const std::vector<Vec3d> rest = at_rest(*kind_->body, fit, others_);
    std::vector<Vec3d> body, result;
    for (std::size_t i = 0; i < others_.size(); ++i)
      if (!limbs_[sides[0]].has(others_[i].part) && !limbs_[sides[1]].has(others_[i].part))
        body.push_back(motions[others_[i].part](rest[i]));
    for (const SampledSurface::Sample& s : surface.samples().first(std::min(of_whole, surface.samples().size())))
      if (std::ranges::none_of(body,
                               [&](Vec3d p) { return dot(p - s.point, p - s.point) < usual_error * usual_error; }))
        result.push_back(s.point);
    return result;
  }

  /// What a limb's poses are judged by.
  class Judge {
   public:
    Judge(const BodyKind& kind, const SampledSurface& surface, const Limb& limb, const BodyFit& fit,
          std::span<const Rigid> motions, double facing)
        : surface_(surface),
          tree_(surface.tree()),
          limb_(limb),
          joints_(kind.body->joints(as_span(fit.betas))),
          rest_(at_rest(*kind.body, fit, limb.points)),
          attached_(motions[static_cast<std::size_t>(kind.plan.joints[limb.joints[0]].parent)]),
          facing_(facing) {}

    /// all: of the whole body.
    Hypothesis operator()(std::span<const float> all) const {
      Hypothesis h;
      std::vector<Rigid> motions{attached_};
      for (const std::size_t j : limb_.joints) {
        h.angles.insert(h.angles.end(), &all[3 * j], &all[3 * j] + 3);
        motions.push_back(motions.back() * Rigid::about(joints_[j], joint_rotation(all, j)));
      }
      h.middle = motions[limb_.middle + 1](joints_[limb_.joints[limb_.middle]]);
      h.end = motions[limb_.middle + 2](joints_[limb_.joints[limb_.middle + 1]]);
      std::uint32_t hint = no_index;
      for (std::size_t i = 0; i < limb_.points.size(); ++i) {
        const Rigid& motion = motions[limb_.step_of(limb_.points[i].part) + 1];
        h.points.push_back(motion(rest_[i]));
        h.distance += distance(h.points.back(), motion.rotation * limb_.points[i].normal, hint);
      }
      h.distance /= static_cast<double>(limb_.points.size());
      return h;
    }

    /// Angles of the whole body with which the limb's end begins at a place, or as near as bones allow. turn: of its
    /// middle about the way there.
    std::vector<float> reaching(std::span<const float> angles, Vec3d place, double turn) const {
      std::vector<float> all(angles.begin(), angles.end());
      Rigid motion = attached_;
      std::size_t k = 0;
      for (; k + 1 < limb_.middle; ++k)  // a girdle, as it is
        motion = motion * Rigid::about(joints_[limb_.joints[k]], joint_rotation(all, limb_.joints[k]));
      const auto bone = [&](std::size_t i) { return joints_[limb_.joints[i + 1]] - joints_[limb_.joints[i]]; };
      const double upper = length(bone(k)), lower = length(bone(k + 1));
      const Vec3d root = motion(joints_[limb_.joints[k]]), along = normalised(place - root);
      const double reach = std::clamp(length(place - root), std::abs(upper - lower), upper + lower);
      if (!(reach > 0)) return all;
      const Vec3d side =
          normalised(cross(along, std::abs(along.y) < std::abs(along.x) ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}));
      const double before = (upper * upper + reach * reach - lower * lower) / (2 * reach);
      const double aside = std::sqrt(std::max(0.0, upper * upper - before * before));
      const Vec3d bend = along * before + (side * std::cos(turn) + cross(along, side) * std::sin(turn)) * aside;
      for (const Vec3d way : {bend, along * reach - bend}) {
        const Matrix3 parent = motion.rotation;
        const Matrix3 own = parent.transposed() * matrix_of(turn_between(parent * bone(k), way)) * parent;
        set_joint_rotation(as_span(all), limb_.joints[k], own);
        motion = motion * Rigid::about(joints_[limb_.joints[k++]], own);
      }
      return all;
    }

   private:
    double distance(Vec3d point, Vec3d normal, std::uint32_t& hint) const {
      const ClosestPoint c = tree_.closest(
          point, [&](std::uint32_t k) { return faces_alike(normal, surface_.samples()[k].normal, facing_); }, hint,
          9 * usual_error * usual_error);
      hint = c.triangle;
      return c.triangle == no_index ? usual_error * usual_error : robust_squared(c.squared_distance, usual_error);
    }

    const SampledSurface& surface_;
    const PointTree& tree_;
    const Limb& limb_;
    std::vector<Vec3d> joints_, rest_;  ///< [J], and the limb's points, of the shaped body at rest
    Rigid attached_;                    ///< the motion of what the limb is attached to
    double facing_;
  };

  /// Poses of one limb: the fit's, those that were seen, natural ones, and those that reach for what nothing covers,
  /// without which a raised arm ends elsewhere (321 mm in one of 1000 natural pairs). The best ones that differ.
  std::vector<Hypothesis> hypotheses(const Judge& judge, const BodyFit& fit, std::span<const std::vector<float>> seen,
                                     std::span<const Vec3d> goals) const {
    std::vector<Hypothesis> all{judge(fit.axis_angles)};
    for (const std::vector<float>& angles : seen) all.push_back(judge(angles));
    for (const std::vector<float>& angles : kind_->poses) all.push_back(judge(angles));
    for (const Vec3d goal : goals)
      for (int quarter = 0; quarter < 4; ++quarter)
        all.push_back(judge(judge.reaching(fit.axis_angles, goal, quarter * std::numbers::pi / 2)));
    stable_sort_by(all, &Hypothesis::distance);
    std::vector<Hypothesis> kept;
    for (Hypothesis& h : all)
      if (kept.size() < of_limb && std::ranges::none_of(kept, [&](const Hypothesis& other) { return h.near(other); }))
        kept.push_back(std::move(h));
    return kept;
  }

  std::vector<BodyFit> combined(const BodyFit& fit, const std::array<std::size_t, 2>& sides,
                                const std::array<std::vector<Hypothesis>, 2>& best, std::size_t left_alone,
                                std::size_t count) const {
    struct Pair {
      std::array<const Hypothesis*, 2> limbs;
      double value;
    };
    std::vector<Pair> pairs, kept;
    for (const Hypothesis& l : best[0])
      for (const Hypothesis& r : best[1]) {
        // A share of the surface counts like the same share of the limbs.
        double value = 0;
        for (std::size_t u = 0; u < left_alone; ++u)
          value += robust_squared(static_cast<double>(std::min(l.reach[u], r.reach[u])), usual_error);
        if (left_alone > 0) value /= static_cast<double>(left_alone);
        pairs.push_back({{&l, &r}, value + (l.distance + r.distance) / 2});
      }
    stable_sort_by(pairs, &Pair::value);
    std::vector<BodyFit> result;
    for (const Pair& p : pairs) {
      if (kept.size() == count) break;
      if (std::ranges::any_of(kept, [&](const Pair& other) {
            return p.limbs[0]->near(*other.limbs[0]) && p.limbs[1]->near(*other.limbs[1]);
          }))
        continue;
      kept.push_back(p);
      BodyFit& changed = result.emplace_back(fit);
      for (std::size_t s = 0; s < 2; ++s)
        for (std::size_t k = 0; k < limbs_[sides[s]].joints.size(); ++k)
          std::copy_n(&p.limbs[s]->angles[3 * k], 3, &changed.axis_angles[3 * limbs_[sides[s]].joints[k]]);
    }
    return result;
  }

  std::shared_ptr<const BodyKind> kind_;
  std::vector<LimbPair> pairs_;
  std::vector<Limb> limbs_;
  std::vector<Point> others_;  ///< of the whole body
};

}  // namespace npt::inline NPT_ABI
