/// How far the hands of a mesh are closed, of a kind with hands: the bend of the fingers that brings a fitted body's
/// nearest to the mesh's, with all else as it is.
///   E(bend) = mean_i rho(|v_i - mesh|^2) + mean_k rho(|q_k - hand|^2),   rho(d^2) = d^2 s^2 / (d^2 + s^2)
/// v_i the body's fingers, q_k the surface's samples that lie nearer to this hand than to any other part.
/// Fingers stay as they were fitted unless bending them takes a good share of E: of 10 meshes of two people, 20 hands,
/// the two that are fists gain 0.35 and 0.4 (and one of a body of 1591 vertices 0.2), the others less than 0.1.
/// Numerics  double; 5 ms a hand that keeps a distance from the fit, 10 where it is closed
/// Threads   a fitter may be used by several threads at a time
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/hands.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/sampled_surface.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace fit::internal {

/// The vertices that one hand is fitted with.
struct HandPart {
  std::vector<std::uint32_t> vertices;  ///< those that finger joints move, then those of the palm
  std::size_t fingers = 0;              ///< how many of the former
  std::vector<Triangle> triangles;      ///< between these vertices, numbered as above
  std::vector<std::uint32_t> others;    ///< some of the rest of the body: enough to tell what belongs to it
};
NPT_INLINE_CLASS(class, FingerSearch);
/// One hand of one mesh.
template <class>
class BasicFingerSearch {
 public:
  BasicFingerSearch(const BodyKind& kind, const HandPart& hand, std::size_t side, const CorrespondenceFit& fit,
                    const SampledSurface& surface)
      : kind_(kind), model_(*kind.hands->fingered), hand_(hand), side_(side), fit_(fit.body), facing_(fit.facing) {
    choose_samples(surface);
    place({});
    least_.assign(samples_.size(), none);
    for (std::size_t v = hand_.fingers; v < points_.size(); ++v) nearest(v, least_);
  }

  /// The bend with the least E, looked for from a few closed hands and from `start`; shrunk where it gains little.
  HandBend best(const HandBend& start) {
    constexpr std::size_t fewest_samples = 4 * finger_count;  // of 5000 a person's hand has 80 and more
    if (samples_.size() < fewest_samples) return {};
    const double before = value({});
    least_value_ = before;
    consider(start);
    for (const double knuckles : {0.0, fist / 2})
      for (const double middle : {fist / 2, fist})
        consider({.knuckles = knuckles, .middle = {middle, middle, middle, middle}});
    for (double step = first_step; step > first_step / 10; step /= 2)
      for (bool nearer = true; nearer;) {
        nearer = false;
        for (std::size_t way = 0; way < finger_count + 2; ++way)
          for (const double by : {step, -step}) nearer |= consider(bent(best_, way, by));
      }
    const double share = std::clamp(((1 - least_value_ / before) - no_gain) / (sure_gain - no_gain), 0.0, 1.0);
    best_.knuckles *= share;
    for (double& middle : best_.middle) middle *= share;
    return best_;
  }

 private:
  static constexpr double none = 1;                      ///< square metres: no hand is so large
  static constexpr double fist = 1.5, first_step = 0.4;  ///< radians of a joint
  static constexpr double scale = 0.02;                  ///< s above, in metres
  /// Shares of E: a bend that takes less counts not at all, one that takes more counts as found.
  static constexpr double no_gain = 0.1, sure_gain = 2 * no_gain;
  /// Square metres by which E may be worse for a finger that is bent by one radian more than the others: a finger has
  /// few samples.
  static constexpr double together = 0.02e-4;

  /// The knuckles bent farther, all fingers, or one.
  static HandBend bent(HandBend bend, std::size_t way, double by) {
    if (way == 0) bend.knuckles = std::clamp(bend.knuckles + by, -fist / 2, fist);
    for (std::size_t f = 0; f < finger_count; ++f)
      if (way == 1 || way == f + 2) bend.middle[f] = std::clamp(bend.middle[f] + by, 0.0, 2.0);
    return bend;
  }

  /// Takes a bend where it is nearer than the best one so far.
  bool consider(const HandBend& bend) {
    const double e = value(bend);
    if (!(e < least_value_)) return false;
    least_value_ = e;
    best_ = bend;
    return true;
  }

  void choose_samples(const SampledSurface& surface) {
    const HandJoints& joints = kind_.hands->joints[side_];
    const std::vector<Vec3d> at = fitted_joints(*kind_.body, fit_);
    const double reach = 2 * length(at[joints.hand] - at[joints.wrist]);
    const std::vector<Vec3d> hand = posed({}, hand_.vertices), others = posed({}, hand_.others);
    const auto nearest_of = [](const std::vector<Vec3d>& points, Vec3d p) {
      double least = none;
      for (const Vec3d q : points) least = std::min(least, dot(p - q, p - q));
      return least;
    };
    for (const SampledSurface::Sample& s : surface.samples())
      if (length(s.point - at[joints.hand]) < reach && nearest_of(hand, s.point) <= nearest_of(others, s.point))
        samples_.push_back(s);
  }

  /// Where vertices of the body are.
  std::vector<Vec3d> posed(const HandBend& bend, std::span<const std::uint32_t> vertices) const {
    std::array<HandBend, 2> both;
    both[side_] = bend;
    std::vector<float> xyz(3 * vertices.size());
    model_.posed(as_span(fit_.betas), as_span(kind_.bound_angles(as_span(fit_.axis_angles), both)), vertices,
                 as_span(xyz));
    std::vector<Vec3d> points = npt::points_of(as_span(xyz));
    for (Vec3d& p : points) p += fit_.translation;
    return points;
  }

  /// Where the hand is with its fingers bent.
  void place(const HandBend& bend) {
    points_ = posed(bend, hand_.vertices);
    normals_ = area_vectors(as_span(points_), as_span(hand_.triangles));
    for (Vec3d& n : normals_) n = normalised(n);
  }

  /// Squared distance of a vertex from the samples that face as it does; their own, to it, become less in `of_samples`.
  double nearest(std::size_t v, std::vector<double>& of_samples) const {
    double least = none;
    for (std::size_t k = 0; k < samples_.size(); ++k) {
      if (!faces_alike(normals_[v], samples_[k].normal, facing_)) continue;
      const Vec3d o = points_[v] - samples_[k].point;
      const double squared = dot(o, o);
      least = std::min(least, squared);
      of_samples[k] = std::min(of_samples[k], squared);
    }
    return least;
  }

  double value(const HandBend& bend) {
    place(bend);
    std::vector<double> of_samples = least_;
    double body = 0, mesh = 0, mean = 0, apart = 0;
    for (const double middle : bend.middle) mean += middle / finger_count;
    for (const double middle : bend.middle) apart += (middle - mean) * (middle - mean);
    for (std::size_t v = 0; v < hand_.fingers; ++v) body += robust_squared(nearest(v, of_samples), scale);
    for (const double squared : of_samples) mesh += robust_squared(squared, scale);
    return body / static_cast<double>(hand_.fingers) + mesh / static_cast<double>(samples_.size()) + together * apart;
  }

  const BodyKind& kind_;
  const BodyModel& model_;
  const HandPart& hand_;
  std::size_t side_;
  const BodyFit& fit_;
  double facing_;
  std::vector<SampledSurface::Sample> samples_;
  std::vector<double> least_;  ///< [samples] squared distance from the palm
  std::vector<Vec3d> points_, normals_;
  HandBend best_;
  double least_value_ = 0;
};

}  // namespace fit::internal

NPT_INLINE_CLASS(class, FingerFitter);
template <class>
class BasicFingerFitter {
 public:
  /// Of a kind without hands it finds none closed.
  explicit BasicFingerFitter(std::shared_ptr<const BodyKind> kind) : kind_(std::move(kind)) {
    if (!kind_->hands) return;
    const BodyModel& model = *kind_->hands->fingered;
    const std::vector<std::uint32_t> part = model.tables().weights.heaviest_columns();
    for (std::size_t side = 0; side < 2; ++side) {
      const HandJoints& joints = kind_->hands->joints[side];
      fit::internal::HandPart& h = hands_[side];
      std::vector<std::uint32_t> own(model.vertex_count(), no_index);
      const auto take = [&](const auto& which) {
        for (std::uint32_t v = 0; v < part.size(); ++v) {
          if (!which(part[v])) continue;
          own[v] = static_cast<std::uint32_t>(h.vertices.size());
          h.vertices.push_back(v);
        }
      };
      take([&joints](std::size_t j) { return j == joints.hand || joints.has_finger(j); });
      h.fingers = h.vertices.size();
      take([&joints](std::size_t j) { return j == joints.wrist; });
      for (std::uint32_t v = 0; v < part.size(); v += 4)
        if (own[v] == no_index) h.others.push_back(v);
      for (const Triangle& t : model.triangles())
        if (own[t[0]] != no_index && own[t[1]] != no_index && own[t[2]] != no_index)
          h.triangles.push_back({own[t[0]], own[t[1]], own[t[2]]});
    }
  }

  /// Of both hands, left and right, for a fit of the plan's joints. `start`: of the last frame of a sequence.
  std::array<HandBend, 2> operator()(const SampledSurface& surface, const CorrespondenceFit& fit,
                                     const std::array<HandBend, 2>& start = {}) const {
    std::array<HandBend, 2> result;
    if (!kind_->hands) return result;
    for (std::size_t side = 0; side < 2; ++side)
      if (fit.part_distances[kind_->hands->joints[side].hand] > least_distance)
        result[side] = fit::internal::FingerSearch(*kind_, hands_[side], side, fit, surface).best(start[side]);
    return result;
  }

 private:
  /// CorrespondenceFit::part_distances of a hand below which its fingers are as they were fitted: of the hands that are
  /// told above the fists have 0.010 to 0.015, most others less than this, which saves their search, 5 ms a hand.
  static constexpr double least_distance = 0.007;

  std::shared_ptr<const BodyKind> kind_;
  std::array<fit::internal::HandPart, 2> hands_;  ///< left and right
};

}  // namespace npt::inline NPT_ABI
