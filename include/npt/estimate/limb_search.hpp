/// Other poses of a fitted body's arms or legs that a surface allows: where limbs cross, lie close or were read wrong,
/// a fit ends in the wrong valley, and no small step leads out of it.
/// 1. poses of each limb alone: draws from the prior of natural poses, and what the caller read; each judged by how far
///    its points are from the surface
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
#include <npt/body/body_model.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/skeleton.hpp>
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

enum class LimbPair { arms, legs };
NPT_INLINE_CLASS(class, LimbSearch);
template <class>
class BasicLimbSearch {
 public:
  /// Axis angles [24, 3], of which a limb's are taken.
  using Angles = std::vector<float>;

  explicit BasicLimbSearch(std::shared_ptr<const BodyModel> model) : model_(std::move(model)) {
    const BodyTables& tables = model_->tables();
    const std::vector<std::uint32_t> part = tables.weights.heaviest_columns();
    const auto at = [&tables](std::uint32_t v) {
      return Vec3f{tables.v_template[3 * v], tables.v_template[3 * v + 1], tables.v_template[3 * v + 2]}.as<double>();
    };
    std::vector<Vec3d> normals(part.size());
    for (const Triangle& t : model_->triangles()) {
      const Vec3d normal = cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0]));
      for (const std::uint32_t v : t) normals[v] += normal;
    }
    Random random(20260620);
    for (const std::uint32_t v : random_permutation(static_cast<std::uint32_t>(part.size()), random)) {
      const Vec3d normal = normalised(normals[v]);
      for (std::size_t l = 0; l < limbs.size(); ++l)
        if (in_limb(l, part[v]) && points_[l].size() < points_of_limb) points_[l].push_back({v, part[v], normal});
      if (others_.size() < points_of_body) others_.push_back({v, part[v], normal});
    }
    for (std::size_t i = 0; i < draws; ++i) {
      Random own(20260620, i);
      const auto pose = natural_poses().sample(own);
      natural_.emplace_back(pose.begin(), pose.end());
    }
  }

  /// At most `count` fits with other poses of a pair of limbs, the best first; may hold the pose that the fit has.
  /// read: other angles of the whole body, as the motions of other readings; facing: as CorrespondenceFit's.
  template <class Exec = SerialExecutor>
  std::vector<BodyFit> operator()(const FitSurface& surface, const BodyFit& fit, LimbPair pair, double facing,
                                  std::span<const Angles> read, std::size_t count,
                                  const Exec& executor = Exec()) const {
    const Posed posed = pose(fit);
    const std::array<std::size_t, 2> sides{pair == LimbPair::arms ? 0U : 2U, pair == LimbPair::arms ? 1U : 3U};
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
  static constexpr std::size_t draws = 1500, points_of_limb = 40, screened_points = 8, screened = 300,
                               points_of_body = 900, kept_of_limb = 60, mesh_points = 600;
  /// Metres, of the robust kernel.
  static constexpr double scale = 0.05;

  static constexpr std::size_t shaken = 12, shakes = 20;

  struct Limb {
    std::array<std::size_t, 5> joints;
    std::size_t count;
    /// Which of them is the elbow or the knee; the next one is the limb's end.
    constexpr std::size_t middle() const { return count - 3; }
  };
  using LimbAngles = std::array<float, 15>;
  /// Left arm, right arm, left leg, right leg; the joint that a limb is attached to is fixed.
  static constexpr std::array<Limb, 4> limbs = [] {
    using enum SmplJoint;
    return std::array<Limb, 4>{{{joint_indices(left_collar, left_shoulder, left_elbow, left_wrist, left_hand), 5},
                                {joint_indices(right_collar, right_shoulder, right_elbow, right_wrist, right_hand), 5},
                                {joint_indices(left_hip, left_knee, left_ankle, left_foot, left_foot), 4},
                                {joint_indices(right_hip, right_knee, right_ankle, right_foot, right_foot), 4}}};
  }();

  struct Point {
    std::uint32_t vertex = 0;
    std::uint32_t part = 0;
    Vec3d normal;  ///< of the resting body
  };
  struct Posed {
    std::vector<Vec3d> joints;               ///< of the shaped body at rest
    std::vector<Rigid> motions;              ///< with the fit's translation
    std::array<std::vector<Vec3d>, 4> rest;  ///< a limb's points, shaped
    std::vector<Vec3d> others;               ///< points of the whole body, posed
  };
  struct Hypothesis {
    LimbAngles angles{};
    std::array<Rigid, 5> motions;
    Vec3d middle, end;  ///< where elbow and wrist, or knee and ankle, are
    double distance = 0;
    std::vector<float> reach;  ///< squared distance of each point that the rest leaves alone
  };

  Posed pose(const BodyFit& fit) const {
    Posed posed;
    posed.joints = model_->joints(as_span(fit.betas));
    posed.motions = model_->bone_motions(as_span(fit.betas), as_span(fit.axis_angles));
    for (Rigid& m : posed.motions) m.shift += fit.translation;
    const std::vector<float> rest_angles(fit.axis_angles.size());
    std::vector<std::uint32_t> vertices;
    for (const auto& points : points_)
      for (const Point& p : points) vertices.push_back(p.vertex);
    for (const Point& p : others_) vertices.push_back(p.vertex);
    std::vector<float> xyz(3 * vertices.size());
    model_->posed(as_span(fit.betas), as_span(rest_angles), as_span(vertices), as_span(xyz));
    std::size_t at = 0;
    const auto next = [&] {
      const Vec3d p = Vec3f{xyz[3 * at], xyz[3 * at + 1], xyz[3 * at + 2]}.as<double>();
      ++at;
      return p;
    };
    for (std::size_t l = 0; l < limbs.size(); ++l)
      for (std::size_t i = 0; i < points_[l].size(); ++i) posed.rest[l].push_back(next());
    for (const Point& p : others_) posed.others.push_back(posed.motions[p.part](next()));
    return posed;
  }

  static bool in_limb(std::size_t limb, std::size_t part) {
    return std::find(limbs[limb].joints.begin(), limbs[limb].joints.end(), part) != limbs[limb].joints.end();
  }

  /// Points of the surface that nothing but the two limbs can be near.
  std::vector<Vec3d> uncovered(const FitSurface& surface, const Posed& posed,
                               const std::array<std::size_t, 2>& sides) const {
    std::vector<Vec3d> result;
    const auto samples = surface.samples().first(std::min(mesh_points, surface.samples().size()));
    for (const FitSurface::Sample& s : samples) {
      bool near = false;
      for (std::size_t i = 0; i < others_.size() && !near; ++i) {
        if (in_limb(sides[0], others_[i].part) || in_limb(sides[1], others_[i].part)) continue;
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

    Hypothesis operator()(const LimbAngles& angles, std::size_t points = points_of_limb) const {
      Hypothesis h;
      h.angles = angles;
      move(h);
      measure(h, points);
      return h;
    }

    void move(Hypothesis& h) const {
      const Limb& l = limbs[limb];
      for (std::size_t k = 0; k < l.count; ++k) {
        const std::size_t j = l.joints[k];
        const Rigid& parent = k == 0 ? posed.motions[static_cast<std::size_t>(smpl_parents[j])] : h.motions[k - 1];
        h.motions[k] = parent * Rigid::about(posed.joints[j], joint_rotation(h.angles, k));
      }
      h.middle = h.motions[l.middle()](posed.joints[l.joints[l.middle()]]);
      h.end = h.motions[l.middle() + 1](posed.joints[l.joints[l.middle() + 1]]);
    }

    void measure(Hypothesis& h, std::size_t count) const {
      const std::vector<Point>& points = search.points_[limb];
      count = std::min(count, points.size());
      h.distance = 0;
      std::uint32_t hint = no_index;
      for (std::size_t i = 0; i < count; ++i) {
        const Rigid& motion = h.motions[step_of(limbs[limb], points[i].part)];
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

  static LimbAngles angles_of(const Limb& l, std::span<const float> all) {
    LimbAngles angles{};
    for (std::size_t k = 0; k < l.count; ++k)
      for (std::size_t e = 0; e < 3; ++e) angles[3 * k + e] = all[3 * l.joints[k] + e];
    return angles;
  }

  /// Poses of one limb: the fit's, with the other side's ends, what was read, draws; and the best ones shaken.
  std::vector<Hypothesis> hypotheses(const Judge& judge, const BodyFit& fit, std::span<const Angles> read,
                                     std::size_t other) const {
    const Limb& l = limbs[judge.limb];
    std::vector<Hypothesis> all;
    for (const Angles& a : natural_) all.push_back(judge(angles_of(l, a), screened_points));
    stable_sort_by(all, &Hypothesis::distance);
    all.resize(std::min(screened, all.size()));
    for (Hypothesis& h : all) judge.measure(h, points_of_limb);
    const Hypothesis now = judge(angles_of(l, fit.axis_angles));
    all.push_back(now);
    for (const Angles& a : read) all.push_back(judge(angles_of(l, a)));
    const Limb& o = limbs[other];
    const Vec3d other_middle = judge.posed.motions[o.joints[o.middle()]](judge.posed.joints[o.joints[o.middle()]]),
                other_end = judge.posed.motions[o.joints[o.middle() + 1]](judge.posed.joints[o.joints[o.middle() + 1]]);
    all.push_back(judge(aimed(judge, now, other_middle, other_end)));
    all.push_back(judge(aimed(judge, now, now.middle, other_end)));
    stable_sort_by(all, &Hypothesis::distance);
    std::vector<Hypothesis> best = distinct(all, shaken, 0.08);
    Random random(20260621);
    for (std::size_t i = 0, n = best.size(); i < n; ++i)
      for (std::size_t k = 0; k < shakes; ++k) {
        LimbAngles angles = best[i].angles;
        for (float& a : angles) a += 0.2F * static_cast<float>(random.normal());
        all.push_back(judge(angles));
      }
    stable_sort_by(all, &Hypothesis::distance);
    return distinct(all, kept_of_limb, 0.05);
  }

  /// The limb turned so that its middle joint and its end lie in the directions of two places.
  LimbAngles aimed(const Judge& judge, Hypothesis h, Vec3d middle, Vec3d end) const {
    const Limb& l = limbs[judge.limb];
    const std::size_t m = l.middle();
    const auto turn = [&](std::size_t step, Vec3d from, Vec3d to) {
      const std::size_t j = l.joints[step];
      const Vec3d joint = h.motions[step](judge.posed.joints[j]);
      const Vec3d a = normalised(from - joint), b = normalised(to - joint), axis = cross(a, b);
      const Matrix3 turned =
          rotation_matrix(normalised(axis) * std::atan2(length(axis), dot(a, b))) * h.motions[step].rotation;
      const Matrix3& parent = step == 0 ? judge.posed.motions[static_cast<std::size_t>(smpl_parents[j])].rotation
                                        : h.motions[step - 1].rotation;
      set_joint_rotation(h.angles, step, parent.transposed() * turned);
      judge.move(h);
    };
    turn(m - 1, h.middle, middle);
    turn(m, h.end, end);
    return h.angles;
  }

  static std::size_t step_of(const Limb& l, std::size_t part) {
    return static_cast<std::size_t>(std::find(l.joints.begin(), l.joints.end(), part) - l.joints.begin());
  }

  /// The best ones of a sorted list that differ.
  static std::vector<Hypothesis> distinct(std::vector<Hypothesis>& sorted, std::size_t count, double apart) {
    std::vector<Hypothesis> kept;
    for (Hypothesis& h : sorted) {
      if (kept.size() == count) break;
      if (std::none_of(kept.begin(), kept.end(), [&](const Hypothesis& other) {
            return length(h.middle - other.middle) < apart && length(h.end - other.end) < apart;
          }))
        kept.push_back(std::move(h));
    }
    return kept;
  }

  void cover(std::span<const Vec3d> points, const Posed& posed, std::size_t limb, Hypothesis& h) const {
    h.reach.assign(points.size(), std::numeric_limits<float>::infinity());
    for (std::size_t i = 0; i < points_[limb].size(); ++i) {
      const Vec3d p = h.motions[step_of(limbs[limb], points_[limb][i].part)](posed.rest[limb][i]);
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
        const Limb& l = limbs[sides[s]];
        for (std::size_t k = 0; k < l.count; ++k)
          for (std::size_t e = 0; e < 3; ++e) changed.axis_angles[3 * l.joints[k] + e] = h.angles[3 * k + e];
      }
    }
    return result;
  }

  std::shared_ptr<const BodyModel> model_;
  std::array<std::vector<Point>, 4> points_;  ///< of each limb
  std::vector<Point> others_;                 ///< of the whole body
  std::vector<Angles> natural_;
};

}  // namespace npt::inline NPT_ABI
