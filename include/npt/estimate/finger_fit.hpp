/// How far the hands of a mesh are closed, of a kind with hands: the bend of the fingers that brings a fitted body's
/// nearest to the mesh's, with all else as it is.
///   E(bend) = mean_i rho(|v_i - mesh|^2) + mean_k rho(|q_k - hand|^2),   rho(d^2) = d^2 s^2 / (d^2 + s^2)
/// v_i the body's fingers, q_k the surface's samples that lie nearer to this hand than to any other part.
/// Fingers stay as they were fitted unless bending them takes a good share of E: of 10 meshes of two people, 20 hands,
/// the two that are fists gain 0.35 and 0.4 (and one of a body of 1591 vertices 0.2), the others less than 0.1.
/// Numerics  double; 5 ms a hand that keeps a distance from the fit, 10 where it is closed
/// Threads   a fitter may be used by several threads at a time
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/hands.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/fit_surface.hpp>
#include <npt/estimate/fitted_body.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <array>
#include <cmath>
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
};
NPT_INLINE_CLASS(class, FingerSearch);
/// One hand of one mesh.
template <class>
class BasicFingerSearch {
 public:
  BasicFingerSearch(const BodyKind::Hands& kind, const HandPart& hand, std::size_t side, const BodyFit& fit,
                    const FitSurface& surface, double facing)
      : kind_(kind), model_(*kind.fingered), hand_(hand), side_(side), fit_(fit), facing_(facing) {
    choose_samples(surface);
    place({});
    least_.assign(samples_.size(), none);
    for (std::size_t v = hand_.fingers; v < points_.size(); ++v) nearest(v, least_);
  }

  /// The bend with the least E: of all fingers alike, looked for from a few closed hands and from `start`, then of
  /// each; shrunk where it gains little.
  HandBend best(const HandBend& start) {
    constexpr std::size_t fewest_samples = 20;  // of 5000 a person's hand has 80 and more
    if (samples_.size() < fewest_samples) return {};
    const double before = value({});
    best_ = {};
    least_value_ = before;
    if (start != HandBend{}) consider(start);
    for (const auto& [knuckles, middle] :
         {std::pair{0.25, 0.75}, {0.75, 0.75}, {-0.25, 1.5}, {0.25, 1.5}, {0.75, 1.5}, {1.0, 1.75}})
      consider({.knuckles = knuckles, .middle = {middle, middle, middle, middle}});
    if (least_value_ > (1 - worth_a_look) * before) return {};
    for (double step = 0.2; step > 0.03; step /= 2)
      for (int round = 0; round < 4; ++round) {
        bool nearer = false;
        for (const double by : {step, -step}) {
          HandBend bend = best_;
          bend.knuckles += by;
          nearer |= consider(bend);
          bend = best_;
          for (double& middle : bend.middle) middle += by;
          nearer |= consider(bend);
        }
        if (!nearer) break;
      }
    for (double step = 0.4; step > 0.08; step /= 2)
      for (std::size_t finger = 0; finger < finger_count; ++finger)
        for (const double by : {step, -step})
          for (bool nearer = true; nearer;) {
            HandBend bend = best_;
            bend.middle[finger] += by;
            nearer = consider(bend);
          }
    const double share = std::clamp(((1 - least_value_ / before) - no_gain) / (sure_gain - no_gain), 0.0, 1.0);
    best_.knuckles *= share;
    for (double& middle : best_.middle) middle *= share;
    return best_;
  }

 private:
  static constexpr double none = 1e9;
  static constexpr double scale = 0.02;  ///< s above, in metres
  static constexpr double worth_a_look = 0.03;
  /// Shares of E: a bend that takes less counts not at all, one that takes more counts as found.
  static constexpr double no_gain = 0.10, sure_gain = 0.18;
  /// Square metres by which E may be worse for a finger that is bent by one radian more than the others: a finger has
  /// few samples.
  static constexpr double together = 0.02e-4;

  /// Takes a bend where it is nearer than the best one so far.
  bool consider(HandBend bend) {
    bend.knuckles = std::clamp(bend.knuckles, -0.6, 1.4);
    for (double& middle : bend.middle) middle = std::clamp(middle, 0.0, 1.9);
    const double e = value(bend);
    if (!(e < least_value_)) return false;
    least_value_ = e;
    best_ = bend;
    return true;
  }

  void choose_samples(const FitSurface& surface) {
    const std::size_t joint = kind_.joints[side_].hand, wrist = kind_.joints[side_].wrist;
    const std::vector<float> angles = with_fingers(as_span(fit_.axis_angles), {}, kind_.joints);
    const std::vector<Rigid> motions = model_.bone_motions(as_span(fit_.betas), as_span(angles));
    const std::vector<Vec3d> rest = model_.joints(as_span(fit_.betas));
    const Vec3d knuckles = motions[joint](rest[joint]) + fit_.translation;
    const double reach = 1.8 * length(rest[joint] - rest[wrist]);
    std::vector<FitSurface::Sample> near;
    for (const FitSurface::Sample& s : surface.samples())
      if (length(s.point - knuckles) < reach) near.push_back(s);
    if (near.empty()) return;
    // Every fourth vertex of the rest of the body is enough to tell to which part a sample belongs.
    std::vector<bool> own(model_.vertex_count());
    for (const std::uint32_t v : hand_.vertices) own[v] = true;
    std::vector<std::uint32_t> compared(hand_.vertices);
    for (std::uint32_t v = 0; v < model_.vertex_count(); v += 4)
      if (!own[v]) compared.push_back(v);
    const std::vector<Vec3d> points = posed({}, compared);
    std::vector<double> least(near.size(), none);
    std::vector<bool> ours(near.size());
    for (std::size_t i = 0; i < compared.size(); ++i) {
      const Vec3d p = points[i];
      if (length(p - knuckles) > 2 * reach) continue;
      for (std::size_t k = 0; k < near.size(); ++k) {
        const Vec3d o = p - near[k].point;
        if (const double squared = dot(o, o); squared < least[k])
          least[k] = squared, ours[k] = i < hand_.vertices.size();
      }
    }
    for (std::size_t k = 0; k < near.size(); ++k)
      if (ours[k]) samples_.push_back(near[k]);
  }

  /// Where vertices of the body are.
  std::vector<Vec3d> posed(const HandBend& bend, std::span<const std::uint32_t> vertices) const {
    std::array<HandBend, 2> both;
    both[side_] = bend;
    std::vector<float> xyz(3 * vertices.size());
    const std::vector<float> angles = with_fingers(as_span(fit_.axis_angles), both, kind_.joints);
    model_.posed(as_span(fit_.betas), as_span(angles), vertices, as_span(xyz));
    std::vector<Vec3d> points;
    points.reserve(vertices.size());
    for (std::size_t i = 0; i < xyz.size(); i += 3)
      points.push_back(Vec3f{xyz[i], xyz[i + 1], xyz[i + 2]}.as<double>() + fit_.translation);
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
      const double cosine = dot(normals_[v], samples_[k].normal);
      if ((facing_ == 0 ? std::abs(cosine) : facing_ * cosine) < 0.2) continue;
      const Vec3d o = points_[v] - samples_[k].point;
      const double squared = dot(o, o);
      least = std::min(least, squared);
      of_samples[k] = std::min(of_samples[k], squared);
    }
    return least;
  }

  double value(const HandBend& bend) {
    place(bend);
    of_samples_ = least_;
    double body = 0, mesh = 0, mean = 0, apart = 0;
    for (const double middle : bend.middle) mean += middle / finger_count;
    for (const double middle : bend.middle) apart += (middle - mean) * (middle - mean);
    for (std::size_t v = 0; v < hand_.fingers; ++v) body += robust_squared(nearest(v, of_samples_), scale);
    for (const double squared : of_samples_) mesh += robust_squared(squared, scale);
    return body / static_cast<double>(hand_.fingers) + mesh / static_cast<double>(samples_.size()) + together * apart;
  }

  const BodyKind::Hands& kind_;
  const BodyModel& model_;
  const HandPart& hand_;
  std::size_t side_;
  const BodyFit& fit_;
  double facing_;
  std::vector<FitSurface::Sample> samples_;
  std::vector<double> least_;  ///< [samples] squared distance from the palm
  std::vector<Vec3d> points_, normals_;
  std::vector<double> of_samples_;
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
      for (const Triangle& t : model.triangles())
        if (own[t[0]] != no_index && own[t[1]] != no_index && own[t[2]] != no_index)
          h.triangles.push_back({own[t[0]], own[t[1]], own[t[2]]});
    }
  }

  /// Of both hands, left and right, for a fit of the plan's joints. `start`: of the last frame of a sequence.
  std::array<HandBend, 2> operator()(const FitSurface& surface, const CorrespondenceFit& fit,
                                     const std::array<HandBend, 2>& start = {}) const {
    std::array<HandBend, 2> result;
    if (!kind_->hands) return result;
    for (std::size_t side = 0; side < 2; ++side)
      if (fit.part_distances[kind_->hands->joints[side].hand] > least_distance)
        result[side] = fit::internal::FingerSearch(*kind_->hands, hands_[side], side, fit.body, surface, fit.facing)
                           .best(start[side]);
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
