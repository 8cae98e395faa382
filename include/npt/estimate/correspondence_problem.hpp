/// One fit of a body to a read surface, by Levenberg and Marquardt's method: what is summed, its derivatives, steps.
/// reading_fit.hpp says which stages follow each other, and gives E.
/// Shapes    x as DifferentiableBody's: [translation, axis angles J x 3, betas S]
/// Units     metres; E in square centimetres
/// Threads   one problem belongs to one thread
/// Source    Chen and Medioni, "Object modelling by registration of multiple range images", 1992 (point to plane);
///           Nocedal and Wright, "Numerical Optimization", 2006, section 10.3 (Levenberg and Marquardt)
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_level.hpp>
#include <npt/estimate/differentiable_body.hpp>
#include <npt/estimate/fit_stages.hpp>
#include <npt/estimate/fit_surface.hpp>
#include <npt/estimate/part_motion.hpp>
#include <npt/estimate/pose_prior.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/solve/normal_equations.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace fit::internal {
NPT_INLINE_CLASS(class, CorrespondenceProblem);
/// One fit: a surface, a reading, and where the body is.
template <class>
class BasicCorrespondenceProblem {
 public:
  struct Match {
    Vec3d offset;         ///< from the mesh to the body
    double squared = -1;  ///< below 0: nothing near
    BodyPoint at;
    double weight = 0;
    double scale = 0.1;

    /// Its squared distance, cut off at the scale; all of that where nothing is near.
    double robust() const { return squared < 0 ? scale * scale : robust_squared(squared, scale); }
  };

  BasicCorrespondenceProblem(const BodyModel& model, const PosePrior& prior, std::span<const double> deviations,
                             const FitSurface& surface)
      : model_(model),
        prior_(prior),
        deviations_(deviations),
        surface_(surface),
        equations_(3 + 3 * model.joint_count() + model.shape_count()),
        row_(equations_.size()) {}

  std::vector<double>& x() noexcept { return x_; }
  const std::vector<double>& x() const noexcept { return x_; }
  double value() const noexcept { return value_; }
  int evaluations() const noexcept { return evaluations_; }

  void set_facing(double facing) { facing_ = facing; }
  /// `places` [n] are on the level's body: those of the motion for the level of the template.
  void set_places(std::span<const PointCorrespondence> points, const PartMotion& motion,
                  std::span<const BodyPoint> places) {
    points_ = points;
    motion_ = &motion;
    places_ = places;
  }

  /// The level that distances are measured with from now on.
  void set_level(const BodyLevel& level, const TriangleTree& tree) {
    level_ = &level;
    tree_ = tree;
    points_of_body_.resize(level.body().vertex_count());
    mesh_hint_.assign(level.probes().size(), no_index);
    body_hint_.assign(surface_.samples().size(), no_index);
  }

  /// Levenberg and Marquardt's method.
  void run(const FitStage& stage) {
    stage_ = &stage;
    prior_share_ = place_share_ = 1;
    value_ = evaluate(x_, matches_, state_);
    if (stage.usual_distance > 0) {
      const double limit = 20, limit_of_places = 10;
      const double times = data_value_ / stage.usual_distance;
      prior_share_ = std::clamp(times, 1.0, limit);
      place_share_ = (std::clamp(times, 1.0, limit_of_places) - 1) / (limit_of_places - 1);
      value_ = evaluate(x_, matches_, state_);
    }
    double damping = 1e-3;
    for (int i = 0; i < stage_steps; ++i) {
      linearise();
      bool better = false;
      for (int attempt = 0; attempt < 3 && !better; ++attempt) {
        std::vector<double> trial = x_;
        const std::vector<double> step = equations_.solve(damping, 1e-4);
        double largest = 0;
        for (std::size_t k = 3; k < 3 + 3 * model_.joint_count(); ++k) largest = std::max(largest, std::abs(step[k]));
        const double share = largest > 0.7 ? 0.7 / largest : 1;
        for (std::size_t k = 0; k < step.size(); ++k) trial[k] += share * step[k];
        wrap(trial);
        const double value = evaluate(trial, trial_matches_, trial_state_);
        if (value < value_ * (1 + stage.slack)) {
          better = true;
          const bool done = value_ - value < stage.enough * value_ && share == 1;
          std::swap(x_, trial);
          std::swap(matches_, trial_matches_);
          std::swap(state_, trial_state_);
          value_ = value;
          damping = std::max(damping * 0.3, 1e-5);
          if (done) return;
        } else {
          damping = std::max(10 * damping, 1e-2);
        }
      }
      if (!better) return;
    }
  }

  /// The sum of the distances without places and priors, at the scale of a stage.
  double distance(const FitStage& stage) {
    stage_ = &stage;
    evaluate(x_, matches_, state_);
    return data_value_;
  }
  std::span<const Match> matches() const noexcept { return matches_; }
  std::size_t probe_matches() const noexcept { return std::min(stage_->points, level_->probes().size()); }
  const DifferentiableBody::State& state() const noexcept { return state_; }
  std::span<const Vec3d> body_points() const noexcept { return as_span(points_of_body_); }

 private:
  /// In deviations: from here on a beta costs hardly more, so that the prior may be strong enough that the body is not
  /// blown up to fill clothes and a stylised figure still keeps its proportions. With a third of the finest stage's
  /// weight dressed people ended at 12.7e-4 instead of 8.8e-4, others of the same set at 9.1e-4 instead of 9.6e-4, a
  /// knight at 6.3e-4 instead of 4.2e-4; with a fifteenth and no such limit the dressed ones at 18e-4.
  static constexpr double unusual_shape = 2;

  double place_weight() const { return place_share_ * stage_->place_weight; }

  /// Directions beyond half a turn are written the other way round.
  void wrap(std::vector<double>& x) const {
    for (std::size_t j = 0; j < model_.joint_count(); ++j) {
      double* a = &x[3 + 3 * j];
      const double angle = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
      if (angle <= std::numbers::pi) continue;
      const double factor = (angle - 2 * std::numbers::pi) / angle;
      for (std::size_t k = 0; k < 3; ++k) a[k] *= factor;
    }
  }

  double evaluate(std::span<const double> x, std::vector<Match>& matches, DifferentiableBody::State& state) {
    ++evaluations_;
    const DifferentiableBody& body = level_->body();
    body.forward(x, state, as_span(points_of_body_));
    matches.clear();
    data_value_ = 0;
    if (stage_->points > 0) {
      from_body(state, matches);
      from_mesh(matches);
      for (const Match& m : matches) data_value_ += m.weight * m.robust();
    }
    double value = data_value_;
    const std::size_t surface_matches = matches.size();
    if (place_weight() > 0) from_places(matches);
    for (std::size_t i = surface_matches; i < matches.size(); ++i)
      value += matches[i].weight * robust_squared(matches[i].squared, matches[i].scale);
    return value + prior_value(x);
  }

  void from_body(const DifferentiableBody::State& state, std::vector<Match>& matches) {
    const std::span<const BodyLevel::Probe> probes = level_->probes();
    const std::size_t count = std::min(stage_->points, probes.size());
    double area = 0;
    for (std::size_t i = 0; i < count; ++i) area += probes[i].area;
    const double limit = 9 * stage_->scale * stage_->scale, spacing = 0.7 * surface_.spacing();
    for (std::size_t i = 0; i < count; ++i) {
      const BodyLevel::Probe& probe = probes[i];
      const Vec3d point = points_of_body_[probe.vertex];
      const Vec3d normal = normalised(level_->body().carried(probe.vertex, probe.normal, state));
      const ClosestPoint c = surface_.tree().closest(
          point, [&](std::uint32_t k) { return faces(normal, surface_.samples()[k].normal); }, mesh_hint_[i], limit);
      mesh_hint_[i] = c.triangle;
      Match& m = matches.emplace_back();
      m.weight = per_square_metre * probe.area / area;
      m.scale = stage_->scale;
      if (c.triangle == no_index) continue;
      m.at = {{probe.vertex, probe.vertex, probe.vertex}, {1, 0, 0}, {}};
      m.offset = across(point - c.point, between(normal, surface_.samples()[c.triangle].normal), spacing);
      m.squared = dot(m.offset, m.offset);
    }
  }

  /// What of an offset from a sample counts: all along the normal; along the surface what goes beyond the next sample.
  static Vec3d across(Vec3d offset, Vec3d normal, double spacing) {
    const double height = dot(offset, normal);
    const Vec3d along = offset - normal * height;
    const double aside = length(along);
    return normal * height + (aside > spacing ? along * (1 - spacing / aside) : Vec3d{});
  }

  /// The direction between two normals: along it, points of one circle with these normals have no distance.
  /// Source: Rusinkiewicz, "A symmetric objective function for ICP", 2019.
  static Vec3d between(Vec3d body, Vec3d mesh) {
    const Vec3d sum = dot(body, mesh) < 0 ? body - mesh : body + mesh;
    return normalised(sum);
  }

  bool faces(Vec3d body, Vec3d mesh) const {
    const double cosine = dot(body, mesh);
    if (facing_ == 0) return mesh == Vec3d{} || std::abs(cosine) > stage_->facing;
    return mesh == Vec3d{} || facing_ * cosine > stage_->facing;
  }

  void from_mesh(std::vector<Match>& matches) {
    const std::span<const Triangle> triangles = level_->triangles();
    tree_.move(as_span(points_of_body_), triangles);
    const std::size_t count = std::min(stage_->points, surface_.samples().size());
    const double limit = 9 * stage_->scale * stage_->scale;
    for (std::size_t k = 0; k < count; ++k) {
      const FitSurface::Sample& s = surface_.samples()[k];
      const ClosestPoint c = tree_.closest(
          s.point,
          [&](std::uint32_t t) {
            const auto& [p, q, r] = triangles[t];
            return faces(
                normalised(cross(points_of_body_[q] - points_of_body_[p], points_of_body_[r] - points_of_body_[p])),
                s.normal);
          },
          body_hint_[k], limit);
      body_hint_[k] = c.triangle;
      Match& m = matches.emplace_back();
      m.weight = per_square_metre / static_cast<double>(count);
      m.scale = stage_->scale;
      if (c.triangle == no_index) continue;
      m.at = {triangles[c.triangle], c.weights, {}};
      m.offset = c.point - s.point;
      m.squared = c.squared_distance;
    }
  }

  void from_places(std::vector<Match>& matches) {
    const std::size_t count = std::min(stage_places, points_.size());
    double total = 0;
    for (std::size_t k = 0; k < count; ++k) total += motion_->certainty[k];
    for (std::size_t k = 0; k < count; ++k) {
      Match& m = matches.emplace_back();
      m.at = places_[k];
      const auto& [p, q, r] = m.at.corners;
      m.offset = points_of_body_[p] * m.at.weights[0] + points_of_body_[q] * m.at.weights[1] +
                 points_of_body_[r] * m.at.weights[2] - points_[k].point;
      m.squared = dot(m.offset, m.offset);
      m.weight = place_weight() * per_square_metre * motion_->certainty[k] / total;
      m.scale = 2 * stage_->scale;
    }
  }

  double deviation(std::size_t b) const { return b < deviations_.size() ? deviations_[b] : 1; }

  double prior_value(std::span<const double> x) {
    const std::size_t angles = 3 * model_.joint_count();
    std::fill(row_.begin(), row_.end(), 0.0);
    double value = prior_(x.subspan(3, angles), prior_share_ * stage_->prior, prior_share_ * stage_->prior,
                          std::span(row_).subspan(3, angles));
    for (std::size_t b = 0; b < model_.shape_count(); ++b) {
      const double off = x[3 + angles + b] / deviation(b);
      value += prior_share_ * stage_->prior * stage_->shape_prior * robust_squared(off * off, unusual_shape);
    }
    return value;
  }

  void linearise() {
    const DifferentiableBody& body = level_->body();
    body.derivatives(as_span(x_), state_, derivatives_);
    equations_.clear();
    const std::size_t from_places = matches_.size() - (place_weight() > 0 ? std::min(stage_places, points_.size()) : 0);
    for (std::size_t i = 0; i < matches_.size(); ++i) {
      const Match& m = matches_[i];
      if (m.squared < 0) continue;
      const double share = m.scale * m.scale / (m.squared + m.scale * m.scale), weight = m.weight * share * share;
      if (i < from_places) {
        const double off = std::sqrt(m.squared);
        if (off < 1e-9) continue;
        add_row(body, m, m.offset / off, weight, off);
        continue;
      }
      add_row(body, m, {1, 0, 0}, weight, m.offset.x);
      add_row(body, m, {0, 1, 0}, weight, m.offset.y);
      add_row(body, m, {0, 0, 1}, weight, m.offset.z);
    }
    const std::size_t angles = 3 * model_.joint_count();
    std::fill(row_.begin(), row_.end(), 0.0);
    const std::span<const double> theta = std::span<const double>(x_).subspan(3, angles);
    prior_(theta, prior_share_ * stage_->prior, prior_share_ * stage_->prior, std::span(row_).subspan(3, angles));
    for (std::size_t i = 3; i < 3 + angles; ++i) equations_.add_to_right(i, 0.5 * row_[i]);
    prior_.add_curvature(theta, prior_share_ * stage_->prior, prior_share_ * stage_->prior, 3, equations_);
    for (std::size_t b = 0; b < model_.shape_count(); ++b) {
      const std::size_t i = 3 + angles + b;
      const double off = x_[i] / deviation(b), limit = unusual_shape * unusual_shape;
      const double share = limit / (off * off + limit) / deviation(b);
      const double weight = prior_share_ * stage_->prior * stage_->shape_prior * share * share;
      equations_.add_to_matrix(i, i, weight);
      equations_.add_to_right(i, weight * x_[i]);
    }
  }

  void add_row(const DifferentiableBody& body, const Match& m, Vec3d direction, double weight, double residual) {
    body.row(state_, derivatives_, m.at.corners, m.at.weights, direction, row_);
    equations_.add(as_span(row_), weight, residual);
  }

  const BodyModel& model_;
  const PosePrior& prior_;
  std::span<const double> deviations_;
  const FitSurface& surface_;
  const FitStage* stage_ = nullptr;
  const BodyLevel* level_ = nullptr;
  std::span<const PointCorrespondence> points_;
  const PartMotion* motion_ = nullptr;
  std::span<const BodyPoint> places_;
  TriangleTree tree_{{}, {}};
  double facing_ = 1, prior_share_ = 1, place_share_ = 1, value_ = 0, data_value_ = 0;
  int evaluations_ = 0;
  std::vector<double> x_;
  std::vector<Vec3d> points_of_body_;
  std::vector<Match> matches_, trial_matches_;
  DifferentiableBody::State state_, trial_state_;
  DifferentiableBody::Derivatives derivatives_;
  NormalEquations equations_;
  std::vector<double> row_;
  std::vector<std::uint32_t> mesh_hint_, body_hint_;
};

}  // namespace fit::internal

}  // namespace npt::inline NPT_ABI
