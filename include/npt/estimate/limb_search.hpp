/// Other poses of a fitted body's pairs of limbs that a surface allows: where limbs cross, lie close or were read
/// wrong, a fit ends in the wrong valley, and no small step leads out of it.
/// 1. poses of each limb alone: the kind's natural ones, and what the caller read; each judged by how far its points
///    are from the surface
/// 2. the best ones of the left limb with the best ones of the right, judged also by how much of the surface that the
///    rest of the body leaves alone lies near one of the two
/// Shapes    fits: as BodyFit, with other axis angles of the limbs
/// Units     metres
/// Numerics  double; the same answer for the same input. 90 to 150 ms for a pair of limbs on one core of a Xeon
/// Threads   a search may be used by several threads at a time; it runs both limbs of a pair side by side on the
///           executor that it is given
/// Source    the idea of hypotheses that are tested: Fischler and Bolles, "Random sample consensus", 1981
#pragma once

#include <npt/base/executor.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/fit_surface.hpp>
#include <npt/estimate/fitted_body.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/closest_point.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, LimbSearch);
template <class>
class BasicLimbSearch {
 public:
  /// Axis angles [J, 3], of which a limb's are taken.
  using Angles = std::vector<float>;

  explicit BasicLimbSearch(std::shared_ptr<const BodyKind> kind)
      : kind_(checked_kind(std::move(kind))), pairs_(kind_->plan.limb_pairs()) {
    for (const LimbPair& pair : pairs_)
      for (const std::vector<std::size_t>& joints : pair.joints) limbs_.push_back({joints, pair.middle(), {}});
    const BodyTables& tables = kind_->body->tables();
    const std::vector<std::uint32_t> part = tables.weights.heaviest_columns();
    const auto at = [&tables](std::uint32_t v) {
      return Vec3f{tables.v_template[3 * v], tables.v_template[3 * v + 1], tables.v_template[3 * v + 2]}.as<double>();
    };
    std::vector<Vec3d> normals(part.size());
    for (const Triangle& t : kind_->body->triangles()) {
      const Vec3d normal = cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0]));
      for (const std::uint32_t v : t) normals[v] += normal;
    }
    Random random(20260620);
    for (const std::uint32_t v : random_permutation(static_cast<std::uint32_t>(part.size()), random)) {
      const Vec3d normal = normalised(normals[v]);
      for (Limb& l : limbs_)
        if (l.has(part[v]) && l.points.size() < points_of_limb) l.points.push_back({v, part[v], normal});
      if (others_.size() < points_of_body) others_.push_back({v, part[v], normal});
    }
  }

  /// The plan's.
  std::span<const LimbPair> pairs() const noexcept { return as_span(pairs_); }

  /// At most `count` fits with other poses of a pair of limbs, the best first; may hold the pose that the fit has.
  /// pair: its number; read: other angles of the whole body, as the motions of other readings; facing: as
  /// CorrespondenceFit's.
  template <class Exec = SerialExecutor>
  std::vector<BodyFit> operator()(const FitSurface& surface, const BodyFit& fit, std::size_t pair, double facing,
                                  std::span<const Angles> read, std::size_t count,
                                  const Exec& executor = Exec()) const {
    const Posed posed = pose(fit);
    const std::array<std::size_t, 2> sides{2 * pair, 2 * pair + 1};
    const std::vector<Vec3d> left_alone = uncovered(surface, posed, sides);
    std::array<std::vector<Hypothesis>, 2> best;
    executor.for_each(2, [&](int i, int) {
      const auto s = static_cast<std::size_t>(i);
      const Judge judge{*this, surface, posed, sides[s], facing};
      best[s] = hypotheses(judge, fit, read, sides[1 - s]);
      for (Hypothesis& h : best[s]) cover(left_alone, posed, sides[s], h);
    });
    return combined(fit, sides, best, left_alone.size(), count);
  }

 private:
  static constexpr std::size_t points_of_limb = 40, screened_points = 8, screened = 300, points_of_body = 900,
                               kept_of_limb = 60, mesh_points = 600;
  /// Metres, of the robust kernel.
  static constexpr double scale = 0.05;

  static constexpr std::size_t shaken = 12, shakes = 20;

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
  struct Posed {
    std::vector<Vec3d> joints;             ///< of the shaped body at rest
    std::vector<Rigid> motions;            ///< with the fit's translation
    std::vector<std::vector<Vec3d>> rest;  ///< each limb's points, shaped
    std::vector<Vec3d> others;             ///< points of the whole body, posed
  };
  struct Hypothesis {
    Angles angles;  ///< of the limb's joints
    std::vector<Rigid> motions;
    Vec3d middle, end;  ///< where elbow and wrist, or knee and ankle, are
    double distance = 0;
    std::vector<float> reach;  ///< squared distance of each point that the rest leaves alone
  };

  Posed pose(const BodyFit& fit) const {
    Posed posed;
    posed.joints = kind_->body->joints(as_span(fit.betas));
    posed.motions = kind_->body->bone_motions(as_span(fit.betas), as_span(fit.axis_angles));
    for (Rigid& m : posed.motions) m.shift += fit.translation;
    const std::vector<float> rest_angles(fit.axis_angles.size());
    std::vector<std::uint32_t> vertices;
    for (const Limb& l : limbs_)
      for (const Point& p : l.points) vertices.push_back(p.vertex);
    for (const Point& p : others_) vertices.push_back(p.vertex);
    std::vector<float> xyz(3 * vertices.size());
    kind_->body->posed(as_span(fit.betas), as_span(rest_angles), as_span(vertices), as_span(xyz));
    std::size_t at = 0;
    const auto next = [&] {
      const Vec3d p = Vec3f{xyz[3 * at], xyz[3 * at + 1], xyz[3 * at + 2]}.as<double>();
      ++at;
      return p;
    };
    for (const Limb& l : limbs_) {
      std::vector<Vec3d>& rest = posed.rest.emplace_back();
      while (rest.size() < l.points.size()) rest.push_back(next());
    }
    for (const Point& p : others_) posed.others.push_back(posed.motions[p.part](next()));
    return posed;
  }

  /// Points of the surface that nothing but the two limbs can be near.
  std::vector<Vec3d> uncovered(const FitSurface& surface, const Posed& posed,
                               const std::array<std::size_t, 2>& sides) const {
    std::vector<Vec3d> result;
    const auto samples = surface.samples().first(std::min(mesh_points, surface.samples().size()));
    for (const FitSurface::Sample& s : samples) {
      bool near = false;
      for (std::size_t i = 0; i < others_.size() && !near; ++i) {
        if (limbs_[sides[0]].has(others_[i].part) || limbs_[sides[1]].has(others_[i].part)) continue;
        const Vec3d d = posed.others[i] - s.point;
        near = dot(d, d) < 0.06 * 0.06;
      }
      if (!near) result.push_back(s.point);
    }
    return result;
  }

  /// What a limb's poses are judged by.
  struct Judge {
    const BasicLimbSearch& search;
    const FitSurface& surface;
    const Posed& posed;
    std::size_t limb;
    double facing;

    const Limb& own() const { return search.limbs_[limb]; }
    const Rigid& parent(const Hypothesis& h, std::size_t step) const {
      if (step > 0) return h.motions[step - 1];
      return posed.motions[static_cast<std::size_t>(search.kind_->plan.joints[own().joints[0]].parent)];
    }

    Hypothesis operator()(Angles angles, std::size_t points = points_of_limb) const {
      Hypothesis h;
      h.angles = std::move(angles);
      h.motions.resize(own().joints.size());
      move(h);
      measure(h, points);
      return h;
    }

    void move(Hypothesis& h) const {
      const Limb& l = own();
      for (std::size_t k = 0; k < l.joints.size(); ++k)
        h.motions[k] = parent(h, k) * Rigid::about(posed.joints[l.joints[k]], joint_rotation(h.angles, k));
      h.middle = h.motions[l.middle](posed.joints[l.joints[l.middle]]);
      h.end = h.motions[l.middle + 1](posed.joints[l.joints[l.middle + 1]]);
    }

    void measure(Hypothesis& h, std::size_t count) const {
      const std::vector<Point>& points = own().points;
      count = std::min(count, points.size());
      h.distance = 0;
      std::uint32_t hint = no_index;
      for (std::size_t i = 0; i < count; ++i) {
        const Rigid& motion = h.motions[own().step_of(points[i].part)];
        const Vec3d normal = motion.rotation * points[i].normal;
        const ClosestPoint c = surface.tree().closest(
            motion(posed.rest[limb][i]),
            [&](std::uint32_t k) {
              const double cosine = dot(normal, surface.samples()[k].normal);
              return facing == 0 ? std::abs(cosine) > 0.2 : facing * cosine > 0.2;
            },
            hint, 9 * scale * scale);
        hint = c.triangle;
        h.distance += c.triangle == no_index ? scale * scale : robust_squared(c.squared_distance, scale);
      }
      h.distance /= static_cast<double>(count);
    }
  };

  static Angles angles_of(const Limb& l, std::span<const float> all) {
    Angles angles;
    for (const std::size_t j : l.joints)
      for (std::size_t e = 0; e < 3; ++e) angles.push_back(all[3 * j + e]);
    return angles;
  }

  /// Poses of one limb: the fit's, with the other side's ends, what was read, natural ones; and the best ones shaken.
  std::vector<Hypothesis> hypotheses(const Judge& judge, const BodyFit& fit, std::span<const Angles> read,
                                     std::size_t other) const {
    const Limb& l = judge.own();
    std::vector<Hypothesis> all;
    for (const Angles& a : kind_->poses) all.push_back(judge(angles_of(l, a), screened_points));
    stable_sort_by(all, &Hypothesis::distance);
    all.resize(std::min(screened, all.size()));
    for (Hypothesis& h : all) judge.measure(h, points_of_limb);
    const Hypothesis now = judge(angles_of(l, fit.axis_angles));
    all.push_back(now);
    for (const Angles& a : read) all.push_back(judge(angles_of(l, a)));
    const auto place = [&](std::size_t joint) { return judge.posed.motions[joint](judge.posed.joints[joint]); };
    const Limb& o = limbs_[other];
    const Vec3d other_middle = place(o.joints[o.middle]), other_end = place(o.joints[o.middle + 1]);
    all.push_back(judge(aimed(judge, now, other_middle, other_end)));
    all.push_back(judge(aimed(judge, now, now.middle, other_end)));
    stable_sort_by(all, &Hypothesis::distance);
    std::vector<Hypothesis> best = distinct(all, shaken, 0.08);
    Random random(20260621);
    for (std::size_t i = 0, n = best.size(); i < n; ++i)
      for (std::size_t k = 0; k < shakes; ++k) {
        Angles angles = best[i].angles;
        for (float& a : angles) a += 0.2F * static_cast<float>(random.normal());
        all.push_back(judge(std::move(angles)));
      }
    stable_sort_by(all, &Hypothesis::distance);
    return distinct(all, kept_of_limb, 0.05);
  }

  /// The limb turned so that its middle joint and its end lie in the directions of two places.
  Angles aimed(const Judge& judge, Hypothesis h, Vec3d middle, Vec3d end) const {
    const std::size_t m = judge.own().middle;
    const auto turn = [&](std::size_t step, Vec3d from, Vec3d to) {
      const Vec3d joint = h.motions[step](judge.posed.joints[judge.own().joints[step]]);
      const Vec3d a = normalised(from - joint), b = normalised(to - joint), axis = cross(a, b);
      const Matrix3 turned =
          rotation_matrix(normalised(axis) * std::atan2(length(axis), dot(a, b))) * h.motions[step].rotation;
      set_joint_rotation(h.angles, step, judge.parent(h, step).rotation.transposed() * turned);
      judge.move(h);
    };
    turn(m - 1, h.middle, middle);
    turn(m, h.end, end);
    return h.angles;
  }

  /// The best ones of a sorted list that differ.
  static std::vector<Hypothesis> distinct(std::span<const Hypothesis> sorted, std::size_t count, double apart) {
    std::vector<Hypothesis> kept;
    for (const Hypothesis& h : sorted) {
      if (kept.size() == count) break;
      if (std::none_of(kept.begin(), kept.end(), [&](const Hypothesis& other) {
            return length(h.middle - other.middle) < apart && length(h.end - other.end) < apart;
          }))
        kept.push_back(h);
    }
    return kept;
  }

  void cover(std::span<const Vec3d> points, const Posed& posed, std::size_t limb, Hypothesis& h) const {
    h.reach.assign(points.size(), std::numeric_limits<float>::infinity());
    const Limb& l = limbs_[limb];
    for (std::size_t i = 0; i < l.points.size(); ++i) {
      const Vec3d p = h.motions[l.step_of(l.points[i].part)](posed.rest[limb][i]);
      for (std::size_t u = 0; u < points.size(); ++u) {
        const Vec3d d = points[u] - p;
        h.reach[u] = std::min(h.reach[u], static_cast<float>(dot(d, d)));
      }
    }
  }

  std::vector<BodyFit> combined(const BodyFit& fit, const std::array<std::size_t, 2>& sides,
                                const std::array<std::vector<Hypothesis>, 2>& best, std::size_t left_alone,
                                std::size_t count) const {
    struct Pair {
      std::size_t left, right;
      double value;
    };
    std::vector<Pair> pairs;
    for (std::size_t a = 0; a < best[0].size(); ++a)
      for (std::size_t b = 0; b < best[1].size(); ++b) {
        const Hypothesis &l = best[0][a], &r = best[1][b];
        double value = 0;
        for (std::size_t u = 0; u < left_alone; ++u)
          value += robust_squared(static_cast<double>(std::min(l.reach[u], r.reach[u])), scale);
        // A share of the surface counts like the same share of the limbs.
        const double points = static_cast<double>(left_alone);
        pairs.push_back({a, b, (left_alone > 0 ? value / points : 0) + (l.distance + r.distance) / 2});
      }
    stable_sort_by(pairs, &Pair::value);
    std::vector<BodyFit> result;
    std::vector<Pair> kept;
    for (const Pair& p : pairs) {
      if (kept.size() == count) break;
      const auto near = [](const Hypothesis& x, const Hypothesis& y) {
        return length(x.middle - y.middle) < 0.1 && length(x.end - y.end) < 0.1;
      };
      if (std::any_of(kept.begin(), kept.end(), [&](const Pair& other) {
            return near(best[0][p.left], best[0][other.left]) && near(best[1][p.right], best[1][other.right]);
          }))
        continue;
      kept.push_back(p);
      BodyFit& changed = result.emplace_back(fit);
      for (std::size_t s = 0; s < 2; ++s) {
        const Hypothesis& h = best[s][s == 0 ? p.left : p.right];
        const Limb& l = limbs_[sides[s]];
        for (std::size_t k = 0; k < l.joints.size(); ++k)
          for (std::size_t e = 0; e < 3; ++e) changed.axis_angles[3 * l.joints[k] + e] = h.angles[3 * k + e];
      }
    }
    return result;
  }

  std::shared_ptr<const BodyKind> kind_;
  std::vector<LimbPair> pairs_;
  std::vector<Limb> limbs_;
  std::vector<Point> others_;  ///< of the whole body
};

}  // namespace npt::inline NPT_ABI
